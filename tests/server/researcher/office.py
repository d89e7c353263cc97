"""The researcher's pages as an application of their own, and a researcher who uses them."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import uvicorn
from starlette.applications import Starlette
from starlette.routing import Mount, Route

from galley.records import Store, VisitRow
from galley.records.store.researcher_accounts import Researchers
from galley.server.app import Static
from galley.server.clock import Clock
from galley.server.headers import SecureHeaders
from galley.server.researcher.passwords import Passwords
from galley.server.researcher.routes import researcher_pages
from galley.server.run import listen, server_config
from galley.server.settings import Settings
from galley.study.study import Study
from galley.workspace import Workspace, frontend_folder
from tests.server.helpers import wait_until
from tests.server.researcher.pilot import Pilot

NAME, PASSWORD = "ada", "correct horse battery"
START_MS = 1_790_000_000_000.0
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>{{7*7}}"


class TurnedClock(Clock):
    """A clock that stands until it is turned."""

    def __init__(self) -> None:
        super().__init__()
        self.at_s = START_MS / 1000

    def now(self) -> float:
        return self.at_s

    def ms(self, at_s: float | None = None) -> float:
        return 1000 * (self.at_s if at_s is None else at_s)


@dataclass
class Office:
    """The pages, what they stand on, and how to get in."""

    pages: list[Route]
    store: Store
    workspace: Workspace
    study: Study
    clock: TurnedClock
    stopped: list[int]
    database: Path
    url: str = ""
    opened: ExitStack = field(default_factory=ExitStack)
    visits: dict[str, VisitRow] = field(default_factory=dict)
    open_round: int = 0

    def visitor(self, **headers: str) -> httpx.Client:
        """A browser of somebody who has not logged in."""
        return self.opened.enter_context(httpx.Client(base_url=self.url, headers=headers, timeout=60))

    def researcher(self) -> Researcher:
        """A browser of somebody who has."""
        client = self.visitor()
        assert log_in(client).status_code == 303
        return Researcher(client)


@dataclass
class Researcher:
    """A browser with a session."""

    http: httpx.Client

    def page(self, path: str, status: int = 200) -> str:
        answer = self.http.get(f"/researcher{path}")
        assert answer.status_code == status, answer.text
        return answer.text

    def data(self, path: str) -> Any:
        answer = self.http.get(f"/researcher{path}")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def send(self, path: str, token: str | None = None, **fields: str) -> httpx.Response:
        """Send a form with this session's token, or with another one."""
        kept = csrf(self.page("")) if token is None else token
        return self.http.post(f"/researcher{path}", data={"csrf": kept, **fields})


def csrf(html: str) -> str:
    """The token of a page's first form."""
    found = re.search(r'name="csrf" value="([^"]+)"', html)
    assert found, html
    return found[1]


def log_in(
    client: httpx.Client, name: str = NAME, password: str = PASSWORD, back: str = ""
) -> httpx.Response:
    """Fill in the login form and send it."""
    form = {
        "csrf": csrf(client.get("/researcher/login").text),
        "name": name,
        "password": password,
        "next": back,
    }
    return client.post("/researcher/login", data=form)


@contextmanager
def open_office(database: Path, workspace: Workspace, study: Study, visits: bool = True) -> Iterator[Office]:
    """The pages over a new database with one researcher, and a pilot's visits if wanted."""
    clock = TurnedClock()
    stopped: list[int] = []

    async def stop_visit(visit_id: int) -> None:
        stopped.append(visit_id)

    with Store.open(database) as store:
        Researchers(store).put(NAME, Passwords().hashed(PASSWORD), clock.ms()).result()
        pages = researcher_pages(
            store=store,
            studies={study.name: study},
            folder=str(frontend_folder() / "templates"),
            clock=clock,
            stop_visit=stop_visit,
        )
        app = Starlette(routes=[*pages, Mount("/static", Static(directory=frontend_folder()))])
        app.add_middleware(SecureHeaders)
        office = Office(pages, store, workspace, study, clock, stopped, database)
        if visits:
            _visit(office, Pilot(store, workspace, study, START_MS - 3_600_000))
        with _served(app) as office.url, office.opened:
            yield office


@contextmanager
def _served(app: Starlette) -> Iterator[str]:
    """The URL of the application, served by a thread as `galley serve` does: a local proxy is trusted."""
    settings = Settings(port=0)
    listening = listen(settings)
    server = uvicorn.Server(server_config(app, settings))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        wait_until(lambda: server.started or not thread.is_alive())
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()
        listening.close()


def _visit(office: Office, pilot: Pilot) -> None:
    """One visit that completed, one hostile in every text, one in a round, one that left, one test."""
    rounds = [step.kind for step in pilot.plan_steps()].index("round")
    made = office.visits
    made["done"] = pilot.begin(PROLIFIC_PID="abc")
    pilot.walk(made["done"], late=30, hidden_s=90)
    made["hostile"] = pilot.begin(**{HOSTILE: HOSTILE})
    pilot.walk(made["hostile"], text=HOSTILE)
    office.store.add_note(made["hostile"].id, HOSTILE, HOSTILE, START_MS).result()
    made["playing"] = pilot.begin()
    pilot.walk(made["playing"], rounds, midway=12)
    made["left"] = pilot.begin()
    pilot.walk(made["left"], 2)
    office.store.end_visit(made["left"].id, "timed_out", START_MS).result()
    made["test"] = pilot.begin(test=True)
    pilot.walk(made["test"], 2)
    row = office.store.open_round(made["playing"].id, pilot.plan_steps()[rounds].id).result()
    assert row is not None
    office.open_round = row.id
