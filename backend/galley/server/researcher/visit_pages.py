"""The researcher's pages about one visit: what happened, notes, and erasing it for good."""

from __future__ import annotations

import asyncio
from typing import Any

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from galley.errors import GalleyError
from galley.records.reading import overview
from galley.records.rows import SessionRow
from galley.records.store.erase import erase_participant, is_unfinished
from galley.server.researcher.login import HOME, NEVER_CACHED, Form, first
from galley.server.researcher.page_context import PageContext, number

LONGEST_NOTE = 4000
MOST_ROUNDS = 1000


class VisitPages:
    """One visit by its number."""

    def __init__(self, context: PageContext) -> None:
        self._context = context

    async def visit(self, request: Request, session: SessionRow) -> Response:
        """Timeline, answers, rounds, flags and notes of a visit."""
        return await self._page(number(request, "visit"), session)

    async def note(self, request: Request, session: SessionRow, form: Form) -> Response:
        """Add a note, signed with the researcher's name."""
        visit_id, text = number(request, "visit"), first(form, "text").replace("\0", "").strip()
        if await self._found(visit_id) is None:
            return self._context.missing(session, "visit")
        if not text or len(text) > LONGEST_NOTE:
            problem = f"A note has 1 to {LONGEST_NOTE} characters; this one has {len(text)}."
            return await self._page(visit_id, session, 422, note=text, note_problem=problem)
        store, author = self._context.store, session.researcher.name
        await asyncio.wrap_future(store.add_note(visit_id, author, text, self._context.clock.ms()))
        return RedirectResponse(f"{HOME}/visits/{visit_id}#notes", 303, NEVER_CACHED)

    async def erase(self, request: Request, session: SessionRow, form: Form) -> Response:
        """Erase the participant for good, once their name was typed as it stands there."""
        visit_id = number(request, "visit")
        found, typed = await self._found(visit_id), first(form, "confirm").strip()
        if found is None and await self._context.read(lambda connection: is_unfinished(connection, typed)):
            return await self._erased(session, typed)
        if found is None:
            return self._context.missing(session, "visit")
        if typed != found.participant:
            problem = f"Nothing was erased. To erase this participant, type {found.participant} exactly."
            return await self._page(visit_id, session, 422, erase_problem=problem)
        store, now_ms = self._context.store, self._context.clock.ms()
        # A visit that is over cannot take up its round again between the match's end and the erasing.
        await asyncio.wrap_future(store.end_visit(visit_id, "expired", now_ms))
        await self._context.stop_visit(visit_id)
        return await self._erased(session, found.participant)

    async def _erased(self, session: SessionRow, participant: str) -> Response:
        try:
            erased = await asyncio.to_thread(erase_participant, self._context.store, participant)
        except GalleyError as error:
            return self._context.logins.plain(session, 409, "Not erased", f"{error}.")
        told = f"{participant} was erased for good: visits {erased.visits}, rounds {erased.rounds}."
        return self._context.logins.plain(session, 200, "Erased", told)

    async def _found(self, visit_id: int) -> Any:
        return await self._context.read(lambda connection: overview.visit(connection, visit_id))

    async def _page(
        self,
        visit_id: int,
        session: SessionRow,
        status: int = 200,
        *,
        note: str = "",
        note_problem: str = "",
        erase_problem: str = "",
    ) -> Response:
        def read(connection: Any) -> dict[str, Any] | None:
            visit = overview.visit(connection, visit_id)
            if visit is None:
                return None
            rounds = overview.rounds(connection, visit.study, visit_id=visit_id, limit=MOST_ROUNDS, offset=0)
            return {
                "visit": visit,
                "study": visit.study,
                "timeline": overview.timeline(connection, visit_id),
                "answers": overview.answers(connection, visit_id),
                "rounds": sorted(rounds, key=lambda round_: round_.id),
                "notes": overview.notes(connection, visit_id),
            }

        values = await self._context.read(read)
        if values is None:
            return self._context.missing(session, "visit")
        return self._context.show(
            session,
            "visit.html",
            status,
            note=note,
            note_problem=note_problem,
            erase_problem=erase_problem,
            longest_note=LONGEST_NOTE,
            **values,
        )
