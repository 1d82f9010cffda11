"""Writes what happens, in a thread of its own; a database that is gone, locked or full never stops the station."""

from __future__ import annotations

import logging
import threading
from collections import deque

from covista_schemas.reports import PartHealth
from sqlalchemy import Engine
from sqlalchemy.exc import SQLAlchemyError

from covista_service import answers
from covista_service.loop import News, SinkStatus
from covista_service.store.database import file_is_gone, open_engine
from covista_service.store.migrations import upgrade
from covista_service.store.numbers import LastNumbers, read_last_numbers
from covista_service.store.rows import Entry, write
from covista_service.telemetry import about

QUEUE = 10_000
BATCH = 500
FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 5.0

log = logging.getLogger(__name__)


class History:
    """A sink of the loop's news. When the queue is full the oldest entries go, counted."""

    def __init__(self, url: str, *, queue: int = QUEUE, first_pause_s: float = FIRST_PAUSE_S) -> None:
        self._engine: Engine = open_engine(url)
        self._queue: deque[Entry] = deque()
        self._most = queue
        self._first_pause_s = first_pause_s
        self._changed = threading.Condition()
        self._closing = False
        self._dropped = 0
        self._written = 0
        self._problem: str | None = None
        self._prepared = False
        self.last = self._read_last()
        self._thread = threading.Thread(target=self._run, name="covista-history")
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Entries that went because the queue was full."""
        return self._dropped

    def status(self) -> SinkStatus:
        """How many entries wait, were written, and were lost."""
        with self._changed:
            return SinkStatus(len(self._queue), self._written, self._dropped)

    def take(self, news: News) -> None:
        """Write this soon."""
        entries: list[Entry] = [*news.events]
        if news.groups_changed:
            entries.append(answers.groups_report(news.snapshot))
        with self._changed:
            self._queue.extend(entries)
            while len(self._queue) > self._most:
                self._queue.popleft()
                self._dropped += 1
            self._changed.notify_all()

    def health(self) -> PartHealth:
        """Whether it writes."""
        with self._changed:
            lost = f"; {self._dropped} entries lost" if self._dropped else ""
            if self._problem is not None:
                return PartHealth(status="degraded", detail=f"{self._problem}; {len(self._queue)} entries wait{lost}")
            return PartHealth(status="ready", detail=f"{self._written} entries written{lost}")

    def close(self) -> None:
        """Write what is waiting, if the database lets us, then end."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        self._engine.dispose()

    def _read_last(self) -> LastNumbers:
        try:
            with self._engine.begin() as connection:
                upgrade(connection)
                last = read_last_numbers(connection)
        except (SQLAlchemyError, OSError) as error:
            self._fail(error)
            return LastNumbers()
        self._prepared = True
        return last

    def _run(self) -> None:
        pause_s = 0.0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing, pause_s)
                self._changed.wait_for(lambda: self._closing or self._queue)
                batch = [self._queue.popleft() for _ in range(min(BATCH, len(self._queue)))]
                closing = self._closing
            if not batch:
                return
            if self._write(batch):
                pause_s = 0.0
            elif closing:
                log.warning("the history ends without what waits", extra=about(lost=len(self._queue)))
                return
            else:
                pause_s = min(LONGEST_PAUSE_S, 2 * pause_s or self._first_pause_s)

    def _write(self, batch: list[Entry]) -> bool:
        if file_is_gone(self._engine):
            # SQLite would go on writing into the file that has no name any more.
            self._engine.dispose()
            self._prepared = False
        try:
            with self._engine.begin() as connection:
                if not self._prepared:
                    upgrade(connection)
                write(connection, batch)
        except (SQLAlchemyError, OSError) as error:
            self._fail(error)
            self._put_back(batch)
            return False
        with self._changed:
            self._prepared = True
            if self._problem is not None:
                log.info("the history is written again", extra=about(waiting=len(self._queue), lost=self._dropped))
            self._problem = None
            self._written += len(batch)
        return True

    def _put_back(self, batch: list[Entry]) -> None:
        with self._changed:
            room = max(0, self._most - len(self._queue))
            self._dropped += max(0, len(batch) - room)
            self._queue.extendleft(reversed(batch[len(batch) - min(room, len(batch)) :]))

    def _fail(self, error: Exception) -> None:
        # The first line: SQLAlchemy adds the statement and a link below it.
        problem = f"the database cannot be used: {str(error).splitlines()[0]}"
        with self._changed:
            if self._problem is None:
                log.warning("the history waits for its database", extra=about(waiting=len(self._queue), said=problem))
            self._problem = problem
            self._prepared = False
