"""Links with which researchers walk a study that runs."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add their table."""
    op.create_table(
        "test_links",
        sa.Column("token", sa.String(64), nullable=False),
        sa.Column("study", sa.String(200), nullable=False),
        sa.Column("cell", sa.Integer(), nullable=True),
        sa.Column("author", sa.String(200), nullable=False),
        sa.Column("created_ms", sa.BigInteger(), nullable=False),
        sa.Column("expires_ms", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(["study"], ["studies.name"], name="fk_test_links_study"),
        sa.PrimaryKeyConstraint("token", name="pk_test_links"),
    )
    op.create_index("ix_test_links_study", "test_links", ["study"])
