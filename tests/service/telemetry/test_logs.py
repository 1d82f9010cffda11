"""One line a record, whatever is in it."""

import io
import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from covista_service.telemetry import about, log_to_stderr
from covista_service.telemetry.logs import _OURS, JsonLine, TextLine, handler_for
from hypothesis import given
from hypothesis import strategies as st

from tests.service.telemetry.records import record


def raised() -> Exception:
    try:
        raise ValueError("no\nsuch thing")
    except ValueError as error:
        return error


def test_text_has_time_level_logger_message_and_fields() -> None:
    made = record("dropped", robot="r1", count=3, said="no pose given", nothing=None)
    made.created, made.msecs = 1_700_000_000.25, 250.0
    line = TextLine().format(made)
    assert line == (
        '2023-11-14T22:13:20.250Z WARNING covista_service.loop: dropped robot=r1 count=3 said="no pose given"'
    )


def test_json_has_the_same_as_an_object() -> None:
    made = record("a %s", "word", level=logging.INFO, pair="r1/r2", share=0.5, nothing=None)
    made.created, made.msecs = 1_700_000_000.25, 250.0
    assert json.loads(JsonLine().format(made)) == {
        "time": "2023-11-14T22:13:20.250Z",
        "level": "info",
        "logger": "covista_service.loop",
        "message": "a word",
        "pair": "r1/r2",
        "share": 0.5,
    }


def test_a_traceback_is_part_of_the_line() -> None:
    made = record("failed", raised=raised())
    told = json.loads(JsonLine().format(made))
    assert told["raised"] == "ValueError"
    assert "in raised" in told["traceback"]
    line = TextLine().format(made)
    assert "raised=ValueError" in line
    assert len(line.splitlines()) == 1


@given(st.text(), st.text(), st.floats())
def test_no_text_breaks_a_line_or_moves_a_cursor(message: str, said: str, number: float) -> None:
    made = record("%s", message, said=said, number=number)
    for formatter in (TextLine(), JsonLine()):
        assert formatter.format(made).isprintable()
    told = json.loads(JsonLine().format(made), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert (told["message"], told["said"]) == (message, said)


def test_long_texts_are_cut() -> None:
    made = record("x" * 10_000, said="y" * 10_000)
    for formatter in (TextLine(), JsonLine()):
        line = formatter.format(made)
        assert len(line) < 1500
        assert "10000 characters" in line


def test_fields_cannot_pass_for_what_every_line_has() -> None:
    told = json.loads(JsonLine().format(record("dropped", level=logging.ERROR, message="fine", time="never")))
    assert told["message"] == "dropped"
    assert told["time"] != "never"


@contextmanager
def logging_to(handler: logging.Handler) -> Iterator[logging.Logger]:
    logger = logging.getLogger("tests.of.a.log")
    logger.addHandler(handler)
    logger.propagate = False
    try:
        yield logger
    finally:
        logger.removeHandler(handler)
        logger.propagate = True


def test_a_flood_writes_so_many_lines_and_no_more() -> None:
    stream = io.StringIO()
    with logging_to(handler_for(stream, "text", lines_per_minute=20)) as logger:
        for number in range(5000):
            logger.warning("dropped", extra=about(robot=f"r{number % 100}"))
    assert len(stream.getvalue().splitlines()) == 20


def test_without_a_limit_all_is_written() -> None:
    stream = io.StringIO()
    with logging_to(handler_for(stream, "json", lines_per_minute=0)) as logger:
        for _ in range(500):
            logger.warning("dropped", extra=about(robot="r1"))
    assert len(stream.getvalue().splitlines()) == 500


@pytest.fixture
def root() -> Iterator[logging.Logger]:
    """The root logger, left as it was found."""
    root = logging.getLogger()
    loggers = [root, *map(logging.getLogger, [*_OURS, "uvicorn.access"])]
    handlers, levels = root.handlers[:], [each.level for each in loggers]
    root.handlers = []
    yield root
    root.handlers = handlers
    for each, level in zip(loggers, levels, strict=True):
        each.setLevel(level)


def test_other_loggers_go_the_same_way(root: logging.Logger, capsys: pytest.CaptureFixture[str]) -> None:
    log_to_stderr("warning", "json")
    logging.getLogger("uvicorn.error").warning("invalid request")
    logging.getLogger("uvicorn.error").info("not heard")
    lines = capsys.readouterr().err.splitlines()
    assert [json.loads(line)["logger"] for line in lines] == ["uvicorn.error"]


def test_what_is_for_who_looks_closely_is_our_own_alone(
    root: logging.Logger, capsys: pytest.CaptureFixture[str]
) -> None:
    log_to_stderr("debug")
    logging.getLogger("numba.core.byteflow").debug("dispatch")
    logging.getLogger("covista_service.loop").debug("surveyed", extra=about(pair="r1/r2"))
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("DEBUG covista_service.loop: surveyed pair=r1/r2")
