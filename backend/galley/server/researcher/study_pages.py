"""The researcher's pages about studies: how each is doing, and the state it is in."""

from __future__ import annotations

import asyncio
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response

from galley.outcomes import VISIT_STATUSES
from galley.records.database.tables import STUDY_STATES
from galley.records.reading import overview
from galley.records.rows import SessionRow
from galley.records.store.links_for_tests import LinksForTests
from galley.server.base_path import site
from galley.server.participant.visits import TEST_PARAM
from galley.server.researcher.counts import DAY_MS, arrivals, cell_rows, flag_counts, study_rows
from galley.server.researcher.downloads import DOWNLOADS
from galley.server.researcher.login import HOME, NEVER_CACHED, Form, first
from galley.server.researcher.page_context import PageContext, link
from galley.study.study import Study
from galley.study.visit.condition_slots import capacity, cells

VISITS_A_PAGE = 50
ROUNDS_A_PAGE = 50
TEST_LINK_DAYS = 7


class StudyPages:
    """All studies, one study, its visits and its rounds."""

    def __init__(self, context: PageContext) -> None:
        self._context = context

    # ---- all studies ---------------------------------------------------------------------------------------

    async def home(self, request: Request, session: SessionRow) -> Response:
        """Every study with its live state."""
        return self._context.show(session, "studies.html", rows=await self._rows())

    async def home_live(self, request: Request, session: SessionRow) -> Response:
        """The numbers of that page, as they are now."""
        html = self._context.part(session, "_studies.html", rows=await self._rows())
        return JSONResponse({"parts": {"studies": html}}, 200, NEVER_CACHED)

    async def _rows(self) -> list[dict[str, Any]]:
        return study_rows(await self._context.read(overview.studies), self._context.studies)

    # ---- one study -----------------------------------------------------------------------------------------

    async def study(self, request: Request, session: SessionRow) -> Response:
        """One study: stages, cells, rounds, flags, links, downloads, and the buttons to pause or close it."""
        name = request.path_params["study"]
        state = await self._state(name)
        if state is None:
            return self._context.missing(session, "study")
        study = self._context.studies.get(name)
        links = [] if study is None else [("Link for participants", f"{site(request)}/s/{name}")]
        kept = () if study is None else study.config.recruitment.keep
        if kept:
            query = "&".join(f"{key}={{{{%{key}%}}}}" for key in kept)
            links.append(("With a recruiter's parameters", f"{site(request)}/s/{name}?{query}"))
        title = name if study is None else study.title
        tests = () if study is None else await self._test_links(request, study)
        design = () if study is None else cells(study.config)
        return self._context.show(
            session,
            "study.html",
            name=name,
            title=title,
            links=links,
            test_links=tests,
            design=design if len(design) > 1 else (),
            downloads=DOWNLOADS,
            **state,
        )

    async def _test_links(self, request: Request, study: Study) -> list[dict[str, Any]]:
        """The study's test links, newest first, as the page shows them."""
        found = await asyncio.wrap_future(
            LinksForTests(self._context.store).of_study(study.name, self._context.clock.ms())
        )
        design = cells(study.config)
        return [
            {
                "token": link.token,
                "url": f"{site(request)}/s/{study.name}?{TEST_PARAM}={link.token}",
                "cell": None if link.cell is None else design[min(link.cell, len(design) - 1)],
                "author": link.author,
                "expires_ms": link.expires_ms,
            }
            for link in found
        ]

    async def make_test_link(self, request: Request, session: SessionRow, form: Form) -> Response:
        """A new test link, for one cell of the design or for any."""
        name = request.path_params["study"]
        study = self._context.studies.get(name)
        if study is None:
            return self._context.missing(session, "study")
        chosen, now_ms = first(form, "cell"), self._context.clock.ms()
        count = len(cells(study.config))
        known = {str(number): number for number in range(count)} | {"": None}
        if chosen not in known:
            told = f"The design has {count} cells, and this is none of them."
            return self._context.logins.plain(session, 400, "Not done", told)
        links = LinksForTests(self._context.store)
        author = session.researcher.name
        await asyncio.wrap_future(
            links.make(name, known[chosen], author, now_ms, now_ms + TEST_LINK_DAYS * DAY_MS)
        )
        return RedirectResponse(f"{HOME}/studies/{name}#tests", 303, NEVER_CACHED)

    async def withdraw_test_link(self, request: Request, session: SessionRow, form: Form) -> Response:
        """Let a test link be good for nothing any more; visits begun with it go on."""
        name = request.path_params["study"]
        links = LinksForTests(self._context.store)
        if not await asyncio.wrap_future(links.withdraw(name, first(form, "link"))):
            return self._context.missing(session, "test link")
        return RedirectResponse(f"{HOME}/studies/{name}#tests", 303, NEVER_CACHED)

    async def study_live(self, request: Request, session: SessionRow) -> Response:
        """The numbers of that page, as they are now."""
        name = request.path_params["study"]
        state = await self._state(name)
        if state is None:
            return JSONResponse({"error": "no such study"}, 404, NEVER_CACHED)
        parts = {
            part: self._context.part(session, f"_{part}.html", name=name, **state)
            for part in ("numbers", "stages", "cells", "rounds", "flags", "arrivals", "arrivals_table")
        }
        return JSONResponse({"parts": parts}, 200, NEVER_CACHED)

    async def _state(self, name: str) -> dict[str, Any] | None:
        def read(connection: Any) -> dict[str, Any]:
            found = overview.studies(connection)
            here = next((row for row in found if row.name == name), None)
            return {
                "rows": found,
                "stages": overview.stages(connection, name) if here else (),
                "cells": overview.cells(connection, name) if here else (),
                "rounds": overview.current_rounds(connection, name) if here else (),
                "flags": flag_counts(overview.flags(connection, name, tests=False) if here else {}),
                "arrivals": arrivals(overview.began(connection, name)),
            }

        state = await self._context.read(read)
        row = next(
            (row for row in study_rows(state.pop("rows"), self._context.studies) if row["name"] == name), None
        )
        study = self._context.studies.get(name)
        room = None if study is None else capacity(study)
        if row is None:
            return None
        return state | {"row": row, "capacity": room, "cells": cell_rows(state["cells"], study)}

    async def set_state(self, request: Request, session: SessionRow, form: Form) -> Response:
        """Open, pause or close a study; visits that are under way go on."""
        name, state = request.path_params["study"], first(form, "state")
        known = name in self._context.studies or any(row["name"] == name for row in await self._rows())
        if not known:
            return self._context.missing(session, "study")
        if state not in STUDY_STATES:
            return self._context.logins.plain(session, 400, "Not done", "A study is open, paused or closed.")
        await asyncio.wrap_future(self._context.store.set_study_state(name, state, self._context.clock.ms()))
        return RedirectResponse(f"{HOME}/studies/{name}", 303, NEVER_CACHED)

    # ---- its visits and rounds -----------------------------------------------------------------------------

    async def visits(self, request: Request, session: SessionRow) -> Response:
        """The visits of a study, filtered by status, flags and tests, newest first."""
        name = request.path_params["study"]
        query = request.query_params
        status = query.get("status", "") if query.get("status") in VISIT_STATUSES else ""
        flagged, tests, page = bool(query.get("flagged")), bool(query.get("tests")), _page(query.get("page"))

        def read(connection: Any) -> Any:
            return overview.visits(
                connection,
                name,
                status=status or None,
                flagged=flagged or None,
                tests=tests,
                limit=VISITS_A_PAGE + 1,
                offset=page * VISITS_A_PAGE,
            )

        found = await self._context.read(read)
        here = f"{HOME}/studies/{name}/visits"
        chosen = {"status": status, "flagged": int(flagged), "tests": int(tests)}
        return self._context.show(
            session,
            "visits.html",
            name=name,
            visits=found[:VISITS_A_PAGE],
            statuses=VISIT_STATUSES,
            chosen=chosen,
            before=link(here, **chosen, page=page - 1) if page else "",
            after=link(here, **chosen, page=page + 1) if len(found) > VISITS_A_PAGE else "",
        )

    async def rounds(self, request: Request, session: SessionRow) -> Response:
        """The rounds of a study, newest first."""
        name, page = request.path_params["study"], _page(request.query_params.get("page"))
        found = await self._context.read(
            lambda connection: overview.rounds(
                connection, name, limit=ROUNDS_A_PAGE + 1, offset=page * ROUNDS_A_PAGE
            )
        )
        here = f"{HOME}/studies/{name}/rounds"
        return self._context.show(
            session,
            "rounds.html",
            name=name,
            rounds=found[:ROUNDS_A_PAGE],
            before=link(here, page=page - 1) if page else "",
            after=link(here, page=page + 1) if len(found) > ROUNDS_A_PAGE else "",
        )


def _page(text: str | None) -> int:
    """A page's number from 0, whatever the query says."""
    return min(int(text), 1_000_000) if text and text.isascii() and text.isdigit() and len(text) < 9 else 0
