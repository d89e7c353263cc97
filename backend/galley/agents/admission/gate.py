"""What an agent must show before it is let in: a whole episode, odd states, and constant answers."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from galley.agents.bundle import Bundle
from galley.agents.choosing import choose
from galley.agents.conformance import check
from galley.agents.network import DecisionGivenUp, Network
from galley.compiled.randomness import uniform
from galley.errors import GalleyError, InvalidFiles
from galley.kitchen import ACTIONS, Encoder, KitchenBatch, Layout
from galley.progress_lines import Progress, untold

GATE_TICKS: Final = 400
KITCHENS: Final = 16
"""Kitchens with chefs that act at random, whose states an agent by itself would not come to."""
ALONE_EVERY_TICKS: Final = 50
"""How often all rows of a batch are asked again, one by one."""
SAME_SUM: Final = 1e-4
"""Outputs that nowhere fall below 0 and everywhere add up to 1 but for this are probabilities."""


@dataclass(frozen=True)
class Figures:
    """What the gate measured on one layout; times in ms of processor time, NaN where it could not."""

    layout: str
    ticks: int
    score: int
    decision_p50_ms: float
    decision_p99_ms: float
    batched_ms: float
    """One decision of a batch with both seats of all random kitchens."""
    apart: float
    """How far logits of a batch and of single rows lie apart at most."""

    def as_json(self) -> dict[str, str | int | float | None]:
        """The figures by name, null where there is none."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


def gate(bundle: Bundle, layout: Layout, progress: Progress = untold) -> tuple[Figures, tuple[str, ...]]:
    """The figures of a network agent on a layout, and every reason to reject it there.

    It plays both seats for 400 ticks, twice with one seed; and it is asked about both seats of kitchens whose
    chefs act at random, as one batch and row by row. Who is given up on the way is not asked further.
    """
    long = layout.with_rules(horizon_ticks=max(GATE_TICKS, layout.rules.horizon_ticks))
    nan = float("nan")
    try:
        found = check(bundle.make, long, GATE_TICKS, bundle.think_ms, progress)
    except InvalidFiles as error:
        nothing = Figures(layout.name, 0, 0, nan, nan, nan, nan)
        return nothing, tuple(problem.message for problem in error.problems)
    batched_ms, apart, faults = nan, nan, list[str]()
    if found.whole:
        batched_ms, apart, faults = _asked_at_random(*bundle.network(long), long, progress)
    figures = Figures(
        layout.name,
        GATE_TICKS if found.whole else 0,
        found.score,
        found.decision_p50_ms,
        found.decision_p99_ms,
        batched_ms,
        apart,
    )
    return figures, tuple(dict.fromkeys((*(fault.what for fault in found.faults), *faults)))


def probabilities(rows: NDArray[np.floating]) -> bool:
    """Whether outputs [B, 6] are probabilities rather than logits."""
    return bool((rows >= 0).all() and (abs(rows.sum(axis=1) - 1) < SAME_SUM).all())


def _asked_at_random(
    network: Network, encoder: Encoder, layout: Layout, progress: Progress
) -> tuple[float, float, list[str]]:
    """Time of a batched decision in ms, how far batch and single rows are apart, and what was wrong."""
    kitchens = KitchenBatch(layout, KITCHENS)
    numbers = np.arange(KITCHENS)
    draws = uniform(np.repeat(numbers, 2), np.tile([0, 1], KITCHENS), 0, 7)
    faults: list[str] = []
    times_ms: list[float] = []
    apart, apart_in_actions, always_probabilities = 0.0, False, True
    for tick in range(GATE_TICKS):
        progress(f"on {layout.name} is asked in {KITCHENS} kitchens at once, tick", tick, GATE_TICKS)
        seen = encoder.both(kitchens.states).reshape(-1, *encoder.shape).astype(np.float32)
        try:
            start = time.thread_time()
            logits = _logits(network, seen)
            times_ms.append(1000 * (time.thread_time() - start) / len(seen))
            always_probabilities &= probabilities(logits)
            if tick % ALONE_EVERY_TICKS == 0:
                alone = np.concatenate([_logits(network, row[None]) for row in seen])
                apart = max(apart, float(abs(alone - logits).max()))
                if not np.array_equal(logits, _logits(network, seen)):
                    faults.append(
                        "the network answers the same observation in another way the second time; export it "
                        "without dropout and without drawing actions"
                    )
                free = np.zeros(logits.shape, dtype=np.bool_)
                apart_in_actions |= not np.array_equal(
                    choose(logits, free, draws), choose(alone, free, draws)
                )
        except DecisionGivenUp as error:
            faults.append(str(error))
            break
        except GalleyError as error:
            faults.append(str(error))
            always_probabilities = False
        walks = [uniform(numbers, seat, tick, 8) * len(ACTIONS) for seat in (0, 1)]
        kitchens.step(np.stack(walks, axis=1).astype(np.uint8))
    if apart_in_actions:
        faults.append(
            f"in a batch of {2 * KITCHENS} the network gives other actions than row by row (outputs up to "
            f"{apart:.3g} apart)"
        )
    if always_probabilities:
        faults.append("the outputs are probabilities, not logits; export what goes into the softmax")
    return float(np.median(times_ms)) if times_ms else float("nan"), apart, faults


def _logits(network: Network, observations: NDArray[np.float32]) -> NDArray[np.float32]:
    start = network.start()
    states = None if start is None else np.repeat(start[None], len(observations), axis=0)
    return network.run(observations, states)[0]
