"""The part of the store that is about visits: arrivals, answers, attempts, signs of life, notes."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future
from typing import Any

from galley.outcomes import VISIT_STATUSES, NoRoom
from galley.records.database.tables import STUDY_STATES, StudyState
from galley.records.rows import Arrival, Begun
from galley.records.store import absences, arrivals, queries, visit_writes
from galley.records.store.arrivals import Allocate, Plan
from galley.records.store.store_base import StoreBase
from galley.records.store.visit_ids import link_secret, participant_name
from galley.study.written.questionnaire import Questionnaire, failed_checks, verdicts


class VisitStore(StoreBase):
    """What is written and read about visits."""

    def begin_visit(self, arrival: Arrival, plan: Plan, allocate: Allocate | None = None) -> Future[Begun]:
        """What comes of an arrival: a visit at its first step, or why there is none.

        In one transaction, in turns with arrivals at other servers: `allocate` picks one of the study's
        slots, whose last visit expires if it was not over; `plan(visit_no, slot)` says what it will meet.
        Both are called in the writer's thread. Without `allocate`, and for tests, no slot is taken.
        """
        names = {"token": link_secret(), "participant": participant_name()}
        return self.write(lambda connection: arrivals.begin(connection, arrival, names, plan, allocate))

    def enter_step(self, visit_id: int, step_id: str, at_ms: float) -> Future[None]:
        """Note that a step's page was sent; the first time counts as entering it."""
        return self.write(
            lambda connection: visit_writes.enter_step(connection, visit_id, step_id, round(at_ms))
        )

    def save_answers(
        self,
        visit_id: int,
        step_id: str,
        answers: Mapping[str, Any],
        new_step_index: int,
        status: str,
        at_ms: float,
        completion_code: str | None = None,
        questionnaire: Questionnaire | None = None,
        consent_sha256: str | None = None,
    ) -> Future[bool]:
        """Store a step's answers and move the visit on, in one transaction.

        `questionnaire` is the one that was answered; its items are kept as they were shown, each with its
        verdict on the answer.
        `consent_sha256` is the hash of the text that was agreed to. A status other than "active" ends the
        visit and completes its slot, or leaves it to be given out again. False, and nothing changed, if the
        step was left before (the same form sent twice counts once) or the visit is over.
        """
        shown = _shown(questionnaire)
        passed = {} if questionnaire is None else verdicts(questionnaire, answers)
        rows = [
            {
                "position": position,
                "item": item,
                "value": value,
                "shown": shown.get(item),
                "passed": passed.get(item),
            }
            for position, (item, value) in enumerate(answers.items(), 1)
        ]
        items = () if questionnaire is None else questionnaire.items
        parts = tuple(dict.fromkeys(item.part for item in items if item.part))
        code = completion_code
        left = visit_writes.LeftStep(
            visit_id,
            step_id,
            rows,
            new_step_index,
            _status(status),
            round(at_ms),
            code,
            consent_sha256,
            parts,
        )
        return self.write(lambda connection: visit_writes.leave_step(connection, left))

    def save_attempt(
        self,
        visit_id: int,
        step_id: str,
        attempt: int,
        answers: Mapping[str, Any],
        at_ms: float,
        questionnaire: Questionnaire | None = None,
    ) -> Future[bool]:
        """Keep failed attempt number `attempt` (from 1) at a quiz; the visit stays where it is."""
        wrong = () if questionnaire is None else failed_checks(questionnaire, answers)
        values = {
            "step_id": step_id,
            "attempt": attempt,
            "answers": dict(answers),
            "wrong": list(wrong),
            "at_ms": round(at_ms),
        }
        return self.write(lambda connection: visit_writes.save_attempt(connection, visit_id, values))

    def end_visit(
        self, visit_id: int, status: str, at_ms: float, completion_code: str | None = None
    ) -> Future[bool]:
        """End a visit at the step where it is; False if it was over."""
        _status(status)
        return self.write(
            lambda connection: visit_writes.end_visit(
                connection, visit_id, status, round(at_ms), completion_code
            )
        )

    def hidden(
        self, visit_id: int, step_id: str, started_ms: float, ended_ms: float | None = None
    ) -> Future[None]:
        """Note that a participant's page was hidden; once more with `ended_ms` when it is shown again."""
        end = None if ended_ms is None else round(ended_ms)
        return self.write(
            lambda connection: visit_writes.hidden(connection, visit_id, step_id, round(started_ms), end)
        )

    def left_page(self, visit_id: int, step_id: str, at_ms: float) -> Future[None]:
        """Note that the page of a step was hidden; the next page, or `back_on_page`, ends that."""
        return self.write(lambda connection: absences.left_page(connection, visit_id, step_id, round(at_ms)))

    def back_on_page(self, visit_id: int, at_ms: float) -> Future[None]:
        """Note that a page is seen again."""
        return self.write(lambda connection: absences.back_on_page(connection, visit_id, round(at_ms)))

    def add_note(self, visit_id: int, author: str, text: str, at_ms: float) -> Future[int]:
        """The id of a researcher's new note about a visit."""
        return self.write(
            lambda connection: visit_writes.add_note(connection, visit_id, author, text, round(at_ms))
        )

    def room_for(self, arrival: Arrival, allocate: Allocate) -> Future[NoRoom | None]:
        """Why an arrival would find no room as things stand; None if it would, or comes back to its visit."""
        return self.read(lambda connection: arrivals.room_for(connection, arrival, allocate))

    def study_state(self, study: str) -> Future[StudyState]:
        """Whether a study takes new visits."""
        return self.read(lambda connection: queries.study_state(connection, study))

    def set_study_state(self, study: str, state: str, at_ms: float) -> Future[None]:
        """Open, pause or close a study for new visits; those that run go on.

        Raises:
            ValueError: there is no such state.
        """
        if state not in STUDY_STATES:
            raise ValueError(f"no state of a study: {state!r}; use one of {STUDY_STATES}")
        return self.write(
            lambda connection: visit_writes.set_study_state(connection, study, state, round(at_ms))
        )


def _status(status: str) -> str:
    if status not in VISIT_STATUSES:
        raise ValueError(f"no status of a visit: {status!r}; use one of {VISIT_STATUSES}")
    return status


def _shown(questionnaire: Questionnaire | None) -> dict[str, dict[str, Any]]:
    items = () if questionnaire is None else questionnaire.items
    return {item.id: item.model_dump(mode="json") for item in items}
