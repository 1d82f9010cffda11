"""What all reports share."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from covista_schemas.keys import ID_PATTERN

RobotId = Annotated[str, Field(pattern=f"^{ID_PATTERN}$", examples=["r1"])]
Share = Annotated[float, Field(ge=0, le=1)]


def _utc(value: datetime) -> datetime:
    return value.astimezone(UTC) if value.tzinfo else value.replace(tzinfo=UTC)


Time = Annotated[datetime, AfterValidator(_utc)]


def time_of(time_ns: int) -> datetime:
    """A moment in ns since the epoch as UTC time (microseconds are what RFC 3339 readers keep)."""
    seconds, rest = divmod(time_ns, 1_000_000_000)
    return datetime.fromtimestamp(seconds, UTC).replace(microsecond=rest // 1000)


class Report(BaseModel):
    """What all answers share: frozen, and no number that is not finite."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    @classmethod
    def read(cls, data: bytes | str) -> Self:
        """The report in JSON; what only later versions of the station say is passed over. Raises ValidationError."""
        return cls.model_validate_json(data, extra="ignore")
