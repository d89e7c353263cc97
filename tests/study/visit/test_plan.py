from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from galley.study.stages.round_step import Goal
from galley.study.study import Study, load_study
from galley.study.visit.plan import Plan, plan_visit, visit_seed
from galley.study.visit.steps import Step
from tests.study.studies import GOOD
from tests.study.workspaces import study_workspace

SEEDS = st.integers(0, 2**63 - 1)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(study_workspace(tmp_path_factory.mktemp("plan") / "w", GOOD), "mine")


def variant(folder: Path, old: str, new: str) -> Study:
    assert old in GOOD
    return load_study(study_workspace(folder / "w", GOOD.replace(old, new)), "mine")


def rounds(plan: Plan) -> list[Step]:
    return [step for step in plan.steps if step.kind == "round" and not step.tutorial]


def test_a_plan_has_every_step_in_order(study: Study) -> None:
    plan = plan_visit(study, 5, 0)
    assert [(step.id, step.kind) for step in plan.steps] == [
        ("consent", "consent"),
        ("questionnaire", "questionnaire"),
        ("instructions", "instructions"),
        ("tutorial", "round"),
        *(
            pair
            for n in range(1, 5)
            for pair in ((f"rounds-{n}", "round"), (f"rounds-{n}-questions", "questionnaire"))
        ),
        ("comparison", "comparison"),
        ("debrief", "debrief"),
    ]
    assert plan.steps[0].title == "Before you take part"
    assert plan.steps[0].stored()["data"] == {"text": "consent", "sha256": study.texts["consent"].sha256}
    assert plan.steps[4].title == "Round 1 of 4"
    assert plan.steps[5].title == "How was this round?"
    assert plan.steps[-1].completion_code == "DONE"
    assert plan.study_sha256 == study.sha256


def test_the_tutorial_does_not_count_and_its_partner_has_a_hat_of_its_own(study: Study) -> None:
    plan = plan_visit(study, 5, 0)
    tutorial = plan.steps[3].stored()["data"]
    assert (tutorial["round_no"], tutorial["of"], tutorial["tutorial"], tutorial["scored"]) == (
        0,
        4,
        True,
        False,
    )
    assert tutorial["layout"] == "cramped_room"
    assert tutorial["goal"] is None
    assert tutorial["partner_hat"] not in {*plan.hats.values(), tutorial["human_hat"]}


def test_goals_come_ready_to_show(study: Study) -> None:
    goals = [step.goal for step in rounds(plan_visit(study, 5, 0))]
    goal = Goal(score=160, text="Reach 160 points together to meet this kitchen's goal.")
    assert goals == [goal, goal, None, None]


@given(seed=SEEDS)
def test_every_plan_keeps_the_design(study: Study, seed: int) -> None:
    plan = plan_visit(study, seed, 3)
    played = rounds(plan)
    assert [step.layout for step in played] == ["cramped_room"] * 2 + ["coordination_ring"] * 2
    assert [step.round_no for step in played] == [1, 2, 3, 4]
    for pair in (played[:2], played[2:]):
        assert {step.agent for step in pair} == {"random", "myopic"}
        assert pair[0].human_seat == pair[1].human_seat
    humans = {step.human_hat for step in played}
    assert len(humans) == 1
    assert len({*plan.hats.values(), *humans}) == 3
    assert all(step.partner_hat == plan.hats[step.agent] for step in played)
    for step, questions in zip(played, plan.steps[5::2], strict=False):
        assert questions.partner_hat == step.partner_hat
        assert questions.round_no == step.round_no
        assert "agent" not in questions.stored()["data"]
    comparison = plan.steps[-2].stored()["data"]
    assert {comparison["first"]["agent"], comparison["second"]["agent"]} == {"random", "myopic"}
    assert all(
        partner["hat"] == plan.hats[partner["agent"]]
        for partner in (comparison["first"], comparison["second"])
    )
    seeds = [step.seed for step in plan.steps if step.kind == "round"]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**63 for seed in seeds)


@given(seed=SEEDS, visit_no=st.integers(0, 10**6))
def test_a_plan_is_a_function_of_its_seed_and_round_trips_exactly(
    study: Study, seed: int, visit_no: int
) -> None:
    plan = plan_visit(study, seed, visit_no)
    assert plan_visit(study, seed, visit_no) == plan
    assert Plan.from_json(plan.to_json()) == plan
    assert Plan.from_json(plan.to_json()).to_json() == plan.to_json()


def test_seeds_are_spawned_from_the_study_to_the_visit_to_the_round(study: Study) -> None:
    """numpy's own spawn, written out: the n-th child of the study's seed is visit n."""
    children = np.random.SeedSequence(11).spawn(5)
    wanted = [int(child.generate_state(1, np.uint64)[0]) >> 1 for child in children]
    assert [visit_seed(study, n) for n in range(5)] == wanted
    plan = plan_visit(study, wanted[2], 2)
    _draws, *of_rounds = np.random.SeedSequence(wanted[2]).spawn(6)
    assert [step.seed for step in plan.steps if step.kind == "round"] == [
        int(child.generate_state(1, np.uint64)[0]) >> 1 for child in of_rounds
    ]


def test_what_is_random_is_even_and_independent(study: Study) -> None:
    """400 visits: each share of two within 4.5 standard deviations, hats independent of agents and order."""
    plans = [plan_visit(study, visit_seed(study, n), n) for n in range(400)]
    halves = {
        "agent first on layout 1": [rounds(p)[0].agent == "myopic" for p in plans],
        "agent first on layout 2": [rounds(p)[2].agent == "myopic" for p in plans],
        "seat on layout 1": [rounds(p)[0].human_seat for p in plans],
        "seat on layout 2": [rounds(p)[2].human_seat for p in plans],
        "first in the comparison": [p.steps[-2].first.agent == "myopic" for p in plans],
        "hat of one before the other": [p.hats["myopic"] < p.hats["random"] for p in plans],
    }
    for what, drawn in halves.items():
        assert abs(sum(drawn) - 200) < 45, what
    names = list(halves)
    for one in range(len(names)):
        for other in range(one):
            same = sum(
                bool(a) == bool(b) for a, b in zip(halves[names[one]], halves[names[other]], strict=True)
            )
            assert abs(same - 200) < 45, (names[one], names[other])
    hats = Counter(plan.hats["myopic"] for plan in plans)
    assert len(hats) == 7
    assert all(abs(count - 400 / 7) < 32 for count in hats.values())


def test_fixed_orders_and_seats_are_kept(tmp_path: Path) -> None:
    fixed = variant(tmp_path, "    after_each:", "    agent_order: fixed\n    seats: 1\n    after_each:")
    for seed in range(20):
        played = rounds(plan_visit(fixed, seed, 0))
        assert [step.agent for step in played] == ["random", "myopic"] * 2
        assert {step.human_seat for step in played} == {1}


def test_seats_may_be_drawn_for_each_round(tmp_path: Path) -> None:
    free = variant(tmp_path, "    after_each:", "    seats: per_round\n    after_each:")
    seats = {tuple(step.human_seat for step in rounds(plan_visit(free, seed, 0))) for seed in range(200)}
    assert len(seats) == 16


def test_only_rounds_and_the_comparison_name_agents(study: Study) -> None:
    for step in plan_visit(study, 1, 0).steps:
        if step.kind not in ("round", "comparison"):
            told = json.dumps(step.stored())
            assert not any(agent in told for agent in ("myopic", "random", "stay"))
        assert not any(agent in step.id + step.title for agent in ("myopic", "random", "stay"))
