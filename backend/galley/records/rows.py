"""What goes into the records and comes out of them: plain frozen rows that know no database."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class VisitRow:
    """One participant's pass through a study, as far as it has come."""

    id: int
    token: str
    participant: str
    study: str
    study_sha256: str
    visit_no: int
    seed: int
    plan_json: str
    condition: dict[str, Any]
    link_params: dict[str, str]
    step_index: int
    status: str
    completion_code: str | None
    created_ms: int
    ended_ms: int | None


@dataclass(frozen=True, slots=True)
class SeatRow:
    """Who sits at one seat of a round: a visit or an agent."""

    seat: int
    visit_id: int | None
    step_id: str | None
    agent: str | None
    agent_sha256: str | None
    hat: str | None


@dataclass(frozen=True, slots=True)
class RoundRow:
    """One round with its joint actions so far, uint8 [T, 2]: enough to go on with it by replaying."""

    id: int
    study: str
    round_no: int
    layout: str
    layout_json: str
    horizon_ticks: int
    tick_ms: int
    seed: int
    status: str
    score: int | None
    deliveries: int | None
    final_sha256: str | None
    created_ms: int
    ended_ms: int | None
    seats: tuple[SeatRow, ...]
    joint_actions: NDArray[np.uint8] = field(compare=False)

    @property
    def human(self) -> SeatRow:
        """The first seat that a visit plays."""
        return next(seat for seat in self.seats if seat.visit_id is not None)

    @property
    def partner(self) -> SeatRow:
        """The seat opposite `human`."""
        return next(seat for seat in self.seats if seat.seat != self.human.seat)


@dataclass(frozen=True, slots=True)
class TickRow:
    """One rules update. `tick` counts joint actions from 0; times in ms, `deadline_ms` since 1970.

    `fault` says why an agent's decision that came could not be used.
    """

    tick: int
    action_0: int
    action_1: int
    deadline_ms: float
    lateness_ms: float
    decision_ms: float | None
    late: bool
    fault: str | None = None


@dataclass(frozen=True, slots=True)
class KeyRow:
    """One key event. `client_ms` by the browser's clock, `arrival_ms` by the server's (since 1970)."""

    seq: int
    key: str
    down: bool
    client_ms: float
    arrival_ms: float
    tick_applied: int | None
    seat: int


@dataclass(frozen=True, slots=True)
class PauseRow:
    """One pause; journal it when it starts and again, with `ended_ms`, when it is over."""

    tick: int
    started_ms: float
    ended_ms: float | None
    reason: str


@dataclass(frozen=True, slots=True)
class ClockRow:
    """One ping: the browser's clock beside the server's."""

    client_ms: float
    server_ms: float
    rtt_ms: float | None
    seat: int


@dataclass(frozen=True, slots=True)
class Health:
    """How the writer fares. `ok` is False while writing fails, and for good once rows were lost.

    `waiting_rows` are journalled but not yet committed; `lost_rows` the database refused for good.
    """

    ok: bool
    message: str
    waiting_rows: int
    lost_rows: int
