"""A participant with nothing but a keyboard: walks a study from its landing page to the completion code."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from playwright.sync_api import BrowserContext, Locator, Page, expect

from galley.agents.protocol import Agent
from tests.browser.cook import Cook
from tests.browser.watching import Watcher

MAX_TABS = 200
FOCUSED = "element => element === document.activeElement"


class Participant:
    """One person in one browser context; `watcher` hears everything their pages do."""

    def __init__(self, context: BrowserContext, watcher: Watcher, agent: Agent, shots: Path) -> None:
        self.page: Page = context.new_page()
        self.watcher = watcher
        self.pressed: Counter[str] = Counter()
        self.answers: list[dict[str, list[str]]] = []
        self.rounds_played = 0
        self._agent = agent
        self._shots = shots
        self._shown: Counter[str] = Counter()
        shots.mkdir(parents=True, exist_ok=True)

    def shoot(self, name: str) -> None:
        """Keep a picture of the page, numbered in the order of the visit; search the page for secrets."""
        self._shown["all"] += 1
        self.page.screenshot(path=self._shots / f"{self._shown['all']:02}-{name}.png")
        self.watcher.read(self.page)

    def tab_to(self, target: Locator) -> None:
        """Reach an element as people without a mouse do."""
        for _ in range(MAX_TABS):
            if target.evaluate(FOCUSED):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"the keyboard does not reach {target}")

    def begin(self, url: str) -> None:
        """Open the landing page and begin."""
        self.page.goto(url)
        self.shoot("landing")
        self.submit()

    def submit(self) -> None:
        """Press the page's first submit button and wait for the next page."""
        self.tab_to(self.page.locator("main button[type=submit]").first)
        with self.page.expect_navigation():
            self.page.keyboard.press("Enter")

    @property
    def stage(self) -> str:
        """Which kind of page this is."""
        return self.page.locator("body").get_attribute("data-stage") or ""

    def fill(self) -> dict[str, list[str]]:
        """Answer every item on the page, each in its own way, and return what was answered."""
        fields = self.page.locator("main form :is(input, textarea, select):not([type=hidden])")
        names = dict.fromkeys(fields.evaluate_all("elements => elements.map(element => element.name)"))
        answers = {name: self._answer(name, number) for number, name in enumerate(names)}
        self.answers.append(answers)
        return answers

    def _answer(self, name: str, number: int) -> list[str]:
        field = self.page.locator(f'main form [name="{name}"]')
        if not field.first.is_visible() and field.first.get_attribute("type") not in ("radio", "checkbox"):
            return []
        kind = field.first.evaluate("element => element.type")
        self.tab_to(field.first)
        if kind == "radio":
            self.page.keyboard.press("Space")
            for _ in range((number * 2 + 1) % field.count()):
                self.page.keyboard.press("ArrowRight")
            return [self.page.locator(f'main form [name="{name}"]:checked').input_value()]
        if kind == "checkbox":
            self.page.keyboard.press("Space")
            return [field.first.input_value()]
        text = "23" if kind == "number" else "Soup, with care & <b>salt</b>"
        self.page.keyboard.type(text)
        return [text]

    def start_round(self) -> Cook:
        """Wait for the kitchen, press Start, sit through the countdown."""
        seen = len(self.watcher.received)
        self.page.wait_for_function("document.querySelector('#kitchen canvas') !== null")
        self.wait_for_frame("keyframe", since=0 if self.rounds_played == 0 else seen - 1)
        keyframe = self.watcher.last("keyframe")
        assert keyframe is not None
        return Cook(self._agent, keyframe)

    def wait_for_frame(self, kind: str, since: int, seconds: float = 30) -> int:
        """Wait until a message of this type came after the first `since` frames; return its place."""
        for _ in range(int(seconds * 100)):
            for place in range(since, len(self.watcher.received)):
                if self.watcher.received[place]["type"] == kind:
                    return place
            self.page.wait_for_timeout(10)
        raise AssertionError(f"no {kind} message in {seconds} s; last frames {self.watcher.received[-3:]}")
