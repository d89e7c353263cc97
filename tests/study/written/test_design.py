"""Designs of whole studies: what participants who complete a study have met, all together."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from galley.errors import InvalidFiles
from galley.study.describe import describe
from galley.study.stages.round_step import Bonus, Goal
from galley.study.study import Study, load_study
from galley.study.visit.condition_slots import cell_number, cells
from galley.study.visit.plan import Plan, plan_visit, visit_seed
from galley.study.visit.steps import Step
from galley.workspace import Workspace
from tests.study.workspaces import ROOT, study_workspace

FRAME = """\
format: 1
title: Design
seed: 5
completion: {code: DONE}
%s
stages:
  - {kind: consent, text: consent}
%s
  - {kind: debrief, text: debrief}
"""
LAYOUTS = "[{layout: cramped_room}, {layout: coordination_ring}, {layout: counter_circuit}]"


def design(folder: Path, stages: str, top: str = "") -> Study:
    text = FRAME % (top, "\n".join(f"  {line}" for line in stages.strip().splitlines()))
    return load_study(study_workspace(folder / "w", text), "mine")


def refused(folder: Path, stages: str, top: str = "") -> str:
    with pytest.raises(InvalidFiles) as caught:
        design(folder, stages, top)
    return str(caught.value)


def plans(study: Study, count: int) -> list[Plan]:
    """The plans of those who complete slots 0, 1, ...: their visits' numbers are anything."""
    return [plan_visit(study, visit_seed(study, 3 * n + 1), 3 * n + 1, n) for n in range(count)]


def rounds(plan: Plan) -> list[Step]:
    return [step for step in plan.steps if step.kind == "round" and not step.tutorial]


def met(plan: Plan, key: str) -> tuple[object, ...]:
    return tuple(getattr(step, key) for step in rounds(plan))


def test_cole_pairs_everyone_meets_the_focal_agent_and_one_baseline_on_every_layout() -> None:
    """COLE paper, Sec. 7.6.1: layouts in the paper's order, the order of agents drawn within each pair."""
    study = load_study(Workspace(ROOT), "cole-pairs")
    order = (
        *("cramped_room", "asymmetric_advantages", "coordination_ring"),
        *("forced_coordination", "counter_circuit"),
    )
    baselines = [cell["baseline"] for cell in cells(study.config)]
    assert len(baselines) >= 3
    given = plans(study, 40 * len(baselines))
    first = 0
    for plan in given:
        baseline = plan.condition["baseline"]
        assert met(plan, "layout") == tuple(layout for layout in order for _ in range(2))
        pairs = [met(plan, "agent")[n : n + 2] for n in range(0, 10, 2)]
        assert all(set(pair) == {"cole-sv", baseline} for pair in pairs)
        assert all(len({step.human_seat for step in rounds(plan)[n : n + 2]}) == 1 for n in (0, 4, 8))
        first += sum(pair[0] == "cole-sv" for pair in pairs)
        comparison = next(step for step in plan.steps if step.kind == "comparison")
        assert {comparison.first.agent, comparison.second.agent} == {"cole-sv", baseline}
        assert rounds(plan)[0].bonus == Bonus(amount=5.0, unit="CNY")
    assert set(Counter(plan.condition["baseline"] for plan in given).values()) == {40}
    drawn = 5 * len(given)
    assert abs(first - drawn / 2) < 4.5 * (drawn / 4) ** 0.5


def test_hats_and_agents_are_independent_over_400_assignments() -> None:
    """Chi-square of hat by agent; with 2 x 7 hats 6 degrees of freedom: 99.9% of draws stay below 22.5."""
    study = load_study(Workspace(ROOT), "cole-pairs")
    given = plans(study, 400)
    focal = Counter(plan.hats["cole-sv"] for plan in given)
    other = Counter(plan.hats[plan.condition["baseline"]] for plan in given)
    expected = 400 / 7
    for counts in (focal, other):
        assert sum((counts[hat] - expected) ** 2 / expected for hat in study.config.hats) < 22.5


def test_lsi_everyone_meets_twelve_kitchens_in_an_order_of_their_own() -> None:
    """LSI paper, Sec. VII: within subjects, randomised order, 3 training sessions, 2 of them alone."""
    study = load_study(Workspace(ROOT), "lsi-environments")
    kinds = ("even_workloads", "uneven_workloads", "high_team_fluency", "low_team_fluency")
    names = {f"lsi_{kind}_{n}" for kind in kinds for n in range(3)}
    given = plans(study, 300)
    places = Counter()
    for plan in given:
        assert set(met(plan, "layout")) == names
        assert set(met(plan, "human_seat")) == {1}
        assert set(met(plan, "ticks")) == {150}
        tutorials = [step.partner for step in plan.steps if step.kind == "round" and step.tutorial]
        assert tutorials == ["none", "none", "agent"]
        places[met(plan, "layout").index("lsi_low_team_fluency_1")] += 1
    assert len({met(plan, "layout") for plan in given}) > 290
    assert sum((places[n] - 25) ** 2 / 25 for n in range(12)) < 31.3  # 99.9% of draws, 11 degrees of freedom
    for name in names:
        layout = study.layouts[name]
        assert (layout.rules.orders, layout.rules.cook_time_ticks) == (("onion", "onion"), 10)
        assert (layout.width, layout.height) == (15, 10)


def test_latin_square_rows_are_even_within_every_cell(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        f"""
- kind: rounds
  agents: [random, myopic]
  layouts: {LAYOUTS}
  layout_order: latin_square
  agent_order: latin_square
  seat_order: latin_square
""",
        "factors: {arm: {levels: [a, b]}}\nhat_order: latin_square",
    )
    given = plans(study, 2 * 42)  # rows: 6 for three layouts, 2 for agents and seats, 14 for hats
    for cell in range(2):
        of_cell = [plan for plan in given if cell_number(study, plan.slot) == cell]
        assert len(of_cell) == 42
        orders = Counter(tuple(dict.fromkeys(met(plan, "layout"))) for plan in of_cell)
        assert len(orders) == 6
        assert set(orders.values()) == {7}
        firsts = Counter(met(plan, "agent")[0] for plan in of_cell)
        assert set(firsts.values()) == {21}
        seats = Counter(met(plan, "human_seat")[0] for plan in of_cell)
        assert set(seats.values()) == {21}
        hats = Counter(plan.hats["myopic"] for plan in of_cell)
        assert len(hats) == 7
        assert set(hats.values()) == {6}
    assert "even after each 42 completed visits of each cell" in describe(study)


def test_full_counterbalancing_of_order_and_seat(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        """
- kind: rounds
  agents: [random, myopic]
  layouts: [{layout: cramped_room}, {layout: coordination_ring}]
  agent_order: full
  layout_order: full
  seats: per_round
  seat_order: full
""",
    )
    given = plans(study, 16)
    assert set(Counter(met(plan, "human_seat") for plan in given).values()) == {1}
    assert set(Counter(met(plan, "layout")[::2] for plan in given).values()) == {8}
    agents = Counter((met(plan, "agent")[0], met(plan, "agent")[2]) for plan in given)
    assert len(agents) == 4
    assert set(agents.values()) == {4}


def test_each_layout_once_with_one_agent_by_latin_square(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        f"""
- kind: rounds
  agents: [random, myopic, stay]
  layouts: {LAYOUTS}
  pairs: latin_square
  after_each: after-round
""",
    )
    given = plans(study, 30)
    assert all(len(rounds(plan)) == 3 and len(set(met(plan, "agent"))) == 3 for plan in given)
    both = Counter(
        pair for plan in given for pair in zip(met(plan, "layout"), met(plan, "agent"), strict=True)
    )
    assert len(both) == 9
    assert set(both.values()) == {10}
    assert [step.of for step in rounds(given[0])] == [3, 3, 3]


def test_blocks_of_one_agent_play_all_layouts_first(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        f"""
- kind: rounds
  agents: [random, myopic]
  layouts: {LAYOUTS}
  blocks: agent
  agent_order: latin_square
  layout_order: random
  seats: per_layout
""",
    )
    for plan in plans(study, 20):
        agents, layouts = met(plan, "agent"), met(plan, "layout")
        assert len(set(agents[:3])) == len(set(agents[3:])) == 1
        assert sorted(layouts[:3]) == sorted(layouts[3:])
        seats = {(step.layout, step.human_seat) for step in rounds(plan)}
        assert len(seats) == 3


def test_factors_stand_for_agents_layouts_texts_and_questionnaires(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        """
- {kind: instructions, text: $words, when: {factor: words, none_of: [debrief]}}
- kind: rounds
  agents: [$partner]
  layouts: [{layout: $kitchen}]
  after_each: $asked
""",
        """\
factors:
  partner: {levels: [random, myopic]}
  kitchen: {levels: [cramped_room, coordination_ring]}
  words: {levels: [instructions, debrief], assign: fixed}
  asked: {levels: [after-round, nasa-tlx], assign: random}""",
    )
    seen = set()
    for plan in plans(study, 40):
        condition = plan.condition
        assert met(plan, "agent") == (condition["partner"],)
        assert met(plan, "layout") == (condition["kitchen"],)
        instructions = [step for step in plan.steps if step.kind == "instructions"]
        assert len(instructions) == (condition["words"] == "instructions")
        asked = next(step for step in plan.steps if step.kind == "questionnaire")
        assert asked.questionnaire == condition["asked"]
        seen.add(tuple(condition.values()))
    assert len(seen) == 16
    assert study.agents == ("random", "myopic")


def test_rounds_carry_all_their_settings(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        """
- {kind: tutorial, layout: practice_alone, agent: none, seat: 0, episodes: 2, skippable: true}
- kind: rounds
  agents: [myopic]
  tick_ms: 100
  horizon_ticks: 50
  episodes: 3
  input_mode: press
  show_score: after
  goal_text: "Get {goal} for {bonus}!"
  layouts:
    - {layout: cramped_room, goal: 60, bonus: 2.5, horizon_ticks: 70, tick_ms: 200}
    - {layout: coordination_ring, goal: 20}
""",
        "bonus_unit: EUR",
    )
    plan = plan_visit(study, 1, 0)
    alone = plan.steps[1]
    assert (alone.partner, alone.agent, alone.skippable) == ("none", "stay", True)
    assert (len(alone.seeds), alone.show_score) == (2, "during")
    first, second = rounds(plan)
    assert (first.ticks, first.tick_ms, second.ticks, second.tick_ms) == (
        70,
        200,
        50,
        100,
    )
    assert first.goal == Goal(score=60, text="Get 60 for 2.5 EUR!")
    assert first.bonus == Bonus(amount=2.5, unit="EUR")
    assert second.bonus is None
    assert (first.input_mode, first.show_score, first.episodes) == (
        "press",
        "after",
        3,
    )
    assert first.seeds[0] == first.seed
    every = [seed for step in (alone, first, second) for seed in step.seeds]
    assert len(set(every)) == len(every) == 8


def test_people_who_play_together_have_the_same_pairing_in_the_same_cell(tmp_path: Path) -> None:
    study = design(
        tmp_path,
        f"""
- kind: rounds
  agents: [human, myopic]
  agent_order: fixed
  layouts: {LAYOUTS}
  lobby: {{wait_s: 30, fallback: random, dropout: myopic}}
""",
        "factors: {arm: {levels: [a, b]}}",
    )
    assert study.agents == ("myopic", "random")
    given = plans(study, 8)
    together: dict[str, set[str]] = {}
    for plan in given:
        person = rounds(plan)[0].stored()["data"]
        assert (person["partner"], person["agent"]) == ("human", None)
        assert person["lobby"] == {"wait_s": 30, "fallback": "random", "dropout": "myopic"}
        assert person["partner_hat"] == plan.hats["human"] != person["human_hat"]
        assert "pairing" not in rounds(plan)[1].stored()["data"]
        assert len({step.pairing for step in rounds(plan)[::2]}) == 3
        together.setdefault(plan.condition["arm"], set()).add(person["pairing"])
    assert {len(pairings) for pairings in together.values()} == {1}
    assert together["a"] != together["b"]


@pytest.mark.parametrize(
    ("stages", "top", "words"),
    [
        ("- {kind: rounds, agents: [$x], layouts: [{layout: simple}]}", "", "no factor is named 'x'"),
        (
            "- {kind: rounds, agents: [$x], layouts: [{layout: simple}]}",
            "factors: {x: {levels: [stay, myopc]}}",
            "mine.yaml:5: level 'myopc' stands for one of agents, and none has that name; did you mean",
        ),
        (
            "- {kind: rounds, agents: [stay, $x], layouts: [{layout: simple}]}",
            "factors: {x: {levels: [stay, myopic]}}",
            "agent 'stay' is met twice where x is stay",
        ),
        ("", "factors: {x: {levels: [a, a]}}", "level 'a' stands twice"),
        (
            "",
            "factors: {x: {levels: [a, b]}, y: {levels: [c, d], assign: latin_square}}",
            "factor 'y' cannot form a Latin square",
        ),
        (
            f"- {{kind: rounds, agents: [human, stay], layouts: {LAYOUTS}}}",
            "",
            "need the same order, not agent_order 'random'; write `agent_order: fixed`",
        ),
        (
            f"- {{kind: rounds, agents: [stay], layouts: {LAYOUTS}, lobby: {{wait_s: 3}}}}",
            "",
            "a lobby is for rounds with another participant",
        ),
        (
            f"- {{kind: rounds, agents: [stay, random, mdp, qmdp], layouts: {LAYOUTS}, agent_order: full}}",
            "",
            "full counterbalancing here needs 13824 participants",
        ),
        (
            "- {kind: rounds, agents: [stay], layouts: [{layout: simple, bonus: 5}]}",
            "",
            "a bonus without a goal cannot be earned",
        ),
        ("- {kind: tutorial, layout: simple, agent: none}", "", "a tutorial alone needs a seat"),
        (
            "- {kind: tutorial, layout: simple, agent: none, seat: 0}",
            "",
            "the start of the other seat on 'simple' is not walled off from seat 0",
        ),
        (
            "- {kind: instructions, text: instructions, when: {factor: x, any_of: [a]}}",
            "",
            "no factor is named",
        ),
        (
            "- {kind: instructions, text: instructions, when: {factor: x, any_of: [c]}}",
            "factors: {x: {levels: [a, b]}}",
            "'c' is no level of 'x'; use one of a b",
        ),
        (
            "- {kind: instructions, text: instructions, time_limit_s: 20, at_least_s: 30}",
            "",
            "nobody may go on before 30 s",
        ),
    ],
)
def test_designs_that_cannot_be_run_are_told(tmp_path: Path, stages: str, top: str, words: str) -> None:
    told = refused(tmp_path, stages, top)
    assert words in told
    assert len(told.splitlines()) == 1
    assert told.startswith("studies/mine.yaml:")


TOGETHER = """
- kind: rounds
  agents: [human-bc, $baseline]
  agent_order: full
  seat_order: full
  layouts: [{layout: cramped_room}]
"""
CROSSED = """
factors: {baseline: {levels: [myopic, random, stay]}}
hats: [orange, sky-blue, bluish-green]
hat_order: full
together: [agent_order, seat_order, hat_order]
"""


def combination(plan: Plan) -> tuple[object, ...]:
    """What a visit meets: the baseline, the order, the seat, every hat."""
    baseline = plan.condition["baseline"]
    first = met(plan, "agent")[0] == baseline
    focal = next(hat for agent, hat in plan.hats.items() if agent != baseline)
    hats = (rounds(plan)[0].human_hat, focal, plan.hats[baseline])
    return baseline, first, met(plan, "human_seat")[0], *hats


def test_agent_order_seat_and_hat_are_even_in_every_combination(tmp_path: Path) -> None:
    study = design(tmp_path, TOGETHER, CROSSED)
    told = describe(study)
    assert "agent_order (2) x seat_order (2) x hat_order (6) = 24 in each of 3 cells" in told
    assert "even after each 24 completed visits of each cell" in told
    given = plans(study, 2 * 3 * 24)
    seen = Counter(map(combination, given))
    assert len(seen) == 3 * 2 * 2 * 6
    assert set(seen.values()) == {2}
    # Six visits of a cell are a run: in each, orders, seats and hats are even by themselves already.
    for run in range(0, len(given), 18):
        for part in (1, 2):
            assert set(Counter(combination(plan)[part] for plan in given[run : run + 18]).values()) == {9}
        assert set(Counter(combination(plan)[3:] for plan in given[run : run + 18]).values()) == {3}


def test_without_together_orders_are_even_only_by_themselves(tmp_path: Path) -> None:
    study = design(tmp_path, TOGETHER, CROSSED.replace("together: [agent_order, seat_order, hat_order]", ""))
    assert "together" not in describe(study)
    seen = Counter(map(combination, plans(study, 2 * 3 * 24)))
    assert set(seen.values()) != {2}


def test_orders_of_several_stages_are_counted_together(tmp_path: Path) -> None:
    stage = TOGETHER.strip().replace("$baseline", "myopic").replace("  seat_order: full\n", "")
    study = design(tmp_path, f"{stage}\n{stage}", "together: [agent_order]")
    assert "rounds.agent_order (2) x rounds-2.agent_order (2) = 4" in describe(study)
    seen = Counter(met(plan, "agent") for plan in plans(study, 12))
    assert sorted(seen.values()) == [3, 3, 3, 3]


def test_a_quota_that_leaves_combinations_uneven_is_told(tmp_path: Path) -> None:
    for number in (24, 30, 10):
        (tmp_path / f"q{number}").mkdir()
    for quota, told in ((24, None), (30, "24 or 48 would be"), (10, "24 would be")):
        lines = describe(design(tmp_path / f"q{quota}", TOGETHER, f"{CROSSED}quota: {quota}"))
        assert (f"quota of {quota} is no multiple of that" in lines) == (told is not None)
        assert told is None or told in lines


@pytest.mark.parametrize(
    ("top", "stages", "told"),
    [
        ("together: [layout_order, seat_order]", TOGETHER, "nothing counts through 'layout_order'"),
        ("together: [seat_order, hat_order]", TOGETHER, "nothing counts through 'hat_order'"),
        ("together: [seat_order]", TOGETHER, "one order alone is not counted with another"),
        ("together: [seat_order, seat_order]", TOGETHER, "order 'seat_order' stands twice"),
        ("together: [order, seat_order]", TOGETHER, "together"),
        (
            "hat_order: full\ntogether: [seat_order, agent_order, hat_order]",
            TOGETHER.replace("[{layout: cramped_room}]", LAYOUTS),
            "these orders have 53760 combinations",
        ),
    ],
)
def test_what_cannot_be_counted_together_is_refused(tmp_path: Path, top: str, stages: str, told: str) -> None:
    message = refused(tmp_path, stages.replace("$baseline", "random"), top)
    assert told in message
    assert "mine.yaml:" in message
