"""What every researcher's page needs: the records, the studies, and a way to show a template."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar
from urllib.parse import urlencode

import jinja2
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from galley.records import Store
from galley.records.rows import SessionRow
from galley.server.clock import Clock
from galley.server.researcher.login import NEVER_CACHED, Logins
from galley.study.study import Study

T = TypeVar("T")
MOST_ID = 2**63 - 1


@dataclass(frozen=True, slots=True)
class PageContext:
    """Handed to every group of pages.

    `stop_visit` ends the live match of a visit, if there is one, without writing its end.
    """

    store: Store
    studies: Mapping[str, Study]
    environment: jinja2.Environment
    clock: Clock
    logins: Logins
    stop_visit: Callable[[int], Awaitable[None]]

    async def read(self, query: Callable[[Any], T]) -> T:
        """What a function of `galley.records.reading.overview` or `queries` finds."""
        return await asyncio.wrap_future(self.store.read(query))

    def show(self, session: SessionRow, template: str, status_code: int = 200, /, **values: Any) -> Response:
        """A page; `session` brings who is logged in and the token of its forms."""
        return HTMLResponse(self.part(session, template, **values), status_code, NEVER_CACHED)

    def part(self, session: SessionRow, template: str, **values: Any) -> str:
        """The HTML of a template."""
        found = self.environment.get_template(f"admin/{template}")
        return found.render(session=session, now_ms=self.clock.ms(), **values)

    def missing(self, session: SessionRow, what: str) -> Response:
        """The page for something that is not there (any more)."""
        return self.logins.plain(session, 404, "Not found", f"There is no such {what}, or it was erased.")


def number(request: Request, name: str) -> int:
    """The number in a path; -1, which nothing has, if no database could hold it."""
    value = int(request.path_params[name])
    return value if value <= MOST_ID else -1


def link(path: str, **query: Any) -> str:
    """A path with a query of everything that is not empty."""
    kept = {name: value for name, value in query.items() if value not in (None, "", False, 0)}
    return f"{path}?{urlencode(kept)}" if kept else path
