"""Every revision of the groups, as the station publishes them: none falls between two looks."""

from __future__ import annotations

import queue
from types import TracebackType
from typing import Self

import zenoh
import zenoh.ext
from covista_schemas import keys, zenoh_config
from covista_schemas.errors import LinkError
from covista_schemas.reports import GroupsReport


class GroupsFeed:
    """Subscribes to the groups of a station; close it, or use it as a context manager. Raises LinkError."""

    def __init__(self, endpoint: str, site: str) -> None:
        self._news: queue.SimpleQueue[GroupsReport] = queue.SimpleQueue()
        try:
            self._session = zenoh.open(zenoh_config.config("client", connect=[endpoint]))
        except zenoh.ZError as error:
            raise LinkError(f"the station's link {endpoint} cannot be reached: {error}") from error
        self._subscriber = zenoh.ext.declare_advanced_subscriber(
            self._session,
            keys.groups(site),
            lambda sample: self._news.put(GroupsReport.model_validate_json(sample.payload.to_bytes())),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        )

    def news(self) -> list[GroupsReport]:
        """The revisions that came since the last call, in order."""
        return [self._news.get_nowait() for _ in range(self._news.qsize())]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the subscription and the session."""
        self._subscriber.undeclare()
        self._session.close()
