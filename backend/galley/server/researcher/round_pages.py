"""The researcher's pages about one round: replayed to its end, or watched while it is played."""

from __future__ import annotations

from typing import Any

import orjson
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from galley.errors import GalleyError
from galley.film.write import can_draw
from galley.records.database.tables import TICKS
from galley.records.reading import overview
from galley.records.rows import RoundRow, SessionRow
from galley.records.store import queries
from galley.server.researcher.downloads import FILMS
from galley.server.researcher.login import NEVER_CACHED
from galley.server.researcher.page_context import PageContext, number
from galley.server.researcher.replay_document import replay_document


class RoundPages:
    """One round by its number. A round under way is read from the journal, a second behind; the match that
    plays it knows nothing of it.
    """

    def __init__(self, context: PageContext) -> None:
        self._context = context

    async def round(self, request: Request, session: SessionRow) -> Response:
        """The page that replays a round."""
        round_id = number(request, "round")

        def read(connection: Any) -> tuple[RoundRow, Any]:
            row = queries.round_row(connection, round_id)
            visits = [seat.visit_id for seat in row.seats if seat.visit_id is not None]
            return row, [overview.visit(connection, visit) for visit in visits]

        try:
            row, visits = await self._context.read(read)
        except GalleyError:
            return self._context.missing(session, "round")
        live = row.status == "open"
        films = tuple(FILMS) if len(row.joint_actions) and not live and can_draw() else ()
        return self._context.show(
            session, "round.html", row=row, visits=visits, seats=row.seats, live=live, films=films
        )

    async def replay(self, request: Request, session: SessionRow) -> Response:
        """The round for that page's script, with the ticks from `after` on."""
        round_id = number(request, "round")
        text = request.query_params.get("after", "0")
        after = int(text) if text.isascii() and text.isdigit() and len(text) < 9 else 0

        def read(connection: Any) -> bytes:
            row = queries.round_row(connection, round_id)
            ticks = {tick["tick"]: tick for tick in queries.of_round(connection, TICKS, round_id)}
            return orjson.dumps(replay_document(row, ticks, after))

        try:
            document = await self._context.read(read)
        except GalleyError as error:
            return JSONResponse({"error": str(error)}, 404, NEVER_CACHED)
        return Response(document, 200, NEVER_CACHED, "application/json")
