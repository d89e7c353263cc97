"""The study of `workspace/` lived through by made-up people, by the front door alone.

Pages, sockets and commands are all that this uses, so that any version of Galley can be driven by it. What
the records of commit c05f99f held afterwards is beside this file, made there by

    python -m tests.records.earlier.lived OUT

Never make it again: it is what old databases look like.
"""

from __future__ import annotations

import csv
import json
import lzma
import re
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Any, cast

import httpx
from typer.testing import CliRunner

from galley.cli import app
from tests import serving
from tests.server.helpers import Participant, Player, Served

STUDY = "whole"
HERE = Path(__file__).resolve().parent
WORKSPACE = HERE / "workspace"
RESEARCHER, PASSWORD = "ada", "correct horse battery"
AGREE = {"choice": "agree"}
ABOUT: Mapping[str, Any] = {
    "agree": "6",
    "against": "2",
    "star": "4",
    "poles": "5",
    "group": "a",
    "after_a": "=1+1",
    "one_check": "yes",
    "several": ["a", "b"],
    "several_check": ["a", "c"],
    "age": "33",
    "load": "45",
    "rank.x": "2",
    "rank.y": "1",
    "rank.z": "3",
    "short": "Suppe, «gut»",
    "long": "Line one\nline two",
}
RIGHT: Mapping[str, Any] = {"key": "space", "parts": ["onion", "tomato"], "count": "3"}
WRONG: Mapping[str, Any] = {"key": "enter", "parts": ["onion", "dish"], "count": "3"}
STARS = {"teamwork": "5", "contribution": "2", "intention": "7"}
TASK_LOAD = {
    name: str(5 * place)
    for place, name in enumerate(
        ("mental_demand", "physical_demand", "temporal_demand", "performance", "effort", "frustration"), 3
    )
}
COMPARED = {"fluency": "2", "preference": "7", "understanding": "4"}
MOVES = ("right", "up", "interact", "left")


class Person(Participant):
    """Somebody who answers what they are asked, always the same."""

    def __init__(self, door: FrontDoor, name: str, query: str = "") -> None:
        super().__init__(cast(Served, door), STUDY, query or f"?PROLIFIC_PID={name}")
        self.waits = True
        self.forms: dict[str, Mapping[str, Any]] = {
            "consent": AGREE,
            "about": ABOUT,
            "quiz": RIGHT,
            "load": TASK_LOAD,
            "comparison": COMPARED,
        }

    def answer(self, **changes: Any) -> None:
        """Fill in the form that is shown and send it."""
        self.submit(
            {**self.forms.get(self.step, STARS if self.step.endswith("questions") else {}), **changes}
        )

    @property
    def here(self) -> str:
        """The step that the visit is at; for a round the title of its stage, for a lobby and an end that."""
        if self.stage == "round":
            heading = re.search(r"<h1[^>]*>(\w+)", self.page.text)
            return heading[1].lower() if heading else ""
        return self.stage if self.stage == "lobby" else self.step or self.stage

    def go_on(self, until: str = "debrief") -> None:
        """Walk on to a step or the title of a round; keys are pressed in practice and in a pair."""
        while self.here != until and self.stage not in ("debrief", "ending"):
            if self.stage == "round":
                self.play_on(keys=self.here in ("practice", "pair"))
            elif self.stage == "lobby" and self.waits:
                time.sleep(0.2)
                self.load()
            elif self.stage == "lobby":
                self.submit({"leave": "1"})
            else:
                self.answer()
        assert self.here == until or self.stage == "ending", (until, self.here, self.page.text)

    def play_on(self, keys: bool = False) -> None:
        """Play the round to its end."""
        with self.play() as player:
            if keys:
                player.whole_round()
            else:
                player.hello()
                player.send("ready")
                player.send("ping", client_ms=1.0, rtt_ms=12.5)
                player.until("ended")
        self.load()

    def play_a_little(self, player: Player, ticks: int) -> None:
        """Begin, or go on, and see some ticks of the round."""
        player.hello()
        player.send("ready")
        for _ in range(ticks):
            player.until("tick")


class FrontDoor:
    """A server as its visitors see it."""

    def __init__(self, url: str, opened: ExitStack) -> None:
        self.url = url
        self.opened = opened

    def client(self) -> httpx.Client:
        """A browser without JavaScript."""
        http = httpx.Client(base_url=self.url, follow_redirects=True, timeout=20)
        return self.opened.enter_context(http)


class Office:
    """The researcher's pages."""

    def __init__(self, door: FrontDoor) -> None:
        self.http = door.client()
        page = self.http.get("/researcher/login").text
        form = {"csrf": self._csrf(page), "name": RESEARCHER, "password": PASSWORD, "next": ""}
        assert self.http.post("/researcher/login", data=form).status_code == 200

    def send(self, path: str, **fields: str) -> str:
        """The page that follows a form."""
        kept = self._csrf(self.http.get("/researcher").text)
        answer = self.http.post(f"/researcher{path}", data={"csrf": kept, **fields})
        assert answer.status_code == 200, answer.text
        return answer.text

    def page(self, path: str) -> str:
        answer = self.http.get(f"/researcher{path}")
        assert answer.status_code == 200, (path, answer.text)
        return answer.text

    @staticmethod
    def _csrf(html: str) -> str:
        found = re.search(r'name="csrf" value="([^"]+)"', html)
        assert found, html
        return found[1]


def live(database: Path) -> dict[str, str]:
    """Tokens of the visits that are not over, by name, after everybody came to a new database."""
    command = [*serving.START, "researchers", "add", RESEARCHER, "--workspace", str(WORKSPACE)]
    subprocess.run([*command, "--database", str(database)], input=f"{PASSWORD}\n", text=True, check=True)
    with serving.served(WORKSPACE, str(database)) as server, ExitStack() as opened:
        door = FrontDoor(server.url, opened)
        tokens = _everybody(door, Office(door))
        server.process.terminate()  # before who is in a game has left it
        server.process.wait()
        return tokens


def _everybody(door: FrontDoor, office: Office) -> dict[str, str]:
    # In this order the two of each pair are in the same cell of the design.
    names = ("first", "screened", "stays", "declined", "second", "leaves", "skips", "abandons", "answering")
    people = {name: Person(door, name) for name in (*names, "playing")}
    link = re.findall(r"galley-test=[\w-]+", office.send(f"/studies/{STUDY}/test-links", cell="0"))[0]
    tester = Person(door, "", f"?{link}")
    with ThreadPoolExecutor(6) as pool:
        walks = [
            pool.submit(_two_meet, people["first"], people["second"]),
            pool.submit(_one_leaves, people["stays"], people["leaves"]),
            pool.submit(_abandoned, people["abandons"]),
            pool.submit(tester.go_on),  # nobody comes to the lobby: an agent steps in
            pool.submit(people["answering"].go_on, "games-1-questions"),
            pool.submit(people["playing"].go_on, "games-1-questions"),
        ]
        _end_early(people["screened"], people["declined"], people["skips"])
        for walk in walks:
            walk.result()
    office.send("/visits/5/notes", text="=2+2 asked what a tomato is")
    office.send("/visits/1/notes", text="fine")
    people["playing"].answer()
    people["playing"].play_a_little(door.opened.enter_context(people["playing"].play()), 6)
    return {name: people[name].token for name in ("answering", "playing")}


def _end_early(screened: Person, declined: Person, skips: Person) -> None:
    screened.forms["about"] = {**ABOUT, "group": "out", "after_a": ""}
    screened.go_on()
    assert "OUT-1" in screened.page.text
    declined.submit({"choice": "decline"})
    assert "NO-1" in declined.page.text
    skips.go_on("instructions")
    skips.submit({"skip": "1"})
    skips.go_on("alone")
    skips.submit({"skip": "1"}, step="alone")
    assert skips.here == "practice"


def _two_meet(first: Person, second: Person) -> None:
    """One leaves a game for a moment, the other fails the quiz twice and a check; they play together."""
    _both(partial(_interrupted, first), partial(_mistaken, second))
    _come_to_the_pair(first, second)
    _both(*(partial(person.play_on, keys=True) for person in (first, second)))
    _both(first.go_on, second.go_on)


def _interrupted(person: Person) -> None:
    person.go_on("games")
    with person.play() as player:
        person.play_a_little(player, 5)
    time.sleep(0.3)
    person.go_on("twice")


def _mistaken(person: Person) -> None:
    person.forms["about"] = {**ABOUT, "several_check": ["a", "b"]}
    person.go_on("quiz")
    person.answer(**WRONG)
    person.answer(**{**WRONG, "count": "4"})
    person.answer()
    for hidden in ("1", "0"):
        person.http.post(f"{person.path}/away", data={"step": "rest", "hidden": hidden})
        time.sleep(0.1)
    person.go_on("twice")


def _one_leaves(stays: Person, leaves: Person) -> None:
    """One leaves the round that they play together for good, and an agent takes over."""
    _both(partial(stays.go_on, "twice"), partial(leaves.go_on, "twice"))
    _come_to_the_pair(stays, leaves)
    with stays.play() as mine:
        with leaves.play() as theirs:
            for player in (mine, theirs):
                player.hello()
            for player in (mine, theirs):
                player.send("ready")
            for _ in range(7):
                mine.until("tick")
        mine.until("ended")
    stays.load()
    stays.go_on()


def _both(*walks: Callable[[], None]) -> None:
    """Let two people walk at the same time."""
    with ThreadPoolExecutor(len(walks)) as pool:
        for walk in [pool.submit(one) for one in walks]:
            walk.result()


def _come_to_the_pair(*people: Person) -> None:
    """Come to the lobby soon after each other; the page of who was there first is loaded again."""
    for person in people:
        person.play_on()
    for person in people:
        person.load()
        assert person.here == "pair", person.page.text


def _abandoned(person: Person) -> None:
    """Leave a game for good."""
    person.go_on("games")
    with person.play() as player:
        person.play_a_little(player, 8)
    time.sleep(2.0)


def export(database: Path, out: Path, *more: str) -> None:
    """Write the study's files, those of test visits too."""
    command = ("export", STUDY, "--out", out, "--tests", "--database", database, "--workspace", WORKSPACE)
    _galley(*command, *more)


def verified(database: Path) -> str:
    """What `galley trajectories verify` says."""
    command = ("trajectories", "verify", STUDY, "--database", database, "--workspace", WORKSPACE)
    return _galley(*command)


def _galley(*arguments: str | Path) -> str:
    """What a command says, run to its end in this process."""
    done = CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output.strip()


def sheet(file: Path) -> list[dict[str, str]]:
    """The rows of an exported file."""
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def _dump(database: Path) -> Iterator[str]:
    with closing(sqlite3.connect(database)) as connection:
        yield from (f"{line}\n" for line in connection.iterdump())


def main() -> None:
    """Make what is beside this file."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True)
    database = out / "whole.sqlite"
    tokens = live(database)
    export(database, out / "exports")
    for file in (out / "exports").iterdir():
        if file.stem != "data-dictionary":
            (out / f"{file.name}.xz").write_bytes(lzma.compress(file.read_bytes()))
    (out / "told.json").write_text(json.dumps({"tokens": tokens, "verified": verified(database)}, indent=2))
    (out / "whole.sql.xz").write_bytes(lzma.compress("".join(_dump(database)).encode()))


if __name__ == "__main__":
    main()
