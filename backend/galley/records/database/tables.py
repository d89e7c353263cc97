"""The tables of the records, each column with its meaning: database and data dictionary both come from here.

Times ending in `_ms` are milliseconds since 1970-01-01 UTC by the server's clock, unless the meaning says
otherwise. Seeds are decimal text: they may need more than the 63 bits that every database keeps as a number.
Actions: 0 north, 1 south, 2 east, 3 west, 4 stay, 5 interact.
"""

from __future__ import annotations

import json
from typing import Any, Final, Literal, get_args

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Float,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.engine import Dialect
from sqlalchemy.types import TypeEngine

from galley.outcomes import ROUND_STATUSES, VISIT_STATUSES

# Names given here, not by the database, so that a later migration can drop a constraint on any of them.
METADATA = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    }
)


class Json(TypeDecorator[Any]):
    """Plain JSON kept as text: a column declared JSON would make numbers of some texts in SQLite."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: Dialect) -> str:
        """The text that is stored."""
        return json.dumps(value)

    def process_result_value(self, value: str | None, dialect: Dialect) -> Any:
        """What the stored text says."""
        return None if value is None else json.loads(value)


# SQLite only numbers rows by itself when the key's type is exactly INTEGER.
_ROW_ID = BigInteger().with_variant(Integer, "sqlite")
_Type = TypeEngine[Any] | type[TypeEngine[Any]]
StudyState = Literal["open", "paused", "closed"]
STUDY_STATES: Final[tuple[StudyState, ...]] = get_args(StudyState)
SLOT_STATES = ("held", "completed")


def _of(name: str, kind: _Type, meaning: str, *more: Any, **settings: Any) -> Column[Any]:
    """A column that must be filled unless `nullable=True`, with its meaning as `.doc`."""
    settings.setdefault("nullable", False)
    return Column(name, kind, *more, doc=meaning, **settings)


def _of_round(**settings: Any) -> Column[Any]:
    return _of("round_id", _ROW_ID, "the round", ForeignKey("rounds.id", ondelete="CASCADE"), **settings)


STUDIES = Table(
    "studies",
    METADATA,
    _of("name", String(200), "name of the study file, without .yaml", primary_key=True),
    _of("visits_begun", Integer, "visit numbers given out so far"),
    _of("state", String(10), "whether it takes new visits: " + ", ".join(STUDY_STATES), default="open"),
    _of("state_ms", BigInteger, "when a researcher last changed that", nullable=True),
    info={"meaning": "one row per study that anybody has visited"},
)

VISITS = Table(
    "visits",
    METADATA,
    _of("id", _ROW_ID, "the visit, numbered by the server", primary_key=True, autoincrement=True),
    _of("token", String(64), "secret of the participant's link; never exported", unique=True),
    _of(
        "participant",
        String(32),
        "the participant's name in every export, made at random by the server",
        index=True,
    ),
    _of("study", String(200), "name of the study", ForeignKey("studies.name")),
    _of("study_sha256", String(64), "hash of the study file and every file it names, at the start"),
    _of("visit_no", Integer, "number of the visit within its study, from 0, in order of arrival"),
    _of("seed", String(64), "seed of everything drawn at random for this visit"),
    _of("plan_json", Text, "the steps of this visit with everything drawn for them, as JSON"),
    _of("condition", Json, "factor: level, for each factor that varies between participants"),
    _of("link_params", Json, "parameters of the participant's link, such as a recruiter's identifier"),
    _of("step_index", Integer, "position in the plan, from 0"),
    _of("status", String(20), "one of: " + ", ".join(VISIT_STATUSES)),
    _of("completion_code", String(200), "code shown at the end, once it was reached", nullable=True),
    _of("created_ms", BigInteger, "when the visit began"),
    _of("ended_ms", BigInteger, "when the visit stopped being active", nullable=True),
    _of("slot", Integer, "number of the slot it was given; empty if it took none", nullable=True),
    _of("test", Boolean, "made to try the study out: it takes no slot and counts nowhere", default=False),
    _of("language", String(20), "language that the pages were shown in", default="en"),
    _of("tries", Integer, "failed attempts at the quiz it is at", default=0),
    _of("consent_sha256", String(64), "hash of the exact text that was agreed to", nullable=True),
    _of("person", String(300), "who says the link that this is, to know a person again", nullable=True),
    _of("last_seen_ms", BigInteger, "last sign of life", default=0),
    UniqueConstraint("study", "visit_no"),
    Index("ix_visits_study_person", "study", "person"),
    info={"meaning": "one row per pass of a participant through a study"},
    sqlite_autoincrement=True,  # an id is never given out again, not even after its visit was erased
)

SLOTS = Table(
    "slots",
    METADATA,
    _of("study", String(200), "name of the study", ForeignKey("studies.name"), primary_key=True),
    _of("number", Integer, "number of the slot, from 0", primary_key=True, autoincrement=False),
    _of("cell", Json, "factor: level, the cell of the design that the slot belongs to"),
    _of("state", String(10), "one of: " + ", ".join(SLOT_STATES)),
    _of(
        "visit_id",
        _ROW_ID,
        "the visit that has it; empty once that was erased",
        ForeignKey("visits.id", ondelete="SET NULL"),
        nullable=True,
    ),
    _of("held_at_ms", BigInteger, "when it was given to that visit"),
    Index("ix_slots_visit_id", "visit_id"),
    info={"meaning": "one row per place in a study's design; places of people who leave are given out again"},
)

STAGES = Table(
    "stages",
    METADATA,
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), primary_key=True),
    _of("step_id", String(200), "step of the visit's plan", primary_key=True),
    _of("entered_ms", BigInteger, "when its page was first sent"),
    _of("left_ms", BigInteger, "when it was answered, continued from or ended", nullable=True),
    _of("views", Integer, "times its page was sent, reloads included"),
    info={"meaning": "one row per step that a visit came to"},
)

RESPONSES = Table(
    "responses",
    METADATA,
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), primary_key=True),
    _of("step_id", String(200), "step of the visit's plan", primary_key=True),
    _of("item", String(200), "item of the step's questionnaire", primary_key=True),
    _of("position", Integer, "place of the item on its page, from 1"),
    _of("value", Json, "the answer: a number, a text, an option, a list of options, or null if left open"),
    _of("shown", Json, "the item as it was shown: kind, text, options or scale; null if it is unknown"),
    _of("at_ms", BigInteger, "when the answer was stored"),
    _of("passed", Boolean, "answered as expected; empty unless the item is a check", nullable=True),
    info={"meaning": "one row per answered item"},
)

ATTEMPTS = Table(
    "attempts",
    METADATA,
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), primary_key=True),
    _of("step_id", String(200), "the quiz", primary_key=True),
    _of("attempt", Integer, "which failed attempt, from 1", primary_key=True, autoincrement=False),
    _of("answers", Json, "item: answer"),
    _of("wrong", Json, "the items that were not answered as expected"),
    _of("at_ms", BigInteger, "when it was sent"),
    info={"meaning": "one row per failed attempt at a quiz; the attempt that went on is in responses"},
)

ABSENCES = Table(
    "absences",
    METADATA,
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), primary_key=True),
    _of("started_ms", BigInteger, "when the page was hidden", primary_key=True, autoincrement=False),
    _of("ended_ms", BigInteger, "when it was shown again; empty while it is not", nullable=True),
    _of("step_id", String(200), "the step it happened at"),
    info={"meaning": "one row per time that a participant's page was hidden behind another tab or window"},
)

NOTES = Table(
    "notes",
    METADATA,
    _of("id", _ROW_ID, "the note, numbered by the server", primary_key=True, autoincrement=True),
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), index=True),
    _of("author", String(200), "name of the researcher"),
    _of("text", Text, "what the researcher wrote"),
    _of("at_ms", BigInteger, "when"),
    info={"meaning": "one row per note of a researcher about a visit"},
)

QUESTIONS = Table(
    "questions",
    METADATA,
    _of("study", String(200), "name of the study", ForeignKey("studies.name"), primary_key=True),
    _of("step_id", String(200), "the step; empty for a factor of the design", primary_key=True),
    _of(
        "item",
        String(200),
        "the item, or the factor, or subscale.NAME; empty for a round",
        primary_key=True,
    ),
    _of("place", Integer, "place of the step in the first plan that came to it"),
    _of("position", Integer, "place of the item on its page, from 1; 1000 for a subscale"),
    info={
        "meaning": "one row per column of the wide export: what anybody was asked, whose answers or not, so "
        "that erasing a person leaves the columns of all others as they are"
    },
)

ROUNDS = Table(
    "rounds",
    METADATA,
    _of("id", _ROW_ID, "the round, numbered by the server", primary_key=True, autoincrement=True),
    _of("study", String(200), "name of the study", ForeignKey("studies.name"), index=True),
    _of("round_no", Integer, "number of the round within the visit, from 1; 0 is the tutorial"),
    _of("layout", String(200), "name of the layout"),
    _of("layout_json", Text, "the layout in full, rules included, as JSON: enough to replay the round"),
    _of("horizon_ticks", Integer, "ticks of a whole round"),
    _of("tick_ms", Integer, "length of a tick in milliseconds"),
    _of("seed", String(64), "seed of the round; its agents draw from it"),
    _of("status", String(20), "one of: " + ", ".join(ROUND_STATUSES)),
    _of("score", Integer, "score at the end", nullable=True),
    _of("deliveries", Integer, "soups delivered that paid", nullable=True),
    _of("final_sha256", String(64), "hash of the last state (its int16 row, little-endian)", nullable=True),
    _of("created_ms", BigInteger, "when the round was set up"),
    _of("ended_ms", BigInteger, "when the round ended", nullable=True),
    _of("episodes", Integer, "episodes, one after the other, each from the start", default=1),
    _of("played_ticks", Integer, "ticks played, counted at its end", nullable=True),
    _of("late_ticks", Integer, "of these, the agent did not answer in time", nullable=True),
    _of("fault_ticks", Integer, "of these, the agent's decision could not be used", nullable=True),
    info={"meaning": "one row per round"},
    sqlite_autoincrement=True,
)

LEASES = Table(
    "leases",
    METADATA,
    _of_round(primary_key=True),
    _of("owner", String(64), "the serving process that plays the round; empty if none", nullable=True),
    _of("number", Integer, "grows each time the round changes hands; only the last may write"),
    _of("expires_ms", BigInteger, "until when it is the owner's, by the database's clock"),
    _of("address", String(300), "where other serving processes reach the owner, host:port", nullable=True),
    info={"meaning": "one row per round: which of several serving processes it belongs to"},
)

SEATS = Table(
    "seats",
    METADATA,
    _of_round(primary_key=True),
    _of("seat", SmallInteger, "which chef: 0 or 1", primary_key=True, autoincrement=False),
    _of("visit_id", _ROW_ID, "the visit that plays here; empty for an agent or if erased", nullable=True),
    _of("step_id", String(200), "the step of that visit's plan; empty as above", nullable=True),
    _of("agent", String(200), "name of the agent that plays here; empty for a person", nullable=True),
    _of("agent_sha256", String(64), "hash of the agent's bundle; empty for a person", nullable=True),
    _of("hat", String(40), "colour of the hat; empty for a chef that was not seen", nullable=True),
    _of("rtt_median_ms", Float, "median round-trip time, counted at the round's end", nullable=True),
    ForeignKeyConstraint(["visit_id"], ["visits.id"], ondelete="CASCADE"),
    UniqueConstraint("visit_id", "step_id"),
    info={"meaning": "two rows per round: who sat where"},
)

WAITING = Table(
    "waiting",
    METADATA,
    _of("visit_id", _ROW_ID, "the visit", ForeignKey("visits.id", ondelete="CASCADE"), primary_key=True),
    _of("step_id", String(200), "the round it waits for"),
    _of("step_index", Integer, "position of that round in its plan, from 0"),
    _of("pairing", Text, "two visits may play together when this is the same"),
    _of("since_ms", BigInteger, "since when it waits, by the database's clock"),
    _of("asked_ms", BigInteger, "when its page asked last, by the database's clock"),
    info={"meaning": "one row per visit that waits for another person to play with"},
)

STAND_INS = Table(
    "stand_ins",
    METADATA,
    _of_round(primary_key=True),
    _of("seat", SmallInteger, "seat of the person who left", primary_key=True, autoincrement=False),
    _of("tick", Integer, "first tick that the agent played"),
    _of("agent", String(200), "name of the agent"),
    _of("agent_sha256", String(64), "hash of the agent's bundle"),
    _of("at_ms", BigInteger, "when it took over"),
    info={"meaning": "one row per agent that took the seat of a person who left a round for two"},
)

# Clustered by key in SQLite: one tree to write to, and a round's ticks lie side by side to be read.
TICKS = Table(
    "ticks",
    METADATA,
    _of_round(primary_key=True),
    _of("tick", Integer, "number of the joint action, from 0", primary_key=True, autoincrement=False),
    _of("action_0", SmallInteger, "action of seat 0"),
    _of("action_1", SmallInteger, "action of seat 1"),
    _of("deadline_ms", Float, "when the tick was due"),
    _of("lateness_ms", Float, "the new state was handed to the socket this long after the deadline"),
    _of("decision_ms", Float, "how long the agent took; empty if it did not answer in time", nullable=True),
    _of("late", Boolean, "the agent did not answer in time, so its action is stay"),
    _of(
        "fault",
        String(40),
        "why the agent's decision could not be used and its action is stay",
        nullable=True,
    ),
    info={"meaning": "one row per tick: with the layout this is the whole round"},
    sqlite_with_rowid=False,
)

KEYS = Table(
    "keys",
    METADATA,
    _of_round(primary_key=True),
    _of("seat", SmallInteger, "seat of the person", primary_key=True, autoincrement=False),
    _of("arrival_ms", Float, "when the server received it", primary_key=True),
    _of("seq", Integer, "number of the message within its page load", primary_key=True, autoincrement=False),
    _of("key", String(20), "up, down, left, right, interact, or release when all keys were let go"),
    _of("down", Boolean, "pressed (true) or let go (false)"),
    _of("client_ms", Float, "when it happened, by the browser's clock (milliseconds since the page loaded)"),
    _of("tick_applied", Integer, "first tick that it could act on; empty if there was none", nullable=True),
    info={"meaning": "one row per key event"},
    sqlite_with_rowid=False,
)

PAUSES = Table(
    "pauses",
    METADATA,
    _of_round(primary_key=True),
    _of("started_ms", Float, "when the kitchen stopped", primary_key=True),
    _of("ended_ms", Float, "when it went on; empty while it stands still or if it never did", nullable=True),
    _of("tick", Integer, "the tick that had to wait"),
    _of("reason", String(40), "why"),
    info={"meaning": "one row per pause of a round"},
    sqlite_with_rowid=False,
)

CLOCKS = Table(
    "clocks",
    METADATA,
    _of_round(primary_key=True),
    _of("seat", SmallInteger, "seat of the person", primary_key=True, autoincrement=False),
    _of("server_ms", Float, "when the ping arrived, by the server's clock", primary_key=True),
    _of("client_ms", Float, "when the ping was sent, by the browser's clock"),
    _of("rtt_ms", Float, "round-trip time that the browser measured with its last ping", nullable=True),
    info={"meaning": "one row per ping: relates the browser's clock to the server's"},
    sqlite_with_rowid=False,
)

RESEARCHERS = Table(
    "researchers",
    METADATA,
    _of("id", _ROW_ID, "the researcher, numbered by the server", primary_key=True, autoincrement=True),
    _of("name", String(200), "name to log in with", unique=True),
    _of("password_hash", String(300), "salted hash of the password"),
    _of("created_ms", BigInteger, "when the account was made"),
    info={"meaning": "one row per researcher who may log in"},
    sqlite_autoincrement=True,
)

SESSIONS = Table(
    "sessions",
    METADATA,
    _of("token_sha256", String(64), "hash of the secret in the researcher's cookie", primary_key=True),
    _of(
        "researcher_id",
        _ROW_ID,
        "the researcher",
        ForeignKey("researchers.id", ondelete="CASCADE"),
        index=True,
    ),
    _of("csrf", String(64), "secret that each of the session's forms carries"),
    _of("created_ms", BigInteger, "when the researcher logged in"),
    _of("expires_ms", BigInteger, "when the session ends by itself"),
    info={"meaning": "one row per researcher's login"},
)

TEST_LINKS = Table(
    "test_links",
    METADATA,
    _of("token", String(64), "secret of the link", primary_key=True),
    _of("study", String(200), "name of the study", ForeignKey("studies.name"), index=True),
    _of("cell", Integer, "which cell of the design, from 0; empty for any", nullable=True),
    _of("author", String(200), "name of the researcher"),
    _of("created_ms", BigInteger, "when it was made"),
    _of("expires_ms", BigInteger, "until when it is good"),
    info={
        "meaning": "one row per link with which researchers walk a study that runs, without counting in it"
    },
)

ERASURES = Table(
    "erasures",
    METADATA,
    _of("name_sha256", String(64), "hash of the erased participant's name", primary_key=True),
    _of("visits", Integer, "visits that were erased"),
    _of("rounds", Integer, "rounds that were erased"),
    info={"meaning": "one row per erasure of which something may still be in the database's files"},
)
