"""The tables of the records, each column with its meaning: database and data dictionary both come from here.

Times ending in `_ms` are milliseconds since 1970-01-01 UTC by the server's clock, unless the meaning says
otherwise. Seeds are decimal text: they may need more than the 63 bits that every database keeps as a number.
Actions: 0 north, 1 south, 2 east, 3 west, 4 stay, 5 interact.
"""

from __future__ import annotations

import json
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    Float,
    ForeignKey,
    ForeignKeyConstraint,
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
VISIT_STATUSES = ("active", "completed", "declined", "abandoned")
ROUND_STATUSES = ("open", "finished", "abandoned", "skipped")


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
    UniqueConstraint("study", "visit_no"),
    info={"meaning": "one row per pass of a participant through a study"},
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
    info={"meaning": "one row per answered item"},
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
    info={"meaning": "one row per round"},
)

SEATS = Table(
    "seats",
    METADATA,
    _of_round(primary_key=True),
    _of("seat", SmallInteger, "which chef: 0 or 1", primary_key=True, autoincrement=False),
    _of("visit_id", _ROW_ID, "the visit that plays here; empty for an agent", nullable=True),
    _of("step_id", String(200), "the step of that visit's plan; empty for an agent", nullable=True),
    _of("agent", String(200), "name of the agent that plays here; empty for a person", nullable=True),
    _of("agent_sha256", String(64), "hash of the agent's bundle; empty for a person", nullable=True),
    _of("hat", String(40), "colour of the hat", nullable=True),
    ForeignKeyConstraint(["visit_id"], ["visits.id"], ondelete="CASCADE"),
    UniqueConstraint("visit_id", "step_id"),
    info={"meaning": "two rows per round: who sat where"},
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
