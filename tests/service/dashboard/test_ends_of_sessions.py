"""What was begun with a session ends with it, and what a session is told by who stands before the station."""

from collections.abc import Iterator

import pytest
from covista_schemas.reports import Problem
from covista_service.access.sessions import COOKIE
from covista_service.api.stream import EVENT_STREAM
from fastapi.responses import StreamingResponse

from tests.service.dashboard.front import OWN, locked
from tests.service.dashboard.test_log_in import session_of


def test_a_stream_ends_when_its_session_is_logged_out() -> None:
    front, reader, _ = locked()
    session = session_of(front.log_in(reader))

    def parts() -> Iterator[str]:
        yield ": alive\n\n"
        front.gate.sessions.end(session)
        yield "id: 1\nevent: join\ndata: {}\n\n"

    front.app.get("/stream")(lambda: StreamingResponse(parts(), media_type=EVENT_STREAM))
    alive, last, rest = front.ask("/stream", cookie=f"{COOKIE}={session}", **OWN).text.split("\n\n")
    assert (alive, rest) == (": alive", "")
    data = last.splitlines()[1].removeprefix("data: ")
    assert Problem.model_validate_json(data).detail == "this session has ended: log in again"


def test_a_stream_goes_on_while_its_session_does() -> None:
    front, reader, _ = locked()
    session = session_of(front.log_in(reader))
    front.app.get("/stream")(lambda: StreamingResponse(iter(["a\n\n", "b\n\n"]), media_type=EVENT_STREAM))
    assert front.ask("/stream", cookie=f"{COOKIE}={session}", **OWN).text == "a\n\nb\n\n"


@pytest.mark.parametrize(("origin", "secure"), [("https://station", True), ("http://station", False)])
def test_behind_a_proxy_that_speaks_tls_the_cookie_is_for_tls_alone(origin: str, secure: bool) -> None:
    front, reader, _ = locked()
    answer = front.log_in(reader, origin=origin, **OWN)
    assert ("; secure" in answer.headers["set-cookie"].lower()) is secure
