"""Nothing that reaches a browser tells which agent a participant plays with, and no hat stands for one."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path

import httpx
import pytest
from sqlalchemy import select

from galley.records.database.tables import SEATS
from galley.simulate.simulation import Simulation, simulate
from galley.study.study import load_study
from galley.study.visit.plan import plan_visit, visit_seed
from galley.workspace import Workspace, frontend_folder
from tests.security.blinding import AGENTS, blind_workspace
from tests.security.recording import recorded
from tests.server.helpers import serving
from tests.study.workspaces import ROOT

ASSIGNMENTS = 400
CHI_SQUARE_6 = 22.458
"""Exceeded with probability 0.001 by a chi-square variable of 6 degrees of freedom (2 agents, 7 hats)."""


@pytest.mark.parametrize("seed", [20, 26])
def test_no_byte_of_a_visit_tells_on_an_agent(tmp_path: Path, seed: int) -> None:
    blind = blind_workspace(tmp_path / "lab", seed)
    wanted = Simulation("blind", 2, seed=seed, agent=blind.names["myopic"])
    with serving(blind.workspace, tmp_path / "records.sqlite") as up, recorded(up.url) as (url, kept):
        report = simulate(blind.workspace, wanted, url)
        with httpx.Client(base_url=url) as http:
            for file in _static_files():
                assert http.get(f"/static/{file}").status_code == 200
            for path in ("/", "/healthz", "/nowhere", "/s/nowhere", "/v/nowhere", "/static/../agents"):
                http.get(path)
        met = up.store.read(lambda connection: connection.execute(select(SEATS.c.agent)).scalars().all())
        played = set(met.result()) - {None}
    assert report["outcomes"] == {"completed": 2}
    assert played == set(blind.names.values()), "every agent was met under its secret name"
    everything = [bytes(conversation).lower() for conversation in kept.values()]
    whole = b"\n".join(everything)
    assert whole.count(b'"type":"tick"') == report["ticks"], "frames are readable in what was kept"
    assert b"content-encoding" not in whole
    assert b"transfer-encoding" not in whole
    assert b"blind-1" in whole
    traces = blind.traces()
    assert len(traces) > 10 * len(AGENTS)
    assert {what for text, what in traces.items() if text.encode() in whole} == set()


def test_the_search_finds_what_is_there(tmp_path: Path) -> None:
    blind = blind_workspace(tmp_path / "lab", 20)
    name = blind.names["human-bc"]
    told = blind.traces()
    for text in (name, name[::-1]):
        assert told[text] == "name of human-bc"
    files = list((blind.workspace.folder("agents") / name).glob("*.onnx"))
    assert len(files) == 5
    assert all(told[file.stem] == "file of human-bc" for file in files)
    assert sum(what.startswith("sha256 of human-bc/") for what in told.values()) == len(files) + 2


def test_hats_and_agents_are_independent() -> None:
    """400 visits of the demonstration: which agent wears which hat, and which comes first in which hat."""
    study = load_study(Workspace(ROOT), "demo")
    wears: Counter[tuple[str, str]] = Counter()
    first: Counter[tuple[str, str]] = Counter()
    for number in range(ASSIGNMENTS):
        plan = plan_visit(study, visit_seed(study, number), number)
        rounds = [step for step in plan.steps if step.kind == "round" and step.round_no]
        wears.update({(step.agent, step.partner_hat) for step in rounds})
        first[rounds[0].agent, rounds[0].partner_hat] += 1
    assert sum(wears.values()) == 2 * ASSIGNMENTS
    assert chi_square(wears) < CHI_SQUARE_6
    assert chi_square(first) < CHI_SQUARE_6


def test_the_bound_would_be_passed_by_a_hat_that_stands_for_an_agent() -> None:
    told: Counter[tuple[str, str]] = Counter()
    for number in range(ASSIGNMENTS):
        told["a", "orange" if number % 4 else "blue"] += 1
        told["b", "blue" if number % 4 else "orange"] += 1
    assert chi_square(told) > CHI_SQUARE_6


def chi_square(counts: Counter[tuple[str, str]]) -> float:
    """Pearson's statistic of independence of the two parts of the counted pairs."""
    rows = {row for row, _ in counts}
    columns = {column for _, column in counts}
    total = sum(counts.values())
    statistic = 0.0
    for row, column in itertools.product(rows, columns):
        in_row = sum(counts[row, other] for other in columns)
        in_column = sum(counts[other, column] for other in rows)
        expected = in_row * in_column / total
        statistic += (counts[row, column] - expected) ** 2 / expected
    return statistic


def _static_files() -> list[str]:
    folder = frontend_folder()
    parts = ("css", "js", "sprites")
    files = [file for part in parts for file in (folder / part).rglob("*") if file.is_file()]
    return [file.relative_to(folder).as_posix() for file in files]
