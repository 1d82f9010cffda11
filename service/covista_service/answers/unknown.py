"""Questions that name what is not there."""

from __future__ import annotations

from covista_schemas.errors import CovistaError
from covista_schemas.reports import Problem


class NotKnownError(CovistaError, LookupError):
    """What a question names is not there; `title` says in two words what."""

    def __init__(self, title: str, detail: str) -> None:
        super().__init__(detail)
        self.title = title
        self.detail = detail


def problem_of(error: NotKnownError, instance: str | None = None) -> Problem:
    """The error as problem details."""
    return Problem(title=error.title, status=404, detail=error.detail, instance=instance)
