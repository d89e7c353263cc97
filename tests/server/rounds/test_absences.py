"""Pages tell when they are hidden: it is in the records, and flags the visit when it was long."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from galley.records.database.tables import ABSENCES
from galley.records.reading import overview
from galley.records.store.absences import MOST_ABSENCES
from tests.server.helpers import QUICK, Participant, Served, serving
from tests.server.participant.test_flow import row_of
from tests.study.workspaces import study_workspace


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("absent")
    with serving(study_workspace(folder / "lab", QUICK), folder / "records.sqlite") as up:
        yield up


def absences(person: Participant) -> list[Any]:
    with person.served.store.reading() as connection:
        query = ABSENCES.select().where(ABSENCES.c.visit_id == row_of(person).id)
        return list(connection.execute(query.order_by(ABSENCES.c.started_ms)).all())


def tell(person: Participant, hidden: str, **fields: str) -> int:
    form = {"step": person.step, "hidden": hidden, **fields}
    return person.http.post(f"{person.path}/away", data=form).status_code


def test_a_page_that_is_hidden_and_seen_again_is_an_absence(served: Served) -> None:
    person = Participant(served)
    assert f'data-away="{person.path}/away" data-step="consent"' in person.page.text
    assert tell(person, "0") == 204
    assert absences(person) == []
    assert tell(person, "1") == tell(person, "1") == tell(person, "0") == 204
    (absence,) = absences(person)
    assert absence.step_id == "consent"
    assert 0 <= absence.ended_ms - absence.started_ms < 20_000
    assert tell(person, "1") == 204
    person.agree()
    assert all(one.ended_ms is not None for one in absences(person)), "who sees the next page is back"
    assert len(absences(person)) == 2
    assert tell(person, "1", step="consent") == 204
    assert len(absences(person)) == 2, "an old page tells nothing"


def test_a_long_absence_flags_the_visit(served: Served) -> None:
    person = Participant(served)
    visit = row_of(person)
    served.store.left_page(visit.id, "consent", visit.created_ms).result()
    served.store.back_on_page(visit.id, visit.created_ms + 61_000).result()
    with served.store.reading() as connection:
        found = overview.flags(connection, "mine", visit.id)
    assert [flag.kind for flag in found[visit.id]] == ["hidden_tab"]


def test_what_is_kept_of_a_page_that_keeps_telling_is_bounded(served: Served) -> None:
    person = Participant(served)
    visit = row_of(person)
    for number in range(MOST_ABSENCES + 5):
        served.store.left_page(visit.id, "consent", visit.created_ms + 2 * number)
        served.store.back_on_page(visit.id, visit.created_ms + 2 * number + 1)
    served.store.flush().result()
    served.store.enter_step(visit.id, "consent", visit.created_ms).result()
    assert len(absences(person)) == MOST_ABSENCES


def test_strangers_and_other_sites_are_told_nothing(served: Served) -> None:
    person = Participant(served)
    http = person.http
    assert http.post("/v/nobody/away", data={"step": "consent", "hidden": "1"}).status_code == 404
    foreign = {"origin": "http://other.example"}
    answer = http.post(f"{person.path}/away", data={"step": "consent", "hidden": "1"}, headers=foreign)
    assert answer.status_code == 403
    assert http.post(f"{person.path}/away", content=b"\xff\xfe").status_code in (204, 415, 400)
    assert absences(person) == []
