"""The rules on random kitchens: kernel = description, batch = single, compiled = plain Python."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from galley.kitchen import Kitchen, KitchenBatch, Layout, from_view, observation_kernels, pots, view
from galley.kitchen.codes import OUT_SIZE, TICK
from galley.kitchen.observations import ENCODINGS, Encoder
from galley.kitchen.rules import classic, shared
from galley.kitchen.rules import tick as rules
from galley.kitchen.state import state_problem
from galley.kitchen.trajectory import play
from tests.kitchen.reference_rules import SlowKitchen
from tests.kitchen.strategies import joint_actions, layouts, situations, states


@given(situations(), joint_actions())
def test_kernel_follows_the_description(
    situation: tuple[Layout, NDArray[np.int16]], actions: NDArray[np.uint8]
) -> None:
    layout, state = situation
    kitchen = Kitchen(layout)
    kitchen.state[:] = state
    slow = SlowKitchen.of(layout, view(layout, state))
    for a0, a1 in actions.tolist():
        assert kitchen.step(a0, a1) == slow.step((a0, a1))
        assert kitchen.view == slow.view()
        assert kitchen.done == slow.done
        assert state_problem(layout, kitchen.state) is None


@given(layouts(), st.data())
def test_batch_equals_single_tick_by_tick(layout: Layout, data: st.DataObject) -> None:
    starts = data.draw(st.lists(states(layout), min_size=1, max_size=3))
    episodes = [data.draw(joint_actions(10)) for _ in starts]
    batch = KitchenBatch(layout, len(starts))
    batch.states[:] = starts
    singles = [Kitchen(layout) for _ in starts]
    for kitchen, state in zip(singles, starts, strict=True):
        kitchen.state[:] = state
    for tick in range(min(len(actions) for actions in episodes)):
        joint = np.array([actions[tick] for actions in episodes])
        rewards = batch.step(joint)
        for index, kitchen in enumerate(singles):
            assert kitchen.step(*joint[index].tolist()) == rewards[index]
            np.testing.assert_array_equal(kitchen.state, batch.states[index])
            np.testing.assert_array_equal(kitchen.out, batch.out[index])
            assert kitchen.done == batch.done[index]
            assert kitchen.score == batch.scores[index]


@given(situations())
def test_views_go_there_and_back(situation: tuple[Layout, NDArray[np.int16]]) -> None:
    layout, state = situation
    np.testing.assert_array_equal(from_view(layout, view(layout, state)), state)


@given(situations(), joint_actions())
def test_a_finished_kitchen_does_not_change(
    situation: tuple[Layout, NDArray[np.int16]], actions: NDArray[np.uint8]
) -> None:
    layout, state = situation
    state[TICK] = layout.rules.horizon_ticks
    episode = play(layout, actions, state)
    assert (episode.states == state).all()
    assert not episode.out.any()


def plain(*modules: ModuleType) -> ModuleType:
    """The last of some modules of kernels as plain Python that calls the others as plain Python."""
    before = numba.config.DISABLE_JIT
    numba.config.DISABLE_JIT = True
    kept = {module.__name__: sys.modules.pop(module.__name__) for module in modules}
    try:
        return [importlib.import_module(name) for name in kept][-1]
    finally:
        numba.config.DISABLE_JIT = before
        for name, module in kept.items():
            sys.modules[name] = module
            package, _, short = name.rpartition(".")
            setattr(sys.modules[package], short, module)


@pytest.fixture(scope="module")
def plain_rules() -> ModuleType:
    return plain(pots, shared, classic, rules)


@pytest.fixture(scope="module")
def plain_kernels() -> ModuleType:
    return plain(pots, shared, observation_kernels)


def test_plain_kernels_are_not_compiled(plain_rules: ModuleType) -> None:
    assert not hasattr(plain_rules.step, "py_func")
    assert not hasattr(plain_rules.classic_step, "py_func")


@given(situation=situations(), actions=joint_actions(12))
def test_compiled_rules_equal_plain_python(
    plain_rules: ModuleType, situation: tuple[Layout, NDArray[np.int16]], actions: NDArray[np.uint8]
) -> None:
    layout, state = situation
    episode = play(layout, actions, state)
    slow, out = state.copy(), np.zeros(OUT_SIZE, dtype=np.int32)
    for tick, (a0, a1) in enumerate(actions.tolist()):
        reward = plain_rules.step(layout.spec, slow, a0, a1, out)
        assert reward == episode.out[tick, 0]
        np.testing.assert_array_equal(out, episode.out[tick])
        np.testing.assert_array_equal(slow, episode.states[tick + 1])


@given(situation=situations(tomatoes=False))
def test_compiled_encodings_equal_plain_python(
    plain_kernels: ModuleType, situation: tuple[Layout, NDArray[np.int16]]
) -> None:
    layout, state = situation
    for name in ENCODINGS:
        encoder = Encoder(layout, name)
        fast = encoder.both(state[None])
        slow = np.empty((1, 2, fast[0, 0].size), dtype=encoder.dtype)
        seats = np.array([[0, 1]])
        if name == "overcooked-2019-features":
            tables = (layout.spec, encoder._costs, encoder._targets)
            plain_kernels.features_2019(*tables, state[None], seats, slow)
        else:
            kernel = plain_kernels.grid if name == "grid" else plain_kernels.grid_2019
            kernel(layout.spec, encoder._static, state[None], seats, slow)
        np.testing.assert_array_equal(slow.reshape(fast.shape), fast)
