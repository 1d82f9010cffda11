"""Microseconds since the epoch, which the history reckons in, and everybody else's time."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
# What a datetime can say, and every database can compare.
EARLIEST_US = (datetime(1, 1, 1, tzinfo=UTC) - _EPOCH) // timedelta(microseconds=1)
LATEST_US = (datetime(9999, 12, 31, tzinfo=UTC) - _EPOCH) // timedelta(microseconds=1)


def microseconds(time: datetime) -> int:
    """A moment as microseconds."""
    return (time - _EPOCH) // timedelta(microseconds=1)


def moment(time_us: int) -> datetime:
    """Microseconds as a moment."""
    return _EPOCH + timedelta(microseconds=within(time_us))


def not_before_us(time_ns: int) -> int:
    """The first microsecond that is not before `time_ns`."""
    return within(-(-time_ns // 1000))


def not_after_us(time_ns: int) -> int:
    """The last microsecond that is not after `time_ns`."""
    return within(time_ns // 1000)


def within(time_us: int) -> int:
    """The nearest moment that can be told."""
    return min(max(time_us, EARLIEST_US), LATEST_US)
