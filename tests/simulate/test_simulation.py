"""Simulated participants on a real server: what they answer, how they leave, what is told of it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from sqlalchemy import Connection, select

from galley.errors import GalleyError
from galley.records.database.tables import RESPONSES, VISITS
from galley.simulate.results import in_words
from galley.simulate.simulation import Simulation, simulate
from tests.server.helpers import Served
from tests.serving import run_galley


@pytest.fixture(scope="module")
def report(served: Served) -> dict[str, Any]:
    return simulate(served.workspace, Simulation("every", 3, seed=5, in_flight=3), served.url)


def test_everybody_comes_to_the_end(report: dict[str, Any]) -> None:
    assert report["first_errors"] == []
    assert report["outcomes"] == {"completed": 3}
    assert report["completion_codes"] == {"EVERY-1": 3}
    assert report["rounds"] == {"finished": 9}
    assert report["ticks"] == 3 * (20 + 60 + 60)
    assert report["lost_ticks"] == 0
    assert all(found["count"] > 0 and found["p50"] >= 0 for found in report["latency_ms"].values())
    assert "3 of 3 completed" in in_words(report)
    assert json.loads(json.dumps(report)) == report


def test_every_kind_of_item_is_answered(report: dict[str, Any], served: Served) -> None:
    def read(connection: Connection) -> list[tuple[int, str, Any]]:
        query = select(RESPONSES.c.visit_id, RESPONSES.c.item, RESPONSES.c.value)
        return [(row.visit_id, row.item, row.value) for row in connection.execute(query)]

    answers = served.store.read(read).result()
    by_item: dict[str, list[Any]] = {}
    for _, item, value in answers:
        by_item.setdefault(item, []).append(value)
    for item in ("agree", "star", "poles", "one", "several", "age", "load", "rank", "short", "long"):
        assert len(by_item[item]) == report["completed"], item
        assert None not in by_item[item], item
    assert all(71 <= age <= 79 for age in by_item["age"])
    assert all(load % 5 == 0 for load in by_item["load"])
    assert all(sorted(rank) == ["x", "y", "z"] for rank in by_item["rank"])
    assert by_item["key"] == ["space"] * 3
    assert [why is None for why in by_item["after_a"]] == [one != "a" for one in by_item["one"]]


def test_people_come_with_links_of_their_own(report: dict[str, Any], served: Served) -> None:
    found = served.store.read(lambda connection: connection.execute(select(VISITS.c.person)).all()).result()
    assert {row.person for row in found} >= {"simulated-5-0", "simulated-5-1", "simulated-5-2"}


def test_some_leave_where_their_seed_says(served: Served) -> None:
    wanted = Simulation("every", 6, seed=9, dropout=1.0, in_flight=6, agent="random")
    left = simulate(served.workspace, wanted, served.url)
    assert left["errors"] == 0
    assert left["outcomes"] == {"dropped_out": 6}
    assert len(left["left_at"]) > 1
    assert sum(left["left_at"].values()) == 6


def test_mistakes_are_told_in_one_line(served: Served) -> None:
    with pytest.raises(GalleyError, match="no study is named 'evry'"):
        simulate(served.workspace, Simulation("evry", 1, seed=0), served.url)
    with pytest.raises(GalleyError, match="no agent is named 'myopc'"):
        simulate(served.workspace, Simulation("every", 1, seed=0, agent="myopc"), served.url)
    with pytest.raises(GalleyError, match="no server can be reached"):
        simulate(served.workspace, Simulation("every", 1, seed=0), "http://127.0.0.1:9")
    with pytest.raises(GalleyError, match="not the address of a server"):
        simulate(served.workspace, Simulation("every", 1, seed=0), "localhost")


def test_a_visit_that_breaks_is_told_and_the_command_fails(served: Served) -> None:
    """The server has lost the study that the workspace still names."""
    copy = served.workspace.folder("studies") / "other.yaml"
    copy.write_text((served.workspace.folder("studies") / "every.yaml").read_text(encoding="utf-8"))
    told = run_galley(
        "simulate", "other", "--workspace", served.workspace.path, "--url", served.url, "--participants", "1"
    )
    assert told.returncode == 1
    assert "GET /s/other" in told.stdout
    assert "answered with 404" in told.stdout


def test_without_a_url_it_serves_itself(served: Served) -> None:
    told = run_galley(
        *("simulate", "every", "--workspace", served.workspace.path, "--participants", "1", "--json")
    )
    assert told.returncode == 0, told.stdout + told.stderr
    assert json.loads(told.stdout)["outcomes"] == {"completed": 1}
