"""The participant's pages: every step of a visit as HTML, and the forms that move it on."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any, Final
from urllib.parse import quote, urlencode

import jinja2
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Route

from galley.errors import GalleyError
from galley.records import Store
from galley.server.clock import Clock
from galley.server.form_decoding import FormError, read_form
from galley.server.headers import names_host, same_origin
from galley.server.limits import REFUSED_AFTER_S, Paces, network_of
from galley.server.participant.step_context import (
    common_context,
    ending_context,
    public_study,
    questionnaire_of,
    step_context,
    turned_away_context,
)
from galley.server.participant.time_limits import time_is_up
from galley.server.participant.visits import GRACE_S, TEST_PARAM, NotBegun, Visit, Visits
from galley.server.rounds.lobby import Lobby, Meeting
from galley.server.rounds.matches import Matches, RoundBusy
from galley.server.rounds.relay import RELAYED, hand_over
from galley.server.rounds.thinking import ThinkingThreads
from galley.study.stages.round_step import RoundStep
from galley.study.study import Study
from galley.study.visit.happenings import Skipped
from galley.study.written.languages import choose_language
from galley.study.written.questionnaire import validate_answers
from galley.translations import SOURCE, language_name, mark

LOG = logging.getLogger(__name__)
MAX_LINK_PARAMS = 30
MAX_LINK_PARAM_CHARS = 200
NEVER_CACHED = {"cache-control": "no-store"}
LANGUAGE_PARAM = "language"

NOT_FOUND = mark("Not found")
NOT_USED = mark("Not used")
UNKNOWN = mark("Unknown link")
UNKNOWN_LINK = mark(
    "This link is not known here. Please check that it is complete, "
    "or begin again from the link you were sent."
)
NOT_SERVED = mark("This study is not open here any more")
ANSWERS_STAY = mark(
    "What you answered so far is stored. You did nothing wrong; please tell the researchers who invited you."
)
NO_PAGE = mark("There is no page at this address. Please check that the link is complete.")
FOREIGN = mark("This form was sent from another site, so it was not used.")
UNREADABLE = mark("This form could not be read, so nothing was changed.")
TOO_LARGE: Final = 413
BEGINS_PER_S: Final = 20.0
BEGINS_AT_ONCE: Final = 5.0
"""How visits that one address begins are spread: each is some milliseconds of work."""
TOO_LONG = mark("Your answers are longer than this page takes. Please answer again in fewer words.")
UNTESTED = mark(
    "This test link is not good any more. Please make a new one on the study's page for researchers."
)
NOT_YET = mark("Not yet")
CROWDED = mark(
    "Many people are beginning from your network just now. Please go back, wait a minute, and try again."
)


class Pages:
    """Answers every HTTP request but those for static files."""

    def __init__(
        self,
        studies: Mapping[str, Study],
        visits: Visits,
        matches: Matches,
        lobby: Lobby,
        store: Store,
        clock: Clock,
        thinking: ThinkingThreads,
        templates: jinja2.Environment,
        max_form_bytes: int,
        begins_per_min: int = 0,
    ) -> None:
        self._studies = studies
        self._visits = visits
        self._matches = matches
        self._lobby = lobby
        self._store = store
        self._clock = clock
        self._thinking = thinking
        self._templates = templates
        self._max_form_bytes = max_form_bytes
        self._begins = Paces(begins_per_min / 60.0, burst=begins_per_min) if begins_per_min else None
        self._one_by_one = Paces(BEGINS_PER_S, burst=BEGINS_AT_ONCE)

    def routes(self) -> list[Route]:
        """The routes of all pages."""
        table: list[tuple[str, str, Callable[..., Awaitable[Response]]]] = [
            ("GET", "/", self.home),
            ("GET", "/healthz", self.health),
            ("GET", "/s/{study}", self.landing),
            ("POST", "/s/{study}/begin", self.begin),
            ("GET", "/s/{study}/begin", self.back_to_landing),
            ("GET", "/v/{token}", self.visit),
            ("POST", "/v/{token}", self.submit),
            ("POST", "/v/{token}/away", self.away),
            ("GET", "/v/{token}/play", self.no_socket),
            ("GET", "/v/{token}/lobby", self.waiting),
        ]
        return [Route(path, _with_params(page), methods=[method]) for method, path, page in table]

    # ---- before a visit ------------------------------------------------------------------------------------

    async def home(self, request: Request) -> Response:
        """The study when there is one, else a list."""
        query = _query(request)
        if len(self._studies) == 1:
            return RedirectResponse(f"/s/{next(iter(self._studies))}{query}", 303)
        spoken = (study.in_language(_language(study, request)) for study in self._studies.values())
        studies = [public_study(study) for study in spoken]
        return self._page("studies.html", studies=studies, query=query, language=self.spoken_to(request))

    async def health(self, _request: Request) -> Response:
        """Whether what happens reaches the database, and all agents answer."""
        self._store.probe()
        health = self._store.health()
        stuck = self._thinking.stuck()
        ok = health.ok and not stuck
        state = {"ok": ok, "rounds": len(self._matches), "rows_waiting": health.waiting_rows}
        agents = {"stuck": stuck, "given_up": self._thinking.given_up()}
        return JSONResponse(state | agents, 200 if ok else 503, NEVER_CACHED)

    async def landing(self, request: Request, study: str) -> Response:
        """What the study is and how long it takes, with a button to begin; or why nobody can."""
        found = self._studies.get(study)
        if found is None:
            return self.plain(404, NOT_FOUND, NO_PAGE, self.spoken_to(request))
        spoken = found.in_language(_language(found, request))
        params = _link_params(request)
        why = await self._visits.closed(found, params)
        if why is not None:
            return self._not_begun(spoken, why, params)
        others = {name: value for name, value in params.items() if name != LANGUAGE_PARAM}
        offered = [
            {
                "code": code,
                "name": language_name(code),
                "url": f"/s/{study}?{urlencode({**others, LANGUAGE_PARAM: code})}",
            }
            for code in found.languages
        ]
        return self._page(
            "landing.html",
            study=public_study(spoken),
            minutes=spoken.minutes,
            minutes_told=spoken.minutes_told,
            action=f"/s/{study}/begin" + (f"?{urlencode(others)}" if others else ""),
            language=spoken.language,
            languages=offered,
            test=TEST_PARAM in params,
        )

    async def back_to_landing(self, request: Request, study: str) -> Response:
        """The way from the address of the form back to the page with its button, for who loads it again."""
        return RedirectResponse(f"/s/{quote(study)}{_query(request)}", 303)

    async def begin(self, request: Request, study: str) -> Response:
        """A new visit, or the one that this person has; the answer leads to its page."""
        found = self._studies.get(study)
        if found is None:
            return self.plain(404, NOT_FOUND, NO_PAGE, self.spoken_to(request))
        if not same_origin(request.headers):
            return self.plain(403, NOT_USED, FOREIGN, self.spoken_to(request))
        try:
            form = await read_form(request, self._max_form_bytes)
        except FormError as error:
            return self.plain(error.status, NOT_USED, UNREADABLE, self.spoken_to(request))
        chosen = form.get(LANGUAGE_PARAM, [""])[0]
        language = chosen if chosen in found.languages else _language(found, request)
        wait_s = self._begin_wait_s(request)
        if wait_s > 0:
            await asyncio.sleep(REFUSED_AFTER_S)
            page = self.plain(429, NOT_YET, CROWDED, language)
            page.headers["retry-after"] = str(math.ceil(wait_s))
            return page
        await self._turn_of(request)
        params = _link_params(request)
        begun = await self._visits.begin(found, params, language)
        if not isinstance(begun, Visit):
            return self._not_begun(found.in_language(language), begun, params)
        return RedirectResponse(begun.url, 303, NEVER_CACHED)

    async def _turn_of(self, request: Request) -> None:
        """Wait for one's turn: a class that begins at once takes its time, not that of rounds in play."""
        if self._begins is not None and request.client:
            now_s = self._clock.now()
            pace = self._one_by_one.of(network_of(request.client.host), now_s)
            if (wait_s := pace.wait_s(now_s)) > 0:
                await asyncio.sleep(wait_s)

    def _begin_wait_s(self, request: Request) -> float:
        """How long the address of a request has to wait until it may begin another visit."""
        address = network_of(request.client.host) if request.client else ""
        if self._begins is None or not address:
            return 0.0
        now_s = self._clock.now()
        wait_s = self._begins.of(address, now_s).wait_s(now_s, patience_s=0.0)
        if wait_s > 0:
            LOG.warning(
                "more visits begin at the address %s than BEGINS_PER_MIN lets; "
                "if that is a proxy, let it pass on X-Forwarded-For",
                address,
            )
        return wait_s

    # ---- a visit -------------------------------------------------------------------------------------------

    async def visit(self, request: Request, token: str) -> Response:
        """The page of the step that the visit is at."""
        visit = await self._visits.find(token)
        if visit is None:
            return await self._no_visit(request, token)
        overdue = self._visits.overdue(visit)
        if overdue is not None:
            await time_is_up(self._visits, self._matches, visit, overdue)
            visit = await self._visits.find(token) or visit
        if visit.progress.status not in ("active", "completed"):
            return self._page("ending.html", **ending_context(visit))
        await self._visits.entered(visit)
        step = visit.round_with_human
        if step is None:
            return self._step_page(visit)
        meeting = await self._lobby.see(visit)
        if meeting.waiting:
            return self._lobby_page(visit, step, meeting)
        if not meeting.begun:
            return RedirectResponse(visit.url, 303, NEVER_CACHED)
        return self._step_page(visit, partner="agent" if meeting.alone else "human")

    async def waiting(self, _request: Request, token: str) -> Response:
        """Whether somebody still has to wait for a partner, and how long at most; for scripts."""
        visit = await self._visits.find(token)
        if visit is None:
            return JSONResponse({"waiting": False, "seconds_left": 0}, 404, NEVER_CACHED)
        meeting = Meeting(waiting=False)
        if visit.round_with_human is not None:
            meeting = await self._lobby.see(visit)
        answer = {"waiting": meeting.waiting, "seconds_left": meeting.seconds_left}
        return JSONResponse(answer, 200, NEVER_CACHED)

    async def no_socket(self, request: Request, token: str) -> Response:
        """What a proxy does not pass on, `host` or `websocket`, for a page whose socket never opened."""
        if await self._visits.find(token) is None:
            return Response(status_code=404, headers=NEVER_CACHED)
        origin, host = request.query_params.get("origin", ""), request.headers.get("host", "")
        missing = "websocket" if names_host({**request.headers, "origin": origin}) else "host"
        LOG.warning(
            "a round's socket does not open: does a proxy not pass on %s? Its page is of %.200r, "
            "the host asked for is %.200r; see docs/scaling-out.md",
            "Host" if missing == "host" else "websockets",
            origin,
            host,
        )
        return JSONResponse({"missing": missing, "origin": origin, "host": host}, 200, NEVER_CACHED)

    async def away(self, request: Request, token: str) -> Response:
        """Note that a page was hidden or is seen again; for scripts, which read no answer."""
        visit = await self._visits.find(token)
        if visit is None or not same_origin(request.headers):
            return Response(status_code=404 if visit is None else 403, headers=NEVER_CACHED)
        try:
            form = await read_form(request, self._max_form_bytes)
        except FormError as error:
            return Response(status_code=error.status, headers=NEVER_CACHED)
        if visit.active and form.get("step") == [visit.step.id] and visit.round is None:
            await self._visits.hidden(visit, hidden=form.get("hidden") == ["1"])
        return Response(status_code=204, headers=NEVER_CACHED)

    async def submit(self, request: Request, token: str) -> Response:
        """Move on by what the step's form says; a form of another step changes nothing."""
        if not same_origin(request.headers):
            return self.plain(403, NOT_USED, FOREIGN, self.spoken_to(request))
        visit = await self._visits.find(token)
        if visit is None:
            return await self._no_visit(request, token)
        language = visit.row.language
        asked = questionnaire_of(visit) if visit.active else None
        try:
            form = await read_form(request, self._max_form_bytes, asked.form_size if asked else (0, 0))
        except FormError as error:
            told = TOO_LONG if error.status == TOO_LARGE else UNREADABLE
            return self.plain(error.status, NOT_USED, told, language)
        step = visit.step
        on = RedirectResponse(visit.url, 303, NEVER_CACHED)
        if not visit.active or form.get("step", [""])[0] != step.id:
            return on
        overdue = self._visits.overdue(visit, GRACE_S)
        if overdue is not None:
            await time_is_up(self._visits, self._matches, visit, overdue)
        elif visit.round is not None:
            await self._round_form(visit, form, relayed=RELAYED in request.headers)
        elif "skip" in form and step.skippable:
            await self._visits.happened(visit, Skipped(step.id))
        else:
            return await self._answered(visit, form) or on
        return on

    async def _no_visit(self, request: Request, token: str) -> Response:
        if await self._visits.unserved(token):
            return self.plain(410, NOT_SERVED, ANSWERS_STAY, self.spoken_to(request))
        return self.plain(404, UNKNOWN, UNKNOWN_LINK, self.spoken_to(request))

    async def tell_broken(self, path: str) -> None:
        """Log which visit's page, at this path, could not be built: its number, never its link."""
        token = path.rpartition("/v/")[2].partition("/")[0]
        try:
            visit = await self._visits.find(token) if "/v/" in path else None
        except Exception:  # what broke the page may break this too
            return
        if visit is not None:
            LOG.error("the page of visit %d at step '%s' could not be built", visit.row.id, visit.step.id)

    async def _answered(self, visit: Visit, form: Mapping[str, list[str]]) -> Response | None:
        """The page again when something is missing or it is too early; None once the form is used."""
        questionnaire = questionnaire_of(visit)
        answers: Mapping[str, Any] | None = None
        problems: Mapping[str, str] = {}
        if questionnaire is not None:
            answers, problems = validate_answers(questionnaire, form, self._visits.say(visit.row.language))
        # A page that counts the seconds itself may be a little ahead of this clock.
        soon = self._visits.overdue(visit, -GRACE_S)
        if problems and "time_up" in form and soon is not None:
            await time_is_up(self._visits, self._matches, visit, soon)
            return None
        early = visit.wait_s(self._clock.ms()) > 1.0
        if problems or early:
            return self._step_page(visit, 422, form, problems, early=early)
        happening = visit.step.happening(form)
        if happening is not None:
            await self._visits.happened(visit, happening, answers, questionnaire)
        return None

    async def _round_form(self, visit: Visit, form: Mapping[str, list[str]], *, relayed: bool) -> None:
        if "skip" in form:
            try:
                await self._matches.skip(visit)
            except RoundBusy as busy:
                if relayed or not busy.address:
                    raise GalleyError(str(busy)) from None
                await hand_over(busy.address, visit.url, form)
        elif "leave" in form and visit.round_with_human is not None:
            await self._lobby.leave(visit)

    # ---- rendering -----------------------------------------------------------------------------------------

    def spoken_to(self, request: Request) -> str:
        """The language of a page that belongs to no study: of all that are offered here, the browser's."""
        offered = list(dict.fromkeys(code for study in self._studies.values() for code in study.languages))
        return choose_language(offered or [SOURCE], request.headers.get("accept-language"))

    def plain(self, status: int, title: str, message: str, language: str) -> Response:
        """A page that only says something, a marked message in a language."""
        say = self._visits.say(language)
        return self._page(
            "plain.html", status, title=say(title), message=say(message), status=status, language=language
        )

    def _not_begun(self, study: Study, why: NotBegun, params: Mapping[str, str]) -> Response:
        if why == "untested":
            return self.plain(403, NOT_USED, UNTESTED, study.language)
        status = 403 if why in ("uninvited", "incomplete") else 200
        return self._page("ending.html", status, **turned_away_context(study, why, params))

    def _step_page(
        self,
        visit: Visit,
        status: int = 200,
        values: Mapping[str, Sequence[str]] | None = None,
        problems: Mapping[str, str] | None = None,
        **more: Any,
    ) -> Response:
        context = common_context(visit, self._clock.ms()) | step_context(visit, values, problems) | more
        return self._page(f"{visit.step.kind}.html", status, **context)

    def _lobby_page(self, visit: Visit, step: RoundStep, meeting: Meeting) -> Response:
        context = common_context(visit, self._clock.ms()) | {
            "seconds_left": meeting.seconds_left,
            "waited_s": meeting.waited_s,
            "poll": f"{visit.url}/lobby",
            "human_hat": step.human_hat,
            "fallback": None if step.lobby is None else step.lobby.without_partner,
            "round_no": step.round_no,
            "of": step.of,
        }
        return self._page("lobby.html", **context)

    def _page(self, template: str, status_code: int = 200, /, **values: Any) -> Response:
        html = self._templates.get_template(template).render(**values)
        return HTMLResponse(html, status_code, NEVER_CACHED)


def _with_params(page: Callable[..., Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
    """A page that is given the parameters of its path by name."""

    async def endpoint(request: Request) -> Response:
        return await page(request, **request.path_params)

    return endpoint


def _query(request: Request) -> str:
    """The query as it came, with its question mark."""
    return f"?{request.url.query}" if request.url.query else ""


def _link_params(request: Request) -> dict[str, str]:
    """The parameters of a link, of bounded number and length."""
    return {
        name[:MAX_LINK_PARAM_CHARS]: value[:MAX_LINK_PARAM_CHARS].replace("\0", "")
        for name, value in list(request.query_params.items())[:MAX_LINK_PARAMS]
    }


def _language(study: Study, request: Request) -> str:
    """The language that a link asks for, else the one the browser likes best."""
    asked = request.query_params.get(LANGUAGE_PARAM, "")
    if asked in study.languages:
        return asked
    return choose_language(study.languages, request.headers.get("accept-language"))
