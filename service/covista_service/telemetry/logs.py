"""The log of this process: a line per record, with what it is about as fields, as text or JSON, at a bounded rate."""

from __future__ import annotations

import json
import logging
import math
import sys
import time
import traceback
from collections.abc import Mapping
from typing import Literal, TextIO

from covista_service.telemetry.rate_limit import RateLimit, RateLimitOptions

LogFormat = Literal["text", "json"]
# Of one value, so that no message of a robot fills the disk.
_LONGEST = 500
_LONGEST_TRACEBACK = 10_000
_OURS = ("covista_service", "covista_clients", "covista_schemas")


def about(**fields: object) -> dict[str, dict[str, object]]:
    """What a record is about, for `extra=`: `robot` or `pair` (a/b), and whatever else a reader would search for."""
    return {"fields": fields}


def log_to_stderr(level: str, form: LogFormat = "text", lines_per_minute: int = 60) -> None:
    """Send the log of this process to stderr, from `level` on (debug, info, warning, error).

    `lines_per_minute` bounds lines of one kind, 0 leaves them unbounded.
    """
    handler = handler_for(sys.stderr, form, lines_per_minute)
    least = getattr(logging, level.upper())
    # A compiler that tells of every instruction would take minutes over it.
    logging.basicConfig(level=max(least, logging.INFO), handlers=[handler], force=True)
    for package in _OURS:
        logging.getLogger(package).setLevel(least)
    # Neither each step of a migration nor each request of a dashboard is news.
    logging.getLogger("alembic").setLevel(logging.WARNING)
    for each in ("access", "error"):
        logging.getLogger(f"uvicorn.{each}").setLevel(logging.WARNING)


def handler_for(stream: TextIO, form: LogFormat, lines_per_minute: int) -> logging.Handler:
    """Writes records to a stream."""
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonLine() if form == "json" else TextLine())
    if lines_per_minute:
        of_robot = max(1, lines_per_minute // 10)
        options = RateLimitOptions(of_robot=of_robot, of_kind=lines_per_minute, in_all=20 * lines_per_minute)
        handler.addFilter(RateLimit(lambda record: _emit(handler, record), options))
    return handler


def _emit(handler: logging.Handler, record: logging.LogRecord) -> None:
    """Write without asking the filters, one of which is asking."""
    handler.acquire()
    try:
        handler.emit(record)
    finally:
        handler.release()


class TextLine(logging.Formatter):
    """`2026-01-31T12:00:00.000Z INFO covista_service.app: listens site=default`; what is no plain word is JSON."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        head = f"{_time_of(record)} {record.levelname} {record.name}: {_plain(record.getMessage())}"
        return " ".join([head, *(f"{name}={_word(value)}" for name, value in _fields_of(record).items())])


class JsonLine(logging.Formatter):
    """An object with `time`, `level`, `logger`, `message`, and the fields beside them."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        told = {
            "time": _time_of(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": _short(record.getMessage()),
        }
        return json.dumps({**_fields_of(record), **told}, default=str)


def _fields_of(record: logging.LogRecord) -> Mapping[str, object]:
    """What it is about, and the traceback of what was raised."""
    fields = {name: _short(value) for name, value in getattr(record, "fields", {}).items() if value is not None}
    if record.exc_info and record.exc_info[1] is not None:
        raised = record.exc_info[1]
        fields["raised"] = type(raised).__name__
        fields["traceback"] = "".join(traceback.format_exception(raised))[-_LONGEST_TRACEBACK:]
    return fields


def _time_of(record: logging.LogRecord) -> str:
    """RFC 3339, UTC, milliseconds."""
    return f"{time.strftime('%Y-%m-%dT%H:%M:%S', time.gmtime(record.created))}.{int(record.msecs):03d}Z"


def _short(value: object) -> object:
    if isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}... ({len(text)} characters)"


def _plain(text: str) -> str:
    """Without line ends or what would move a terminal's cursor."""
    shown = str(_short(text))
    return shown if shown.isprintable() else json.dumps(shown)[1:-1]


def _word(value: object) -> str:
    text = str(value)
    bare = text.isprintable() and text and not any(letter in text for letter in ' "=')
    return text if bare else json.dumps(text)
