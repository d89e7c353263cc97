"""Evaluations: medians of trials, the same on any number of workers, mistakes in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from galley.cli import app
from galley.errors import GalleyError
from galley.evaluation.many_layouts import evaluate_many
from galley.evaluation.measure_spreads import spreads, trial_measures
from galley.evaluation.teams import Team, evaluate, play_trials
from galley.kitchen import Layout
from galley.kitchen.measures import measures

ROOT = Path(__file__).resolve().parents[2]
ROOM = Layout.from_ascii("room", "XXPXX\nO  2O\nX1  X\nXDXSX", cook_time_ticks=10)
SMALL = Team(epsilon=0.1, trials=6, horizon_ticks=80, seed=4, workspace=str(ROOT))


def test_medians_are_those_of_the_trials() -> None:
    answer = evaluate(ROOM, SMALL)
    trials = [trial_measures(measures(one)) for one in play_trials(ROOM, SMALL)]
    assert len(trials) == 6
    for name, spread in spreads(trials).items():
        assert answer["measures"][name]["median"] == spread.median
    ticks = sorted(trial["ticks"] for trial in trials)
    assert answer["measures"]["ticks"]["median"] == (ticks[2] + ticks[3]) / 2


def test_differences_are_robot_minus_human_on_either_seat() -> None:
    trial = measures(play_trials(ROOM, SMALL)[0])
    first, second = trial_measures(trial, 0), trial_measures(trial, 1)
    assert first["ingredients_difference"] == trial.ingredients[0] - trial.ingredients[1]
    assert first["ingredients_difference"] == -second["ingredients_difference"]


def test_agents_asked_tick_by_tick_play_the_compiled_trials() -> None:
    slow = replace(SMALL, human="human-bc", trials=1, epsilon=0.0)
    assert evaluate(ROOM.with_rules(), replace(SMALL, trials=1)) != {}
    with pytest.raises(GalleyError, match="does not know layout"):
        evaluate(ROOM, slow)
    pair = replace(SMALL, robot="centralized", human="centralized", trials=1, epsilon=0.0)
    assert evaluate(ROOM, pair)["measures"]["orders"]["median"] == 2


def test_results_are_the_same_on_any_number_of_workers() -> None:
    layouts = [ROOM, Layout.from_ascii("other", "XXPXXX\nO   2O\nX1   X\nXDXSXX")]
    told: list[int] = []
    alone = evaluate_many(layouts, SMALL, on_done=told.append)
    assert evaluate_many(layouts, SMALL, workers=2) == alone
    assert told == [1, 2]


def test_kitchens_that_cannot_be_served_are_refused() -> None:
    with pytest.raises(GalleyError, match="no serving place"):
        evaluate(Layout.from_ascii("no", "XXPXX\nO  2O\nX1  X\nXDXXX"), SMALL)


def test_the_command_prints_json_and_mistakes_in_one_line() -> None:
    options = ["--trials", "4", "--horizon", "60", "--seed", "2", "--workspace", str(ROOT)]
    done = CliRunner().invoke(app, ["evaluate", "cramped_room", "--epsilon", "0.05", *options, "--json"])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout.strip().splitlines()[-1])
    assert answer["layout"] == "cramped_room"
    assert set(answer["measures"]) >= {"performance", "concurrent_share", "stuck_ticks", "served_difference"}
    done = CliRunner().invoke(app, ["evaluate", "nowhere.yaml", *options])
    assert isinstance(done.exception, GalleyError)
