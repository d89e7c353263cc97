"""Run by Alembic for every migration, on the connection that `galley.records.database.migrate` hands over."""

from alembic import context

from galley.records.database.tables import METADATA

# Batch mode rewrites a table where SQLite cannot alter it.
context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    render_as_batch=True,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
