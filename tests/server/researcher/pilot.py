"""Visits as a pilot of a study would leave them in the records: played, half-way, left and flagged."""

from __future__ import annotations

import json
import random
from typing import Any

import numpy as np

from galley.agents.catalogue import Catalogue
from galley.kitchen import Kitchen, Layout
from galley.kitchen.layout_file import load_layouts
from galley.records import ClockRow, KeyRow, PauseRow, Store, TickRow, VisitRow
from galley.records.rows import Arrival, NewRound, Planned, SeatRow
from galley.study.stages.round_step import RoundStep
from galley.study.study import Study
from galley.study.visit.condition_slots import Issue, allocate
from galley.study.visit.plan import Plan, plan_visit, visit_seed
from galley.study.visit.steps import QuestionsStep, Step
from galley.study.written.questionnaire import Questionnaire
from galley.workspace import Workspace

STAGE_MS = 20_000


class Pilot:
    """Fills a store. `now_ms` is the server's clock of the next visit.

    With `agents` the games are theirs; without, they are quick and senseless.
    """

    def __init__(
        self,
        store: Store,
        workspace: Workspace,
        study: Study,
        now_ms: float,
        seed: int = 1,
        agents: Catalogue | None = None,
    ) -> None:
        self.store = store
        self.study = study
        self.layouts = load_layouts(workspace)
        self.catalogue = agents
        self.now_ms = now_ms
        self.draw = random.Random(seed)
        self.games: dict[tuple[str, str, int, int], list[tuple[int, int]]] = {}

    def begin(self, test: bool = False, **params: str) -> VisitRow:
        """A new visit in a slot of its own."""

        def plan(visit_no: int, slot: int | None) -> Planned:
            seed = visit_seed(self.study, visit_no)
            made = plan_visit(self.study, seed, visit_no, slot)
            return Planned(seed, made.to_json(), made.condition)

        def slots(known: Any) -> Any:
            found = allocate(known, self.now_ms, 3_600_000, None)
            assert isinstance(found, Issue)
            return found

        arrival = Arrival(self.study.name, self.study.sha256, self.now_ms, params, test=test)
        visit = self.store.begin_visit(arrival, plan, None if test else slots).result().visit
        assert visit is not None
        return visit

    def plan_steps(self) -> tuple[Step, ...]:
        """The steps of any visit, as far as they are the same for all."""
        return plan_visit(self.study, 1, 0).steps

    def walk(
        self,
        visit: VisitRow,
        stop_at: int | None = None,
        *,
        late: int = 0,
        text: str = "Fine.",
        hidden_s: float = 0,
        rtt_ms: float = 40.0,
        midway: int | None = None,
    ) -> None:
        """Take a visit to the step `stop_at` (or its end); `midway` ticks of a round there are played."""
        plan = Plan.from_json(visit.plan_json)
        at = self.now_ms
        for index, step in enumerate(plan.steps):
            self.store.enter_step(visit.id, step.id, at).result()
            if index == stop_at:
                if step.kind == "round" and midway is not None:
                    self.round(visit, step, at, late, rtt_ms, midway)
                return
            if hidden_s and index == 1:
                self.store.hidden(visit.id, step.id, at, at + 1000 * hidden_s).result()
                at += 1000 * hidden_s
            if step.kind == "round":
                at = self.round(visit, step, at, late, rtt_ms)
            at += STAGE_MS * self.draw.uniform(0.4, 2)
            if index == len(plan.steps) - 1:
                return
            last = index == len(plan.steps) - 2
            questions = self.questions(step)
            answers = {} if questions is None else self.answers(questions, text)
            self.store.save_answers(
                visit.id,
                step.id,
                answers,
                index + 1,
                "completed" if last else "active",
                at,
                completion_code="PILOT-1" if last else None,
                questionnaire=questions,
            ).result()

    def questions(self, step: Step) -> Questionnaire | None:
        return self.study.questionnaire_for(step) if isinstance(step, QuestionsStep) else None

    def answers(self, questions: Questionnaire, text: str) -> dict[str, Any]:
        def one(item: Any) -> Any:
            match item.kind:
                case "likert" | "comparison" | "semantic_differential":
                    return self.draw.randint(1, item.scale)
                case "single_choice":
                    return self.draw.choice(item.options).value
                case "multiple_choice":
                    return [item.options[0].value]
                case "number" | "slider":
                    return int(item.min or 0) + self.draw.randint(0, 9)
                case "ranking":
                    return [option.value for option in item.options]
                case _:
                    return text

        return {item.id: one(item) for item in questions.items}

    def round(
        self, visit: VisitRow, step: RoundStep, at: float, late: int, rtt_ms: float, ticks: int | None = None
    ) -> float:
        """Set up and play a round, to its end or for some ticks; gives when it was over."""
        layout = self.layouts[step.layout].with_rules(horizon_ticks=step.ticks)
        seat = step.human_seat
        person = SeatRow(seat, visit.id, step.id, hat=step.human_hat)
        agent = SeatRow(1 - seat, None, None, step.agent, "a" * 64, step.partner_hat)
        round_id = self.store.set_up_round(
            NewRound(
                step.round_no,
                layout.name,
                json.dumps(layout.to_dict()),
                layout.rules.horizon_ticks,
                step.tick_ms,
                step.seed,
                at,
                (person, agent) if seat == 0 else (agent, person),
            )
        ).result()
        actions = self.game(layout, step.agent, seat)[: ticks or step.ticks]
        kitchen = Kitchen(layout)
        rows = []
        for tick, (first, second) in enumerate(actions):
            kitchen.step(first, second)
            missed = self.draw.random() < late / len(actions)
            decision = None if missed else self.draw.uniform(2, 9)
            due = at + (tick + 1) * step.tick_ms
            rows.append(TickRow(tick, first, second, due, self.draw.uniform(0.1, 2), decision, missed))
        keys = [
            KeyRow(1, "up", True, 100.0, at + 150, 0, seat),
            KeyRow(2, "up", False, 180.0, at + 230, 1, seat),
        ]
        clocks = [
            ClockRow(1000.0 * n, at + 1000 * n, rtt_ms + self.draw.uniform(0, 9), seat) for n in range(5)
        ]
        pauses = [PauseRow(40, at + 6000, at + 9000, "left")] if late else []
        self.store.journal(round_id, rows, keys, pauses, clocks)
        over = at + len(actions) * step.tick_ms
        if ticks is None:
            end = (kitchen.score, int(kitchen.view.deliveries), over, kitchen.state.astype("<i2").tobytes())
            self.store.finish_round(round_id, "finished", *end).result()
        else:
            self.store.flush().result()
        return over

    def game(self, layout: Layout, agent: str, seat: int) -> list[tuple[int, int]]:
        """Joint actions of a planner with a wandering mind beside the agent, played once per pairing."""
        if self.catalogue is None:
            return [
                (self.draw.randint(0, 5), self.draw.randint(0, 5)) for _ in range(layout.rules.horizon_ticks)
            ]
        key = (layout.name, agent, seat, self.draw.randint(0, 1))
        if key not in self.games:
            chefs = [self.catalogue.bundle(name).make() for name in ("myopic", agent)]
            if seat == 1:
                chefs.reverse()
            kitchen, noise = Kitchen(layout), np.random.default_rng(key[3])
            for number, chef in enumerate(chefs):
                chef.reset(layout, number, 5 + key[3])
            played = []
            while not kitchen.done:
                before, tick = kitchen.state.copy(), kitchen.tick
                joint = [chef.act(before, tick) for chef in chefs]
                if noise.random() < 0.15:
                    joint[seat] = int(noise.integers(0, 6))
                kitchen.step(joint[0], joint[1])
                for chef in chefs:
                    chef.observe(before, (joint[0], joint[1]))
                played.append((joint[0], joint[1]))
            self.games[key] = played
        return self.games[key]
