"""The participant's pages: every step of a visit as HTML, and the forms that move it on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import jinja2
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse, Response

from galley.records import Store
from galley.server.forms import FormError, read_form
from galley.server.matches import Matches
from galley.server.origin import same_origin
from galley.server.templates import templates as templates
from galley.server.visits import Visit, Visits
from galley.study.plan import Step
from galley.study.progress import Agreed, Continued, Declined, Happening, Submitted
from galley.study.questionnaire import Questionnaire, validate_answers
from galley.study.study import Study

MAX_LINK_PARAMS = 20
MAX_LINK_PARAM_CHARS = 200
NEVER_CACHED = {"cache-control": "no-store"}

UNKNOWN_LINK = (
    "This link is not known here. Please check that it is complete, "
    "or begin again from the link you were sent."
)
DECLINED = "You chose not to take part. Nothing more is recorded, and you may close this page."
NO_PAGE = "There is no page at this address. Please check that the link is complete."
FOREIGN = "This form was sent from another site, so it was not used."


class Pages:
    """Answers every HTTP request but those for static files."""

    def __init__(
        self,
        studies: Mapping[str, Study],
        visits: Visits,
        matches: Matches,
        store: Store,
        templates: jinja2.Environment,
        max_form_bytes: int,
    ) -> None:
        self._studies = studies
        self._visits = visits
        self._matches = matches
        self._store = store
        self._templates = templates
        self._max_form_bytes = max_form_bytes

    def router(self) -> APIRouter:
        """The routes of all pages."""
        router = APIRouter()
        shown: dict[str, Any] = {"response_class": HTMLResponse, "response_model": None}
        router.add_api_route("/", self.home, methods=["GET", "HEAD"], **shown)
        router.add_api_route("/healthz", self.health, methods=["GET", "HEAD"], response_model=None)
        router.add_api_route("/s/{study}", self.landing, methods=["GET", "HEAD"], **shown)
        router.add_api_route("/s/{study}/begin", self.begin, methods=["POST"], **shown)
        router.add_api_route("/v/{token}", self.visit, methods=["GET", "HEAD"], **shown)
        router.add_api_route("/v/{token}", self.submit, methods=["POST"], **shown)
        return router

    # ---- before a visit ------------------------------------------------------------------------------------

    async def home(self, request: Request) -> Response:
        """The study when there is one, else a list."""
        if len(self._studies) == 1:
            return RedirectResponse(f"/s/{next(iter(self._studies))}", 303)
        return self._page("studies.html", studies=[_public_study(study) for study in self._studies.values()])

    async def health(self) -> Response:
        """Whether what happens reaches the database."""
        health = self._store.health()
        state = {"ok": health.ok, "rounds": len(self._matches), "rows_waiting": health.waiting_rows}
        return JSONResponse(state, 200 if health.ok else 503, NEVER_CACHED)

    async def landing(self, request: Request, study: str) -> Response:
        """What the study is and how long it takes, with a button to begin."""
        found = self._studies.get(study)
        if found is None:
            return self.plain(404, "Not found", NO_PAGE)
        query = f"?{request.url.query}" if request.url.query else ""
        return self._page(
            "landing.html",
            study=_public_study(found),
            minutes=found.minutes,
            action=f"/s/{study}/begin{query}",
        )

    async def begin(self, request: Request, study: str) -> Response:
        """A new visit; the answer leads to its page."""
        found = self._studies.get(study)
        if found is None:
            return self.plain(404, "Not found", NO_PAGE)
        if not same_origin(request.headers):
            return self.plain(403, "Not used", FOREIGN)
        params = {
            name[:MAX_LINK_PARAM_CHARS]: value[:MAX_LINK_PARAM_CHARS].replace("\0", "")
            for name, value in list(request.query_params.items())[:MAX_LINK_PARAMS]
        }
        visit = await self._visits.begin(found, params)
        return RedirectResponse(visit.url, 303, NEVER_CACHED)

    # ---- a visit -------------------------------------------------------------------------------------------

    async def visit(self, token: str) -> Response:
        """The page of the step that the visit is at."""
        visit = await self._visits.find(token)
        if visit is None:
            return self.plain(404, "Unknown link", UNKNOWN_LINK)
        if visit.progress.status == "declined":
            return self.plain(200, "Thank you", DECLINED)
        await self._visits.entered(visit)
        return self._step_page(visit)

    async def submit(self, request: Request, token: str) -> Response:
        """Move on by what the step's form says; a form of another step changes nothing."""
        if not same_origin(request.headers):
            return self.plain(403, "Not used", FOREIGN)
        visit = await self._visits.find(token)
        if visit is None:
            return self.plain(404, "Unknown link", UNKNOWN_LINK)
        try:
            form = await read_form(request, self._max_form_bytes)
        except FormError as error:
            return self.plain(error.status, "Not used", f"This form could not be read: {error}.")
        step = visit.step
        on = RedirectResponse(visit.url, 303, NEVER_CACHED)
        if visit.progress.status != "active" or form.get("step", [""])[0] != step.id:
            return on
        if step.kind == "round":
            if "skip" in form:
                await self._matches.skip(visit)
            return on
        questionnaire = _questionnaire(visit)
        answers: Mapping[str, Any] = {}
        if questionnaire is not None:
            answers, problems = validate_answers(questionnaire, form)
            if problems:
                return self._step_page(visit, 422, form, problems)
        happening = _happening(step, form)
        if happening is not None:
            await self._visits.happened(visit, happening, answers, questionnaire)
        return on

    # ---- rendering -----------------------------------------------------------------------------------------

    def plain(self, status: int, title: str, message: str) -> Response:
        """A page that only says something."""
        return self._page("plain.html", status, title=title, message=message, status=status)

    def _step_page(
        self,
        visit: Visit,
        status: int = 200,
        values: Mapping[str, Sequence[str]] | None = None,
        problems: Mapping[str, str] | None = None,
    ) -> Response:
        step = visit.step
        data = step.data
        more: dict[str, Any] = {}
        if step.kind in ("consent", "instructions", "debrief"):
            more["html"] = visit.study.texts[data["text"]].html
        if step.kind in ("questionnaire", "comparison"):
            more |= {
                "questionnaire": _questionnaire(visit),
                "values": values or {},
                "problems": problems or {},
            }
        if step.kind == "comparison":
            more |= {name: {"hat": data[name]["hat"]} for name in ("first", "second")}
            more["human_hat"] = data["human_hat"]
        if step.kind == "debrief":
            more |= {"completion_code": data["completion_code"], "redirect": data["redirect"]}
        if step.kind == "round":
            more |= {
                "socket": f"{visit.url}/play",
                "next": visit.url,
                "minutes": data["ticks"] * data["tick_ms"] / 60_000,
                **{
                    name: data[name]
                    for name in ("round_no", "of", "goal", "human_hat", "partner_hat", "tutorial")
                },
                "skippable": data["skippable"],
            }
        return self._page(
            f"{step.kind}.html",
            status,
            step=_public_step(step),
            study=_public_study(visit.study),
            progress={"at": visit.progress.step_index + 1, "of": len(visit.plan.steps)},
            action=visit.url,
            **more,
        )

    def _page(self, template: str, status_code: int = 200, /, **values: Any) -> Response:
        html = self._templates.get_template(template).render(**values)
        return HTMLResponse(html, status_code, NEVER_CACHED)


def _public_study(study: Study) -> dict[str, Any]:
    """What templates may know of a study: no agents, no design."""
    return {"name": study.name, "title": study.title, "about": study.about, "minutes": study.minutes}


def _public_step(step: Step) -> dict[str, Any]:
    """What templates may know of a step: no agents, no seeds."""
    about = {name: step.data.get(name) for name in ("round_no", "partner_hat", "human_hat")}
    return {"id": step.id, "kind": step.kind, "title": step.title, **about}


def _questionnaire(visit: Visit) -> Questionnaire | None:
    name = visit.step.data.get("questionnaire")
    return None if name is None else visit.study.questionnaires[name]


def _happening(step: Step, form: Mapping[str, list[str]]) -> Happening | None:
    """What a form without problems means for the visit; None when it says nothing."""
    if step.kind == "consent":
        choice = form.get("choice", [""])[0]
        if choice == "decline":
            return Declined(step.id)
        return Agreed(step.id) if choice == "agree" else None
    if step.kind == "instructions":
        return Continued(step.id)
    return Submitted(step.id) if step.kind in ("questionnaire", "comparison") else None
