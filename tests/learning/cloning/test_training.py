"""Cloning learns what was done, repeats itself, and leaves rows out to be measured on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnxruntime as ort
import pytest

from galley.learning.bundles.onnx_writing import dense_onnx
from galley.learning.cloning.training import CloningSettings, train_clone

RNG = np.random.default_rng(3)
SEEN = RNG.integers(-4, 5, size=(600, 5)).astype(np.float32)
DONE = np.where(SEEN[:, 0] > 0, 5, np.where(SEEN[:, 1] > 0, 2, 4))
SETTINGS = CloningSettings(epochs=30, hidden=(16,))


def test_a_rule_that_can_be_learned_is_learned() -> None:
    clone = train_clone(SEEN, DONE, SETTINGS, seed=1)
    assert clone.rows == 600
    assert clone.train_accuracy > 0.95
    assert clone.held_out_accuracy > 0.9
    guesses = train_clone(SEEN, RNG.permutation(DONE), SETTINGS, seed=1)
    assert guesses.held_out_accuracy < 0.7


def test_equal_seeds_give_equal_files_and_other_seeds_others() -> None:
    short = CloningSettings(epochs=1, hidden=(16,))
    files = [dense_onnx(train_clone(SEEN, DONE, short, seed).layers) for seed in (1, 1, 2)]
    assert files[0] == files[1] != files[2]


def test_all_actions_begin_about_equally_probable() -> None:
    layers = train_clone(SEEN, DONE, CloningSettings(epochs=0), seed=1).layers
    assert [weights.shape for weights, _ in layers] == [(64, 5), (64, 64), (6, 64)]
    assert np.abs(layers[-1][0]).max() <= 0.011
    hidden = layers[1][0]
    assert np.allclose(hidden @ hidden.T, 2 * np.eye(64), atol=1e-4)


def test_the_file_computes_the_network(tmp_path: Path) -> None:
    layers = train_clone(SEEN, DONE, SETTINGS, seed=1).layers
    session = ort.InferenceSession(dense_onnx(layers), providers=["CPUExecutionProvider"])
    logits = session.run(["logits"], {"observation": SEEN[:7]})[0]
    (first, start), (last, end) = layers
    assert np.allclose(logits, np.tanh(SEEN[:7] @ first.T + start) @ last.T + end, atol=1e-4)


@pytest.mark.parametrize("rows", [1, 40])
def test_few_rows_are_enough_to_run(rows: int) -> None:
    clone = train_clone(SEEN[:rows], DONE[:rows], CloningSettings(epochs=2), seed=0)
    assert clone.rows == rows
