"""Where the pages are, and which of them are open."""

from __future__ import annotations

from importlib.util import find_spec

from covista_service.access import Pages

PREFIX = "/dashboard"
LOG_IN = "/log-in"
# With none at all a browser would not say either from where a form is sent.
REFERRER = "same-origin"
# Pages that are open at a time: each holds some memory.
MOST_PAGES = 256
FILES = ("/_nicegui/", "/files/")
PAGES = Pages(
    prefix=PREFIX,
    open=frozenset({LOG_IN, "/session"}),
    files=FILES,
    data="/data/",
    log_in=LOG_IN,
    sockets="/_nicegui_ws/",
)


def has_pages() -> bool:
    """Whether what serves them is installed."""
    return find_spec("nicegui") is not None
