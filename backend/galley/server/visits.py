"""Participants on their way through a study: begun, found again, moved on."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from weakref import WeakValueDictionary

from galley.records import Store, VisitRow
from galley.server.clock import Clock
from galley.study.plan import Plan, Step, plan_visit, visit_seed
from galley.study.progress import Happening, Progress, Refusal, next_progress
from galley.study.questionnaire import Questionnaire
from galley.study.study import Study


@dataclass(frozen=True, slots=True)
class Visit:
    """A visit as stored, with the study it belongs to."""

    row: VisitRow
    study: Study
    plan: Plan
    progress: Progress

    @property
    def step(self) -> Step:
        """The step the participant is at."""
        return self.plan.steps[self.progress.step_index]

    @property
    def url(self) -> str:
        """The path of the participant's page."""
        return f"/v/{self.row.token}"


class Visits:
    """All visits to the studies that are served. Every answer is stored before its method returns."""

    def __init__(self, store: Store, studies: Mapping[str, Study], clock: Clock) -> None:
        self._store = store
        self._studies = studies
        self._clock = clock
        self._locks: WeakValueDictionary[int, asyncio.Lock] = WeakValueDictionary()

    async def begin(self, study: Study, link_params: Mapping[str, str]) -> Visit:
        """A new visit, at its first step."""
        number = await asyncio.wrap_future(self._store.next_visit_no(study.name))
        seed = visit_seed(study, number)
        plan = plan_visit(study, seed, number)
        row = await asyncio.wrap_future(
            self._store.create_visit(
                study.name,
                study.sha256,
                seed,
                number,
                plan.to_json(),
                plan.condition,
                link_params,
                self._clock.ms(),
            )
        )
        return Visit(row, study, plan, Progress())

    async def find(self, token: str) -> Visit | None:
        """The visit behind a link; None when there is none or its study is not served."""
        row = await asyncio.wrap_future(self._store.visit(token))
        study = None if row is None else self._studies.get(row.study)
        if row is None or study is None:
            return None
        return Visit(row, study, Plan.from_json(row.plan_json), Progress(row.step_index, row.status))  # type: ignore[arg-type]

    async def entered(self, visit: Visit) -> None:
        """Note that the page of the visit's step is sent."""
        await asyncio.wrap_future(self._store.enter_step(visit.row.id, visit.step.id, self._clock.ms()))

    async def happened(
        self,
        visit: Visit,
        happening: Happening,
        answers: Mapping[str, Any] | None = None,
        questionnaire: Questionnaire | None = None,
    ) -> bool:
        """Whether the visit moved on by this; what came twice, late or early changes nothing."""
        lock = self._locks.setdefault(visit.row.id, asyncio.Lock())
        async with lock:
            now = await self.find(visit.row.token)
            if now is None:
                return False
            following = next_progress(now.plan, now.progress, happening)
            if isinstance(following, Refusal):
                return False
            code = None
            if following.status == "completed":
                code = now.plan.steps[following.step_index].data.get("completion_code")
            return await asyncio.wrap_future(
                self._store.save_answers(
                    now.row.id,
                    now.step.id,
                    answers or {},
                    following.step_index,
                    following.status,
                    self._clock.ms(),
                    completion_code=code,
                    questionnaire=questionnaire,
                )
            )
