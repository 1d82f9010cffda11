"""Answers over zenoh: the same models as over REST, errors as error replies with the problem model."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import zenoh
from covista_schemas import keys
from covista_schemas.errors import KeyExpressionError
from covista_schemas.reports import Problem

from covista_service import answers
from covista_service.answers import NotKnownError
from covista_service.station.snapshot import Snapshot

Ask = Callable[[], Snapshot]

log = logging.getLogger(__name__)


class Queries:
    """The queryables of one site. Zenoh's threads build the answers; `ask` gives them the station's snapshot."""

    def __init__(self, session: zenoh.Session, site: str, ask: Ask) -> None:
        self._site = site
        self._ask = ask
        self._queryables: list[zenoh.Queryable[Any]] = [
            session.declare_queryable(key, self._answer, complete=True) for key in keys.queryables(site)
        ]

    def close(self) -> None:
        """Answer no more."""
        for queryable in self._queryables:
            queryable.undeclare()

    def _answer(self, query: zenoh.Query) -> None:
        key = str(query.key_expr)
        with query:
            try:
                text = answer(self._ask(), self._site, key)
            except NotKnownError as error:
                _refuse(query, answers.problem_of(error, key))
            except KeyExpressionError as error:
                _refuse(query, Problem(title="Unknown key", status=404, detail=str(error), instance=key))
            except TimeoutError:
                _refuse(query, Problem(title="The station is busy", status=503, instance=key))
            else:
                query.reply(key, text, encoding=zenoh.Encoding.APPLICATION_JSON)


def answer(snapshot: Snapshot, site: str, key: str) -> bytes | str:
    """What the station says to a query on this key, as JSON. Raises NotKnownError or KeyExpressionError."""
    match keys.parse_station_query(site, key):
        case keys.StationQuery("groups"):
            return answers.groups_report(snapshot).model_dump_json()
        case keys.StationQuery("similarity"):
            return b"".join(answers.similarity_json(snapshot))
        case keys.StationQuery("pairs", (a, b)):
            return answers.pair_report(snapshot, a, b).model_dump_json()
        case keys.StationQuery(_, ids):
            return answers.robot_report(snapshot, ids[0]).model_dump_json()


def _refuse(query: zenoh.Query, problem: Problem) -> None:
    query.reply_err(problem.model_dump_json(), encoding=zenoh.Encoding.APPLICATION_JSON)
