"""Answers over zenoh: the same models as over REST, errors as error replies with the problem model.

Questions wait in a line that is bounded, and a thread of their own answers them one after the other. What is large is
made once for all who ask while it stands; what is larger than clients take is refused, and REST has it.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

import zenoh
from covista_schemas import keys
from covista_schemas.errors import CovistaError, KeyExpressionError
from covista_schemas.reports import Problem
from covista_schemas.zenoh_config import MAX_REPLY_BYTES

from covista_service import answers
from covista_service.answers import NotKnownError
from covista_service.station.snapshot import GroupsView, Snapshot

Ask = Callable[[], Snapshot]
# Questions that wait for their answers; who comes later hears that the station is busy.
MAX_WAITING = 32

log = logging.getLogger(__name__)


class Queries:
    """The queryables of one site. `ask` gives the station's snapshot."""

    def __init__(self, session: zenoh.Session, site: str, ask: Ask) -> None:
        self._ask = ask
        self._replies = Replies(site)
        self._changed = threading.Condition()
        self._waiting: deque[zenoh.Query] = deque()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="covista-queries")
        self._thread.start()
        self._queryables: list[zenoh.Queryable[Any]] = [
            session.declare_queryable(key, self._take, complete=True) for key in keys.queryables(site)
        ]

    def close(self) -> None:
        """Answer no more; who waits is told so."""
        for queryable in self._queryables:
            queryable.undeclare()
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join()
        for query in self._waiting:
            _turn_away(query)

    def _take(self, query: zenoh.Query) -> None:
        """Let a question stand in line; in a thread of zenoh's."""
        with self._changed:
            admitted = len(self._waiting) < MAX_WAITING and not self._closing
            if admitted:
                self._waiting.append(query)
                self._changed.notify()
        if not admitted:
            _turn_away(query)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._waiting)
                if self._closing:
                    return
                query = self._waiting.popleft()
            try:
                self._answer(query)
            except Exception:
                # What cannot be answered must not keep others from being so.
                log.exception("cannot answer a query")

    def _answer(self, query: zenoh.Query) -> None:
        key = str(query.key_expr)
        with query:
            try:
                content = self._replies.to(key, self._ask())
            except NotKnownError as error:
                _refuse(query, answers.problem_of(error, key))
            except TooLargeError as error:
                _refuse(query, Problem(title=error.title, status=413, detail=str(error), instance=key))
            except KeyExpressionError as error:
                _refuse(query, Problem(title="Unknown key", status=404, detail=str(error), instance=key))
            except TimeoutError:
                _refuse(query, _busy(key))
            else:
                query.reply(key, content, encoding=zenoh.Encoding.APPLICATION_JSON)


class TooLargeError(CovistaError):
    """The answer is larger than what a client takes in one piece."""

    title = "Too large for zenoh"


class Replies:
    """What the station says to queries; for one thread. The last similarity and groups are kept for who asks next."""

    def __init__(self, site: str) -> None:
        self._site = site
        self._similarity: tuple[int, zenoh.ZBytes | TooLargeError] | None = None
        self._groups: tuple[GroupsView, zenoh.ZBytes] | None = None

    def to(self, key: str, snapshot: Snapshot) -> zenoh.ZBytes:
        """The reply to a query on this key, as JSON. Raises NotKnownError, KeyExpressionError or TooLargeError."""
        match keys.parse_station_query(self._site, key):
            case keys.StationQuery("groups"):
                return self._of_groups(snapshot)
            case keys.StationQuery("similarity"):
                return self._of_similarity(snapshot)
            case keys.StationQuery("pairs", (a, b)):
                return _in_one([answers.pair_report(snapshot, a, b).model_dump_json().encode()], "/pairs/{a}/{b}")
            case keys.StationQuery(_, ids):
                return _in_one([answers.robot_report(snapshot, ids[0]).model_dump_json().encode()], "/robots/{robot}")

    def _of_groups(self, snapshot: Snapshot) -> zenoh.ZBytes:
        view = snapshot.groups
        # Scores move without a new revision, but not within a view; one that was never in force tells the time of now.
        if self._groups is None or self._groups[0] is not view or not view.time_ns:
            self._groups = view, _in_one([answers.groups_report(snapshot).model_dump_json().encode()], "/groups")
        return self._groups[1]

    def _of_similarity(self, snapshot: Snapshot) -> zenoh.ZBytes:
        revision = snapshot.similarity.revision
        if self._similarity is None or self._similarity[0] != revision:
            self._similarity = None
            self._similarity = revision, _matrices(snapshot)
        made = self._similarity[1]
        if isinstance(made, TooLargeError):
            raise made
        return made


def _matrices(snapshot: Snapshot) -> zenoh.ZBytes | TooLargeError:
    try:
        return _in_one(answers.similarity_json(snapshot), "/similarity")
    except TooLargeError as error:
        return error


def _in_one(pieces: Iterable[bytes], route: str) -> zenoh.ZBytes:
    """The pieces as one answer; no more of them are made than fit. Raises TooLargeError."""
    whole = bytearray()
    for piece in pieces:
        whole += piece
        if len(whole) > MAX_REPLY_BYTES:
            raise TooLargeError(f"more than {MAX_REPLY_BYTES} bytes; ask over REST: GET /api/v1{route}")
    return zenoh.ZBytes(whole)


def _turn_away(query: zenoh.Query) -> None:
    with query:
        _refuse(query, _busy(str(query.key_expr)))


def _busy(key: str) -> Problem:
    return Problem(title="The station is busy", status=503, instance=key)


def _refuse(query: zenoh.Query, problem: Problem) -> None:
    query.reply_err(problem.model_dump_json(), encoding=zenoh.Encoding.APPLICATION_JSON)
