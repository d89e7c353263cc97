"""The application: everything built once, in one place, and handed down."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from galley.errors import GalleyError
from galley.records import Store
from galley.server.base_path import BasePath
from galley.server.changed_files import kept_by
from galley.server.clock import Clock, Following, WakingClock
from galley.server.content import Content
from galley.server.garbage_collection import collect_between_rounds, few_collections
from galley.server.headers import HEADERS, SecureHeaders
from galley.server.limits import PerAddress
from galley.server.participant.pages import NO_PAGE, NOT_FOUND, Pages
from galley.server.participant.time_limits import TimeLimits
from galley.server.participant.visits import Visits
from galley.server.researcher.routes import researcher_pages
from galley.server.rounds.lobby import Lobby
from galley.server.rounds.matches import Matches
from galley.server.rounds.play_socket import Play
from galley.server.rounds.thinking import ThinkingThreads
from galley.server.settings import Settings
from galley.server.templates import translated_templates
from galley.translations import mark
from galley.workspace import frontend_folder

LOG = logging.getLogger(__name__)
STATIC_KEPT_S = 300
KEPT_FOR_GOOD = {"cache-control": "public, max-age=31536000, immutable"}
"""A picture's name tells its content."""

WRONG = mark("Something went wrong")
NOT_POSSIBLE = mark("Not possible")
BROKEN = mark(
    "Something went wrong here, not with you. What you answered so far is stored. "
    "Please load this page again in a moment; you will be where you were."
)
AWAY_RETRY_S = "5"


def create_app(content: Content, store: Store, settings: Settings, *, preview: bool = False) -> Starlette:
    """The application that serves studies and keeps what happens in a store; with `preview` all are tests."""
    studies = content.studies
    clock, rounds_clock = WakingClock(), Clock()
    thinking = ThinkingThreads(settings.think_window_ms / 1000.0)
    has = kept_by(content.layouts, content.agents)
    visits = Visits(store, studies, clock, content.catalogues, has, preview=preview)
    matches = Matches(
        store, visits, content.agents, content.layouts, thinking, rounds_clock, settings.reached_at
    )
    frontend = frontend_folder()
    environment = translated_templates(str(frontend / "templates"), content.catalogues)
    pages = Pages(
        studies,
        visits,
        matches,
        Lobby(store, matches, visits, clock),
        store,
        clock,
        thinking,
        environment,
        settings.max_form_kib * 1024,
        settings.begins_per_min,
    )
    play = Play(
        visits,
        matches,
        settings.messages_per_s,
        settings.address_messages_per_s,
        debug=bool(settings.debug),
    )

    time_limits = TimeLimits(store, studies, visits, matches, clock)
    following = Following(store, clock, rounds_clock, matches.playing)

    @asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncIterator[None]:
        await following.look()
        thinking.start()
        with few_collections():
            beside = [
                asyncio.create_task(work)
                for work in (
                    time_limits.watch(),
                    thinking.watch(),
                    following.watch(),
                    collect_between_rounds(matches.playing),
                )
            ]
            try:
                yield
            finally:
                for task in beside:
                    task.cancel()
                await matches.stop()
                await asyncio.wrap_future(store.flush())
                app.state.all_ended = thinking.stop()

    shown = {picture.name: picture for study in studies.values() for picture in study.pictures}

    async def picture(request: Request) -> Response:
        found = shown.get(request.path_params["name"])
        if found is None:
            raise HTTPException(404)
        return Response(found.content, media_type=found.media_type, headers=KEPT_FOR_GOOD)

    routes = [
        *pages.routes(),
        *researcher_pages(
            store=store,
            studies=studies,
            folder=str(frontend / "templates"),
            clock=clock,
            stop_visit=matches.stop_visit,
        ),
        WebSocketRoute("/v/{token}/play", play.endpoint),
        Route("/pictures/{name}", picture),
        Mount("/static", Static(directory=frontend), name="static"),
    ]
    app = Starlette(routes=routes, lifespan=lifespan)
    if settings.requests_per_s:
        app.add_middleware(PerAddress, per_s=settings.requests_per_s)
    app.add_middleware(SecureHeaders, framed_by=settings.framed_by)
    app.add_middleware(BasePath, base=settings.base_path)

    async def not_here(request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 404
        return pages.plain(
            status, NOT_FOUND if status == 404 else NOT_POSSIBLE, NO_PAGE, pages.spoken_to(request)
        )

    async def away(request: Request, error: Exception) -> Response:
        LOG.error("a page could not be served: %s", error)
        response = pages.plain(503, WRONG, BROKEN, pages.spoken_to(request))
        response.headers["retry-after"] = AWAY_RETRY_S
        return response

    async def broken(request: Request, _error: Exception) -> Response:
        await pages.tell_broken(request.url.path)
        response = pages.plain(500, WRONG, BROKEN, pages.spoken_to(request))
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
