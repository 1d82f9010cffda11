import asyncio
import threading

import pytest
from covista_service.workers import daemon


def test_work_goes_on_beside_and_its_result_comes() -> None:
    go_on = threading.Event()
    work = daemon.start(lambda: go_on.wait(10.0), "beside")
    (thread,) = (each for each in threading.enumerate() if each.name == "beside")
    assert thread.daemon
    assert not work.done()
    go_on.set()
    assert work.result(10.0) is True
    thread.join(10.0)


def test_its_error_comes_to_whoever_waits() -> None:
    with pytest.raises(ZeroDivisionError):
        daemon.start(lambda: 1 // 0, "failing").result(10.0)


def test_who_does_not_wait_any_more_disturbs_nothing() -> None:
    go_on = threading.Event()
    work = daemon.start(lambda: go_on.wait(10.0), "given up")
    (thread,) = (each for each in threading.enumerate() if each.name == "given up")

    async def give_up() -> None:
        waiting = asyncio.ensure_future(asyncio.wrap_future(work))
        await asyncio.sleep(0)
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting

    asyncio.run(give_up())
    go_on.set()
    assert work.result(10.0) is True
    thread.join(10.0)
