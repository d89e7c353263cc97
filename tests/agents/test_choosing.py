"""Logits become actions with the right probabilities."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from galley.agents.choosing import choose
from galley.compiled.randomness import uniform

LOGITS = hnp.arrays(np.float32, (3, 6), elements=st.floats(-50, 50, width=32))
BARRED = hnp.arrays(np.bool_, (3, 6))
DRAWS = hnp.arrays(np.float64, 3, elements=st.floats(0, 1, exclude_max=True))


@given(LOGITS, BARRED, DRAWS)
def test_barred_actions_are_never_taken_unless_all_are(
    logits: np.ndarray, barred: np.ndarray, draws: np.ndarray
) -> None:
    for chosen in (choose(logits, barred, draws), choose(logits, barred, None)):
        for row, action in enumerate(chosen):
            assert 0 <= action < 6
            assert not barred[row, action] or barred[row].all()


@given(LOGITS, BARRED, DRAWS)
def test_rows_do_not_touch_each_other(logits: np.ndarray, barred: np.ndarray, draws: np.ndarray) -> None:
    alone = [int(choose(logits[[row]], barred[[row]], draws[[row]])[0]) for row in range(3)]
    assert choose(logits, barred, draws).tolist() == alone


def test_sampling_follows_the_softmax() -> None:
    logits = np.array([[0.0, 1.0, -1.0, 2.0, 0.5, -0.5]], dtype=np.float32)
    barred = np.array([[False, False, False, True, False, False]])
    draws = (np.arange(10_000) + 0.5) / 10_000
    chosen = choose(np.repeat(logits, 10_000, axis=0), np.repeat(barred, 10_000, axis=0), draws)
    weights = np.where(barred[0], 0, np.exp(logits[0]))
    assert np.allclose(np.bincount(chosen, minlength=6) / 10_000, weights / weights.sum(), atol=2e-4)


def test_the_most_probable_is_the_first_of_equals() -> None:
    logits = np.array([[1.0, 3.0, 3.0, 0.0, 0.0, 0.0]], dtype=np.float32)
    assert choose(logits, np.zeros((1, 6), dtype=bool), None).tolist() == [1]


@given(st.lists(st.tuples(st.integers(0, 2**64 - 1), st.integers(0, 1), st.integers(0, 30_000)), min_size=1))
def test_draws_are_those_of_the_randomness_of_agents(rows: list[tuple[int, int, int]]) -> None:
    seeds, seats, ticks = zip(*rows, strict=True)
    drawn = uniform(np.array(seeds, dtype=np.uint64), np.array(seats), np.array(ticks))
    assert drawn.tolist() == [uniform(*row) for row in rows]
