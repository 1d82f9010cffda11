import asyncio
import threading

import pytest
from covista_service.loop.rooms import FullError, Room


def test_so_many_work_at_a_time_so_many_wait_and_one_more_hears_so() -> None:
    let, inside, most = threading.Event(), [0, 0], 2

    def work() -> str:
        inside[0] += 1
        inside[1] = max(inside)
        assert let.wait(10)
        inside[0] -= 1
        return "done"

    async def scenario() -> None:
        room = Room(at_once=most, waiting=1)
        asked = [asyncio.ensure_future(room.run(work)) for _ in range(3)]
        await asyncio.sleep(0)
        with pytest.raises(FullError):
            await room.run(work)
        patient = asyncio.ensure_future(room.run(work, patient=True))
        await asyncio.sleep(0)
        let.set()
        assert await asyncio.gather(*asked, patient) == ["done"] * 4
        assert await room.run(work) == "done"

    asyncio.run(scenario())
    assert inside[1] <= most


def test_a_failure_leaves_room_for_others() -> None:
    async def scenario() -> None:
        room = Room(at_once=1, waiting=0)
        for _ in range(3):
            with pytest.raises(ZeroDivisionError):
                await room.run(lambda: 1 // 0)
        assert await room.run(lambda: 1) == 1

    asyncio.run(scenario())
