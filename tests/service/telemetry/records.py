"""Records of the log, as loggers make them."""

import logging

from covista_service.telemetry import about


def record(
    message: str = "dropped",
    /,
    *args: object,
    name: str = "covista_service.loop",
    level: int = logging.WARNING,
    raised: BaseException | None = None,
    **fields: object,
) -> logging.LogRecord:
    traced = None if raised is None else (type(raised), raised, raised.__traceback__)
    made = logging.LogRecord(name, level, __file__, 1, message, args, traced)
    made.__dict__.update(about(**fields))
    return made
