from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.study.study import Study, load_study
from galley.study.visit.condition_slots import (
    Full,
    Issue,
    Slot,
    allocate,
    capacity,
    cell_number,
    cell_of_slot,
    cells,
    place_in_cell,
)
from tests.study.studies import GOOD
from tests.study.workspaces import study_workspace

FACTORS = """\
factors:
  partner: {levels: [random, myopic, stay]}
  length: {levels: [short, long]}
quota: 4
"""
EXPIRES_MS = 60_000


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    text = GOOD.replace("seed: 11\n", "seed: 11\n" + FACTORS)
    return load_study(study_workspace(tmp_path_factory.mktemp("slots") / "w", text), "mine")


def crossed(tmp_path: Path, factors: str) -> Study:
    text = GOOD.replace("seed: 11\n", "seed: 11\n" + factors)
    return load_study(study_workspace(tmp_path / "w", text), "mine")


def test_cells_are_the_crossing_of_full_factors(study: Study) -> None:
    assert len(cells(study.config)) == 6
    assert {(cell["partner"], cell["length"]) for cell in cells(study.config)} == {
        (partner, length) for partner in ("random", "myopic", "stay") for length in ("short", "long")
    }
    assert capacity(study) == 24


@given(start=st.integers(0, 10**6))
def test_every_block_of_slots_holds_every_cell_once(study: Study, start: int) -> None:
    block = [cell_number(study, start * 6 + n) for n in range(6)]
    assert sorted(block) == list(range(6))
    assert {place_in_cell(study, start * 6 + n) for n in range(6)} == {start}


def test_a_study_without_factors_has_one_cell(tmp_path: Path) -> None:
    study = crossed(tmp_path, "")
    assert cells(study.config) == ({},)
    assert [cell_of_slot(study, n) for n in range(3)] == [{}, {}, {}]
    assert capacity(study) is None


def test_latin_fixed_and_random_factors(tmp_path: Path) -> None:
    study = crossed(
        tmp_path,
        """\
factors:
  a: {levels: [a1, a2, a3]}
  b: {levels: [b1, b2, b3]}
  c: {levels: [c1, c2, c3], assign: latin_square}
  d: {levels: [d1, d2], assign: fixed}
  e: {levels: [e1, e2], assign: random}
""",
    )
    conditions = [cell_of_slot(study, n) for n in range(360)]
    assert len(cells(study.config)) == 9
    for one, other in (("a", "b"), ("a", "c"), ("b", "c")):
        met = Counter((condition[one], condition[other]) for condition in conditions)
        assert len(met) == 9
        assert set(met.values()) == {40}
    assert [condition["d"] for condition in conditions[:4]] == ["d1", "d2", "d1", "d2"]
    assert abs(sum(condition["e"] == "e1" for condition in conditions) - 180) < 45


def slot(number: int, *, completed: bool = False, ended: bool = False, seen: float = 0) -> Slot:
    return Slot(number, completed, ended, seen)


def test_an_arrival_gets_the_next_slot_until_one_comes_free() -> None:
    assert allocate([], 0, EXPIRES_MS, None) == Issue(0, again=False)
    held = [slot(0), slot(1), slot(2)]
    assert allocate(held, 0, EXPIRES_MS, None) == Issue(3, again=False)
    assert allocate([*held, slot(3, ended=True)], 0, EXPIRES_MS, None) == Issue(3, again=True)
    assert allocate([slot(2, ended=True), slot(0), slot(1, ended=True)], 0, EXPIRES_MS, None) == Issue(
        1, again=True
    )
    assert allocate([slot(0, seen=1), slot(1, seen=5)], EXPIRES_MS, EXPIRES_MS, None) == Issue(2, again=False)
    assert allocate([slot(0, seen=1), slot(1)], EXPIRES_MS, EXPIRES_MS, None) == Issue(1, again=True)
    assert allocate([slot(0, completed=True)], 10 * EXPIRES_MS, EXPIRES_MS, None) == Issue(1, again=False)


def test_a_full_study_says_whether_slots_may_come_free() -> None:
    assert allocate([slot(0), slot(1, completed=True)], 0, EXPIRES_MS, 2) == Full(closed=False)
    assert allocate([slot(0, completed=True), slot(1, completed=True)], 0, EXPIRES_MS, 2) == Full(closed=True)


@dataclass
class Desk:
    """The slots of a study as records keep them, moved by what visits do."""

    study: Study
    now_ms: float = 0
    slots: tuple[Slot, ...] = ()
    cell_of: dict[int, int] = field(default_factory=dict)

    def arrive(self) -> Issue | Full:
        answer = allocate(self.slots, self.now_ms, EXPIRES_MS, capacity(self.study))
        if isinstance(answer, Issue):
            others = tuple(slot for slot in self.slots if slot.number != answer.number)
            assert answer.again == (len(others) < len(self.slots))
            assert all(not slot.completed for slot in self.slots if slot.number == answer.number)
            self.slots = (
                *others,
                Slot(answer.number, completed=False, ended=False, last_seen_ms=self.now_ms),
            )
        return answer

    def change(self, number: int, **changes: bool | float) -> None:
        self.slots = tuple(
            replace(slot, last_seen_ms=self.now_ms, **changes) if slot.number == number else slot  # type: ignore[arg-type]
            for slot in self.slots
        )

    def counts(self) -> Counter[int]:
        counts = Counter(dict.fromkeys(range(len(cells(self.study.config))), 0))
        for slot in self.slots:
            if slot.number not in self.cell_of:
                self.cell_of[slot.number] = cell_number(self.study, slot.number)
            counts[self.cell_of[slot.number]] += 1
        return counts

    def check(self) -> None:
        counts = self.counts()
        assert max(counts.values()) - min(counts.values()) <= 1
        numbers = [slot.number for slot in self.slots]
        assert sorted(numbers) == list(range(len(numbers)))
        total = capacity(self.study)
        assert total is None or len(numbers) <= total


happening = st.tuples(
    st.sampled_from(["arrive", "arrive", "complete", "leave", "seen", "wait"]), st.integers(0, 10**6)
)


@given(happenings=st.lists(happening, max_size=150))
def test_cells_never_differ_by_more_than_one_whatever_visits_do(
    study: Study, happenings: list[tuple[str, int]]
) -> None:
    desk = Desk(study)
    for what, which in happenings:
        running = [slot.number for slot in desk.slots if not slot.completed and not slot.ended]
        if what == "arrive":
            answer = desk.arrive()
            if isinstance(answer, Full):
                done = sum(slot.completed for slot in desk.slots)
                assert len(desk.slots) == capacity(study)
                assert answer.closed == (done == capacity(study))
        elif what == "wait":
            desk.now_ms += which % (2 * EXPIRES_MS)
        elif running:
            number = running[which % len(running)]
            desk.change(number, **{"complete": {"completed": True}, "leave": {"ended": True}}.get(what, {}))
        desk.check()
    # Whoever comes from now on stays: the study closes with exactly its quota in every cell.
    desk.now_ms += EXPIRES_MS
    for _ in range(2 * 24):
        answer = desk.arrive()
        if isinstance(answer, Issue):
            desk.change(answer.number, completed=True)
        desk.check()
    assert desk.arrive() == Full(closed=True)
    assert set(desk.counts().values()) == {study.config.quota}
    assert all(slot.completed for slot in desk.slots)


@pytest.mark.parametrize("seed", range(2))
def test_a_thousand_arrivals_with_fifty_in_flight_and_thirty_in_a_hundred_who_leave(
    study: Study, seed: int
) -> None:
    """No quota: every visit completes, declines, or falls silent; cells are even at every moment."""
    free = replace(study, config=study.config.model_copy(update={"quota": None}))
    desk = Desk(free)
    chance = random.Random(seed)
    in_flight: list[int] = []
    for _ in range(1000):
        desk.now_ms += 1000
        answer = desk.arrive()
        assert isinstance(answer, Issue)
        in_flight.append(answer.number)
        desk.check()
        for number in in_flight:
            if chance.random() < 0.5:
                desk.change(number)
        while len(in_flight) >= 50:
            number = in_flight.pop(chance.randrange(len(in_flight)))
            fate = chance.random()
            if fate < 0.7:
                desk.change(number, completed=True)
            elif fate < 0.85:
                desk.change(number, ended=True)
            desk.check()
        in_flight = [
            slot.number
            for slot in desk.slots
            if slot.number in in_flight and desk.now_ms - slot.last_seen_ms < EXPIRES_MS
        ]
    completed = Counter(cell_number(free, slot.number) for slot in desk.slots if slot.completed)
    assert sum(completed.values()) > 500
