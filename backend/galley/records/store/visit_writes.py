"""Writes about visits: what each job does in its transaction. Each may be done twice and counts once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import Connection, Table, func, insert, select, update

from galley.errors import GalleyError
from galley.records.database.engine import insert_into
from galley.records.database.tables import (
    ABSENCES,
    ATTEMPTS,
    NOTES,
    QUESTIONS,
    RESPONSES,
    SLOTS,
    STAGES,
    STUDIES,
    VISITS,
)
from galley.records.store.absences import back_on_page

NEW_VISIT: dict[str, Any] = {
    **dict.fromkeys(("completion_code", "ended_ms", "slot", "consent_sha256", "person")),
    "step_index": 0,
    "status": "active",
    "test": False,
    "language": "en",
    "tries": 0,
}
SUBSCALE: Final = "subscale."
"""Begins the name of a subscale among the questions; no item's name has a dot."""
AFTER_ALL_ITEMS: Final = 1000


def question_of(subscale: str) -> str:
    """The name under which a subscale stands among the questions."""
    return f"{SUBSCALE}{subscale}"


def subscale_of(question: str) -> str:
    """The subscale with this name among the questions; empty for an item, a round or a factor."""
    return question.removeprefix(SUBSCALE) if question.startswith(SUBSCALE) else ""


def new_id(connection: Connection, table: Table, values: Mapping[str, Any]) -> int:
    """The id of a new row."""
    return int(connection.execute(insert(table).values(**values).returning(table.c.id)).scalar_one())


def meet(connection: Connection, study: str) -> None:
    """Make sure that there is a row for the study."""
    row = {"name": study, "visits_begun": 0, "state": "open"}
    connection.execute(insert_into(connection.engine, STUDIES).values(**row).on_conflict_do_nothing())


def enter_step(connection: Connection, visit_id: int, step_id: str, at_ms: int) -> None:
    """Count a view of a step; the first one says when it was entered. A page that was hidden is left."""
    back_on_page(connection, visit_id, at_ms)
    new = insert_into(connection.engine, STAGES).values(
        visit_id=visit_id, step_id=step_id, entered_ms=at_ms, left_ms=None, views=1
    )
    connection.execute(
        new.on_conflict_do_update(
            index_elements=[STAGES.c.visit_id, STAGES.c.step_id], set_={"views": STAGES.c.views + 1}
        )
    )
    seen(connection, visit_id, at_ms)


def seen(connection: Connection, visit_id: int, at_ms: int) -> None:
    """Note a sign of life."""
    later = (VISITS.c.id == visit_id) & (VISITS.c.last_seen_ms < at_ms)
    connection.execute(update(VISITS).where(later).values(last_seen_ms=at_ms))


@dataclass(frozen=True, slots=True)
class LeftStep:
    """A step that is left: its answers as rows without visit, step and time, and where the visit goes."""

    visit_id: int
    step_id: str
    answers: Sequence[Mapping[str, Any]]
    new_step_index: int
    status: str
    at_ms: int
    completion_code: str | None
    consent_sha256: str | None
    subscales: Sequence[str] = ()


def leave_step(connection: Connection, left: LeftStep) -> bool:
    """Store the answers and move on, unless the step was left before or the visit is over.

    Raises:
        GalleyError: the visit is unknown.
    """
    visit = active(connection, left.visit_id)
    if visit is None:
        return False
    stage = insert_into(connection.engine, STAGES).values(
        visit_id=left.visit_id, step_id=left.step_id, entered_ms=left.at_ms, left_ms=None, views=0
    )
    connection.execute(stage.on_conflict_do_nothing())
    here = (STAGES.c.visit_id == left.visit_id) & (STAGES.c.step_id == left.step_id)
    leaving = update(STAGES).where(here, STAGES.c.left_ms.is_(None)).values(left_ms=left.at_ms)
    if connection.execute(leaving).rowcount == 0:
        return False
    if left.answers:
        here_and_now = {"visit_id": left.visit_id, "step_id": left.step_id, "at_ms": left.at_ms}
        connection.execute(insert(RESPONSES), [{**answer, **here_and_now} for answer in left.answers])
        asked = [(answer["item"], answer["position"]) for answer in left.answers]
        asked += [(question_of(name), AFTER_ALL_ITEMS) for name in left.subscales]
        keep_questions(connection, visit, left.step_id, asked)
    changes: dict[str, Any] = {"step_index": left.new_step_index, "tries": 0}
    if left.consent_sha256 is not None:
        changes["consent_sha256"] = left.consent_sha256
    move(connection, left.visit_id, left.status, left.at_ms, left.completion_code, changes)
    return True


def active(connection: Connection, visit_id: int) -> Mapping[str, Any] | None:
    """The visit's row, kept from others until this transaction is over; None if the visit is over.

    Raises:
        GalleyError: the visit is unknown.
    """
    query = select(VISITS.c.study, VISITS.c.step_index, VISITS.c.status, VISITS.c.test)
    found = (
        connection.execute(query.where(VISITS.c.id == visit_id).with_for_update()).mappings().one_or_none()
    )
    if found is None:
        raise GalleyError(f"there is no visit {visit_id}")
    return dict(found) if found["status"] == "active" else None


def move(
    connection: Connection,
    visit_id: int,
    status: str,
    at_ms: int,
    completion_code: str | None,
    changes: Mapping[str, Any],
) -> None:
    """Change a visit; one that is over leaves its slot, completed or to be given out again."""
    changes = {**changes, "status": status}
    if status != "active":
        changes["ended_ms"] = at_ms
    if completion_code is not None:
        changes["completion_code"] = completion_code
    connection.execute(update(VISITS).where(VISITS.c.id == visit_id).values(**changes))
    seen(connection, visit_id, at_ms)
    if status == "completed":
        connection.execute(update(SLOTS).where(SLOTS.c.visit_id == visit_id).values(state="completed"))


def end_visit(
    connection: Connection, visit_id: int, status: str, at_ms: int, completion_code: str | None
) -> bool:
    """End a visit at the step where it is, unless it is over."""
    if active(connection, visit_id) is None:
        return False
    move(connection, visit_id, status, at_ms, completion_code, {})
    return True


def save_attempt(connection: Connection, visit_id: int, values: Mapping[str, Any]) -> bool:
    """Keep a failed attempt at a quiz, unless it was kept before or the visit is over."""
    if active(connection, visit_id) is None:
        return False
    new = insert_into(connection.engine, ATTEMPTS).values(visit_id=visit_id, **values)
    if connection.execute(new.on_conflict_do_nothing().returning(ATTEMPTS.c.attempt)).first() is None:
        return False
    changes = {"tries": values["attempt"], "last_seen_ms": values["at_ms"]}
    connection.execute(update(VISITS).where(VISITS.c.id == visit_id).values(**changes))
    return True


def hidden(
    connection: Connection, visit_id: int, step_id: str, started_ms: int, ended_ms: int | None
) -> None:
    """Note that a page was hidden, or that it is shown again."""
    new = insert_into(connection.engine, ABSENCES).values(
        visit_id=visit_id, step_id=step_id, started_ms=started_ms, ended_ms=ended_ms
    )
    over = {"ended_ms": func.coalesce(new.excluded.ended_ms, ABSENCES.c.ended_ms)}
    same = [ABSENCES.c.visit_id, ABSENCES.c.started_ms]
    connection.execute(new.on_conflict_do_update(index_elements=same, set_=over))


def keep_questions(
    connection: Connection, visit: Mapping[str, Any], step_id: str, items: Sequence[tuple[str, int]]
) -> None:
    """Make sure that the wide export has a column for each of these items, unless this is a test."""
    rows = [
        {
            "study": visit["study"],
            "step_id": step_id,
            "item": item,
            "place": visit["step_index"],
            "position": at,
        }
        for item, at in items
    ]
    if not visit["test"]:
        connection.execute(insert_into(connection.engine, QUESTIONS).on_conflict_do_nothing(), rows)


def set_study_state(connection: Connection, study: str, state: str, at_ms: int) -> None:
    """Open, pause or close a study for new visits."""
    meet(connection, study)
    changes = update(STUDIES).where(STUDIES.c.name == study).values(state=state, state_ms=at_ms)
    connection.execute(changes)


def add_note(connection: Connection, visit_id: int, author: str, text: str, at_ms: int) -> int:
    """The id of a new note.

    Raises:
        GalleyError: the visit is unknown.
    """
    if connection.execute(select(VISITS.c.id).where(VISITS.c.id == visit_id)).first() is None:
        raise GalleyError(f"there is no visit {visit_id}")
    return new_id(connection, NOTES, {"visit_id": visit_id, "author": author, "text": text, "at_ms": at_ms})
