"""One round as rows of the exported files: rounds, ticks, events, keys, pauses, clocks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from sqlalchemy import Connection, select

from galley.errors import GalleyError
from galley.kitchen import ACTIONS
from galley.records.database.tables import CLOCKS, KEYS, PAUSES, TICKS, VISITS
from galley.records.export.columns import (
    CLOCKS_SHEET,
    EVENTS_SHEET,
    KEYS_SHEET,
    MEASURES,
    PAUSES_SHEET,
    ROUNDS_SHEET,
    TICKS_SHEET,
)
from galley.records.reading.round_replay import Replayed, replay_round
from galley.records.rows import RoundRow
from galley.records.store import queries
from galley.study.stages.round_step import RoundStep

Rows = Sequence[Mapping[str, Any]]


class TableFile(Protocol):
    """What takes the rows of one sheet."""

    def write(self, values: Mapping[str, Any]) -> None:
        """Add a row."""


class RoundExport:
    """Writes everything about one round that a visit played, as seen from its seat.

    `step` is the one it was played at, `at` what the visit adds to every row, `dyad` names the two people.
    """

    def __init__(
        self,
        connection: Connection,
        row: RoundRow,
        visit_id: int,
        step: RoundStep,
        at: Mapping[str, Any],
        dyad: str | None,
    ) -> None:
        self.row = row
        self.dyad = dyad
        self.step = step
        self.at = {**at, "round_id": row.id, "round_no": row.round_no}
        mine = row.seats[0].visit_id == visit_id
        self.human, self.partner = row.seats if mine else row.seats[::-1]
        self.ticks: Rows = queries.of_round(connection, TICKS, row.id)
        self.pauses: Rows = queries.of_round(connection, PAUSES, row.id)
        self.people = queries.participants(connection, row)
        # An erased person has no name, and none of their keys and pings are left.
        self.keys = queries.of_round(connection, KEYS, row.id)
        self.clocks = queries.of_round(connection, CLOCKS, row.id)
        self.replay = self._replay()

    def _replay(self) -> Replayed | None:
        try:
            replay = replay_round(self.row, [tick["tick"] for tick in self.ticks])
        except GalleyError:  # `galley trajectories verify` tells what is wrong; here the rest still counts
            return None
        return None if replay.problems else replay

    def write(self, files: Mapping[str, TableFile]) -> None:
        """Add this round's rows to the files, named by their sheets.

        Of a round for two people everything but the row of each of them is told by the lower seat.
        """
        files[ROUNDS_SHEET.name].write(self._round())
        if self.human.seat != self.row.human.seat:
            return
        self._write_ticks(files[TICKS_SHEET.name])
        self._write_events(files[EVENTS_SHEET.name])
        for key in self.keys:
            who = {"participant": self.people.get(key["seat"])}
            files[KEYS_SHEET.name].write({**self.at, **key, **who, "arrival_utc": key["arrival_ms"]})
        for pause in self.pauses:
            times = {"started_utc": pause["started_ms"], "ended_utc": pause["ended_ms"]}
            files[PAUSES_SHEET.name].write({**self.at, **pause, **times})
        for ping in self.clocks:
            who = {"participant": self.people.get(ping["seat"])}
            files[CLOCKS_SHEET.name].write({**self.at, **ping, **who, "server_utc": ping["server_ms"]})

    def _round(self) -> dict[str, Any]:
        row = self.row
        goal = None if self.step.goal is None else self.step.goal.score
        lateness = [tick["lateness_ms"] for tick in self.ticks]
        decisions = [tick["decision_ms"] for tick in self.ticks if tick["decision_ms"] is not None]
        mine = (ping for ping in self.clocks if ping["seat"] == self.human.seat)
        rtts = [ping["rtt_ms"] for ping in mine if ping["rtt_ms"] is not None]
        other = row.stand_ins[0] if row.stand_ins else None
        paused = [queries.seconds_between(p["started_ms"], p["ended_ms"]) or 0.0 for p in self.pauses]
        return {
            **self.at,
            "tutorial": self.step.tutorial,
            "layout": row.layout,
            "layout_sha256": hashlib.sha256(row.layout_json.encode()).hexdigest(),
            "agent": self.partner.agent,
            "agent_sha256": self.partner.agent_sha256,
            "partner_participant": self.people.get(self.partner.seat),
            "stand_in": other and other.agent,
            "stand_in_seat": other and other.seat,
            "stand_in_tick": other and other.tick,
            "human_seat": self.human.seat,
            "human_hat": self.human.hat or self.step.human_hat,
            "partner_hat": self.partner.hat if self.dyad is None else self.step.partner_hat,
            "seed": row.seed,
            "horizon_ticks": row.horizon_ticks,
            "episodes": row.episodes,
            "tick_ms": row.tick_ms,
            "status": row.status,
            "ticks": len(self.ticks),
            "score": row.score,
            "deliveries": row.deliveries,
            "goal": goal,
            "goal_reached": None if goal is None or row.score is None else row.score >= goal,
            "started_utc": self.ticks[0]["deadline_ms"] if self.ticks else None,
            "ended_utc": row.ended_ms,
            "pauses": len(self.pauses),
            "paused_s": sum(paused, 0.0),
            "late_ticks": sum(tick["late"] for tick in self.ticks),
            "fault_ticks": sum(tick["fault"] is not None for tick in self.ticks),
            "lateness_median_ms": _quantile(lateness, 0.5),
            "lateness_p99_ms": _quantile(lateness, 0.99),
            "lateness_max_ms": _quantile(lateness, 1.0),
            "decision_p99_ms": _quantile(decisions, 0.99),
            "rtt_median_ms": _quantile(rtts, 0.5),
            "replays": self.replay is not None,
            **self._measures(),
            "dyad": self.dyad,
            **earnings(self.step, row),
        }

    def _measures(self) -> dict[str, Any]:
        if self.replay is None:
            return dict.fromkeys(field.name for field in MEASURES)
        found = self.replay.measures
        chefs = {
            f"{name}_{what}": getattr(found, what)[seat]
            for name, seat in (("human", self.human.seat), ("partner", self.partner.seat))
            for what in ("ingredients", "dishes", "served", "blocked")
        }
        together = ("concurrent_ticks", "stuck_ticks", "delivery_ticks", "performance")
        return {**chefs, **{name: getattr(found, name) for name in together}}

    def _write_ticks(self, file: TableFile) -> None:
        rewards = None if self.replay is None else self.replay.rewards
        score = 0
        for number, tick in enumerate(self.ticks):
            reward = None if rewards is None else rewards[number]
            score += reward or 0
            actions = {f"action_{seat}": _action(tick[f"action_{seat}"]) for seat in (0, 1)}
            file.write(
                {
                    **self.at,
                    **tick,
                    **actions,
                    "human_action": actions[f"action_{self.human.seat}"],
                    "partner_action": actions[f"action_{self.partner.seat}"],
                    "reward": reward,
                    "score": None if reward is None else score,
                    "deadline_utc": tick["deadline_ms"],
                }
            )

    def _write_events(self, file: TableFile) -> None:
        by = {None: None, self.human.seat: "human", self.partner.seat: "partner"}
        for event in () if self.replay is None else self.replay.events():
            columns = ("tick", "seat", "kind", "thing", "place", "x", "y", "reward")
            values = {name: getattr(event, name) for name in columns}
            file.write({**self.at, **values, "by": by[event.seat]})


def dyad_of(connection: Connection, row: RoundRow) -> str | None:
    """The two people of a round by the numbers of their visits, as `3+7`; None if an agent sits there.

    The hats that they wear are of their own plans: each sees the other as their own plan says.
    """
    if any(seat.agent is not None for seat in row.seats):
        return None
    there = VISITS.c.id.in_([seat.visit_id for seat in row.seats if seat.visit_id is not None])
    numbers = connection.execute(select(VISITS.c.visit_no).where(there).order_by(VISITS.c.visit_no)).scalars()
    return "+".join([*map(str, numbers), "erased"][:2])


def earnings(step: RoundStep, row: RoundRow) -> dict[str, Any]:
    """What a round earned: its bonus if the goal was reached, else 0; None where there was no bonus."""
    if step.bonus is None or step.goal is None:
        return {"bonus": None, "bonus_unit": None}
    reached = row.score is not None and row.score >= step.goal.score
    return {"bonus": step.bonus.amount if reached else 0.0, "bonus_unit": step.bonus.unit}


def earned(rounds: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """What the rounds of a visit earned together, of each as `earnings` tells it."""
    found = [one for one in rounds if one["bonus"] is not None]
    if not found:
        return {"bonus": None, "bonus_unit": None}
    return {"bonus": round(sum(one["bonus"] for one in found), 6), "bonus_unit": found[-1]["bonus_unit"]}


def _action(code: int) -> str:
    """The action's name; a code that is none stays a number, so that it can be seen."""
    return ACTIONS[code] if 0 <= code < len(ACTIONS) else str(code)


def _quantile(values: Sequence[float], share: float) -> float | None:
    return round(float(np.quantile(values, share)), 3) if values else None
