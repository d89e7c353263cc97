"""Whether every stored round of a study replays to exactly what was stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from galley.errors import GalleyError
from galley.kitchen import STAY
from galley.records.database.tables import TICKS
from galley.records.reading.round_replay import replay_round
from galley.records.rows import RoundRow
from galley.records.store import queries
from galley.records.store.store import Store


@dataclass(frozen=True)
class Fault:
    """One round that is not what it should be, and all that is wrong with it."""

    round_id: int
    layout: str
    status: str
    problems: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join(
            f"round {self.round_id} ({self.layout}, {self.status}): {it}" for it in self.problems
        )


@dataclass(frozen=True)
class VerifyReport:
    """The outcome for all rounds of a study; prints as one line per problem and a summary."""

    rounds: int
    ticks: int
    open: int
    faults: tuple[Fault, ...]

    @property
    def ok(self) -> bool:
        """Whether every round agrees."""
        return not self.faults

    def __str__(self) -> str:
        mismatched = len(self.faults)
        summary = (
            f"rounds={self.rounds} ticks={self.ticks} open={self.open} "
            f"matched={self.rounds - mismatched} mismatched={mismatched}"
        )
        return "\n".join([*map(str, self.faults), summary])


def verify_study(store: Store, study: str) -> VerifyReport:
    """What replaying every stored round of a study finds.

    Compared are the numbering of the ticks, the length of finished rounds, and the stored score, deliveries
    and hash of the last state. An open round has no end to compare; it must replay as far as it goes.

    Raises:
        GalleyError: nobody visited the study.
    """
    rounds = ticks = still_open = 0
    faults = []
    with store.reading() as connection:
        queries.must_know(connection, store.name, study)
        for round_id in queries.rounds_of_study(connection, study):
            row = queries.round_row(connection, round_id)
            problems = _problems(row, queries.of_round(connection, TICKS, round_id))
            rounds += 1
            ticks += len(row.joint_actions)
            still_open += row.status == "open"
            if problems:
                faults.append(Fault(round_id, row.layout, row.status, problems))
    return VerifyReport(rounds, ticks, still_open, tuple(faults))


def _problems(row: RoundRow, ticks: list[dict[str, Any]]) -> tuple[str, ...]:
    agents = [seat.seat for seat in row.seats if seat.agent is not None]
    moved = [
        f"tick {tick['tick']}: the agent of seat {seat} was late or at fault, yet its action is not stay"
        for tick in ticks
        for seat in agents
        if (tick["late"] or tick["fault"] is not None) and tick[f"action_{seat}"] != STAY
    ]
    try:
        replay = replay_round(row, [tick["tick"] for tick in ticks])
    except GalleyError as error:
        return (str(error).removeprefix(f"round {row.id}: "), *moved)
    return (*replay.problems, *moved)
