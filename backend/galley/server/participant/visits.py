"""Participants on their way through a study: begun, found again, moved on, kept to their time."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal
from weakref import WeakValueDictionary

from galley.outcomes import TurnedAway
from galley.records import Arrival, Planned, Store, VisitRow
from galley.records.store import queries
from galley.records.store.links_for_tests import LinkForTests, LinksForTests
from galley.records.store.visit_state import Attempt, visit_state
from galley.server.clock import Clock
from galley.study.stages.round_step import RoundStep
from galley.study.study import Study
from galley.study.visit.condition_slots import (
    Full,
    Issue,
    Slot,
    allocate,
    capacity,
    cell_number,
    cells,
    slot_in_cell,
)
from galley.study.visit.gone import Has, gone
from galley.study.visit.happenings import Agreed, Ended, Happening, TimedOut
from galley.study.visit.plan import Plan, plan_visit, visit_seed
from galley.study.visit.progress import Progress, Refusal, next_progress, position
from galley.study.visit.steps import Step, TextStep
from galley.study.written.questionnaire import Questionnaire
from galley.study.written.recruitment import INVITATION_PARAM, is_placeholder
from galley.translations import Catalogues, Translator

GRACE_S: Final = 5.0
"""How much later than its limit a form still counts: it was on its way."""

TEST_PARAM: Final = "galley-test"
"""The parameter of a test link; a name that no recruiter's link has."""

NotBegun = TurnedAway | Literal["untested"]
LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Visit:
    """A visit as stored, with the study it belongs to in its language.

    `answers` are all so far by step and item; `entered_ms` is when the page of its step was first sent, None
    before; `attempt` is the last failed try at the quiz that it is at.
    """

    row: VisitRow
    study: Study
    plan: Plan
    progress: Progress
    answers: Mapping[str, Mapping[str, Any]]
    entered_ms: float | None
    attempt: Attempt | None

    @property
    def step(self) -> Step:
        """The step the participant is at."""
        return self.plan.steps[self.progress.step_index]

    @property
    def round(self) -> RoundStep | None:
        """The round the participant is at; None at any other step."""
        return self.step if isinstance(self.step, RoundStep) else None

    @property
    def round_with_human(self) -> RoundStep | None:
        """The round that the participant is to play with another one; None if they are at none."""
        step = self.round
        return step if self.active and step is not None and step.partner == "human" else None

    @property
    def agreed_to(self) -> str | None:
        """The hash of the text that the page of the step shows."""
        text = self.step.text if isinstance(self.step, TextStep) else None
        return None if text is None else self.study.texts[text].sha256

    @property
    def url(self) -> str:
        """The path of the participant's page."""
        return f"/v/{self.row.token}"

    @property
    def active(self) -> bool:
        """Whether it goes on."""
        return self.progress.status == "active"

    @property
    def position(self) -> tuple[int, int]:
        """(place, number) of its step among those it meets."""
        return position(self.plan, self.progress, self.answers)

    def spent_s(self, now_ms: float) -> float:
        """How long it has been at its step."""
        return 0.0 if self.entered_ms is None else max(0.0, (now_ms - self.entered_ms) / 1000.0)

    def seconds_left(self, now_ms: float) -> float | None:
        """What is left of the step's time; None without a limit."""
        limit = self.step.time_limit_s
        return None if limit is None else limit - self.spent_s(now_ms)

    def visit_seconds_left(self, now_ms: float) -> float | None:
        """What is left of the visit's time; None without a limit."""
        limit = self.study.config.visit_limit_min
        return None if limit is None else limit * 60.0 - (now_ms - self.row.created_ms) / 1000.0

    def wait_s(self, now_ms: float) -> float:
        """How long the participant has to stay at the step; 0 once they may go on."""
        return max(0.0, self.step.at_least_s - self.spent_s(now_ms))


class Visits:
    """All visits to the studies that are served. Every answer is stored before its method returns.

    With `preview` every new visit is a test: it takes no slot and counts nowhere.
    """

    def __init__(
        self,
        store: Store,
        studies: Mapping[str, Study],
        clock: Clock,
        catalogues: Catalogues,
        has: Has,
        *,
        preview: bool = False,
    ) -> None:
        self._store = store
        self._studies = studies
        self._clock = clock
        self._catalogues = catalogues
        self._has = has
        self._preview = preview
        self._locks: WeakValueDictionary[int, asyncio.Lock] = WeakValueDictionary()

    # ---- beginning -----------------------------------------------------------------------------------------

    def person(self, study: Study, params: Mapping[str, str]) -> str | None:
        """Who a link's parameters say that this is; None when they do not say."""
        if study.invitations is not None:
            code = params.get(INVITATION_PARAM, "")
            return f"code:{code}" if code in study.invitations else None
        name = study.config.recruitment.participant
        told = study.kept(params).get(name, "") if name is not None else ""
        return None if not told.strip() or is_placeholder(told, name or "") else told

    async def _turned_away(self, study: Study, params: Mapping[str, str]) -> TurnedAway | None:
        """What is wrong with a link that lets nobody in; of a study that takes nobody, that it does not."""
        if self.person(study, params) is not None:
            return None
        if study.invitations is not None:
            return "uninvited"
        asked = study.config.recruitment
        if asked.participant is None or not asked.required:
            return None
        state = await asyncio.wrap_future(self._store.study_state(study.name))
        if state != "open":
            return state
        LOG.warning(
            "%s: turned somebody away whose link has no id as %s but %r; check the link at the recruiter",
            study.name,
            asked.participant,
            study.kept(params).get(asked.participant, ""),
        )
        return "incomplete"

    async def test_link(
        self, study: Study, params: Mapping[str, str]
    ) -> LinkForTests | Literal["bad"] | None:
        """The test link that parameters name; `bad` if it is not good any more; None if they name none."""
        token = params.get(TEST_PARAM)
        if token is None:
            return None
        links = LinksForTests(self._store)
        return await asyncio.wrap_future(links.find(study.name, token, self._clock.ms())) or "bad"

    async def closed(self, study: Study, params: Mapping[str, str]) -> NotBegun | None:
        """Why somebody with such a link cannot begin, as far as is known before they try; None if they can.

        Who has a visit already is never sent away: beginning leads back to it. Test links always let in.
        """
        if self._preview:
            return None
        link = await self.test_link(study, params)
        if link is not None:
            return "untested" if link == "bad" else None
        wrong = await self._turned_away(study, params)
        if wrong is not None:
            return wrong
        arrival = self._arrival(study, params, study.language, test=False)
        return await asyncio.wrap_future(self._store.room_for(arrival, self._allocate(study)))

    async def begin(self, study: Study, params: Mapping[str, str], language: str) -> Visit | NotBegun:
        """A visit at its first step, or the one that this person has already, or why there is none."""
        link = await self.test_link(study, params)
        if link == "bad":
            return "untested"
        test = self._preview or link is not None
        wrong = None if test else await self._turned_away(study, params)
        if wrong is not None:
            return wrong
        spoken = study.in_language(language)
        say = self.say(spoken.language)
        design = cells(study.config)

        def plan(visit_no: int, slot: int | None) -> Planned:
            if slot is None and link is not None and link.cell is not None:
                slot = slot_in_cell(study, link.cell, visit_no)
            seed = visit_seed(study, visit_no)
            made = plan_visit(spoken, seed, visit_no, slot, say)
            return Planned(seed, made.to_json(), made.condition, design[cell_number(study, made.slot)])

        arrival = self._arrival(study, params, spoken.language, test=test)
        begun = await asyncio.wrap_future(self._store.begin_visit(arrival, plan, self._allocate(study)))
        if begun.why != "new" and begun.why != "again":
            return begun.why
        found = None if begun.visit is None else await self.find(begun.visit.token)
        if found is None:
            raise RuntimeError(f"a visit to {study.name} vanished as it began")
        return found

    def _arrival(self, study: Study, params: Mapping[str, str], language: str, *, test: bool) -> Arrival:
        return Arrival(
            study.name,
            study.sha256,
            self._clock.ms(),
            study.kept(params),
            language,
            self.person(study, params),
            once=study.invitations is not None or study.config.recruitment.once,
            test=test,
        )

    def _allocate(self, study: Study) -> Callable[[Sequence[Slot]], Issue | Full]:
        """Which slot somebody who arrives now would get."""
        now_ms, expires_ms = self._clock.ms(), study.config.slot_expires_min * 60_000.0
        return lambda slots: allocate(slots, now_ms, expires_ms, capacity(study))

    # ---- on the way ----------------------------------------------------------------------------------------

    def say(self, language: str) -> Translator:
        """Speaks a visit's language."""
        return self._catalogues.translator(language)

    async def find(self, token: str) -> Visit | None:
        """The visit behind a link; None when there is none or its study is not served.

        A visit whose step needs a file that is gone ends here, as interrupted.
        """
        visit = await self._stored(token)
        missing = () if visit is None or not visit.active else gone(visit.study, visit.step, self._has)
        if visit is None or not missing or await self._goes_on(visit, missing):
            return visit
        LOG.error(
            "visit %d of study %s ended as interrupted at step '%s', which needs what is gone: %s",
            visit.row.id,
            visit.row.study,
            visit.step.id,
            ", ".join(missing),
        )
        await self.happened(visit, Ended(visit.step.id, "interrupted"))
        return await self._stored(token)

    async def unserved(self, token: str) -> bool:
        """Whether a link is that of a visit whose study is not served any more."""
        found = await asyncio.wrap_future(self._store.read(lambda connection: visit_state(connection, token)))
        return found is not None and found.visit.study not in self._studies

    async def _goes_on(self, visit: Visit, missing: Sequence[str]) -> bool:
        """Whether the round that a visit is at has begun and all who play it are there."""
        at_step = visit.row.id, visit.step.id
        row = await asyncio.wrap_future(
            self._store.read(lambda connection: queries.round_of(connection, *at_step))
        )
        if row is None:
            return False
        seated = {f"agent {seat.agent}" for seat in row.seats if seat.agent is not None}
        return seated.isdisjoint(missing)

    async def _stored(self, token: str) -> Visit | None:
        """The visit behind a link as its records say."""
        found = await asyncio.wrap_future(self._store.read(lambda connection: visit_state(connection, token)))
        study = None if found is None else self._studies.get(found.visit.study)
        if found is None or study is None:
            return None
        row = found.visit
        plan = Plan.from_json(row.plan_json)
        here = plan.steps[row.step_index].id
        attempt = found.attempt if found.attempt is not None and found.attempt.step_id == here else None
        return Visit(
            row,
            study.in_language(row.language).met_by(plan.condition),
            plan,
            Progress(row.step_index, row.status, row.tries),
            found.answers,
            found.entered_ms.get(here),
            attempt,
        )

    async def entered(self, visit: Visit) -> None:
        """Note that the page of the visit's step is sent."""
        await asyncio.wrap_future(self._store.enter_step(visit.row.id, visit.step.id, self._clock.ms()))

    async def hidden(self, visit: Visit, *, hidden: bool) -> None:
        """Note that the page of the visit's step was hidden, or is seen again."""
        now_ms = self._clock.ms()
        if hidden:
            await asyncio.wrap_future(self._store.left_page(visit.row.id, visit.step.id, now_ms))
        else:
            await asyncio.wrap_future(self._store.back_on_page(visit.row.id, now_ms))

    def overdue(self, visit: Visit, grace_s: float = 0.0) -> Happening | None:
        """What the passing of time does to a visit, or did `grace_s` ago; None while no limit has passed."""
        if not visit.active:
            return None
        now_ms = self._clock.ms() - grace_s * 1000.0
        whole_s = visit.visit_seconds_left(now_ms)
        if whole_s is not None and whole_s <= 0:
            return Ended(visit.step.id, "timed_out")
        left_s = visit.seconds_left(now_ms)
        return TimedOut(visit.step.id) if left_s is not None and left_s <= 0 else None

    async def happened(
        self,
        visit: Visit,
        happening: Happening,
        answers: Mapping[str, Any] | None = None,
        questionnaire: Questionnaire | None = None,
    ) -> bool:
        """Whether the visit changed by this; what came twice, late or early changes nothing."""
        lock = self._locks.setdefault(visit.row.id, asyncio.Lock())
        async with lock:
            now = await self._stored(visit.row.token)
            if now is None:
                return False
            if now.attempt is not None and answers is not None and now.attempt.answers == answers:
                return False  # the same form again is no new try
            given = dict(now.answers) if answers is None else {**now.answers, now.step.id: answers}
            following = next_progress(now.plan, now.progress, happening, given)
            if isinstance(following, Refusal):
                return False
            at_ms = self._clock.ms()
            if following.status == "active" and following.step_index == now.progress.step_index:
                return await asyncio.wrap_future(
                    self._store.save_attempt(
                        now.row.id, now.step.id, following.tries, answers or {}, at_ms, questionnaire
                    )
                )
            code = None
            if following.status != "active":
                code = now.study.ending(following.status, now.row.link_params).code
            return await asyncio.wrap_future(
                self._store.save_answers(
                    now.row.id,
                    now.step.id,
                    answers or {},
                    following.step_index,
                    following.status,
                    at_ms,
                    completion_code=code,
                    questionnaire=questionnaire,
                    consent_sha256=now.agreed_to if isinstance(happening, Agreed) else None,
                )
            )
