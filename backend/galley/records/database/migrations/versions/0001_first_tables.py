"""The first tables: studies, visits, stages, responses, rounds, seats, ticks, keys, pauses, clocks."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make them."""
    op.create_table(
        "studies",
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("visits_begun", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_studies"),
    )
    op.create_table(
        "rounds",
        sa.Column(
            "id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=True, nullable=False
        ),
        sa.Column("study", sa.String(length=200), nullable=False),
        sa.Column("round_no", sa.Integer(), nullable=False),
        sa.Column("layout", sa.String(length=200), nullable=False),
        sa.Column("layout_json", sa.Text(), nullable=False),
        sa.Column("horizon_ticks", sa.Integer(), nullable=False),
        sa.Column("tick_ms", sa.Integer(), nullable=False),
        sa.Column("seed", sa.String(length=64), nullable=False),
        sa.Column("status", sa.String(length=20), nullable=False),
        sa.Column("score", sa.Integer(), nullable=True),
        sa.Column("deliveries", sa.Integer(), nullable=True),
        sa.Column("final_sha256", sa.String(length=64), nullable=True),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("ended_ms", sa.BigInteger(), nullable=True),
        sa.ForeignKeyConstraint(["study"], ["studies.name"], name="fk_rounds_study"),
        sa.PrimaryKeyConstraint("id", name="pk_rounds"),
    )
    op.create_index("ix_rounds_study", "rounds", ["study"], unique=False)
    op.create_table(
        "visits",
        sa.Column(
            "id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=True, nullable=False
        ),
        sa.Column("token", sa.String(length=64), nullable=False),
        sa.Column("participant", sa.String(length=32), nullable=False),
        sa.Column("study", sa.String(length=200), nullable=False),
        sa.Column("study_sha256", sa.String(length=64), nullable=False),
        sa.Column("visit_no", sa.Integer(), nullable=False),
        sa.Column("seed", sa.String(length=64), nullable=False),
        sa.Column("plan_json", sa.Text(), nullable=False),
        sa.Column("condition", sa.Text(), nullable=False),
        sa.Column("link_params", sa.Text(), nullable=False),
        sa.Column("step_index", sa.Integer(), nullable=False),
        sa.Column("status", sa.String(length=20), nullable=False),
        sa.Column("completion_code", sa.String(length=200), nullable=True),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("ended_ms", sa.BigInteger(), nullable=True),
        sa.ForeignKeyConstraint(["study"], ["studies.name"], name="fk_visits_study"),
        sa.PrimaryKeyConstraint("id", name="pk_visits"),
        sa.UniqueConstraint("study", "visit_no", name="uq_visits_study_visit_no"),
        sa.UniqueConstraint("token", name="uq_visits_token"),
    )
    op.create_index("ix_visits_participant", "visits", ["participant"], unique=False)
    op.create_table(
        "clocks",
        sa.Column("round_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("seat", sa.SmallInteger(), autoincrement=False, nullable=False),
        sa.Column("server_ms", sa.Float(), nullable=False),
        sa.Column("client_ms", sa.Float(), nullable=False),
        sa.Column("rtt_ms", sa.Float(), nullable=True),
        sa.ForeignKeyConstraint(["round_id"], ["rounds.id"], name="fk_clocks_round_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("round_id", "seat", "server_ms", name="pk_clocks"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "keys",
        sa.Column("round_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("seat", sa.SmallInteger(), autoincrement=False, nullable=False),
        sa.Column("arrival_ms", sa.Float(), nullable=False),
        sa.Column("seq", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("key", sa.String(length=20), nullable=False),
        sa.Column("down", sa.Boolean(), nullable=False),
        sa.Column("client_ms", sa.Float(), nullable=False),
        sa.Column("tick_applied", sa.Integer(), nullable=True),
        sa.ForeignKeyConstraint(["round_id"], ["rounds.id"], name="fk_keys_round_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("round_id", "seat", "arrival_ms", "seq", name="pk_keys"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "pauses",
        sa.Column("round_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("started_ms", sa.Float(), nullable=False),
        sa.Column("ended_ms", sa.Float(), nullable=True),
        sa.Column("tick", sa.Integer(), nullable=False),
        sa.Column("reason", sa.String(length=40), nullable=False),
        sa.ForeignKeyConstraint(["round_id"], ["rounds.id"], name="fk_pauses_round_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("round_id", "started_ms", name="pk_pauses"),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "responses",
        sa.Column("visit_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("step_id", sa.String(length=200), nullable=False),
        sa.Column("item", sa.String(length=200), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("value", sa.Text(), nullable=False),
        sa.Column("shown", sa.Text(), nullable=False),
        sa.Column("at_ms", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(
            ["visit_id"], ["visits.id"], name="fk_responses_visit_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("visit_id", "step_id", "item", name="pk_responses"),
    )
    op.create_table(
        "seats",
        sa.Column("round_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("seat", sa.SmallInteger(), autoincrement=False, nullable=False),
        sa.Column("visit_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=True),
        sa.Column("step_id", sa.String(length=200), nullable=True),
        sa.Column("agent", sa.String(length=200), nullable=True),
        sa.Column("agent_sha256", sa.String(length=64), nullable=True),
        sa.Column("hat", sa.String(length=40), nullable=True),
        sa.ForeignKeyConstraint(["round_id"], ["rounds.id"], name="fk_seats_round_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["visit_id"], ["visits.id"], name="fk_seats_visit_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("round_id", "seat", name="pk_seats"),
        sa.UniqueConstraint("visit_id", "step_id", name="uq_seats_visit_id_step_id"),
    )
    op.create_table(
        "stages",
        sa.Column("visit_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("step_id", sa.String(length=200), nullable=False),
        sa.Column("entered_ms", sa.BigInteger(), nullable=False),
        sa.Column("left_ms", sa.BigInteger(), nullable=True),
        sa.Column("views", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["visit_id"], ["visits.id"], name="fk_stages_visit_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("visit_id", "step_id", name="pk_stages"),
    )
    op.create_table(
        "ticks",
        sa.Column("round_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("tick", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("action_0", sa.SmallInteger(), nullable=False),
        sa.Column("action_1", sa.SmallInteger(), nullable=False),
        sa.Column("deadline_ms", sa.Float(), nullable=False),
        sa.Column("lateness_ms", sa.Float(), nullable=False),
        sa.Column("decision_ms", sa.Float(), nullable=True),
        sa.Column("late", sa.Boolean(), nullable=False),
        sa.Column("fault", sa.String(length=40), nullable=True),
        sa.ForeignKeyConstraint(["round_id"], ["rounds.id"], name="fk_ticks_round_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("round_id", "tick", name="pk_ticks"),
        sqlite_with_rowid=False,
    )
