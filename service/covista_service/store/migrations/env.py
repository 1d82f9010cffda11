"""Alembic runs this for every upgrade; the connection comes from `upgrade`, and so does its transaction."""

from alembic import context

context.configure(connection=context.config.attributes["connection"], transactional_ddl=True)
with context.begin_transaction():
    context.run_migrations()
