"""Pages for people in a browser, as the door sees them: which are open, and where somebody without a token is sent."""

from __future__ import annotations

from dataclasses import dataclass

from covista_service.access.scopes import Scope


@dataclass(frozen=True, slots=True)
class Pages:
    """All below `prefix`: `open` and what begins with `files` tell nothing of the robots.

    A browser that asks for a page without a session is sent to `log_in`; what begins with `data` is asked for by
    scripts, which want an answer instead. Websockets are there below `sockets` alone.
    """

    prefix: str
    open: frozenset[str]
    files: tuple[str, ...]
    data: str
    log_in: str
    sockets: str

    def holds(self, path: str) -> bool:
        """Is this one of them?"""
        return path == self.prefix or path.startswith(f"{self.prefix}/")

    def wanted_scope(self, path: str) -> Scope | None:
        """What it needs; None where it is open. Nothing here changes the station: that is REST's."""
        below = path.removeprefix(self.prefix)
        return None if below in self.open or below.startswith(self.files) else Scope.READ

    def is_page(self, path: str) -> bool:
        """Whether a person is to see it."""
        below = path.removeprefix(self.prefix)
        return not below.startswith((self.data, self.sockets))
