"""What the sources of the methods set differently on each layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class LayoutConstants:
    """The constants of a method on a layout."""

    learning_rate: float
    shaping_ticks: float
    """Ticks over which the extra reward falls to 0."""
    ticks: float
    """Kitchen ticks that one learner learns from."""


OTHER: Final = "any other"
"""For layouts that no source trained on: our choice."""

Constants = Mapping[str, LayoutConstants]
"""By layout name, or `OTHER`."""

SELF_PLAY: Final[Constants] = {
    "cramped_room": LayoutConstants(1e-3, 2.5e6, 6e6),
    "asymmetric_advantages": LayoutConstants(1e-3, 2.5e6, 7e6),
    "coordination_ring": LayoutConstants(6e-4, 3.5e6, 1e7),
    "forced_coordination": LayoutConstants(8e-4, 2.5e6, 7.5e6),
    "counter_circuit": LayoutConstants(8e-4, 2.5e6, 8e6),
    OTHER: LayoutConstants(8e-4, 2.5e6, 8e6),
}
"""Source: Carroll et al. 2019 (arXiv:1910.05789), App. C and code."""

PBT: Final[Constants] = {
    "cramped_room": LayoutConstants(2e-3, 3e6, 8e6),
    "asymmetric_advantages": LayoutConstants(8e-4, 5e6, 1.1e7),
    "coordination_ring": LayoutConstants(8e-4, 4e6, 5e6),
    "forced_coordination": LayoutConstants(3e-3, 7e6, 8e6),
    "counter_circuit": LayoutConstants(1e-3, 4e6, 6e6),
    OTHER: LayoutConstants(1e-3, 4e6, 8e6),
}
"""Source: Carroll et al. 2019 (arXiv:1910.05789), App. C and code."""

COLE_GENERATION: Final = 10 * 48_000
"""Ticks of a generation of COLE."""

COLE: Final[Constants] = {
    "cramped_room": LayoutConstants(2e-3, 2.5e6, 80 * COLE_GENERATION),
    "asymmetric_advantages": LayoutConstants(1e-3, 2.5e6, 60 * COLE_GENERATION),
    "coordination_ring": LayoutConstants(6e-4, 3.5e6, 75 * COLE_GENERATION),
    "forced_coordination": LayoutConstants(8e-4, 2.5e6, 70 * COLE_GENERATION),
    "counter_circuit": LayoutConstants(8e-4, 2.5e6, 70 * COLE_GENERATION),
    OTHER: LayoutConstants(8e-4, 2.5e6, 70 * COLE_GENERATION),
}
"""Source: COLE paper, App. C; the ticks of extra reward are those of self-play."""
