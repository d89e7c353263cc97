"""What people need who wait at different servers: the lobby's table, and where owners of rounds are."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"

ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Add them; who waits at this moment asks again within seconds."""
    op.add_column("leases", sa.Column("address", sa.String(300), nullable=True))
    op.create_table(
        "waiting",
        sa.Column("visit_id", ROW_ID, nullable=False),
        sa.Column("step_id", sa.String(200), nullable=False),
        sa.Column("step_index", sa.Integer(), nullable=False),
        sa.Column("pairing", sa.Text(), nullable=False),
        sa.Column("since_ms", sa.BigInteger(), nullable=False),
        sa.Column("asked_ms", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(["visit_id"], ["visits.id"], name="fk_waiting_visit_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("visit_id", name="pk_waiting"),
    )
