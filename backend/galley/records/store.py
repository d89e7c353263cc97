"""The records as the server sees them: writes are futures, done once they are durable."""

from __future__ import annotations

import base64
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar

from sqlalchemy import Connection, Engine

from galley.errors import GalleyError
from galley.kitchen.trajectory import Trajectory
from galley.records import jobs, queries
from galley.records.engine import connect, database_url, shown, sqlite_file
from galley.records.lock import ServingLock
from galley.records.migrate import migrate
from galley.records.replay import trajectory_of
from galley.records.rows import ClockRow, Health, KeyRow, PauseRow, RoundRow, TickRow, VisitRow
from galley.records.writer import FLUSH_EVERY_S, Journal, Writer
from galley.study.questionnaire import Questionnaire

T = TypeVar("T")
READERS = 2


class Store:
    """One database of visits and rounds. Writes go through one thread, reads through others.

    Futures fail with what went wrong: GalleyError, or SQLAlchemy's error if the database failed.
    Times named `at_ms` are milliseconds since 1970-01-01 UTC.
    """

    def __init__(
        self, name: str, engine: Engine, reader: Engine, lock: ServingLock | None, flush_s: float
    ) -> None:
        self.name = name
        self._engine = engine
        self._reader = reader
        self._lock = lock
        self._writer = Writer(engine, flush_s)
        self._readers = ThreadPoolExecutor(READERS, thread_name_prefix="galley-reader")

    @classmethod
    def open(
        cls,
        database: str | Path,
        *,
        serving: bool = False,
        must_exist: bool = False,
        flush_every_s: float = FLUSH_EVERY_S,
    ) -> Self:
        """The store in `database` (a URL or the path of an SQLite file), made or migrated as needed.

        Raises: GalleyError if it cannot be opened, is newer than this Galley, does not exist though it must,
        or is to be served and is served already.
        """
        url = database_url(database)
        file = sqlite_file(url)
        if must_exist and file is not None and not file.is_file():
            raise GalleyError(
                f"{file}: there is no such database; name the one that was served with --database"
            )
        lock = None
        try:
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                lock = ServingLock(file) if serving else None
            migrate(url, locked=lock is not None)
        except BaseException as error:
            if lock is not None:
                lock.release()
            if isinstance(error, OSError):
                fix = "name another database with --database"
                raise GalleyError(f"{file}: {error.strerror or error}; {fix}") from None
            raise
        reader = connect(url, writes=False)
        return cls(shown(url), connect(url, writes=True), reader, lock, flush_every_s)

    # ---- visits --------------------------------------------------------------------------------------------

    def next_visit_no(self, study: str) -> Future[int]:
        """A visit number of `study` that was never given out before, from 0."""
        return self._writer.submit(lambda connection: jobs.next_visit_no(connection, study))

    def create_visit(
        self,
        study: str,
        study_sha256: str,
        seed: int,
        visit_no: int,
        plan_json: str,
        condition: Mapping[str, Any],
        link_params: Mapping[str, str],
        at_ms: float,
    ) -> Future[VisitRow]:
        """A new visit at its first step, with a token that cannot be guessed and a name for exports."""
        values = {
            "token": secrets.token_urlsafe(24),
            "participant": "p" + base64.b32encode(secrets.token_bytes(10)).decode().lower(),
            "study": study,
            "study_sha256": study_sha256,
            "seed": str(seed),
            "visit_no": visit_no,
            "plan_json": plan_json,
            "condition": dict(condition),
            "link_params": dict(link_params),
            "created_ms": round(at_ms),
        }
        return self._writer.submit(lambda connection: jobs.create_visit(connection, values))

    def visit(self, token: str) -> Future[VisitRow | None]:
        """The visit behind a link, None if there is none."""
        return self._read(lambda connection: queries.visit(connection, token))

    def enter_step(self, visit_id: int, step_id: str, at_ms: float) -> Future[None]:
        """Note that a step's page was sent; the first time counts as entering it."""
        return self._writer.submit(
            lambda connection: jobs.enter_step(connection, visit_id, step_id, round(at_ms))
        )

    def save_answers(
        self,
        visit_id: int,
        step_id: str,
        answers: Mapping[str, Any],
        new_step_index: int,
        status: str,
        at_ms: float,
        completion_code: str | None = None,
        questionnaire: Questionnaire | None = None,
    ) -> Future[bool]:
        """Store a step's answers and move the visit on, in one transaction.

        `questionnaire` is the one that was answered; its items are kept as they were shown.
        False, and nothing changed, if the step was left before: the same form sent twice counts once.
        """
        items = () if questionnaire is None else questionnaire.items
        shown = {item.id: item.model_dump(mode="json") for item in items}
        rows = [
            {"position": position, "item": item, "value": value, "shown": shown.get(item)}
            for position, (item, value) in enumerate(answers.items(), 1)
        ]
        return self._writer.submit(
            lambda connection: jobs.leave_step(
                connection, visit_id, step_id, rows, new_step_index, status, round(at_ms), completion_code
            )
        )

    # ---- rounds --------------------------------------------------------------------------------------------

    def create_round(
        self,
        visit_id: int,
        step_id: str,
        round_no: int,
        layout_json: str,
        layout: str,
        horizon: int,
        tick_ms: int,
        human_seat: int,
        agent: str,
        agent_sha256: str,
        partner_hat: str,
        seed: int,
        at_ms: float,
        human_hat: str | None = None,
    ) -> Future[int]:
        """The id of the visit's round at this step, set up now unless it was before."""
        values = {
            "round_no": round_no,
            "layout": layout,
            "layout_json": layout_json,
            "horizon_ticks": horizon,
            "tick_ms": tick_ms,
            "seed": str(seed),
            "created_ms": round(at_ms),
        }
        human = {"seat": human_seat, "visit_id": visit_id, "step_id": step_id, "hat": human_hat}
        partner = {"seat": 1 - human_seat, "agent": agent, "agent_sha256": agent_sha256, "hat": partner_hat}
        return self._writer.submit(lambda connection: jobs.create_round(connection, values, human, partner))

    def open_round(self, visit_id: int, step_id: str) -> Future[RoundRow | None]:
        """The visit's round at this step with everything journalled so far, None if it was never set up.

        Its `status` may be other than "open": a server may have died between a round's end and the next page.
        """
        return self._writer.submit(
            lambda connection: queries.round_of(connection, visit_id, step_id), first="all"
        )

    def journal(
        self,
        round_id: int,
        ticks: Sequence[TickRow] = (),
        keys: Sequence[KeyRow] = (),
        pauses: Sequence[PauseRow] = (),
        clocks: Sequence[ClockRow] = (),
    ) -> None:
        """Take rows to be written within a second. A row that was written before stays as it was."""
        self._writer.journal(round_id, Journal(list(ticks), list(keys), list(pauses), list(clocks)))

    def finish_round(
        self,
        round_id: int,
        status: str,
        score: int,
        deliveries: int,
        ended_at_ms: float,
        final_state: bytes,
    ) -> Future[bool]:
        """Write the rest of a round's journal and close it; False, with nothing changed, if it was closed."""
        return self._writer.submit(
            lambda connection: jobs.finish_round(
                connection, round_id, status, score, deliveries, round(ended_at_ms), final_state
            ),
            first=round_id,
        )

    # ---- the store itself ----------------------------------------------------------------------------------

    def flush(self) -> Future[None]:
        """Done when everything journalled before this call is committed."""
        return self._writer.flush()

    def health(self) -> Health:
        """Whether what is journalled reaches the database."""
        return self._writer.health()

    def trajectory(self, round_id: int) -> Trajectory:
        """A round as far as it is committed, ready to be replayed.

        Raises: GalleyError if there is no such round, or what is stored cannot be played.
        """
        with self.reading() as connection:
            return trajectory_of(queries.round_row(connection, round_id))

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection that sees the database as it stands now, for as long as it is open."""
        with self._reader.connect() as connection:
            if connection.dialect.name == "postgresql":
                connection = connection.execution_options(
                    isolation_level="REPEATABLE READ", postgresql_readonly=True
                )
            with connection.begin():
                yield connection

    def close(self) -> None:
        """Write what waits, then let go of the database; a second call does nothing.

        Raises: GalleyError if journalled rows could not be written.
        """
        try:
            self._writer.close()
        finally:
            self._readers.shutdown()
            self._engine.dispose()
            self._reader.dispose()
            if self._lock is not None:
                self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self, query: Callable[[Connection], T]) -> Future[T]:
        def run() -> T:
            with self.reading() as connection:
                return query(connection)

        return self._readers.submit(run)
