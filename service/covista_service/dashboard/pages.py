"""The pages: what stands on each, and under which address. Shells alone: what they show, their views ask for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from covista_service.dashboard import views

# Where one can go from everywhere: address and name.
PLACES = (
    ("/", "Swarm"),
    ("/similarity", "Similarity"),
    ("/timeline", "Timeline"),
    ("/what-if", "What if"),
    ("/health", "Health"),
)


def register() -> None:
    """Tell NiceGUI of all pages; once a process."""
    ui.page("/", title="Swarm - Covista")(swarm)
    ui.page("/similarity", title="Similarity - Covista")(similarity)
    ui.page("/pairs/{a}/{b}", title="Pair - Covista")(pair)
    ui.page("/robots/{robot}", title="Robot - Covista")(robot)
    ui.page("/timeline", title="Timeline - Covista")(timeline)
    ui.page("/what-if", title="What if - Covista")(what_if)
    ui.page("/health", title="Health - Covista")(health)


@contextmanager
def _shell(heading: str, here: str = "") -> Iterator[None]:
    """What all pages have: the way to the others, how the station is, and one heading."""
    ui.add_css(views.STYLE, shared=False)
    with ui.element("header").classes("cv-head"):
        ui.html('<a class="cv-skip" href="#cv-main">To the content</a>', sanitize=False)
        with ui.element("nav").props('aria-label="Pages"'):
            for address, name in PLACES:
                link = ui.link(name, address).classes("cv-place")
                if address == here:
                    link.props('aria-current="page"')
        views.Standing()
    # What the framework puts around it is the page's main already.
    with ui.element("div").classes("cv-main").props('id="cv-main" tabindex="-1"'):
        ui.html(f"<h1>{heading}</h1>", sanitize=True)
        yield


def swarm() -> None:
    """Who is with whom."""
    with _shell("Swarm", "/"):
        views.Swarm()


def similarity() -> None:
    """The matrix, and why so many groups."""
    with _shell("Similarity", "/similarity"):
        views.Similarity()


def pair(a: str, b: str) -> None:
    """What two robots both see."""
    with _shell("Pair"):
        views.Pair(a=a, b=b)


def robot(robot: str) -> None:
    """One robot: what it sees, with whom, and what becomes of what it sends."""
    with _shell("Robot"):
        views.Robot(robot=robot)


def timeline() -> None:
    """What was."""
    with _shell("Timeline", "/timeline"):
        views.Timeline()


def what_if() -> None:
    """What other settings would make of the swarm."""
    with _shell("What if", "/what-if"):
        views.WhatIf()


def health() -> None:
    """How the station is."""
    with _shell("Health", "/health"):
        views.Health()
