"""What a lab needs: slots, leases, study states, notes, absences, researchers, rounds for two."""

import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Add them, and count for what is there already what is counted from now on."""
    sqlite = op.get_bind().dialect.name == "sqlite"
    # A rebuilt table numbers its rows so that no id is given out twice; PostgreSQL does so anyway.
    rebuilt: dict[str, Any] = (
        {"recreate": "always", "table_kwargs": {"sqlite_autoincrement": True}} if sqlite else {}
    )
    with op.batch_alter_table("studies") as studies:
        studies.add_column(sa.Column("state", sa.String(10), nullable=False, server_default="open"))
        studies.add_column(sa.Column("state_ms", sa.BigInteger(), nullable=True))
    with op.batch_alter_table("visits", **rebuilt) as visits:
        visits.add_column(sa.Column("slot", sa.Integer(), nullable=True))
        visits.add_column(sa.Column("test", sa.Boolean(), nullable=False, server_default=sa.false()))
        visits.add_column(sa.Column("language", sa.String(20), nullable=False, server_default="en"))
        visits.add_column(sa.Column("tries", sa.Integer(), nullable=False, server_default="0"))
        visits.add_column(sa.Column("consent_sha256", sa.String(64), nullable=True))
        visits.add_column(sa.Column("person", sa.String(300), nullable=True))
        visits.add_column(sa.Column("last_seen_ms", sa.BigInteger(), nullable=False, server_default="0"))
    with op.batch_alter_table("rounds", **rebuilt) as rounds:
        rounds.add_column(sa.Column("episodes", sa.Integer(), nullable=False, server_default="1"))
        rounds.add_column(sa.Column("played_ticks", sa.Integer(), nullable=True))
        rounds.add_column(sa.Column("late_ticks", sa.Integer(), nullable=True))
        rounds.add_column(sa.Column("fault_ticks", sa.Integer(), nullable=True))
    op.create_index("ix_visits_study_person", "visits", ["study", "person"])
    op.add_column("seats", sa.Column("rtt_median_ms", sa.Float(), nullable=True))
    op.add_column("responses", sa.Column("passed", sa.Boolean(), nullable=True))
    _tables_of_visits()
    _tables_of_rounds()
    _tables_of_researchers()
    _fill()


def _visit() -> sa.Column[int]:
    return sa.Column("visit_id", ROW_ID, nullable=False)


def _of_visit(table: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        ["visit_id"], ["visits.id"], name=f"fk_{table}_visit_id", ondelete="CASCADE"
    )


def _of_round(table: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        ["round_id"], ["rounds.id"], name=f"fk_{table}_round_id", ondelete="CASCADE"
    )


def _tables_of_visits() -> None:
    op.create_table(
        "slots",
        sa.Column("study", sa.String(200), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("cell", sa.Text(), nullable=False),
        sa.Column("state", sa.String(10), nullable=False),
        sa.Column("visit_id", ROW_ID, nullable=True),
        sa.Column("held_at_ms", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(["study"], ["studies.name"], name="fk_slots_study"),
        sa.ForeignKeyConstraint(["visit_id"], ["visits.id"], name="fk_slots_visit_id", ondelete="SET NULL"),
        sa.PrimaryKeyConstraint("study", "number", name="pk_slots"),
    )
    op.create_index("ix_slots_visit_id", "slots", ["visit_id"])
    op.create_table(
        "attempts",
        _visit(),
        sa.Column("step_id", sa.String(200), nullable=False),
        sa.Column("attempt", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("answers", sa.Text(), nullable=False),
        sa.Column("wrong", sa.Text(), nullable=False),
        sa.Column("at_ms", sa.BigInteger(), nullable=False),
        _of_visit("attempts"),
        sa.PrimaryKeyConstraint("visit_id", "step_id", "attempt", name="pk_attempts"),
    )
    op.create_table(
        "absences",
        _visit(),
        sa.Column("started_ms", sa.BigInteger(), autoincrement=False, nullable=False),
        sa.Column("ended_ms", sa.BigInteger(), nullable=True),
        sa.Column("step_id", sa.String(200), nullable=False),
        _of_visit("absences"),
        sa.PrimaryKeyConstraint("visit_id", "started_ms", name="pk_absences"),
    )
    op.create_table(
        "notes",
        sa.Column("id", ROW_ID, autoincrement=True, nullable=False),
        _visit(),
        sa.Column("author", sa.String(200), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("at_ms", sa.BigInteger(), nullable=False),
        _of_visit("notes"),
        sa.PrimaryKeyConstraint("id", name="pk_notes"),
    )
    op.create_index("ix_notes_visit_id", "notes", ["visit_id"])
    op.create_table(
        "questions",
        sa.Column("study", sa.String(200), nullable=False),
        sa.Column("step_id", sa.String(200), nullable=False),
        sa.Column("item", sa.String(200), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["study"], ["studies.name"], name="fk_questions_study"),
        sa.PrimaryKeyConstraint("study", "step_id", "item", name="pk_questions"),
    )


def _tables_of_rounds() -> None:
    op.create_table(
        "leases",
        sa.Column("round_id", ROW_ID, nullable=False),
        sa.Column("owner", sa.String(64), nullable=True),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("expires_ms", sa.BigInteger(), nullable=False),
        _of_round("leases"),
        sa.PrimaryKeyConstraint("round_id", name="pk_leases"),
    )
    op.create_table(
        "stand_ins",
        sa.Column("round_id", ROW_ID, nullable=False),
        sa.Column("seat", sa.SmallInteger(), autoincrement=False, nullable=False),
        sa.Column("tick", sa.Integer(), nullable=False),
        sa.Column("agent", sa.String(200), nullable=False),
        sa.Column("agent_sha256", sa.String(64), nullable=False),
        sa.Column("at_ms", sa.BigInteger(), nullable=False),
        _of_round("stand_ins"),
        sa.PrimaryKeyConstraint("round_id", "seat", name="pk_stand_ins"),
    )


def _tables_of_researchers() -> None:
    op.create_table(
        "researchers",
        sa.Column("id", ROW_ID, autoincrement=True, nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("password_hash", sa.String(300), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_researchers"),
        sa.UniqueConstraint("name", name="uq_researchers_name"),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "sessions",
        sa.Column("token_sha256", sa.String(64), nullable=False),
        sa.Column("researcher_id", ROW_ID, nullable=False),
        sa.Column("csrf", sa.String(64), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("expires_ms", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(
            ["researcher_id"], ["researchers.id"], name="fk_sessions_researcher_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("token_sha256", name="pk_sessions"),
    )
    op.create_index("ix_sessions_researcher_id", "sessions", ["researcher_id"])


def _fill() -> None:
    op.execute(
        "UPDATE visits SET last_seen_ms = coalesce(ended_ms, (SELECT max(coalesce(left_ms, entered_ms)) "
        "FROM stages WHERE stages.visit_id = visits.id), created_ms)"
    )
    counts = {
        "played_ticks": "count(*)",
        "late_ticks": "coalesce(sum(CASE WHEN late THEN 1 ELSE 0 END), 0)",
        "fault_ticks": "count(fault)",
    }
    for name, count in counts.items():
        op.execute(
            f"UPDATE rounds SET {name} = (SELECT {count} FROM ticks WHERE ticks.round_id = rounds.id) "  # noqa: S608
            "WHERE status <> 'open'"
        )
    _fill_questions()


def _fill_questions() -> None:
    """The columns of the wide export, from the plans and answers that are there."""
    connection = op.get_bind()
    found: dict[tuple[str, str, str], tuple[int, int]] = {}
    places: dict[int, tuple[str, dict[str, int]]] = {}
    visits = sa.text("SELECT id, study, plan_json FROM visits ORDER BY id")
    for visit_id, study, text in connection.execute(visits).all():
        plan = json.loads(text)
        places[visit_id] = (study, {step["id"]: at for at, step in enumerate(plan["steps"])})
        for at, factor in enumerate(plan["condition"], 1):
            found.setdefault((study, "", factor), (-1, at))
        for at, step in enumerate(plan["steps"]):
            if step["kind"] == "round":
                found.setdefault((study, step["id"], ""), (at, 0))
    answers = sa.text("SELECT visit_id, step_id, item, position FROM responses ORDER BY visit_id")
    for visit_id, step_id, item, position in connection.execute(answers).all():
        study, steps = places[visit_id]
        found.setdefault((study, step_id, item), (steps.get(step_id, len(steps)), position))
    rows = [
        {"study": s, "step_id": step, "item": item, "place": place, "position": position}
        for (s, step, item), (place, position) in found.items()
    ]
    if rows:
        columns = sa.table("questions", *(sa.column(name) for name in rows[0]))
        op.bulk_insert(columns, rows)
