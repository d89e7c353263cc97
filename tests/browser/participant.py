"""A participant with nothing but a keyboard: walks a study from its landing page to the completion code."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import BrowserContext, Locator, Page

from galley.agents.protocol import Agent
from tests.browser.cook import Cook
from tests.browser.watching import Watcher

MAX_TABS = 200
SETTLE_MS = 400  # cards fade in; a picture waits for them
FOCUSED = "element => element === document.activeElement"
BUTTON = "[data-part=card-button]"


class Participant:
    """One person in one browser; `watcher` hears everything that their pages do."""

    def __init__(self, context: BrowserContext, watcher: Watcher, agent: Agent, shots: Path) -> None:
        self.page: Page = context.new_page()
        self.watcher = watcher
        self.answers: list[tuple[str, str, str]] = []
        """(stage, item, value) of everything answered, in order."""
        self.presses: list[list[str]] = []
        """The keys pressed in each round."""
        self._agent = agent
        self.folder = shots
        self._shown = 0

    @property
    def stage(self) -> str:
        """Which kind of page this is."""
        return self.page.locator("body").get_attribute("data-stage") or ""

    def shoot(self, name: str, settle: bool = True) -> None:
        """Keep a picture of the page, numbered in the order of the visit, and search the page for secrets."""
        self._shown += 1
        if settle:
            self.page.wait_for_timeout(SETTLE_MS)
        self.page.screenshot(path=self.folder / f"{self._shown:02}-{name}.png", full_page=True)
        self.watcher.read(self.page)

    def begin(self, url: str) -> None:
        """Open the landing page and begin."""
        self.page.goto(url)
        assert self.stage == "landing"
        self.shoot("landing")
        self.submit()

    def go_through(self) -> str:
        """Do what every page asks for until the debrief; return the completion code shown there."""
        while (stage := self.stage) != "debrief":
            if stage == "round":
                self.play()
            else:
                self.do_page()
        self.shoot("debrief")
        return self.page.locator("#completion-code").inner_text()

    def do_page(self) -> None:
        """Read a page, answer what it asks and go on."""
        stage = self.stage
        assert stage in ("consent", "questionnaire", "instructions", "comparison"), stage
        self.shoot(stage)
        if stage in ("questionnaire", "comparison"):
            self.fill(stage)
            self.shoot(f"{stage}-filled")
        self.submit()

    def tab_to(self, target: Locator) -> None:
        """Reach an element as people without a mouse do."""
        for _ in range(MAX_TABS):
            if target.evaluate(FOCUSED):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"the keyboard does not reach {target}")

    def submit(self) -> None:
        """Press the page's first submit button and wait for the next page."""
        self.tab_to(self.page.locator("main button[type=submit]").first)
        with self.page.expect_navigation():
            self.page.keyboard.press("Enter")

    def fill(self, stage: str) -> None:
        """Answer every item that the page shows, not all in the same way."""
        items = self.page.locator("main fieldset")
        for number in range(items.count()):
            item = items.nth(number)
            if item.is_visible():
                name, value = self._answer(item.locator("input, textarea"), 2 * number)
                self.answers.append((stage, name, value))

    def _answer(self, fields: Locator, choice: int) -> tuple[str, str]:
        first = fields.first
        name = first.get_attribute("name") or ""
        kind = first.get_attribute("type")
        self.tab_to(first)
        if kind in ("radio", "checkbox"):
            self.page.keyboard.press("Space")
            for _ in range(choice % fields.count() if kind == "radio" else 0):
                self.page.keyboard.press("ArrowRight")
            return name, self.page.locator(f'[name="{name}"]:checked').input_value()
        text = "34" if first.get_attribute("inputmode") else "Soup & <b>salt</b>; 'twas good, said 2 < 3"
        self.page.keyboard.type(text)
        return name, text

    def start(self) -> Cook:
        """Wait for the kitchen and press the button on the card over it: Start, or Go on."""
        self.page.locator("#kitchen.drawn").wait_for()
        button = self.page.locator(BUTTON)
        button.wait_for()
        keyframe = self.watcher.last("keyframe")
        assert keyframe is not None
        cook = Cook(self._agent, keyframe)
        self.tab_to(button)
        self.page.keyboard.press("Enter")
        return cook

    def play(self) -> None:
        """Play a round from its start card to the page after it."""
        self.presses.append([])
        self.page.locator(BUTTON).wait_for()
        self.shoot("round-start")
        cook = self.start()
        self.cook_until(cook, 1)
        self.press("Space")
        self.cook_until(cook, cook.horizon // 2)
        self.shoot("round-middle", settle=False)
        self.cook_until(cook, cook.horizon)
        self.finish()

    def cook_until(self, cook: Cook, tick: int) -> None:
        """Play on, at most one key a tick, until this many ticks are over."""
        heard = len(self.watcher.received)
        while cook.tick < tick:
            self.page.wait_for_timeout(3)
            news, heard = self.watcher.received[heard:], len(self.watcher.received)
            assert self.watcher.alive(), "the server went silent in the middle of a round"
            for frame in news:
                if frame["type"] in ("tick", "keyframe"):
                    cook.see(frame)
            ticked = any(frame["type"] == "tick" for frame in news)
            if ticked and cook.tick < tick and (key := cook.next_key()):
                self.press(key)

    def press(self, key: str) -> None:
        """Tap a key of the game."""
        self.presses[-1].append(key)
        self.page.keyboard.press(key)

    def finish(self) -> None:
        """Wait for the card at the end of a round and go on."""
        button = self.page.locator(BUTTON)
        button.wait_for()
        self.shoot("round-end")
        self.tab_to(button)
        with self.page.expect_navigation():
            self.page.keyboard.press("Enter")
