"""A real server in a thread, a participant who fills in forms, and a player on a socket."""

from __future__ import annotations

import itertools
import json
import re
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import uvicorn
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from galley.records import Store
from galley.server.app import create_app
from galley.server.content import load_content
from galley.server.run import listen, server_config
from galley.server.settings import Settings
from galley.study.written.questionnaire import Questionnaire
from galley.workspace import Workspace

QUICK = """
format: 1
title: A quick visit
seed: 3
tick_ms: 20
horizon_ticks: 25
countdown_s: 0
abandon_after_s: 2
completion: {code: QUICK-1}
stages:
  - {kind: consent, text: consent}
  - {kind: questionnaire, id: survey, questionnaire: before-game}
  - {kind: instructions, text: instructions}
  - {kind: tutorial, layout: cramped_room, agent: stay, horizon_ticks: 10, skippable: true}
  - kind: rounds
    agents: [random, myopic]
    after_each: after-round
    layouts:
      - {layout: cramped_room, goal: 20}
  - {kind: comparison, questionnaire: comparison}
  - {kind: debrief, text: debrief}
"""
ONE_ROUND = """
format: 1
title: One round
seed: 4
tick_ms: 20
horizon_ticks: 40
countdown_s: 0
abandon_after_s: 2
completion: {code: ONE-1}
stages:
  - {kind: consent, text: consent}
  - {kind: rounds, agents: [random], layouts: [{layout: cramped_room}]}
  - {kind: debrief, text: debrief}
"""


@dataclass(frozen=True)
class Served:
    """A server that is up; `open` closes what its participants opened."""

    url: str
    store: Store
    workspace: Workspace
    open: ExitStack = field(default_factory=ExitStack)

    def client(self) -> httpx.Client:
        """A browser without JavaScript."""
        return self.open.enter_context(httpx.Client(base_url=self.url, follow_redirects=True, timeout=20))


@contextmanager
def serving(
    workspace: Workspace, database: Path | str, *, preview: bool = False, **settings: Any
) -> Iterator[Served]:
    """A server for a workspace on a free port, until the block ends; it checks what it says."""
    chosen = Settings(**{"port": 0, "debug": 1, **settings})
    with Store.open(database, serving=True) as store:
        app = create_app(load_content(workspace, chosen.study), store, chosen, preview=preview)
        listening = listen(chosen)
        server = uvicorn.Server(server_config(app, chosen))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            wait_until(lambda: server.started or not thread.is_alive())
            with ExitStack() as opened:
                yield Served(f"http://127.0.0.1:{listening.getsockname()[1]}", store, workspace, opened)
        finally:
            server.should_exit = True
            thread.join()
            listening.close()


def wait_until(holds: Callable[[], bool], seconds: float = 30.0) -> None:
    """Return once `holds()`; fail after `seconds`."""
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            raise AssertionError("waited in vain")
        time.sleep(0.005)


def good_answers(questionnaire: Questionnaire) -> dict[str, str | list[str]]:
    """An answer for every item."""
    answers: dict[str, str | list[str]] = {}
    for item in questionnaire.items:
        match item.kind:
            case "likert" | "comparison" | "semantic_differential":
                answers[item.id] = "2"
            case "slider":
                answers[item.id] = str(item.max)
            case "ranking":
                answers |= {f"{item.id}.{o.value}": str(n) for n, o in enumerate(item.options, 1)}
            case "single_choice":
                answers[item.id] = item.options[0].value
            case "multiple_choice":
                answers[item.id] = [item.options[0].value]
            case "number":
                answers[item.id] = str(int(item.min or 0) + 1)
            case _:
                answers[item.id] = "Soup & <b>salt</b>"
    return answers


class Participant:
    """One visit, walked page by page."""

    def __init__(self, served: Served, study: str = "mine", query: str = "", **fields: str) -> None:
        self.served = served
        self.http = served.client()
        self.page = self.http.post(f"/s/{study}/begin{query}", data=fields)
        self.path = self.page.url.path
        self.token = self.path.rsplit("/", 1)[1]

    def load(self) -> httpx.Response:
        """Load the page of the visit again."""
        self.page = self.http.get(self.path)
        return self.page

    @property
    def stage(self) -> str:
        found = re.search(r'data-stage="([a-z]+)"', self.page.text)
        return found[1] if found else ""

    @property
    def step(self) -> str:
        """The step that the page's form names."""
        found = re.search(r'name="step" value="([^"]+)"', self.page.text)
        return found[1] if found else ""

    def submit(self, fields: Mapping[str, Any] | None = None, step: str | None = None) -> httpx.Response:
        """Submit the page's form."""
        self.page = self.http.post(self.path, data={"step": step or self.step, **(fields or {})})
        return self.page

    def agree(self) -> httpx.Response:
        return self.submit({"choice": "agree"})

    def play(self, tab: str = "tab") -> Player:
        """Connect to the round."""
        return Player(self.served.url.replace("http", "ws") + f"{self.path}/play", tab)


@dataclass
class Player:
    """A browser's side of a play socket."""

    url: str
    tab: str
    origin: str | None = None
    received: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._opened = ExitStack()
        self.seq = itertools.count()

    def __enter__(self) -> Player:
        connecting = connect(self.url, origin=self.origin, compression=None)  # type: ignore[arg-type]
        self.socket: ClientConnection = self._opened.enter_context(connecting)
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def send(self, kind: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **fields}))

    def hello(self) -> dict[str, Any]:
        """Say hello; the keyframe that answers."""
        self.send("hello", protocol=2, tab=self.tab)
        return self.until("keyframe")

    def key(self, key: str, down: bool) -> None:
        self.send("key", key=key, down=down, seq=next(self.seq), client_ms=time.monotonic() * 1000)

    def next(self) -> dict[str, Any]:
        message: dict[str, Any] = json.loads(self.socket.recv(timeout=20))
        self.received.append(message)
        return message

    def until(self, kind: str, **fields: Any) -> dict[str, Any]:
        """The next message of a kind with these fields."""
        while True:
            message = self.next()
            if message["type"] == kind and all(message[name] == value for name, value in fields.items()):
                return message

    def whole_round(self) -> dict[str, Any]:
        """Play with some keys until the round has ended."""
        self.hello()
        self.send("ready")
        while (message := self.next())["type"] != "ended":
            if message["type"] == "tick" and message["tick"] % 4 == 0:
                self.key(
                    ("right", "up", "interact", "left")[message["tick"] // 4 % 4], message["tick"] % 8 == 0
                )
        return message

    def closed_with(self) -> int:
        """Read until the server closes; its code."""
        with suppress(ConnectionClosed):
            while True:
                self.next()
        return int(self.socket.close_code or 0)


@dataclass(frozen=True)
class Played:
    """What one of two people saw of a round: its first picture, its ticks, its end."""

    frame: dict[str, Any]
    ticks: list[dict[str, Any]]
    ended: dict[str, Any]


def together(*people: Participant) -> list[Played]:
    """What each person saw of a round that they play with each other to its end, at the same time."""
    seen: dict[int, Played] = {}

    def play(number: int, person: Participant) -> None:
        with person.play(f"tab-{number}") as player:
            ended = player.whole_round()
            frames = [message for message in player.received if message["type"] == "keyframe"]
            ticks = [message for message in player.received if message["type"] == "tick"]
            seen[number] = Played(frames[0], ticks, ended)

    threads = [threading.Thread(target=play, args=pair) for pair in enumerate(people)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [seen[number] for number in range(len(people))]
