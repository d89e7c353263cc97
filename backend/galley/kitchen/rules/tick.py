"""One tick of a kitchen under the rule set of its layout; compiled."""

from __future__ import annotations

from numpy import int16, int32, uint8
from numpy.typing import NDArray

from galley.compiled.kernels import kernel, lean_kernel
from galley.kitchen.codes import CLASSIC, SPEC_RULE_SET
from galley.kitchen.rules.classic import classic_step
from galley.kitchen.rules.shared import finished


@lean_kernel
def step(spec: NDArray[int16], state: NDArray[int16], a0: int, a1: int, out: NDArray[int32]) -> int:
    """The reward of one tick; changes `state` int16[S] and fills `out` int32[OUT_SIZE].

    `out` is reward, event mask of seat 0, event mask of seat 1, mask of the pots that became ready.
    A finished kitchen does not change and gives zeros.
    """
    if finished(spec, state) or spec[SPEC_RULE_SET] != CLASSIC:  # the door lets in no other rule set
        out[:] = 0
        return 0
    return classic_step(spec, state, a0, a1, out)


@lean_kernel
def step_batch(
    spec: NDArray[int16], states: NDArray[int16], actions: NDArray[uint8], out: NDArray[int32]
) -> None:
    """Play one tick of B kitchens: `states` int16[B,S], `actions` uint8[B,2], `out` int32[B,OUT_SIZE]."""
    for index in range(states.shape[0]):
        step(spec, states[index], int(actions[index, 0]), int(actions[index, 1]), out[index])


@kernel
def run(
    spec: NDArray[int16], state: NDArray[int16], joint_actions: NDArray[uint8],
    states: NDArray[int16], out: NDArray[int32],
) -> None:  # fmt: skip
    """Play T ticks on from `state` int16[S].

    `joint_actions` uint8[T,2] in; `states` int16[T+1,S] and `out` int32[T,OUT_SIZE] are filled.
    """
    states[0] = state
    for tick in range(joint_actions.shape[0]):
        states[tick + 1] = states[tick]
        step(spec, states[tick + 1], int(joint_actions[tick, 0]), int(joint_actions[tick, 1]), out[tick])
