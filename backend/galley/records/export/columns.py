"""The columns of every exported file with their meaning, for the export and its data dictionary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal

from sqlalchemy import Column

from galley.kitchen.events import EVENTS, PLACES
from galley.records.database.tables import (
    ABSENCES,
    ATTEMPTS,
    CLOCKS,
    KEYS,
    NOTES,
    PAUSES,
    RESPONSES,
    ROUNDS,
    STAGES,
    TICKS,
    VISITS,
)
from galley.records.reading.flags import FLAGS

Kind = Literal["text", "whole number", "number", "true/false", "time", "JSON"]


@dataclass(frozen=True)
class Field:
    """One column of an exported file."""

    name: str
    kind: Kind
    meaning: str


@dataclass(frozen=True)
class Sheet:
    """One exported file: a row per something, in a fixed order."""

    name: str
    about: str
    order: str
    fields: tuple[Field, ...]
    patterns: tuple[Field, ...] = ()
    """Further columns, as many as the study has steps and items."""

    @property
    def file(self) -> str:
        """Name of the file in a CSV export's folder."""
        return f"{self.name}.csv"


def _as_in(column: Column[Any], kind: Kind, name: str = "") -> Field:
    """A column of a table handed through, with the meaning it has there."""
    return Field(name or column.name, kind, str(column.doc))


_WHO: Final = (
    _as_in(VISITS.c.participant, "text"),
    _as_in(VISITS.c.visit_no, "whole number"),
)
_CONDITION: Final = _as_in(VISITS.c.condition, "JSON")
_ROUND: Final = (
    Field("round_id", "whole number", str(ROUNDS.c.id.doc)),
    _as_in(ROUNDS.c.round_no, "whole number"),
)
_STEP: Final = (
    Field("step_index", "whole number", "place of the step in the visit's plan, from 0"),
    Field("step", "text", "the step of the visit's plan"),
)
_ABOUT: Final = (
    Field("round_no", "whole number", "the round that was asked about; empty if none was"),
    Field("layout", "text", "the layout of that round"),
    Field("agent", "text", "the agent of that round"),
    Field("partner_hat", "text", "colour of that agent's hat"),
)
_DYAD: Final = Field(
    "dyad",
    "text",
    "the two people of the round, by the numbers of their visits, lower first; empty with an agent",
)
_BONUS: Final = (
    Field("bonus", "number", "what was earned: the bonus of every goal reached; empty if there was none"),
    Field("bonus_unit", "text", "the unit of that"),
)


def _chef(name: str) -> Iterator[Field]:
    yield Field(f"{name}_ingredients", "whole number", f"ingredients that the {name} took from dispensers")
    yield Field(f"{name}_dishes", "whole number", f"dishes that the {name} took from dispensers")
    yield Field(f"{name}_served", "whole number", f"soups that the {name} delivered")
    yield Field(f"{name}_blocked", "whole number", f"moves that left the {name} in its cell")


_FLAGS: Final = "; ".join(f"{kind}: {meaning}" for kind, meaning in FLAGS.items())

PARTICIPANTS: Final = Sheet(
    "participants",
    "One row per visit.",
    "visit_no",
    (
        *_WHO,
        _as_in(VISITS.c.study, "text"),
        _as_in(VISITS.c.study_sha256, "text"),
        _CONDITION,
        _as_in(VISITS.c.slot, "whole number"),
        _as_in(VISITS.c.test, "true/false"),
        _as_in(VISITS.c.language, "text"),
        _as_in(VISITS.c.consent_sha256, "text"),
        _as_in(VISITS.c.seed, "text"),
        _as_in(VISITS.c.status, "text"),
        Field("flags", "text", "what stands out, separated by ' | ': " + _FLAGS),
        Field("step_index", "whole number", "how far the visit came: place of its present step, from 0"),
        Field("step", "text", "how far the visit came: its present step"),
        Field("steps", "whole number", "steps of the visit's whole plan"),
        _as_in(VISITS.c.completion_code, "text"),
        Field("hats", "JSON", "agent: hat colour, for the partners of this visit"),
        _as_in(VISITS.c.link_params, "JSON"),
        Field("begun_utc", "time", str(VISITS.c.created_ms.doc)),
        Field("ended_utc", "time", str(VISITS.c.ended_ms.doc)),
        Field("last_seen_utc", "time", str(VISITS.c.last_seen_ms.doc)),
        Field("duration_s", "number", "seconds from begin to end; none if the clock was set back"),
        Field("hidden_s", "number", "seconds that the page was hidden behind another tab or window"),
        Field("rounds_finished", "whole number", "rounds played to their end, tutorials left out"),
        Field("rounds_abandoned", "whole number", "rounds left before their end, tutorials left out"),
        *_BONUS,
    ),
)

STAGES_SHEET: Final = Sheet(
    "stages",
    "One row per step that a visit came to, with the time spent there.",
    "visit_no, step_index",
    (
        *_WHO,
        *_STEP,
        Field(
            "kind",
            "text",
            "consent, questionnaire, quiz, instructions, round, break, comparison, debrief, ...",
        ),
        Field("title", "text", "title of its page"),
        Field("entered_utc", "time", str(STAGES.c.entered_ms.doc)),
        Field("left_utc", "time", str(STAGES.c.left_ms.doc)),
        Field("duration_s", "number", "seconds from entering to leaving; none if the clock was set back"),
        _as_in(STAGES.c.views, "whole number"),
    ),
)

MEASURES: Final = (
    *_chef("human"),
    *_chef("partner"),
    Field("concurrent_ticks", "whole number", "ticks in which neither action was stay"),
    Field("stuck_ticks", "whole number", "ticks before which both chefs stood and faced as they did before"),
    Field("delivery_ticks", "JSON", "for each soup that paid, the ticks played when it was delivered"),
    Field("performance", "number", "how early the order list was served, from 0 to 1; empty without a list"),
)

ROUNDS_SHEET: Final = Sheet(
    "rounds",
    "One row per person and round, with its outcome and the measures of coordination; a round for two people "
    "has a row for each of them, from their side, with one round_id and dyad.",
    "visit_no, round_id",
    (
        *_WHO,
        _CONDITION,
        *_ROUND,
        *_STEP,
        Field("tutorial", "true/false", "a round for practice"),
        _as_in(ROUNDS.c.layout, "text"),
        Field("layout_sha256", "text", "hash of the layout in full, rules included"),
        Field("agent", "text", "name of the agent that was the partner; empty for a person"),
        Field("agent_sha256", "text", "hash of the agent's bundle; empty for a person"),
        Field(
            "partner_participant",
            "text",
            "the other participant of a round for two, who has a row of their own for it; empty if erased",
        ),
        Field("stand_in", "text", "name of the agent that took the seat of a person who left"),
        Field("stand_in_seat", "whole number", "that seat"),
        Field("stand_in_tick", "whole number", "first tick that it played"),
        Field("human_seat", "whole number", "seat of the participant"),
        Field("human_hat", "text", "colour of the participant's hat"),
        Field("partner_hat", "text", "colour of the partner's hat, as this participant saw it"),
        _as_in(ROUNDS.c.seed, "text"),
        _as_in(ROUNDS.c.horizon_ticks, "whole number"),
        _as_in(ROUNDS.c.episodes, "whole number"),
        _as_in(ROUNDS.c.tick_ms, "whole number"),
        _as_in(ROUNDS.c.status, "text"),
        Field("ticks", "whole number", "ticks played"),
        _as_in(ROUNDS.c.score, "whole number"),
        _as_in(ROUNDS.c.deliveries, "whole number"),
        Field("goal", "whole number", "score that earned the bonus; empty if there was none"),
        Field("goal_reached", "true/false", "score is at least the goal; empty without a goal or a score"),
        Field("started_utc", "time", "when the first tick was due"),
        Field("ended_utc", "time", str(ROUNDS.c.ended_ms.doc)),
        Field("pauses", "whole number", "times the kitchen stood still"),
        Field("paused_s", "number", "seconds it stood still, pauses without an end left out"),
        Field("late_ticks", "whole number", "ticks at which the agent did not answer in time"),
        Field("fault_ticks", "whole number", "ticks at which the agent's decision could not be used"),
        Field("lateness_median_ms", "number", "median of the ticks' lateness_ms"),
        Field("lateness_p99_ms", "number", "99th percentile of the ticks' lateness_ms"),
        Field("lateness_max_ms", "number", "largest of the ticks' lateness_ms"),
        Field("decision_p99_ms", "number", "99th percentile of the ticks' decision_ms"),
        Field("rtt_median_ms", "number", "median of the round-trip times measured by the browser"),
        Field(
            "replays",
            "true/false",
            "the stored actions replay to the stored end; if not, the measures are empty",
        ),
        *MEASURES,
        _DYAD,
        *_BONUS,
    ),
)

TICKS_SHEET: Final = Sheet(
    "ticks",
    "One row per tick; of a round for two people under the visit with the lower seat.",
    "visit_no, round_id, tick",
    (
        _WHO[0],
        *_ROUND,
        _as_in(TICKS.c.tick, "whole number"),
        Field("action_0", "text", "action of seat 0: north, south, east, west, stay or interact"),
        Field("action_1", "text", "action of seat 1"),
        Field("human_action", "text", "action of the participant"),
        Field("partner_action", "text", "action of the partner"),
        Field("reward", "whole number", "reward of the tick; empty if the round does not replay"),
        Field("score", "whole number", "score after the tick; empty if the round does not replay"),
        Field("deadline_utc", "time", str(TICKS.c.deadline_ms.doc)),
        _as_in(TICKS.c.lateness_ms, "number"),
        _as_in(TICKS.c.decision_ms, "number"),
        _as_in(TICKS.c.late, "true/false"),
        _as_in(TICKS.c.fault, "text"),
    ),
)

KEYS_SHEET: Final = Sheet(
    "keys",
    "One row per key event of a participant.",
    "visit_no, round_id, arrival, seq",
    (
        _WHO[0],
        *_ROUND,
        _as_in(KEYS.c.seat, "whole number"),
        _as_in(KEYS.c.seq, "whole number"),
        _as_in(KEYS.c.key, "text"),
        _as_in(KEYS.c.down, "true/false"),
        _as_in(KEYS.c.client_ms, "number"),
        Field("arrival_utc", "time", str(KEYS.c.arrival_ms.doc)),
        _as_in(KEYS.c.tick_applied, "whole number"),
    ),
)

PAUSES_SHEET: Final = Sheet(
    "pauses",
    "One row per pause of a round.",
    "visit_no, round_id, started",
    (
        _WHO[0],
        *_ROUND,
        _as_in(PAUSES.c.tick, "whole number"),
        Field("started_utc", "time", str(PAUSES.c.started_ms.doc)),
        Field("ended_utc", "time", str(PAUSES.c.ended_ms.doc)),
        _as_in(PAUSES.c.reason, "text"),
    ),
)

CLOCKS_SHEET: Final = Sheet(
    "clocks",
    "One row per ping: a moment by the browser's clock and by the server's.",
    "visit_no, round_id, server time",
    (
        _WHO[0],
        *_ROUND,
        _as_in(CLOCKS.c.seat, "whole number"),
        _as_in(CLOCKS.c.client_ms, "number"),
        Field("server_utc", "time", str(CLOCKS.c.server_ms.doc)),
        _as_in(CLOCKS.c.rtt_ms, "number"),
    ),
)

RESPONSES_SHEET: Final = Sheet(
    "responses",
    "One row per item of a submitted questionnaire, those left blank included.",
    "visit_no, step_index, position",
    (
        *_WHO,
        _CONDITION,
        *_STEP,
        Field("questionnaire", "text", "name of the questionnaire"),
        _as_in(RESPONSES.c.position, "whole number"),
        _as_in(RESPONSES.c.item, "text"),
        Field("kind", "text", "kind of the item: likert, single_choice, number, long_text, comparison, ..."),
        Field("text", "text", "the question as it was shown"),
        Field("scale", "whole number", "how many points the scale has"),
        Field("start", "whole number", "the number of its first point"),
        Field("low_label", "text", "label of the first point"),
        Field("high_label", "text", "label of the last point"),
        Field("value", "text", "the answer; several options are separated by ' | '; empty if left blank"),
        Field("label", "text", "the chosen option, or several, in the words that were shown"),
        _as_in(RESPONSES.c.passed, "true/false"),
        Field("answered_utc", "time", str(RESPONSES.c.at_ms.doc)),
        *_ABOUT,
        Field("first_agent", "text", "comparison: the agent at the low end of the scale"),
        Field("first_hat", "text", "comparison: colour of its hat"),
        Field("second_agent", "text", "comparison: the agent at the high end of the scale"),
        Field("second_hat", "text", "comparison: colour of its hat"),
        Field(
            "preference",
            "number",
            "comparison: points from the scale's middle; negative: the first agent, positive: the second",
        ),
        Field("preferred_agent", "text", "comparison: the agent preferred; empty at the middle"),
        Field("subscale", "text", "the subscale that the answer counts in; empty if it counts in none"),
        Field(
            "subscale_value",
            "number",
            "what the answer counts there: its value, turned round where the item is reversed",
        ),
        _DYAD,
    ),
)

SUBSCALES_SHEET: Final = Sheet(
    "subscales",
    "One row per subscale of a submitted questionnaire; of NASA-TLX, workload is the Raw TLX.",
    "visit_no, step_index, first item",
    (
        *_WHO,
        _CONDITION,
        *_STEP,
        Field("questionnaire", "text", "name of the questionnaire"),
        Field("subscale", "text", "name of the subscale"),
        Field("items", "whole number", "items of the subscale"),
        Field("answered", "whole number", "those of them that were answered"),
        Field("mean", "number", "mean of the items' subscale_value; empty unless all of them were answered"),
        *_ABOUT,
        _DYAD,
    ),
)

EVENTS_SHEET: Final = Sheet(
    "events",
    "One row per named happening in a kitchen, from replaying the rounds.",
    "visit_no, round_id, tick, seat 0 before seat 1 before pots",
    (
        _WHO[0],
        *_ROUND,
        Field("tick", "whole number", "the tick it happened in, as in ticks.csv"),
        Field("seat", "whole number", "seat of the chef; empty for a pot's own"),
        Field("by", "text", "human or partner; empty for a pot's own"),
        Field("kind", "text", "; ".join(f"{kind}: {meaning}" for kind, meaning in EVENTS.items())),
        Field("thing", "text", "what was taken, put or delivered"),
        Field("place", "text", "where: " + ", ".join(PLACES)),
        Field("x", "whole number", "column of the tile, from 0 in the west"),
        Field("y", "whole number", "row of the tile, from 0 in the north"),
        Field("reward", "whole number", "reward it brought"),
    ),
)

ATTEMPTS_SHEET: Final = Sheet(
    "attempts",
    "One row per failed attempt at a quiz.",
    "visit_no, step_index, attempt",
    (
        *_WHO,
        *_STEP,
        _as_in(ATTEMPTS.c.attempt, "whole number"),
        _as_in(ATTEMPTS.c.answers, "JSON"),
        _as_in(ATTEMPTS.c.wrong, "JSON"),
        Field("sent_utc", "time", str(ATTEMPTS.c.at_ms.doc)),
    ),
)

ABSENCES_SHEET: Final = Sheet(
    "absences",
    "One row per time that a participant's page was hidden.",
    "visit_no, started",
    (
        *_WHO,
        *_STEP,
        Field("started_utc", "time", str(ABSENCES.c.started_ms.doc)),
        Field("ended_utc", "time", str(ABSENCES.c.ended_ms.doc)),
        Field("duration_s", "number", "seconds in between; none if the clock was set back"),
    ),
)

NOTES_SHEET: Final = Sheet(
    "notes",
    "One row per note of a researcher.",
    "visit_no, time",
    (
        *_WHO,
        _as_in(NOTES.c.author, "text"),
        _as_in(NOTES.c.text, "text"),
        Field("written_utc", "time", str(NOTES.c.at_ms.doc)),
    ),
)

ROUND_COLUMNS: Final = (
    Field("layout", "text", str(ROUNDS.c.layout.doc)),
    Field("agent", "text", "name of the agent that was the partner; empty for a person"),
    Field("status", "text", str(ROUNDS.c.status.doc)),
    Field("score", "whole number", str(ROUNDS.c.score.doc)),
    Field("deliveries", "whole number", str(ROUNDS.c.deliveries.doc)),
    _DYAD,
    _BONUS[0],
)

WIDE: Final = Sheet(
    "wide",
    "One row per visit with all its answers and rounds side by side.",
    "visit_no",
    (
        *_WHO,
        _as_in(VISITS.c.status, "text"),
        _as_in(VISITS.c.language, "text"),
        Field("duration_s", "number", "seconds from begin to end; none if the clock was set back"),
    ),
    (
        Field("condition.FACTOR", "text", "level of a factor that varies between participants"),
        Field("STEP.ITEM", "text", "the answer to an item; several options are separated by ' | '"),
        *(Field(f"STEP.{field.name}", field.kind, f"round: {field.meaning}") for field in ROUND_COLUMNS),
        Field("STEP.subscale.NAME", "number", "mean of a subscale, as in subscales.csv"),
    ),
)

SHEETS: Final = (
    PARTICIPANTS,
    WIDE,
    STAGES_SHEET,
    RESPONSES_SHEET,
    ROUNDS_SHEET,
    TICKS_SHEET,
    EVENTS_SHEET,
    KEYS_SHEET,
    PAUSES_SHEET,
    CLOCKS_SHEET,
    ATTEMPTS_SHEET,
    ABSENCES_SHEET,
    NOTES_SHEET,
    SUBSCALES_SHEET,
)
