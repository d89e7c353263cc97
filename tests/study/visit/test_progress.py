from __future__ import annotations

from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.outcomes import ROUND_OUTCOMES
from galley.study.stages.stage_kinds import STEP_TYPES
from galley.study.visit.happenings import (
    Agreed,
    Continued,
    Declined,
    Ended,
    Happening,
    RoundEnded,
    Skipped,
    Submitted,
    TimedOut,
)
from galley.study.visit.plan import Plan
from galley.study.visit.progress import Progress, Refusal, next_progress
from galley.study.visit.steps import Step
from tests.study.stages.kinds import KINDS as STAGES
from tests.study.stages.kinds import rounds_end

STEP_KINDS = tuple(STEP_TYPES)
MIDDLE = [kind for kind in STEP_KINDS if kind not in ("consent", "debrief", "screen_out")]
KINDS = ("consent", *MIDDLE, "round", "questionnaire", "debrief")


def plan_of(*kinds: str) -> Plan:
    steps = []
    skippable = next((number for number, kind in enumerate(kinds) if kind == "round"), None)
    for number, kind in enumerate(kinds):
        data: dict[str, Any] = dict(next(one for one in STAGES.values() if one.step == kind).stored)
        for rule in ("time_limit_s", "at_limit"):
            data.pop(rule, None)
        data["skippable"] = number == skippable
        if kind == "round":
            data["seed"] = number
        if kind == "quiz":
            data |= {"tries": 2, "after_last": "end", "expected": {"q": 1}}
        if kind == "screen_out":
            data["when"] = [{"item": "s0.never", "any_of": [1]}]
        steps.append(STEP_TYPES[kind].model_validate({"id": f"s{number}", "title": "", **data}))
    return Plan("study", "", 0, 0, {}, {}, tuple(steps))


PLAN = plan_of(*KINDS)


def all_happenings(step_id: str) -> list[Happening]:
    return [
        Agreed(step_id),
        Declined(step_id),
        Submitted(step_id),
        Continued(step_id),
        *(RoundEnded(step_id, outcome) for outcome in ROUND_OUTCOMES),
        RoundEnded(step_id, "lost"),  # type: ignore[arg-type]
        Skipped(step_id),
        TimedOut(step_id),
        Ended(step_id, "completed"),
    ]


def legal(step: Step) -> list[Happening]:
    """What the contract allows at a step, written out once more."""
    if step.kind == "round":
        return rounds_end(step.id, skippable=step.skippable)
    return next(kind for kind in STAGES.values() if kind.step == step.kind).ends(step.id)


def test_every_happening_at_every_step_does_what_the_contract_says() -> None:
    last = len(KINDS) - 1
    for index, step in enumerate(PLAN.steps):
        allowed = legal(step)
        for other in PLAN.steps:
            for happening in all_happenings(other.id):
                after = next_progress(PLAN, Progress(index), happening)
                if happening not in allowed:
                    assert isinstance(after, Refusal), (step, happening)
                    assert after.reason
                elif isinstance(happening, Declined):
                    assert after == Progress(index, "declined")
                else:
                    assert after == Progress(index + 1, "completed" if index + 1 == last else "active")


@pytest.mark.parametrize("status", ["completed", "declined"])
def test_a_visit_that_is_over_stays_over(status: Any) -> None:
    for index, step in enumerate(PLAN.steps):
        for happening in all_happenings(step.id):
            assert isinstance(next_progress(PLAN, Progress(index, status), happening), Refusal)


def test_every_kind_of_step_is_covered() -> None:
    assert {*KINDS, "screen_out"} == set(STEP_KINDS)


anything = st.builds(
    lambda n, which: all_happenings(f"s{n}")[which], st.integers(0, len(KINDS)), st.integers(0, 10)
)


@given(tries=st.lists(st.one_of(anything, st.none()), max_size=60))
def test_no_sequence_of_happenings_skips_or_repeats_a_step(tries: list[Happening | None]) -> None:
    """None stands for what the participant would rightly do next; the rest comes from anywhere."""
    progress = Progress()
    visited = [0]
    for happening in tries:
        step = PLAN.steps[progress.step_index]
        right = [h for h in legal(step) if not isinstance(h, Declined)]
        if happening is None and not right:
            continue
        before = progress
        after = next_progress(PLAN, progress, right[0] if happening is None else happening)
        if isinstance(after, Refusal):
            assert progress == before
            continue
        if after.status == "declined":
            assert progress.step_index == 0
            assert after.step_index == 0
        else:
            assert after.step_index == progress.step_index + 1
            visited.append(after.step_index)
        # The same happening arriving a second time changes nothing.
        again = next_progress(PLAN, after, right[0] if happening is None else happening)
        assert isinstance(again, Refusal)
        progress = after
    assert visited == list(range(len(visited)))
    assert (progress.status == "completed") == (progress.step_index == len(KINDS) - 1)


def test_the_straight_way_through_ends_at_the_debrief() -> None:
    progress = Progress()
    for _ in range(len(KINDS) - 1):
        after = next_progress(PLAN, progress, legal(PLAN.steps[progress.step_index])[0])
        assert isinstance(after, Progress)
        progress = after
    assert progress == Progress(len(KINDS) - 1, "completed")


def test_any_two_kinds_in_a_row_work() -> None:
    for one, other in product(MIDDLE, MIDDLE):
        plan = plan_of("consent", one, other, "debrief")
        progress = Progress()
        while progress.status == "active":
            after = next_progress(plan, progress, legal(plan.steps[progress.step_index])[0])
            assert isinstance(after, Progress)
            progress = after
        assert progress.step_index == 3
