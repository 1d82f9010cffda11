"""The station's process: serves, tells its parent how it is doing, and stops when the parent is gone."""

from __future__ import annotations

import threading

from covista_schemas.errors import CovistaError

from covista_service import serve, telemetry
from covista_service.config import Settings
from covista_service.demo.children import Line, end_soon
from covista_service.demo.tidings import Failed, Ready


def play(line: Line, settings: Settings) -> None:
    """Serve. Says `Ready` or `Failed`, answers every message with a `telemetry.Summary`, ends with its line."""
    telemetry.log_to_stderr(settings.log_level, settings.log_format, settings.log_lines_per_minute)

    def ready(running: serve.Running) -> None:
        line.send(Ready(running.url, running.link))
        threading.Thread(target=_answer, args=(line, running), name="parent", daemon=True).start()

    try:
        serve.run(settings, ready=ready, signals=False)
    except CovistaError as error:
        line.send(Failed(str(error)))


def _answer(line: Line, running: serve.Running) -> None:
    while line.receive() is not None:
        line.send(running.summary())
    end_soon()
    running.stop()
