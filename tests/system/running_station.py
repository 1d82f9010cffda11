"""A station in this process, as `covista-station serve` runs it, for real rovers and real questions."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from covista_service.config import Settings
from covista_service.serve import Running, run

from tests.service.deadline import free_endpoint, wait_until


def settings_for(folder: Path, **changes: Any) -> Settings:
    values = {"api": "127.0.0.1:0", "link": (free_endpoint(),), "database": f"sqlite:///{folder / 'covista.db'}"}
    return Settings.model_validate(values | changes)


@contextmanager
def running_station(settings: Settings) -> Iterator[Running]:
    """Serve in a thread; at the end the station is gone, its threads too."""
    before = set(threading.enumerate())
    listening = threading.Event()
    running: list[Running] = []
    failure: list[BaseException] = []

    def ready(station: Running) -> None:
        running.append(station)
        listening.set()

    def serve() -> None:
        try:
            run(settings, ready=ready)
        except BaseException as error:
            failure.append(error)
            raise
        finally:
            listening.set()

    thread = threading.Thread(target=serve, name="station")
    thread.start()
    assert listening.wait(30)
    assert not failure, failure
    try:
        yield running[0]
    finally:
        running[0].stop()
        thread.join(10)
    assert not thread.is_alive()
    # Those of AnyIO may be another station's, started since.
    wait_until(
        lambda: all(each in before or each.name.startswith("AnyIO") for each in threading.enumerate()),
        "its threads have ended",
    )
