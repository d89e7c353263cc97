"""A live round: its phases and its clock. Runs on the event loop and never waits there."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Iterable
from typing import Any

from galley.kitchen import STAY
from galley.outcomes import RoundOutcome
from galley.protocol import messages
from galley.protocol.codec import MessageError, encode
from galley.protocol.scene import Scene
from galley.records import LeaseLost, PauseRow
from galley.records.store.absences import MOST_ABSENCES
from galley.server.clock import Clock, Deadlines, Timer
from galley.server.rounds.match_host import MatchHost
from galley.server.rounds.minds import Mind, Question
from galley.server.rounds.person import Connection, Person
from galley.server.rounds.round_journal import Played, RoundJournal, SentAt
from galley.server.rounds.round_kitchen import RoundKitchen
from galley.server.rounds.round_messages import round_end, round_keyframe, round_tick
from galley.server.rounds.round_spec import RoundSpec

LOG = logging.getLogger(__name__)
LEFT = "left"
RESTART = "restart"
PARTNER = "partner"


class Match:
    """One round from its first connection to its end, for one person with an agent or for two people.

    Phases: waiting -> countdown -> playing -> ended, the middle two once for each episode. The countdown
    begins when everybody is ready. Somebody lost in countdown or play pauses the round; when they are ready
    again it goes on with a countdown. A pause that lasts too long ends the round as abandoned, or, when the
    other person is still there, does what the study says of drop-outs. Tick k is due at `deadline(k)`. Each
    start, and each going on after a pause, fixes the deadlines of all ticks left, at the phase of the tick
    that this match was given (`stagger` in [0, 1)), so that matches do not tick in step.
    """

    def __init__(
        self,
        spec: RoundSpec,
        round_kitchen: RoundKitchen,
        players: tuple[Person | Mind, Person | Mind],
        journal: RoundJournal,
        clock: Clock,
        host: MatchHost,
        *,
        stagger: float,
    ) -> None:
        self.spec = spec
        self.round_kitchen = round_kitchen
        self.scene = Scene(round_kitchen.layout)
        self.players = list(players)
        self.phase = "waiting"
        self.outcome: RoundOutcome | None = None
        self.left: tuple[Person, ...] = ()
        self.journal = journal
        self._clock = clock
        self._host = host
        self._loop = asyncio.get_running_loop()
        self._deadlines = Deadlines(spec.tick_ms / 1000.0, stagger)
        self._timer = Timer()
        self._absence = Timer()
        self._give_up_at_s = 0.0
        self._pause: PauseRow | None = None
        self._ending: asyncio.Task[None] | None = None
        self._replacing: asyncio.Task[None] | None = None
        if round_kitchen.between:
            round_kitchen.next_episode()
        self.state = round_kitchen.kitchen.state.copy()
        self._questions: dict[int, Question] = {}
        if round_kitchen.over:
            self.end("finished")
            return
        self._ask(None)
        if round_kitchen.ticks > 0:
            self._stand_still(RESTART)
        else:
            self._await()

    @property
    def people(self) -> list[Person]:
        """The participants who still belong to the round."""
        return [player for player in self.players if isinstance(player, Person)]

    @property
    def under_way(self) -> bool:
        """Whether the round is played: it ticks, or counts down to go on after its first tick."""
        return self.phase == "playing" or (self.phase == "countdown" and self.round_kitchen.ticks > 0)

    # ---- what the browsers do ------------------------------------------------------------------------------

    def join(self, person: Person, connection: Connection) -> None:
        """Take a connection that has said hello: the newest wins, an older one is told and closed."""
        older = person.connection
        if older is not None:
            if older.tab != connection.tab:
                older.send(encode({"type": "elsewhere"}))
            older.close(messages.CLOSE_REPLACED)
            self.leave(older)
        person.connection = connection
        if self.phase == "waiting":
            self._await()
        self.show(person)

    def leave(self, connection: Connection, reason: str = LEFT) -> None:
        """Lose a connection; nothing happens when another has taken its place."""
        person = next((one for one in self.people if one.connection is connection), None)
        if person is None:
            return
        person.connection = None
        was_ready, person.ready = person.ready, False
        self._in_sight(person)
        if self.under_way:
            self._stand_still(reason)
        elif self.phase in ("waiting", "countdown"):
            self._timer.cancel()
            if self.phase == "countdown":
                self.phase = "waiting"
                for other in self.people:
                    other.ready = False
                    self.show(other)
            self._await()
        elif self.phase == "paused" and was_ready:
            self._wait_for(self.spec.abandon_after_s)

    def show(self, person: Person) -> None:
        """Send a person the whole picture and what belongs to the phase."""
        if not person.here:
            return
        person.send(round_keyframe(self, person))
        if self.phase == "paused" and self._pause is not None:
            left_s = max(0, math.ceil(self._give_up_at_s - self._loop.time()))
            reason = PARTNER if person.ready else self._pause.reason
            person.send({"type": "paused", "reason": reason, "seconds_left": left_s})
        elif self._ending is not None and self._ending.done():
            person.send(round_end(self, person))

    def ready(self, person: Person) -> None:
        """Begin the countdown once all are ready.

        Raises:
            MessageError: it does not wait for that.
        """
        if self.phase not in ("waiting", "paused"):
            raise MessageError(f"the round is not waiting for ready: it is {self.phase}")
        if person.ready:
            raise MessageError("the round is waiting for the other participant")
        person.ready = True
        if all(one.ready for one in self.people):
            self._count_down()
        elif self.phase == "waiting":
            self._await()
        else:
            self.show(person)

    def key(self, person: Person, message: messages.Key, arrival_s: float) -> None:
        """A key went down or up.

        Raises:
            MessageError: nothing is being played.
        """
        if self.phase not in ("countdown", "playing"):
            raise MessageError(f"no key counts now: the round is {self.phase}")
        self._in_sight(person)
        if message.down:
            person.keys.press(message.key)
        else:
            person.keys.let_go(message.key)
        self.journal.key(message, arrival_s, self.round_kitchen.ticks, person.seat)

    def release(self, person: Person, message: messages.Release, arrival_s: float) -> None:
        """All keys were let go; outside of play there is none to let go of."""
        if message.reason == "shown":
            self._in_sight(person)
        if self.phase in ("countdown", "playing"):
            if message.reason == "hidden" and person.hidden_ms is None and person.absences < MOST_ABSENCES:
                person.absences += 1
                person.hidden_ms = self._clock.ms(arrival_s)
                self._host.hidden(self, person, person.hidden_ms, None)
            person.keys.let_go_all()
            self.journal.key(message, arrival_s, self.round_kitchen.ticks, person.seat)

    def ping(self, person: Person, message: messages.Ping, arrival_s: float) -> None:
        """Answer a ping and note it."""
        server_ms = self._clock.ms(arrival_s)
        person.send({"type": "pong", "client_ms": message.client_ms, "server_ms": server_ms})
        if self.phase != "ended":
            self.journal.ping(message, arrival_s, person.seat)

    def _in_sight(self, person: Person) -> None:
        if person.hidden_ms is not None:
            self._host.hidden(self, person, person.hidden_ms, self._clock.ms())
            person.hidden_ms = None

    # ---- the clock -----------------------------------------------------------------------------------------

    def deadline(self, tick: int) -> float:
        """When a tick of the round is due while playing, in seconds of the event loop's clock."""
        return self._deadlines.of(tick)

    def _count_down(self) -> None:
        self._absence.cancel()
        for person in self.people:
            person.keys.clear()
        self.phase = "countdown"
        self._show_all()
        self._count(self.spec.countdown_s)

    def _count(self, seconds: int) -> None:
        if seconds > 0:
            self._send_all({"type": "countdown", "seconds": seconds})
            self._timer.set(self._loop.time() + 1.0, self._count, seconds - 1)
            return
        for person in self.people:
            person.keys.forget_waiting()
        self.phase = "playing"
        # The first tick is due a whole tick from now at the earliest, so that keys can reach it.
        self._deadlines.begin(self._loop.time(), self.round_kitchen.ticks)
        if self._pause is not None:
            self.journal.goes_on(self._pause)
            self._pause = None
        self._show_all()
        self._timer.set(self.deadline(self.round_kitchen.ticks), self._tick)

    def _tick(self) -> None:
        if self.journal.lost:
            self.lose()
            return
        round_kitchen = self.round_kitchen
        tick = round_kitchen.ticks
        deadline_s = self.deadline(tick)
        people = self.people
        actions = [STAY, STAY]
        for person in people:
            actions[person.seat] = person.keys.take()
        decision_ms, fault = None, None
        late = False
        for seat, question in self._questions.items():
            answer = question.answer
            late = answer is None
            if answer is None:
                actions[seat] = question.late_action
            else:
                decision_ms, fault = answer.decision_ms, answer.fault
                if answer.action is not None:
                    actions[seat] = answer.action
        joint = (actions[0], actions[1])
        before = self.state
        round_kitchen.step(*joint)
        self.state = round_kitchen.kitchen.state.copy()
        text = encode(round_tick(self, before))
        sent_at = SentAt()
        for person in people:
            if person.connection is not None:
                person.connection.send(text, sent_at)
        played = Played(tick, joint, deadline_s, self._loop.time(), sent_at, decision_ms, late, fault)
        self.journal.played(played)
        if not round_kitchen.kitchen.done:
            self._ask((before, joint))
            self._timer.set(self.deadline(tick + 1), self._tick)
        elif round_kitchen.over:
            self.end("finished")
        else:
            self._next_episode()

    def _next_episode(self) -> None:
        self.round_kitchen.next_episode()
        self.state = self.round_kitchen.kitchen.state.copy()
        for seat, player in enumerate(self.players):
            if not isinstance(player, Person):
                player.restart(
                    self.round_kitchen.layout, seat, self.spec.seeds[self.round_kitchen.episode - 1]
                )
        self._ask(None)
        self.phase = "countdown"
        self._show_all()
        self._count(self.spec.countdown_s)

    def _ask(self, seen: Any) -> None:
        self._questions = {
            seat: player.ask(self.round_kitchen.kitchen.tick, self.state, seen)
            for seat, player in enumerate(self.players)
            if not isinstance(player, Person)
        }

    # ---- waiting for people --------------------------------------------------------------------------------

    def _stand_still(self, reason: str) -> None:
        self._timer.cancel()
        self.journal.write()
        self.phase = "paused"
        for person in self.people:
            person.keys.clear()
            if reason == RESTART:
                person.ready = False
        if self._pause is None:
            self._pause = self.journal.pause(self.round_kitchen.ticks, reason)
        self._wait_for(self.spec.abandon_after_s)
        self._show_all()

    def _await(self) -> None:
        """Before the first tick: wait so long for the other when one is ready, or for anybody to come."""
        someone_ready = any(person.ready for person in self.people)
        if someone_ready and self._absence.runs and all(person.here for person in self.people):
            return
        self._absence.cancel()
        if someone_ready or not any(person.here for person in self.people):
            self._wait_for(self.spec.abandon_after_s)

    def _wait_for(self, seconds: float) -> None:
        self._give_up_at_s = self._loop.time() + seconds
        self._absence.set(self._give_up_at_s, self._give_up)

    def _give_up(self) -> None:
        if self.journal.lost:
            self.lose()
        elif self.phase == "paused" or any(person.ready for person in self.people):
            self._without([person for person in self.people if not person.ready])
        elif self.phase == "waiting" and not any(person.here for person in self.people):
            self._host.forget(self)

    def drop_out(self, person: Person) -> None:
        """Go on without a person, who left for good."""
        if self.phase == "ended" or person not in self.people:
            return
        person.ready = False
        if self.under_way:
            self._stand_still(LEFT)
        self._cancel_both()
        self._without([person], asked=True)

    def _without(self, absent: Iterable[Person], *, asked: bool = False) -> None:
        """Go on without those who did not come back, as the study says; the end when nobody is left."""
        absent = tuple(absent)
        there = [one for one in self.people if one not in absent and (one.ready or asked)]
        if not there:
            self.end("abandoned")
        elif self.spec.stand_in is None:
            self.left = absent
            self.end("abandoned")
        elif self._replacing is None:
            self._replacing = self._loop.create_task(self._replace(absent[0], self.spec.stand_in))

    async def _replace(self, person: Person, agent: str) -> None:
        """An agent takes the seat of a person, who leaves the round."""
        try:
            mind = await self._host.stand_in(self, person, agent)
        except Exception:  # whatever keeps the agent from coming, the other person must not wait for ever
            LOG.exception("round %d goes on with nobody", self.spec.round_id)
            self.left = (person,)
            self.end("abandoned")
            return
        finally:
            self._replacing = None
        if self.phase == "ended":
            return
        person.close(messages.CLOSE_ENDED)
        self.players[person.seat] = mind
        self._ask(None)
        if all(one.ready and one.here for one in self.people):
            self._count_down()
        elif self.phase == "paused":
            self._wait_for(self.spec.abandon_after_s)
            self._show_all()
        else:
            self.phase = "waiting"
            self._await()
            self._show_all()

    # ---- the end -------------------------------------------------------------------------------------------

    def end(self, outcome: RoundOutcome) -> None:
        """End the round, if it has not ended yet; `ended` tells when that is stored."""
        if self.phase == "ended":
            return
        self._cancel_both()
        for person in self.people:
            self._in_sight(person)
        self.phase = "ended"
        self.outcome = outcome
        self._ending = self._loop.create_task(self._close(outcome))

    async def ended(self) -> None:
        """Return when a round that is over is stored; at once when it is not over."""
        if self._ending is not None:
            await asyncio.wait([self._ending])

    async def _close(self, outcome: RoundOutcome) -> None:
        # A little later, so that the last tick has reached the socket and its lateness is known.
        await asyncio.sleep(0.01)
        self.journal.write()
        try:
            await self._host.finish(self, outcome)
        except LeaseLost:
            self.lose()
            return
        except Exception:  # the round is in the journal; opening the page again tries to close it again
            LOG.exception("round %d could not be closed", self.spec.round_id)
            for person in self.people:
                person.close(messages.CLOSE_ENDED)
            return
        for person in self.people:
            person.send(round_end(self, person))

    def lose(self) -> None:
        """Stop: another process has the round now, and this one's people with it."""
        self._cancel_both()
        self.phase = "ended"
        alone = len(self.people) == 1
        for person in self.people:
            if alone:
                person.send({"type": "elsewhere"})
            person.close(messages.CLOSE_REPLACED if alone else messages.CLOSE_BUSY)
        self._host.forget(self)

    def stop(self) -> None:
        """Stop for a shutdown: what was played is journalled, a round in play is left paused."""
        if self.under_way:
            self._stand_still(RESTART)
        self._cancel_both()

    def stop_minds(self) -> None:
        """Let the agents go: nothing more is asked of them."""
        for player in self.players:
            if not isinstance(player, Person):
                player.stop()

    # ---- small parts ---------------------------------------------------------------------------------------

    def _send_all(self, message: messages.Outgoing) -> None:
        for person in self.people:
            person.send(message)

    def _show_all(self) -> None:
        for person in self.people:
            self.show(person)

    def _cancel_both(self) -> None:
        self._timer.cancel()
        self._absence.cancel()
