"""Plans that older versions stored are read for good, and lead to the end of their visits."""

from __future__ import annotations

import json
from pathlib import Path

from galley.study.stages.round_step import RoundStep
from galley.study.stages.stage_kinds import STEP_TYPES
from galley.study.visit.happenings import (
    Agreed,
    Continued,
    Happening,
    RoundEnded,
    Skipped,
    Submitted,
    TimedOut,
)
from galley.study.visit.plan import Plan
from galley.study.visit.progress import Progress, next_progress
from galley.study.visit.steps import Step

STORED = Path(__file__).with_name("plan_of_every_kind.json").read_text(encoding="utf-8")
"""A visit to a study with every kind of stage, as the version before steps had types stored it."""

OLDEST = """{"study":"demo","study_sha256":"d","visit_no":0,"visit_seed":7,"condition":{"arm":"a"},
"hats":{"chef-a":"orange"},"steps":[{"id":"tutorial","kind":"round","title":"Practice","data":{"round_no":0,
"of":2,"layout":"tiny","agent":"chef-a","human_seat":1,"human_hat":"blue","partner_hat":"orange",
"seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":null,"tutorial":true,"scored":true,"skippable":false}},
{"id":"after","kind":"questionnaire","title":"After","data":{"questionnaire":"after","round_no":1,
"partner_hat":"orange","human_hat":"blue"}},
{"id":"debrief","kind":"debrief","title":"Thank you","data":{"completion_code":"DONE"}}]}"""


def test_it_holds_every_kind_of_step() -> None:
    assert {step["kind"] for step in json.loads(STORED)["steps"]} == {
        *("consent", "questionnaire", "instructions", "quiz", "break", "screen_out", "round"),
        *("comparison", "debrief"),
    }


def test_it_is_read_whole_and_stored_as_before() -> None:
    plan = Plan.from_json(STORED)
    assert all(type(step) is STEP_TYPES[step.kind] for step in plan.steps)
    assert json.loads(plan.to_json()) == json.loads(STORED)
    assert Plan.from_json(plan.to_json()) == plan
    alone, first, second = [step for step in plan.steps if isinstance(step, RoundStep)][:3]
    assert (alone.partner, alone.tutorial, alone.skippable, alone.scored) == ("none", True, True, False)
    assert first.goal is not None
    assert (first.goal.score, first.seconds, first.agents) == (20, 4.0, ("random",))
    assert second.lobby is not None
    assert (second.partner, second.agent, second.agents) == ("human", None, ("myopic", "random"))
    assert (second.lobby.wait_s, second.pairing) == (30, "rounds|2|cramped_room|40|50|2|hold|length=short")


def test_its_visit_can_go_on_to_the_end() -> None:
    plan = Plan.from_json(STORED)
    answers = {"survey": {"age": 30}, "quiz": {"onions": 3.0, "start": "by-itself", "score": "shared"}}
    progress, met = Progress(), []
    while progress.status == "active":
        step = plan.steps[progress.step_index]
        met.append(step.id)
        after = next_progress(plan, progress, _next(step), answers)
        assert isinstance(after, Progress), after
        progress = after
    assert (progress.status, progress.step_index) == ("completed", len(plan.steps) - 1)
    assert met == [step.id for step in plan.steps if step.id not in ("screen-out", "debrief")]
    child = next_progress(plan, Progress(1), Submitted("survey"), {"survey": {"age": 17}})
    assert child == Progress(2, "screened_out")
    assert next_progress(plan, Progress(1), TimedOut("survey")) == Progress(1, "timed_out")
    assert next_progress(plan, Progress(1), Skipped("survey")) == Progress(3)


def _next(step: Step) -> Happening:
    match step.kind:
        case "consent":
            return Agreed(step.id)
        case "instructions" | "break":
            return Continued(step.id)
        case "round":
            return RoundEnded(step.id, "finished")
        case _:
            return Submitted(step.id)


def test_plans_from_before_episodes_and_lobbies_are_read() -> None:
    plan = Plan.from_json(OLDEST)
    played = plan.steps[0]
    assert isinstance(played, RoundStep)
    assert (played.partner, played.episodes, played.seeds, played.input_mode) == ("agent", 1, (), "hold")
    assert (plan.language, plan.slot, plan.attention.allowed, plan.attention.then) == ("en", 0, 0, "flag")
