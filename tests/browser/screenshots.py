"""Takes a picture of every page on a demo of its own: `python -m tests.browser.screenshots [FOLDER]`."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from covista_clients import MissionControl
from covista_service.bench.browsing import browser_path
from covista_service.bench.rig import free_endpoint
from PIL import Image
from playwright.sync_api import Browser, sync_playwright

PICTURES = Path(__file__).parents[2] / "docs" / "pictures" / "dashboard"
# Until a demo has something to tell: groups, a history, and robots that have moved.
_WARM_S = 200
_START_S = 120.0
_WIDE, _PHONE = (1280, 800), (390, 844)
_COLOURS = 256
# For the README.
_SMALL, _SMALL_PX = ("swarm", "timeline"), 640


@dataclass(frozen=True, slots=True)
class Shot:
    """A page as it is to be seen after `settled_s`; `full` shows all of it, however long."""

    name: str
    path: str
    size_px: tuple[int, int] = _WIDE
    dark: bool = False
    full: bool = True
    # Pictures come and the map settles.
    settled_s: float = 5


SHOTS = (
    Shot("swarm", "/", full=False),
    Shot("swarm_dark", "/", dark=True, full=False),
    Shot("swarm_phone", "/", _PHONE),
    Shot("similarity", "/similarity"),
    Shot("robot", "/robots/r1"),
    Shot("timeline", "/timeline"),
    Shot("what_if", "/what-if?groups=3&criterion=gain"),
    # Until rates are told.
    Shot("health", "/health", settled_s=25),
)


def main(folder: Path) -> None:
    """Take them all."""
    folder.mkdir(parents=True, exist_ok=True)
    with _demo() as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path(), args=["--no-sandbox"])
        first = browser.new_page()
        first.goto(f"{url}/dashboard/")
        first.wait_for_timeout(1000 * _WARM_S)
        for shot in (*SHOTS, Shot("pair", _best_pair(url))):
            _take(browser, url, shot, folder)
        browser.close()


def _best_pair(url: str) -> str:
    """The page of the two robots whose images have most in common."""
    with MissionControl(url) as control:
        pairs = control.pairs().pairs
    # Those of which images told last; where everybody moves, what was found is soon foretold.
    best = max(pairs, key=lambda pair: (pair.outcome == "measured", min(pair.overlap_a or 0.0, pair.overlap_b or 0.0)))
    return f"/pairs/{best.a}/{best.b}"


def _take(browser: Browser, url: str, shot: Shot, folder: Path) -> None:
    width, height = shot.size_px
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="dark" if shot.dark else "light")
    page.goto(f"{url}/dashboard{shot.path}")
    page.wait_for_timeout(1000 * shot.settled_s)
    _keep(Image.open(BytesIO(page.screenshot(full_page=shot.full))), folder / f"{shot.name}.png")
    page.close()


def _keep(picture: Image.Image, file: Path) -> None:
    """As a file of few colours, a third as large; of some a small one too."""
    picture.convert("RGB").quantize(_COLOURS).save(file, optimize=True)
    print(file)  # noqa: T201 - what was asked for
    if file.stem in _SMALL:
        small = picture.convert("RGB").resize((_SMALL_PX, round(_SMALL_PX * picture.height / picture.width)))
        small.quantize(_COLOURS).save(file.with_stem(f"{file.stem}_small"), optimize=True)


@contextmanager
def _demo() -> Iterator[str]:
    """A demo on ports of its own; the address of its API."""
    with tempfile.TemporaryDirectory(prefix="covista-") as temporary:
        command = [sys.executable, "-m", "covista_service", "demo", "--api", "127.0.0.1:0", "--link", free_endpoint()]
        command += ["--database", f"sqlite:///{temporary}/covista.db"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as demo:
            try:
                assert demo.stdout is not None
                found = next(filter(None, (re.search(r"pages +(\S+)/dashboard/", line) for line in demo.stdout)))
                yield found[1]
            finally:
                demo.terminate()
                demo.communicate(timeout=_START_S)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)
