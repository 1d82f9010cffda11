import mmap
from collections.abc import Iterator

import numpy as np
import pytest
from covista_service.perception.camera import Features
from covista_service.workers.arena import Arena, Lent, Slip
from hypothesis import given
from hypothesis import strategies as st

_PAGES = 8


def features(n: int, seed: int = 0, width: int = 128) -> Features:
    random = np.random.default_rng(seed)
    names = random.integers(0, 256, (n, width)).astype(np.uint8)
    return Features("rootsift", random.uniform(0, 640, (n, 2)).astype(np.float32), names)


def same(one: Features, other: Features) -> bool:
    return (
        one.kind == other.kind
        and np.array_equal(one.keypoints_px, other.keypoints_px)
        and np.array_equal(one.descriptors, other.descriptors)
    )


@pytest.fixture
def arena() -> Iterator[Arena]:
    arena = Arena(_PAGES * mmap.PAGESIZE)
    yield arena
    arena.close()


@pytest.fixture
def lent(arena: Arena) -> Iterator[Lent]:
    lent = Lent(arena.path)
    yield lent
    lent.close()


@pytest.mark.parametrize("laid", [features(0), features(1), features(100), features(40, width=32)])
def test_what_is_laid_down_is_read_as_it_was(arena: Arena, lent: Lent, laid: Features) -> None:
    slip = arena.put(laid)
    assert slip is not None
    read = lent.features(slip)
    assert same(read, laid)
    assert read.keypoints_px.dtype == np.float32
    assert read.descriptors.flags.writeable


def test_a_full_arena_says_so_and_has_room_again(arena: Arena, lent: Lent) -> None:
    large = features(_PAGES * mmap.PAGESIZE // 136)
    slip = arena.put(large)
    assert slip is not None
    assert arena.put(features(1)) is None
    arena.free(slip)
    again = arena.put(features(1, seed=2))
    assert again is not None
    assert same(lent.features(again), features(1, seed=2))
    assert arena.put(features(_PAGES * mmap.PAGESIZE)) is None


def test_memory_is_given_back(arena: Arena) -> None:
    """What is not laid down takes no memory; read by the name of the file, that knows how much does."""
    import os

    def blocks() -> int:
        return os.stat(arena.path).st_blocks

    assert blocks() == 0
    slip = arena.put(features(200))
    assert slip is not None
    assert blocks() > 0
    arena.free(slip)
    assert blocks() == 0


@given(st.lists(st.one_of(st.integers(0, 120), st.just(-1)), max_size=40))
def test_slips_never_overlap_and_all_room_comes_back(steps: list[int]) -> None:
    arena = Arena(_PAGES * mmap.PAGESIZE)
    lent = Lent(arena.path)
    held: list[tuple[Slip, Features]] = []
    for number, n in enumerate(steps):
        if n < 0 and held:
            arena.free(held.pop(len(held) // 2)[0])
        elif n >= 0:
            laid = features(n, seed=number)
            slip = arena.put(laid)
            if slip is not None:
                held.append((slip, laid))
        assert all(same(lent.features(slip), laid) for slip, laid in held)
    for slip, _ in held:
        arena.free(slip)
    everything = arena.put(features(_PAGES * mmap.PAGESIZE // 136))
    assert everything is not None
    lent.close()
    arena.close()
