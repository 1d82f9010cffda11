"""Looks for bytes that break a law, led by what they reach: `python -m tests.fuzz codec --payloads=1000000`.

What else follows the target's name is for libFuzzer: its options, and folders (the first takes what is found on the
way), or files that are to be run once. But for those it starts from the corpus.
"""

import logging
import math
import os
import random
import sys
from pathlib import Path

import atheris

# Beyond what a pose may have; keyframes' own limit is too far away for a fuzzer.
MOST_BYTES = 20_000
_TELL_EVERY = 100_000
_PAYLOADS = "--payloads="

with atheris.instrument_imports(include=["covista_schemas"]):
    from tests.fuzz import codec_law
# What is compiled must not be instrumented.
import covista_service.station.station  # noqa: E402, F401

with atheris.instrument_imports(include=["covista_service.link"]):
    from tests.fuzz import ingest_law
from tests.fuzz import mutation  # noqa: E402 - imports what is instrumented


class Count:
    """How many payloads were tried, and in how many goes: a script has several. Ends the process after `most`."""

    def __init__(self, target: str, most: float) -> None:
        self._target, self._most = target, most
        self._tried = self._goes = self._told = 0

    def add(self, payloads: int) -> None:
        self._tried += payloads
        self._goes += 1
        if self._tried - self._told >= _TELL_EVERY or self._goes == 1 or self._tried >= self._most:
            self._tell()
        if self._tried >= self._most:
            # As libFuzzer does it: what was found is in its folder already.
            os._exit(0)

    def _tell(self) -> None:
        self._told = self._tried
        resident_mb = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        told = f"{self._target}: {self._tried} payloads in {self._goes} goes; resident: {resident_mb:.0f} MB"
        print(told, file=sys.stderr, flush=True)


def main(target: str, *options: str) -> None:
    """Run one target to the end; libFuzzer ends the process."""
    # A fault that is caught and logged is told by the law, once.
    logging.disable(logging.CRITICAL)
    most = [float(option.removeprefix(_PAYLOADS)) for option in options if option.startswith(_PAYLOADS)]
    options = tuple(option for option in options if not option.startswith(_PAYLOADS))
    count = Count(target, *most or [math.inf])

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
