"""The planning robots: one implementation behind two doors, beliefs that follow the human, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from galley.compiled.randomness import draw, uniform
from galley.errors import GalleyError
from galley.kitchen import NORTH, STAY, Kitchen, Layout
from galley.kitchen.state import ChefView, KitchenView, PotView, from_view
from galley.planning.brain import brain
from galley.planning.distances import distances
from galley.planning.myopic import Myopic
from galley.planning.robots import MDP, QMDP
from galley.planning.subtasks import SUBTASKS
from galley.planning.trials import run
from tests.kitchen.pots import pot_of
from tests.planning.kitchens import random_kitchen
from tests.planning.subtasks import feasible_subtasks, myopic_subtask

ROOM = Layout.from_ascii(
    "room",
    """
    XXPXX
    O   O
    X2 1X
    XDXSX
    """,
    horizon_ticks=150,
)
APART = Layout.from_ascii(
    "apart",
    """
    XXXPX
    O X1P
    O2X X
    D X X
    XXXSX
    """,
    horizon_ticks=200,
)


@pytest.mark.parametrize("seed", [0, 7, 2**64 - 1])
def test_compiled_random_numbers_are_those_of_galley(seed: int) -> None:
    for seat, tick, stream in ((0, 0, 0), (1, 399, 3)):
        assert draw(np.uint64(seed), seat, tick, stream) == uniform(seed, seat, tick, stream)


@pytest.mark.parametrize("robot", ["myopic", "mdp", "qmdp"])
@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("layout", [ROOM, APART], ids=lambda layout: layout.name)
def test_compiled_trials_are_those_of_the_agents(robot: str, seat: int, layout: Layout) -> None:
    seeds = np.array([3, 2**63 + 5], dtype=np.uint64)
    trials = run(layout, robot, 0.1, seeds, seat)
    for trial, seed in enumerate(seeds.tolist()):
        agents = [{"myopic": Myopic, "mdp": MDP, "qmdp": QMDP}[robot](), Myopic(epsilon=0.1)]
        if seat == 1:
            agents.reverse()
        kitchen = Kitchen(layout)
        for place, agent in enumerate(agents):
            agent.reset(layout, place, seed)
        while not kitchen.done:
            state, tick = kitchen.state.copy(), kitchen.tick
            joint = (agents[0].act(state, tick), agents[1].act(state, tick))
            assert joint == tuple(trials.joint_actions[trial, tick].tolist()), tick
            kitchen.step(*joint)
            for agent in agents:
                agent.observe(state, joint)
        assert kitchen.tick == trials.ticks[trial]


def test_the_belief_goes_where_the_human_goes() -> None:
    layout = Layout.from_ascii(
        "between",
        """
        XXXXPXX
        O     D
        X 2   X
        X   1 X
        XXXXSXX
        """,
    )
    state = from_view(
        layout,
        KitchenView(
            chefs=(ChefView(4, 3, NORTH), ChefView(3, 1, NORTH)),
            pots={(4, 0): pot_of(kind=1, count=3, ticks=5)},
        ),
    )
    assert "take dish" in feasible_subtasks(distances(layout), state, 1)
    robot = QMDP()
    robot.reset(layout.with_rules(), 0, 0)
    robot.observe(state, (STAY, STAY))
    assert robot.belief == {"take dish": 1.0}

    two = Layout.from_ascii("two", "XPXXPXX\nO     D\nX 2   X\nX   1 X\nXXXXSXX")
    state = from_view(
        two,
        KitchenView(
            chefs=(ChefView(4, 3, NORTH), ChefView(3, 2, NORTH)),
            pots={(1, 0): pot_of(), (4, 0): pot_of(kind=1, count=3, ticks=5)},
        ),
    )
    robot.reset(two, 0, 0)
    robot.observe(state, (STAY, STAY))
    assert robot.belief == {"take onion": 0.5, "take dish": 0.5}
    robot.observe(state, (STAY, 2))
    assert robot.belief["take dish"] > 0.9


def test_the_belief_is_uniform_again_when_the_human_has_done_a_subtask() -> None:
    two = Layout.from_ascii("two", "XPXXPXX\nO2    D\nX     X\nX   1 X\nXXXXSXX")
    state = from_view(
        two,
        KitchenView(
            chefs=(ChefView(4, 3, NORTH), ChefView(1, 1, 3)),
            pots={(1, 0): pot_of(), (4, 0): pot_of(kind=1, count=3, ticks=5)},
        ),
    )
    robot = QMDP()
    robot.reset(two, 0, 0)
    for _ in range(3):
        robot.observe(state, (STAY, STAY))
    robot.observe(state, (STAY, 5))
    assert robot.belief == {"fill pot": 1.0}


def test_subtasks_follow_the_state_machine() -> None:
    known = distances(ROOM)

    def at(held: int, pot: PotView) -> set[str]:
        seen = KitchenView(chefs=(ChefView(3, 2, 0, held), ChefView(1, 2, 0)), pots={(2, 0): pot})
        return set(feasible_subtasks(known, from_view(ROOM, seen), 0))

    cooking, begun = pot_of(kind=1, count=3, ticks=2), pot_of(kind=1, count=1)
    assert at(0, begun) == {"take onion"}
    assert at(0, cooking) == {"take dish"}
    assert at(1, begun) == {"fill pot"}
    assert at(1, cooking) == {"drop"}
    assert at(3, cooking) == {"fetch soup"}
    assert at(3, begun) == {"drop"}
    assert at(4, begun) == {"deliver"}
    assert {name for held in range(5) for name in at(held, cooking)} <= {one.name for one in SUBTASKS}


def test_chefs_apart_pass_things_over_shared_counters() -> None:
    known = distances(APART)
    seen = KitchenView(chefs=(ChefView(3, 1, 0), ChefView(1, 2, 0, 1)))
    state = from_view(APART, seen)
    found = feasible_subtasks(known, state, 1)
    assert set(found) == {"drop"}
    assert found["drop"][0][0] == 2
    assert myopic_subtask(known, state, 1)[0] == "drop"
    for robot in ("mdp", "qmdp"):
        for seat in (0, 1):
            assert run(APART, robot, 0.0, np.arange(2, dtype=np.uint64), seat).joint_actions.any()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("XXXXX\nO1 2D\nX   X\nXXSXX", "no pot"),
        ("XPXXXXX\nO1XX2 D\nX XX  X\nXXXXSXX", "share no counter"),
        ("XXPXXXXX\nO1 2DX X\nX    XSX\nXXXXXXXX", "serving place at"),
    ],
)
def test_kitchens_that_cannot_be_served_are_refused_by_name_of_the_station(text: str, named: str) -> None:
    layout = Layout.from_ascii("broken", text)
    for robot in (MDP(), QMDP()):
        with pytest.raises(GalleyError, match=named):
            robot.reset(layout, 0, 0)


def test_robots_play_any_small_kitchen_that_can_be_served() -> None:
    played = 0
    for seed in range(60):
        layout = random_kitchen(seed, 14, "PODSPO").with_rules(horizon_ticks=60)
        try:
            brain(layout, 0)
        except GalleyError:
            continue
        run(layout, "qmdp", 0.2, np.arange(3, dtype=np.uint64), seed % 2)
        played += 1
    assert played > 10
