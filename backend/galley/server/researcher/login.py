"""Who may see the researcher's pages: logins, sessions, and the token that every form carries."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from urllib.parse import quote

import jinja2
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response

from galley.records import Store
from galley.records.rows import ResearcherRow, SessionRow
from galley.records.store.researcher_accounts import Researchers
from galley.server.clock import Clock
from galley.server.form_decoding import FormError, read_form
from galley.server.headers import same_origin
from galley.server.limits import network_of
from galley.server.researcher.login_throttle import (
    FREE_TRIES_OF_A_NAME,
    LONGEST_WAIT_OF_A_NAME_S,
    MOST_KEPT,
    Throttle,
)
from galley.server.researcher.passwords import LONGEST, LONGEST_NAME, Passwords

HOME = "/researcher"
LOGIN = f"{HOME}/login"
SESSION_COOKIE = "galley_researcher"
FORM_COOKIE = "galley_login"
SESSION_S = 12 * 3600
MAX_FORM_BYTES = 64 * 1024
NEVER_CACHED = {"cache-control": "no-store"}

WRONG = "Name and password do not belong together. Check both; passwords tell capitals from small letters."
OLD_FORM = "This form was too old or came from another page, so nothing was changed. Load the page again."
FOREIGN = "This form was sent from another site, so nothing was changed."

Form = Mapping[str, list[str]]
Page = Callable[[Request, SessionRow], Awaitable[Response]]
FormAction = Callable[[Request, SessionRow, Form], Awaitable[Response]]
Endpoint = Callable[[Request], Awaitable[Response]]


class Logins:
    """Lets researchers in and out. Sessions are kept in the records, so they survive a restart."""

    def __init__(self, store: Store, environment: jinja2.Environment, clock: Clock) -> None:
        self._researchers = Researchers(store)
        self._environment = environment
        self._clock = clock
        self._passwords = Passwords()
        self._throttle = Throttle()
        # Whoever guesses from ever new addresses is slowed by the name, but cannot keep its owner out for
        # long, nor at all where the owner has logged in before.
        self._names = Throttle(FREE_TRIES_OF_A_NAME, LONGEST_WAIT_OF_A_NAME_S)
        self._known: deque[str] = deque(maxlen=MOST_KEPT)
        # One at a time: each check takes 19 MiB and some milliseconds of a core.
        self._checking = asyncio.Semaphore(1)

    # ---- around every page ---------------------------------------------------------------------------------

    def page(self, page: Page) -> Endpoint:
        """The page for researchers; anybody else is led to the login."""

        async def endpoint(request: Request) -> Response:
            session = await self.session(request)
            if session is None:
                back = request.url.path + (f"?{request.url.query}" if request.url.query else "")
                return RedirectResponse(f"{LOGIN}?next={quote(back)}", 303, NEVER_CACHED)
            return await page(request, session)

        return endpoint

    def data(self, page: Page) -> Endpoint:
        """Data for a script of a page; 401 for anybody else."""

        async def endpoint(request: Request) -> Response:
            session = await self.session(request)
            if session is None:
                return JSONResponse({"error": "log in again"}, 401, NEVER_CACHED)
            return await page(request, session)

        return endpoint

    def form_action(self, form_action: FormAction) -> Endpoint:
        """What a researcher's form does; refused without a session or without that session's token."""

        async def endpoint(request: Request) -> Response:
            session = await self.session(request)
            if session is None:
                return RedirectResponse(LOGIN, 303, NEVER_CACHED)
            if not same_origin(request.headers):
                return self.plain(session, 403, "Not done", FOREIGN)
            try:
                form = await read_form(request, MAX_FORM_BYTES)
            except FormError as error:
                return self.plain(session, error.status, "Not done", f"The form could not be read: {error}.")
            if not _same(first(form, "csrf"), session.csrf):
                return self.plain(session, 403, "Not done", OLD_FORM)
            return await form_action(request, session, form)

        return endpoint

    async def session(self, request: Request) -> SessionRow | None:
        """The session of a request's cookie, if it is still good."""
        token = request.cookies.get(SESSION_COOKIE, "")
        if not token:
            return None
        return await asyncio.wrap_future(self._researchers.session(token, self._clock.ms()))

    def plain(self, session: SessionRow | None, status: int, title: str, message: str) -> Response:
        """A page that only says something."""
        return self._shown("plain.html", status, session=session, title=title, message=message)

    # ---- in and out ----------------------------------------------------------------------------------------

    async def login_page(self, request: Request) -> Response:
        """The form to log in with, or what to do while there is no researcher."""
        if await self.session(request) is not None:
            return RedirectResponse(HOME, 303, NEVER_CACHED)
        return await self._login_form(request, 200, request.query_params.get("next", ""))

    async def login(self, request: Request) -> Response:
        """A new session for the right name and password."""
        if not same_origin(request.headers):
            return self.plain(None, 403, "Not done", FOREIGN)
        try:
            form = await read_form(request, MAX_FORM_BYTES)
        except FormError as error:
            return self.plain(None, error.status, "Not done", f"The form could not be read: {error}.")
        back, name = first(form, "next"), first(form, "name").strip()[:LONGEST_NAME]
        if not _same(first(form, "csrf"), request.cookies.get(FORM_COOKIE, "")):
            return await self._login_form(request, 403, back, name, OLD_FORM)
        host = request.client.host if request.client else ""
        address = network_of(host) or host
        here = f"name {name.casefold()} at {address}"
        keys = (f"address {address}", here)
        now_s = self._clock.now()
        wait_s = max(self._throttle.wait_s(key, now_s) for key in keys)
        if here not in self._known:
            wait_s = max(wait_s, self._names.wait_s(name.casefold(), now_s))
        if wait_s > 0:
            told = f"Too many wrong logins. Wait {round(wait_s + 0.5)} seconds, then try again."
            return await self._login_form(request, 429, back, name, told)
        # Counted before it is looked at: guesses sent side by side cannot slip through together.
        for key in keys:
            self._throttle.failed(key, now_s)
        self._names.failed(name.casefold(), now_s)
        researcher = await self._researcher(name, first(form, "password"))
        if researcher is None:
            return await self._login_form(request, 403, back, name, WRONG)
        for key in keys:
            self._throttle.succeeded(key)
        self._names.succeeded(name.casefold())
        if here not in self._known:
            self._known.append(here)
        now_ms = self._clock.ms()
        token = await asyncio.wrap_future(
            self._researchers.open_session(researcher.id, now_ms, now_ms + SESSION_S * 1000.0)
        )
        response = RedirectResponse(_inside(back), 303, NEVER_CACHED)
        _set(response, request, SESSION_COOKIE, token, SESSION_S)
        response.delete_cookie(FORM_COOKIE, path=LOGIN)
        return response

    async def logout(self, request: Request, _session: SessionRow, _form: Form) -> Response:
        """The end of this session; its cookie is worth nothing from now on."""
        await asyncio.wrap_future(self._researchers.close_session(request.cookies[SESSION_COOKIE]))
        response = RedirectResponse(LOGIN, 303, NEVER_CACHED)
        response.delete_cookie(SESSION_COOKIE, path=HOME)
        return response

    async def _researcher(self, name: str, password: str) -> ResearcherRow | None:
        found = await asyncio.wrap_future(self._researchers.find(name))
        async with self._checking:
            right = await asyncio.to_thread(
                self._passwords.right, password[:LONGEST], found.password_hash if found else None
            )
        return found if right else None

    async def _login_form(
        self, request: Request, status: int, back: str, name: str = "", problem: str = ""
    ) -> Response:
        everybody: tuple[ResearcherRow, ...] = await asyncio.wrap_future(self._researchers.all())
        token = secrets.token_urlsafe(24)
        response = self._shown(
            "login.html",
            status,
            session=None,
            csrf=token,
            back=_inside(back),
            name=name,
            problem=problem,
            anybody=bool(everybody),
        )
        _set(response, request, FORM_COOKIE, token, 3600, LOGIN)
        return response

    def _shown(self, template: str, status: int, **values: object) -> Response:
        html = self._environment.get_template(f"admin/{template}").render(**values)
        return HTMLResponse(html, status, NEVER_CACHED)


def first(form: Form, name: str) -> str:
    """The first value of a form's field; empty when there is none."""
    return form.get(name, [""])[0]


def _same(given: str, wanted: str) -> bool:
    return bool(wanted) and secrets.compare_digest(given.encode(), wanted.encode())


def _inside(path: str) -> str:
    """A path of these pages to go on to: never another site's."""
    plain = path.isprintable() and "\\" not in path
    return path if plain and (path == HOME or path.startswith((f"{HOME}/", f"{HOME}?"))) else HOME


def _set(response: Response, request: Request, name: str, value: str, seconds: int, path: str = HOME) -> None:
    response.set_cookie(
        name,
        value,
        max_age=seconds,
        path=path,
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="strict",
    )
