"""What goes into the records and comes out of them: plain frozen rows that know no database.

Those that a live round writes many times a second are named tuples, which are made in a fraction of the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from galley.outcomes import NoRoom, RoundStatus, VisitStatus
from galley.study.visit.condition_slots import Slot


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
    status: VisitStatus
    completion_code: str | None
    created_ms: int
    ended_ms: int | None
    slot: int | None = None
    test: bool = False
    language: str = "en"
    tries: int = 0
    consent_sha256: str | None = None
    person: str | None = None
    last_seen_ms: int = 0


@dataclass(frozen=True, slots=True)
class Arrival:
    """Somebody who opens a study's link and begins.

    `person` is who the link says that this is; with `once` a person has one visit only.
    """

    study: str
    study_sha256: str
    at_ms: float
    link_params: Mapping[str, str] = field(default_factory=dict)
    language: str = "en"
    person: str | None = None
    once: bool = False
    test: bool = False


@dataclass(frozen=True, slots=True)
class Planned:
    """What a new visit will meet, as the study plans it."""

    seed: int
    plan_json: str
    condition: Mapping[str, Any]
    cell: Mapping[str, Any] | None = None
    """The cell of the design to count it in; the condition if None."""


@dataclass(frozen=True, slots=True)
class SlotRow(Slot):
    """A slot with the cell that it belongs to and the visit that has it, None once that was erased."""

    cell: dict[str, Any]
    visit_id: int | None


@dataclass(frozen=True, slots=True)
class Begun:
    """What came of an arrival: a visit, or why there is none.

    `why`: `new`; `again`, the visit that this person had before; `full`, every slot is completed; `later`,
    all slots are taken, some of them by visits that may still give theirs back; `paused`; `closed`.
    """

    visit: VisitRow | None
    why: Literal["new", "again"] | NoRoom


@dataclass(frozen=True, slots=True)
class SeatRow:
    """Who sits at one seat of a round: a visit at a step of its plan, or an agent; neither once erased."""

    seat: int
    visit_id: int | None
    step_id: str | None
    agent: str | None = None
    agent_sha256: str | None = None
    hat: str | None = None
    rtt_median_ms: float | None = None


@dataclass(frozen=True, slots=True)
class NewRound:
    """A round to be set up; `horizon_ticks` is the length of each of its episodes."""

    round_no: int
    layout: str
    layout_json: str
    horizon_ticks: int
    tick_ms: int
    seed: int
    at_ms: float
    seats: tuple[SeatRow, SeatRow]
    episodes: int = 1


@dataclass(frozen=True, slots=True)
class StandInRow:
    """An agent that plays a person's seat from a tick on."""

    seat: int
    tick: int
    agent: str
    agent_sha256: str
    at_ms: int


@dataclass(frozen=True, slots=True)
class RoundRow:
    """One round with its joint actions so far, uint8 [T, 2]: enough to go on with it by replaying.

    Ticks are counted on through all episodes; `horizon_ticks` is the length of one.
    """

    id: int
    study: str
    round_no: int
    layout: str
    layout_json: str
    horizon_ticks: int
    tick_ms: int
    seed: int
    status: RoundStatus
    score: int | None
    deliveries: int | None
    final_sha256: str | None
    created_ms: int
    ended_ms: int | None
    seats: tuple[SeatRow, ...]
    joint_actions: NDArray[np.uint8] = field(compare=False)
    episodes: int = 1
    stand_ins: tuple[StandInRow, ...] = ()
    played_ticks: int | None = None
    late_ticks: int | None = None
    fault_ticks: int | None = None

    @property
    def human(self) -> SeatRow:
        """The first seat that a visit plays."""
        return next(seat for seat in self.seats if seat.visit_id is not None)

    @property
    def partner(self) -> SeatRow:
        """The seat opposite `human`."""
        return next(seat for seat in self.seats if seat.seat != self.human.seat)


class TickRow(NamedTuple):
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


class KeyRow(NamedTuple):
    """One key event. `client_ms` by the browser's clock, `arrival_ms` by the server's (since 1970)."""

    seq: int
    key: str
    down: bool
    client_ms: float
    arrival_ms: float
    tick_applied: int | None
    seat: int


class PauseRow(NamedTuple):
    """One pause; journal it when it starts and again, with `ended_ms`, when it is over."""

    tick: int
    started_ms: float
    ended_ms: float | None
    reason: str


class ClockRow(NamedTuple):
    """One ping: the browser's clock beside the server's."""

    client_ms: float
    server_ms: float
    rtt_ms: float | None
    seat: int


@dataclass(frozen=True, slots=True)
class Health:
    """How the writer fares. `ok` is False while writing fails, and for good once rows were lost.

    `waiting_rows` are journalled but not yet committed; `lost_rows` the database refused for good;
    `fenced_rows` came for rounds that another server had taken over, which is no fault.
    """

    ok: bool
    message: str
    waiting_rows: int
    lost_rows: int
    fenced_rows: int = 0


@dataclass(frozen=True, slots=True)
class ResearcherRow:
    """An account for the researcher's pages."""

    id: int
    name: str
    password_hash: str = field(repr=False)
    created_ms: int = 0


@dataclass(frozen=True, slots=True)
class SessionRow:
    """A researcher's login; `csrf` is the secret that each of its forms carries."""

    researcher: ResearcherRow
    csrf: str = field(repr=False)
    expires_ms: int = 0
