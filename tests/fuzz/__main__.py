"""Looks for bytes that break a law, led by what they reach: `python -m tests.fuzz codec -runs=1000000`.

What follows the target's name is for libFuzzer: its options, and folders (the first takes what is found on the way), or
files that are to be run once. But for those it starts from the corpus.
"""

import logging
import random
import sys
from pathlib import Path

import atheris

# Beyond what a pose may have; keyframes' own limit is too far away for a fuzzer.
MOST_BYTES = 20_000
_TELL_EVERY = 100_000

with atheris.instrument_imports(include=["covista_schemas"]):
    from tests.fuzz import codec_law
# What is compiled must not be instrumented.
import covista_service.station.station  # noqa: E402, F401

with atheris.instrument_imports(include=["covista_service.link"]):
    from tests.fuzz import ingest_law
from tests.fuzz import mutation  # noqa: E402 - imports what is instrumented


class Count:
    """How many payloads were tried: a script has several."""

    def __init__(self, target: str) -> None:
        self._target = target
        self._tried = self._told = 0

    def add(self, payloads: int) -> None:
        self._tried += payloads
        if self._tried - self._told >= _TELL_EVERY:
            self._told = self._tried
            print(f"{self._target}: {self._tried} payloads", file=sys.stderr, flush=True)


def main(target: str, *options: str) -> None:
    """Run one target to the end; libFuzzer ends the process."""
    # A fault that is caught and logged is told by the law, once.
    logging.disable(logging.CRITICAL)
    count = Count(target)

    def codec(data: bytes) -> None:
        count.add(1)
        codec_law.check_payload(data)

    def ingest(data: bytes) -> None:
        count.add(ingest_law.check_script(data))

    alone = any(Path(option).is_file() for option in options)
    corpus = [] if alone else [str(Path(__file__).parent / "corpus" / target)]
    atheris.Setup(
        [target, f"-max_len={MOST_BYTES}", *options, *corpus],
        {"codec": codec, "ingest": ingest}[target],
        custom_mutator={"codec": mutate, "ingest": mutate_script}[target],
    )
    atheris.Fuzz()


def mutate(data: bytes, most: int, seed: int) -> bytes:
    """Half of the time a field, half of the time bytes."""
    rng = random.Random(seed)
    told = mutation.changed(data, rng) if rng.random() < 0.5 else None
    return told if told is not None and len(told) <= most else atheris.Mutate(data, most)


def mutate_script(data: bytes, most: int, seed: int) -> bytes:
    """Half of the time a message, or which and when it is; half of the time bytes."""
    rng = random.Random(seed)
    parts = list(ingest_law.parts(data))
    if not parts or rng.random() < 0.5:
        return atheris.Mutate(data, most)
    at = rng.randrange(len(parts))
    head, payload = parts[at]
    match rng.randrange(4):
        case 0:
            parts[at] = (head ^ 1 << rng.randrange(8), payload)
        case 1:
            parts.insert(rng.randrange(len(parts) + 1), (head, payload))
        case 2:
            parts.insert(rng.randrange(len(parts) + 1), parts.pop(at))
        case _:
            parts[at] = (head, mutate(payload, most, seed))
    told = ingest_law.script_of(parts)
    return told if len(told) <= most else atheris.Mutate(data, most)


if __name__ == "__main__":
    main(*sys.argv[1:])
