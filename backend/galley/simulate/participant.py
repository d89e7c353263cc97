"""One simulated participant: opens a study, does what each page asks for, and perhaps leaves half-way."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from random import Random
from typing import Any, Final
from urllib.parse import urlencode

import httpx

from galley.kitchen import Layout
from galley.simulate.form_filling import Known, fill
from galley.simulate.page import Form, Page, read_page
from galley.simulate.playing import Player, RoundLost
from galley.simulate.results import Figures
from galley.simulate.seen import MakeAgent

MAX_PAGES: Final = 500
MAX_SENT_BACK: Final = 12
LEAVES_WITHIN_TICKS: Final = 100
LOBBY_ASKS_EVERY_S: Final = 1.0
RETRY_S: Final = (0.5, 1.0, 2.0, 4.0, 5.0, 5.0, 5.0)
BUSY: Final = 503


class Broken(Exception):
    """The visit cannot go on; the text says why."""


@dataclass
class World:
    """What all participants of a simulation share."""

    study: str
    make: MakeAgent
    layouts: Mapping[str, Layout]
    known: Known
    figures: Figures
    thinks: Executor
    dropout: float = 0.0


@dataclass
class Participant:
    """One person with a browser of their own; everything they do is drawn from `rng`."""

    world: World
    http: httpx.AsyncClient
    rng: Random
    params: Mapping[str, str] = field(default_factory=dict)
    path: str = ""
    _pages: int = 0
    _at: int = 0
    _leaves_at: int | None = None

    async def visit(self) -> str:
        """How the visit ended; what went wrong is told to the figures."""
        figures = self.world.figures
        try:
            outcome = await self._walk()
        except (Broken, RoundLost, httpx.HTTPError) as error:
            outcome = "broken"
            about = str(error) or type(error).__name__
            figures.errors.append(f"{self.path or self.world.study}: {about}")
        figures.outcomes[outcome] += 1
        return outcome

    async def _walk(self) -> str:
        query = f"?{urlencode(self.params)}" if self.params else ""
        page = await self._ask("GET", f"/s/{self.world.study}{query}")
        leaves = self.rng.random() < self.world.dropout
        sent_back = 0
        last: str | None = None
        while self._pages < MAX_PAGES:
            self._come_to(page, leaves)
            match page.stage:
                case "debrief" | "ending" | "plain":
                    return self._ended(page)
                case stage if self._leaves_at is not None and self._at >= self._leaves_at:
                    return await self._leave(page, stage)
                case "round":
                    await self._play(page, None)
                    page = await self._ask("GET", page.data["next"])
                case "lobby":
                    page = await self._wait(page)
                case _:
                    form = _form(page)
                    step = form.hidden.get("step", "")
                    sent_back = sent_back + 1 if step == last else 0
                    if sent_back > MAX_SENT_BACK:
                        raise Broken(f"the form of step {last!r} came back again and again")
                    self.world.figures.sent_back += sent_back > 0
                    last = step
                    await asyncio.sleep(page.wait_s)
                    sent = fill(form, self.rng, self.world.known, max(0, sent_back - 1))
                    page = await self._ask("POST", form.action, sent)
        raise Broken(f"the visit has no end within {MAX_PAGES} pages")

    def _come_to(self, page: Page, leaves: bool) -> None:
        """Note where in the visit this is; who leaves chooses a step once their number is known."""
        if page.progress is not None:
            self._at, of = page.progress
            if leaves and self._leaves_at is None:
                self._leaves_at = self.rng.randint(1, max(1, of - 1))
        elif page.stage in ("round", "lobby"):
            self._at += 1

    async def _ask(self, method: str, path: str, form: list[tuple[str, str]] | None = None) -> Page:
        """A page, after its redirects; a server that is away is asked again for a while."""
        content = None if form is None else urlencode(form)
        headers = {} if form is None else {"content-type": "application/x-www-form-urlencoded"}
        for wait_s in (*RETRY_S, None):
            began_s = time.monotonic()
            try:
                answer = await self.http.request(method, path, content=content, headers=headers)
            except httpx.TransportError:
                if wait_s is None:
                    raise
            else:
                if answer.status_code != BUSY or wait_s is None:
                    break
            self.world.figures.reconnects += 1
            await asyncio.sleep(wait_s or 0.0)
        self.world.figures.page_ms.append((time.monotonic() - began_s) * 1000.0)
        self.world.figures.pages += 1
        self._pages += 1
        if answer.status_code not in (200, 422):
            raise Broken(f"{method} {path} was answered with {answer.status_code}")
        self.path = answer.url.path
        return read_page(answer.text)

    async def _play(self, page: Page, leave_at: int | None) -> None:
        url = str(self.http.base_url).rstrip("/").replace("http", "ws", 1) + page.data["socket"]
        world = self.world
        player = Player(url, world.make, world.layouts, self.rng, world.figures, world.thinks, leave_at)
        outcome = "lost"
        try:
            outcome = await player.play()
        finally:
            world.figures.rounds[outcome] += 1

    async def _leave(self, page: Page, stage: str) -> str:
        """Go without a word, out of a round somewhere in its middle."""
        if stage == "round":
            await self._play(page, self.rng.randint(1, LEAVES_WITHIN_TICKS))
        self.world.figures.left_at[stage] += 1
        return "dropped_out"

    async def _wait(self, page: Page) -> Page:
        """Wait in a lobby as its script does."""
        while True:
            answer = await self.http.get(page.data["poll"], headers={"accept": "application/json"})
            if answer.status_code != httpx.codes.OK or not answer.json()["waiting"]:
                return await self._ask("GET", page.data.get("next", self.path))
            await asyncio.sleep(LOBBY_ASKS_EVERY_S)

    def _ended(self, page: Page) -> str:
        if page.code:
            self.world.figures.codes[page.code] += 1
        if page.stage == "debrief":
            return "completed"
        return page.outcome or page.heading or page.stage


def _form(page: Page) -> Form:
    if not page.forms:
        raise Broken(f"the {page.stage} page has no form to go on with")
    return page.forms[0]


def known_answers(questionnaires: Mapping[str, Any]) -> dict[str, Any]:
    """The right answers of a study's attention checks and quizzes, by item."""
    return {name: value for one in questionnaires.values() for name, value in one.expected.items()}
