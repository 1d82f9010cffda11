"""Writes what happens, in a thread of its own; a database that is gone, locked or full never stops the station."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence

from covista_schemas.reports import PartHealth, time_of

from covista_service import answers
from covista_service.loop import News, SinkStatus
from covista_service.station.memory import Memory
from covista_service.station.snapshot import Snapshot
from covista_service.store.backlog import Backlog, Loss
from covista_service.store.database import UNUSABLE, DatabaseError, first_line, is_passing
from covista_service.store.numbers import LastNumbers
from covista_service.store.retention import Retention
from covista_service.store.rows import Entry, SettingsChange
from covista_service.store.sampler import Sampler
from covista_service.store.writer import Writer
from covista_service.telemetry import about

Ask = Callable[[], Snapshot]
QUEUE = 20_000
BATCH = 2000
FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 5.0
PERIOD_S = 1.0
# A database that starts together with the station is waited for so long: it has the numbers and settings to go on with.
START_S = 5.0
# A server takes longer than a file when a machine boots, and nothing has it started before the station then.
SERVER_START_S = 30.0
_LONGEST_START_PAUSE_S = 1.0
# Whoever closes waits so long.
CLOSE_S = 2.0
# A database that takes longer for one batch is worth a word.
SLOW_S = 2.0

log = logging.getLogger(__name__)


class History:
    """A sink of the loop's news. When the queue is full the oldest entries go, counted."""

    def __init__(
        self,
        url: str,
        *,
        retention: Retention | None = None,
        queue: int = QUEUE,
        first_pause_s: float = FIRST_PAUSE_S,
        period_s: float = PERIOD_S,
        start_s: float | None = None,
    ) -> None:
        """Open the database, if it can be within `start_s`, and one try more; by default as long as its kind may take.

        Raises DatabaseError for a URL that no engine can be made of.
        """
        self._writer = Writer(url, retention or Retention())
        self._backlog = Backlog(queue)
        self._first_pause_s, self._period_s = first_pause_s, period_s
        self._changed = threading.Condition()
        self._closing = False
        self._written = self._known_lost = 0
        self._problem: str | None = None
        self._ask: Ask | None = None
        self._sampler = Sampler()
        self._batch = BATCH
        # Monotonic times: when to sample again, when to try again, and since when the database is busy.
        self._sample_s = self._resume_s = 0.0
        self._busy_s: float | None = None
        self._pause_s = 0.0
        self._more = False
        # Snapshots in a row that could not be stored for what they are.
        self._unremembered = 0
        self.last = self._used = self._start(longest_start_s(url) if start_s is None else start_s)
        self._thread = threading.Thread(target=self._run, name="covista-history", daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Entries that went because the queue was full."""
        return self._backlog.lost

    def status(self) -> SinkStatus:
        """How many entries wait, were written, and were lost."""
        with self._changed:
            return SinkStatus(len(self._backlog), self._written, self._backlog.lost)

    def follow(self, ask: Ask) -> None:
        """Look at the station about each second from now on; `ask` may raise TimeoutError."""
        with self._changed:
            self._ask = ask
            self._changed.notify_all()

    def take(self, news: News) -> None:
        """Write this soon."""
        entries: list[Entry] = [*news.events]
        if news.groups_changed:
            entries.append(answers.groups_report(news.snapshot))
        if news.settings is not None and news.patch:
            entries.append(SettingsChange(time_of(news.snapshot.wall_ns), _by(news), news.patch, news.settings))
        groups = news.snapshot.groups
        event = max((each.id for each in news.events), default=0)
        with self._changed:
            self._used = self._used.over(LastNumbers(groups.revision, event, groups.last_label))
            self._backlog.tell(entries)
            self._changed.notify_all()

    def flush(self, timeout_s: float) -> bool:
        """Wait until all that was taken so far is written; False if it is not.

        Also if some of what was taken since the last time that somebody waited never will be.
        """
        with self._changed:
            came = self._backlog.told_came
            self._changed.wait_for(lambda: self._closing or self._backlog.told_went >= came, timeout_s)
            before, self._known_lost = self._known_lost, self._backlog.told_lost
            return self._backlog.told_went >= came and self._known_lost == before

    def recall(self, forget_after_s: float, unknown_after_s: float) -> Memory:
        """What the station before this one knew, as far as it is young enough; all there is where it can be read.

        Before the loop runs.
        """
        nothing = Memory(revision=self.last.revision, label=self.last.label, event=self.last.event)
        if not self._writer.continues:
            return nothing
        try:
            return self._writer.recall(forget_after_s, unknown_after_s)
        except UNUSABLE as error:
            log.warning("nothing is remembered", extra=about(said=first_line(error)))
            return nothing

    def stored_settings(self) -> dict[str, object]:
        """The last value of every live setting that was given, by its name such as hysteresis.gain."""
        return dict(self._writer.patch)

    def health(self) -> PartHealth:
        """Whether it writes."""
        with self._changed:
            lost = f"; {self._backlog.lost} entries lost" if self._backlog.lost else ""
            if self._unremembered:
                lost += f"; {self._unremembered} states in a row for the next station could not be stored"
            problem = self._problem
            if self._busy_s is not None and time.monotonic() - self._busy_s > SLOW_S:
                problem = problem or "the database takes long to answer"
            if problem is not None:
                return PartHealth(status="degraded", detail=f"{problem}; {len(self._backlog)} entries wait{lost}")
            return PartHealth(status="ready", detail=f"{self._written} entries written{lost}")

    def close(self) -> None:
        """Write what is waiting, if the database lets us, then end; a database that does not answer is left alone."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            log.warning("the history ends without its database", extra=about(lost=self.status().waiting))

    def _start(self, start_s: float) -> LastNumbers:
        """Where the database ends; who goes on without it begins at 1, so one that is only away is waited for."""
        give_up_s, pause_s = time.monotonic() + start_s, self._first_pause_s
        while True:
            try:
                last = self._writer.start()
            except UNUSABLE as error:
                self._fail(error)
                lasting = isinstance(error, DatabaseError) or not is_passing(error)
                if lasting or time.monotonic() + pause_s > give_up_s:
                    log.warning("the station starts without its database", extra=about(said=first_line(error)))
                    return LastNumbers()
            else:
                self._recover()
                return last
            time.sleep(pause_s)
            pause_s = min(_LONGEST_START_PAUSE_S, 2 * pause_s)

    def _run(self) -> None:
        try:
            while True:
                with self._changed:
                    self._changed.wait_for(self._is_due, self._rest_s())
                    closing = self._closing
                snapshot = self._sample(closing=closing)
                self._settle(snapshot, closing=closing)
                if closing:
                    return
        except Exception:
            with self._changed:
                self._problem = "the history has failed"
            log.exception("the history has failed")
        finally:
            self._writer.dispose()

    def _is_due(self) -> bool:
        """Is there anything to do now?"""
        now_s = time.monotonic()
        waits = (len(self._backlog) > 0 or self._more) and now_s >= self._resume_s
        return self._closing or waits or (self._ask is not None and now_s >= self._sample_s)

    def _rest_s(self) -> float:
        """How long there may be nothing to do."""
        now_s = time.monotonic()
        rest_s = self._sample_s - now_s if self._ask is not None else self._period_s
        if self._resume_s > now_s:
            rest_s = min(rest_s, self._resume_s - now_s)
        return max(0.0, rest_s)

    def _sample(self, *, closing: bool) -> Snapshot | None:
        """Look at the station, if it is time; what is news waits to be written like all else."""
        now_s = time.monotonic()
        if self._ask is None or (now_s < self._sample_s and not closing):
            return None
        # In step with the clock, but after a pause not all at once.
        self._sample_s = max(self._sample_s + self._period_s, now_s)
        try:
            snapshot = self._ask()
            news = self._sampler.look(snapshot)
        except TimeoutError:
            return None
        except Exception:
            # A bug here must not silence the events.
            log.exception("the history cannot look at the station")
            return None
        with self._changed:
            self._backlog.sample(news)
        return snapshot

    def _settle(self, snapshot: Snapshot | None, *, closing: bool) -> None:
        """Write what waits, remember the snapshot, remove what is old; on failure pause."""
        if time.monotonic() < self._resume_s and not closing:
            return
        try:
            while self._write():
                pass
            if snapshot is not None:
                self._remember(snapshot)
            self._more = self._writer.tidy()
            if closing:
                self._writer.end()
        except Exception as error:
            if not isinstance(error, UNUSABLE):
                log.exception("the history cannot be written")
            self._fail(error)
            self._pause_s = min(LONGEST_PAUSE_S, 2 * self._pause_s or self._first_pause_s)
            self._resume_s = time.monotonic() + self._pause_s
            if closing:
                log.warning("the history ends without what waits", extra=about(lost=len(self._backlog)))
        else:
            self._pause_s = 0.0
            self._recover()
        finally:
            self._busy_s = None

    def _remember(self, snapshot: Snapshot) -> None:
        """Keep the snapshot; one that cannot be stored for what it is must not end all else, such as retention."""
        try:
            self._writer.remember(snapshot)
        except Exception as error:
            if is_passing(error):
                raise
            self._unremembered += 1
            if self._unremembered == 1:
                log.exception("the state for the next station cannot be stored", extra=about(said=first_line(error)))
        else:
            if self._unremembered:
                log.info("the state for the next station is stored again", extra=about(missed=self._unremembered))
            self._unremembered = 0

    def _write(self) -> bool:
        """Write the next batch; False if there is none, nor a gap to be marked."""
        with self._changed:
            loss = self._backlog.take_loss()
            # While it is looked for what cannot be stored, gaps go by themselves: one of the two is at fault.
            batch = self._backlog.take(0 if loss is not None and self._batch < BATCH else self._batch)
            reason = self._problem or "entries came faster than they could be written"
            self._busy_s, used = time.monotonic(), self._used
        if not batch and loss is None and self._problem is None:
            return False
        try:
            self._writer.write(batch, loss, reason, used)
        except Exception as error:
            if not self._put_back(batch, loss, error):
                raise
            return True
        with self._changed:
            self._backlog.written(batch)
            self._written += len(batch)
            if batch:
                self._batch = BATCH
            self._changed.notify_all()
        self._recover()
        return bool(batch) or loss is not None

    def _put_back(self, batch: Sequence[Entry], loss: Loss | None, error: Exception) -> bool:
        """What cannot be stored for what it is must not hold up all others: it is found by halves, and goes.

        False if it is the database that has to be waited for.
        """
        with self._changed:
            if is_passing(error) or not (batch or loss):
                self._backlog.put_back(batch, loss)
                return False
            if not batch:
                log.error("a gap of the history cannot be stored", extra=about(said=first_line(error), gap=str(loss)))
            elif len(batch) == 1 and loss is None:
                self._backlog.lose(batch)
                log.error("an entry of the history cannot be stored", extra=about(said=first_line(error)))
            else:
                self._batch = max(1, len(batch) // 2)
                self._backlog.put_back(batch, loss)
        return True

    def _recover(self) -> None:
        with self._changed:
            if self._problem is not None:
                told = about(waiting=len(self._backlog), lost=self._backlog.lost)
                log.info("the history is written again", extra=told)
            self._problem = None

    def _fail(self, error: Exception) -> None:
        self._writer.fail()
        problem = f"the database cannot be used: {first_line(error)}"
        with self._changed:
            if self._problem is None:
                log.warning("the history waits for its database", extra=about(waiting=len(self._backlog), said=problem))
            self._problem = problem


def longest_start_s(url: str) -> float:
    """How long a database is waited for that starts together with the station."""
    return START_S if url.startswith("sqlite") else SERVER_START_S


def _by(news: News) -> str | None:
    return next((event.by for event in news.events if event.event == "settings"), None)
