import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from covista_clients.__main__ import main
from covista_schemas.reports import Report

from tests.clients import sample

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run the command in this process: its exit code, stdout and stderr."""
    monkeypatch.delenv("COVISTA_URL", raising=False)
    monkeypatch.delenv("COVISTA_TOKEN", raising=False)
    monkeypatch.delenv("COVISTA_CA", raising=False)
    monkeypatch.setenv("COLUMNS", "160")

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


class _Answering(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        assert isinstance(self.server, _Station)
        self.server.asked.append((self.path, self.headers["Authorization"]))
        self._answer(200, sample.ANSWERS[self.path.partition("?")[0]])

    def do_PATCH(self) -> None:
        self._hear()
        self._answer(200, sample.ANSWERS[self.path])

    def do_POST(self) -> None:
        self._hear()
        self._answer(200, sample.PREVIEW)

    def do_DELETE(self) -> None:
        self._hear()
        self._answer(204 if self.path in sample.ANSWERS else 404)

    def _hear(self) -> None:
        assert isinstance(self.server, _Station)
        content = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.told.append((self.command, self.path, json.loads(content or "null")))

    def _answer(self, status: int, answer: Report | None = None) -> None:
        self.send_response(status)
        self.end_headers()
        if answer is not None:
            self.wfile.write(answer.model_dump_json().encode())

    def log_message(self, *arguments: object) -> None:
        """Silence."""


class _Station(ThreadingHTTPServer):
    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Answering)
        self.asked: list[tuple[str, str | None]] = []
        self.told: list[tuple[str, str, object]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


@pytest.fixture
def api() -> Iterator[_Station]:
    """The API of a station that says what is in `sample`."""
    with _Station() as station:
        thread = threading.Thread(target=station.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield station
        station.shutdown()
        thread.join()
