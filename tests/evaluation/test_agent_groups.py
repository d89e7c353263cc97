"""Means and standard errors of rows and columns, found by hand from a few scores."""

from __future__ import annotations

import math

import pytest

from galley.errors import GalleyError
from galley.evaluation.agent_groups import (
    AgentGroup,
    Seats,
    agent_group,
    agent_groups,
    mean_of,
    with_others,
    with_partner,
)
from galley.evaluation.game_scores import Cell, GameScores, MeanScore
from galley.evaluation.score_tables import as_rows, report


def played(*cells: tuple[str, str, tuple[int, ...]]) -> GameScores:
    return GameScores(
        Cell(layout="room", seat_0=one, seat_1=other, seed=0, fingerprint="f", scores=scores)
        for one, other, scores in cells
    )


GAMES = played(
    ("a", "a", (100, 140)),
    ("a", "p", (0, 40)),
    ("p", "a", (60, 60)),
    ("b", "b", (80, 80)),
    ("b", "p", (40, 40)),
    ("p", "b", (100, 140)),
    ("a", "b", (20, 20)),
    ("b", "a", (40, 40)),
    ("p", "p", (0, 0)),
)
A, B, P = (AgentGroup(name, (name,)) for name in "abp")
BOTH = AgentGroup("both", ("a", "b"))


def test_entries_are_read_as_they_are_written() -> None:
    assert agent_group("sp") == AgentGroup("sp", ("sp",))
    assert agent_group("COLE 1:3=cole-1, cole-2") == AgentGroup("COLE 1:3", ("cole-1", "cole-2"))
    assert agent_group("runs/today/sp/") == AgentGroup("sp", ("runs/today/sp/",))
    for text, told in (
        ("sp=", "names no agent"),
        ("=sp", "names no agent"),
        ("a,,b", "names no agent"),
        ("a,b", "write LABEL=a,b"),
        ("x=a,a", "names an agent twice"),
    ):
        with pytest.raises(GalleyError, match=told):
            agent_group(text)
    with pytest.raises(GalleyError, match="sp: named twice"):
        agent_groups(["sp", "sp=other"])


def test_left_is_seat_0_and_right_is_seat_1() -> None:
    # (0, 40): mean 20, sample deviation 28.28, error 20. (60, 60): 60, no error. Both: 40, error 20 / 2.
    seats = with_partner(GAMES, "room", A, P)
    assert seats.left == MeanScore(20, pytest.approx(20))
    assert seats.right == MeanScore(60, 0)
    assert seats.average == MeanScore(40, pytest.approx(10))


def test_an_agent_with_itself_has_one_seat_order() -> None:
    alone = MeanScore(120, pytest.approx(20))
    assert with_partner(GAMES, "room", A, A) == Seats(alone, alone, alone)
    # Two seeds with themselves: 120 and 80, not each other's 20 and 40.
    figure = with_partner(GAMES, "room", BOTH, BOTH).average
    assert figure == MeanScore(100, pytest.approx(20))


def test_seeds_of_one_method_are_averaged_and_their_spread_is_the_error() -> None:
    seats = with_partner(GAMES, "room", BOTH, P)
    # a: 20 left, 60 right, 40 in the mean; b: 40, 120, 80. Errors: half the difference of the two.
    assert seats.left == MeanScore(30, pytest.approx(10))
    assert seats.right == MeanScore(90, pytest.approx(30))
    assert seats.average == MeanScore(60, pytest.approx(20))


def test_several_partners_in_a_column_count_alike() -> None:
    experts = AgentGroup("experts", ("b", "p"))
    seats = with_partner(GAMES, "room", A, experts)
    assert seats.left == MeanScore(20, pytest.approx(10))  # 20 without and 20 with an error of 20
    assert seats.right == MeanScore(50, 0)
    assert seats.average == MeanScore(35, pytest.approx(5))


def test_others_leave_self_play_out() -> None:
    # a with b: (20 + 40) / 2 = 30; with p: 40, error 10. b with a 30, with p 80, error 20 / 2.
    assert with_others(GAMES, "room", A, [A, B, P]) == MeanScore(35, pytest.approx(5))
    assert with_others(GAMES, "room", B, [A, B, P]) == MeanScore(55, pytest.approx(5))
    assert with_others(GAMES, "room", P, [A, B, P]) == MeanScore(60, pytest.approx(math.hypot(10, 10) / 2))
    assert with_others(GAMES, "room", BOTH, [BOTH, P]) == MeanScore(60, pytest.approx(20))
    with pytest.raises(GalleyError, match="a has no other"):
        with_others(GAMES, "room", A, [A])


def test_errors_of_means_add_in_squares() -> None:
    assert mean_of([MeanScore(10, 3), MeanScore(20, 4)]) == MeanScore(15, 2.5)


def test_what_was_not_played_is_told() -> None:
    with pytest.raises(GalleyError, match="a on seat 0 was not played with q on seat 1 of room"):
        with_partner(GAMES, "room", A, AgentGroup("q", ("q",)))


def test_the_table_by_seats_has_the_form_of_table_3() -> None:
    assert report(GAMES, ["room"], [A, BOTH], [P], itself=True) == "\n".join(
        [
            "With p: mean score (standard error)",
            "",
            "| agent | seat |        room |",
            "| ----- | ---: | ----------: |",
            "| a     |    L | 20.0 (20.0) |",
            "|       |    R |  60.0 (0.0) |",
            "|       |  AVG | 40.0 (10.0) |",
            "| both  |    L | 30.0 (10.0) |",
            "|       |    R | 90.0 (30.0) |",
            "|       |  AVG | 60.0 (20.0) |",
            "",
            "With itself: mean score (standard error)",
            "",
            "| agent |         room |",
            "| ----- | -----------: |",
            "| a     | 120.0 (20.0) |",
            "| both  | 100.0 (20.0) |",
        ]
    )


def test_cross_play_has_the_form_of_table_2_too() -> None:
    assert report(GAMES, ["room"], [A, B, P], None, itself=False) == "\n".join(
        [
            "| room |            a |           b |           p |     others |",
            "| ---- | -----------: | ----------: | ----------: | ---------: |",
            "| a    | 120.0 (20.0) |  30.0 (0.0) | 40.0 (10.0) | 35.0 (5.0) |",
            "| b    |   30.0 (0.0) |  80.0 (0.0) | 80.0 (10.0) | 55.0 (5.0) |",
            "| p    |  40.0 (10.0) | 80.0 (10.0) |   0.0 (0.0) | 60.0 (7.1) |",
            "",
            "With all others: mean score (standard error)",
            "",
            "| layout |          a |          b |              p |",
            "| ------ | ---------: | ---------: | -------------: |",
            "| room   | 35.0 (5.0) | 55.0 (5.0) | **60.0** (7.1) |",
        ]
    )


def test_rows_for_machines_hold_the_same_figures() -> None:
    rows = list(as_rows(GAMES, ["room"], [A], [P], itself=True))
    assert [(row["agent"], row["partner"]) for row in rows] == [("a", "p"), ("a", "itself")]
    assert rows[0]["left"] == {"mean": 20.0, "standard_error": pytest.approx(20.0)}
    rows = list(as_rows(GAMES, ["room"], [A, P], None, itself=False))
    told = [(row["agent"], row["partner"], row["average"]["mean"]) for row in rows]
    assert told == [
        ("a", "itself", 120),
        ("a", "p", 40),
        ("a", "others", 40),
        ("p", "a", 40),
        ("p", "itself", 0),
        ("p", "others", 40),
    ]
