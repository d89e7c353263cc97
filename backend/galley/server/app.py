"""The application: everything built once, in one place, and handed down."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import Response
from starlette.exceptions import HTTPException
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from galley.agents.catalogue import Catalogue
from galley.agents.episode import play_episode
from galley.agents.scripted import Stay
from galley.errors import GalleyError
from galley.kitchen import Layout, warm
from galley.kitchen.layout_file import load_layouts
from galley.records import Store
from galley.server.clock import Clock
from galley.server.garbage_collection import collect_between_rounds, few_collections
from galley.server.headers import HEADERS, SecureHeaders
from galley.server.participant.pages import NO_PAGE, NOT_FOUND, Pages
from galley.server.participant.time_limits import TimeLimits
from galley.server.participant.visits import Visits
from galley.server.researcher.routes import researcher_pages
from galley.server.rounds.lobby import Lobby
from galley.server.rounds.matches import Matches
from galley.server.rounds.play_socket import Play
from galley.server.rounds.set_up import round_layout
from galley.server.rounds.thinking import Thinking
from galley.server.settings import Settings
from galley.server.templates import translated_templates
from galley.study.study import Study, load_study
from galley.study.visit.condition_slots import cells
from galley.study.visit.plan import plan_visit, visit_seed
from galley.translations import Catalogues, mark
from galley.workspace import Workspace, frontend_folder

LOG = logging.getLogger(__name__)
STATIC_KEPT_S = 300
REHEARSED_TICKS = 3
REHEARSED_VISITS = 64
REHEARSED_PER_CELL = 8
NO_AGENTS = (None, "exit", "go_on", "end_round")

WRONG = mark("Something went wrong")
NOT_POSSIBLE = mark("Not possible")
BROKEN = mark(
    "Something went wrong here, not with you. What you answered so far is stored. "
    "Please load this page again in a moment; you will be where you were."
)
AWAY_RETRY_S = "5"


def create_app(workspace: Workspace, store: Store, settings: Settings, *, preview: bool = False) -> FastAPI:
    """The application that serves a workspace's studies (or the one that the settings name) into a store.

    With `preview` every visit is a test. Kernels are compiled and every agent that a study needs is tried
    here, so that nothing is left to the first round.

    Raises: GalleyError or InvalidFiles when a study or an agent it needs cannot be used.
    """
    studies = _studies(workspace, settings.study)
    layouts = load_layouts(workspace)
    catalogue = Catalogue(workspace)
    warm()
    _rehearse(studies, layouts, catalogue)

    clock = Clock()
    thinking = Thinking(settings.think_window_ms / 1000.0)
    catalogues = Catalogues.load()
    visits = Visits(store, studies, clock, catalogues, preview=preview)
    matches = Matches(store, visits, catalogue, layouts, thinking, clock, settings.reached_at)
    frontend = frontend_folder()
    environment = translated_templates(str(frontend / "templates"), catalogues)
    pages = Pages(
        studies,
        visits,
        matches,
        Lobby(store, matches, visits, clock),
        store,
        clock,
        environment,
        settings.max_form_kib * 1024,
    )
    play = Play(visits, matches, settings.messages_per_s)

    time_limits = TimeLimits(store, studies, visits, matches, clock)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        thinking.start()
        with few_collections():
            watching = asyncio.create_task(time_limits.watch())
            collecting = asyncio.create_task(collect_between_rounds(matches.playing))
            try:
                yield
            finally:
                watching.cancel()
                collecting.cancel()
                await matches.stop()
                await asyncio.wrap_future(store.flush())
                thinking.stop()

    app = FastAPI(title="Galley", docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan)
    app.include_router(pages.router())
    app.include_router(
        researcher_pages(
            store=store,
            database=settings.database or workspace.database,
            studies=studies,
            folder=str(frontend / "templates"),
            clock=clock,
            stop_visit=matches.stop_visit,
        )
    )
    app.add_api_websocket_route("/v/{token}/play", play.endpoint)
    app.mount("/static", Static(directory=frontend), name="static")
    app.add_middleware(SecureHeaders)

    async def not_here(_request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 404
        return pages.plain(status, NOT_FOUND if status == 404 else NOT_POSSIBLE, NO_PAGE)

    async def away(_request: Request, error: Exception) -> Response:
        LOG.error("a page could not be served: %s", error)
        response = pages.plain(503, WRONG, BROKEN)
        response.headers["retry-after"] = AWAY_RETRY_S
        return response

    async def broken(_request: Request, _error: Exception) -> Response:
        response = pages.plain(500, WRONG, BROKEN)
        # This page is made outside of the middleware.
        response.headers.update(HEADERS)
        return response

    app.add_exception_handler(HTTPException, not_here)
    app.add_exception_handler(GalleyError, away)
    app.add_exception_handler(Exception, broken)
    return app


class Static(StaticFiles):
    """The frontend's styles, scripts and sprites; its templates are not for the world."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """One file, kept by browsers for a few minutes."""
        if not path.startswith(("css/", "js/", "sprites/")):
            raise HTTPException(404)
        response = await super().get_response(path, scope)
        response.headers["cache-control"] = f"public, max-age={STATIC_KEPT_S}"
        return response


def _studies(workspace: Workspace, only: str) -> Mapping[str, Study]:
    names = (only,) if only else workspace.names("studies")
    if not names:
        raise GalleyError(
            f"{workspace.path / 'studies'}: there is no study to serve; write one, see docs/first-study.md"
        )
    return {name: load_study(workspace, name) for name in names}


def _rehearse(studies: Mapping[str, Study], layouts: Mapping[str, Layout], catalogue: Catalogue) -> None:
    """Let every agent act on every layout that a visit can bring it to, from both seats.

    Raises: GalleyError naming agent and layout when one cannot.
    """
    met = {
        (name, round_layout(layouts, data))
        for study in studies.values()
        for data in _rounds(study)
        for name in _agents_of(data)
    }
    for name, layout in sorted(met, key=lambda pair: (pair[0], pair[1].name)):
        bundle = catalogue.bundle(name)
        try:
            for seat in (0, 1):
                agent = bundle.make()
                agents = (agent, Stay()) if seat == 0 else (Stay(), agent)
                play_episode(layout, agents, seed=0, ticks=REHEARSED_TICKS)
        except GalleyError:
            raise
        except Exception as error:
            raise GalleyError(
                f"agents/{name}: it cannot play on layout {layout.name} ({type(error).__name__}: {error}); "
                "run `galley agents check`"
            ) from error


def _rounds(study: Study) -> Iterator[Mapping[str, Any]]:
    """The settings of the rounds that visits meet: of some visits in each cell of the design."""
    for number in range(min(REHEARSED_VISITS, REHEARSED_PER_CELL * len(cells(study.config)))):
        for step in plan_visit(study, visit_seed(study, number), number).steps:
            if step.kind == "round":
                yield step.data


def _agents_of(data: Mapping[str, Any]) -> set[str]:
    """Every agent that may play a round, those that stand in for a person included."""
    lobby = data.get("lobby", {})
    names = {data["agent"], lobby.get("fallback"), lobby.get("dropout")}
    return {name for name in names if name not in NO_AGENTS}
