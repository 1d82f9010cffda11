"""What a station refuses, as exceptions."""

from __future__ import annotations

from datetime import UTC, datetime
from email.utils import parsedate_to_datetime

import httpx
from covista_schemas.errors import ApiError, ForbiddenError, TooManyError, UnauthorizedError
from covista_schemas.reports import Problem
from pydantic import ValidationError

_KINDS: dict[int, type[ApiError]] = {401: UnauthorizedError, 403: ForbiddenError, 429: TooManyError}
# A preview, the one POST, changes nothing.
_READING = {"GET", "HEAD", "POST"}


def refusal(response: httpx.Response) -> ApiError:
    """The error that says what the station said, and where it is about access what is needed."""
    title, detail = _said(response)
    status = response.status_code
    # Where no token would help, such as under a name that is not the station's, it does not ask for one.
    if status in (401, 403) and "WWW-Authenticate" in response.headers:
        request = response.request
        scope = "read" if request.method in _READING else "operate"
        title = f"{request.method} {request.url.path} needs a token with scope {scope}"
    error = _KINDS.get(status, ApiError)(title, status=status, detail=detail)
    error.retry_after_s = retry_after_s(response)
    return error


def retry_after_s(response: httpx.Response) -> float | None:
    """Seconds until the station wants to be asked again; None where it does not say, or not in a way to be read."""
    text = response.headers.get("Retry-After", "").strip()
    if text.isascii() and text.isdigit():
        return float(text)
    try:
        moment = parsedate_to_datetime(text)
    except ValueError:
        return None
    return max(0.0, (moment.replace(tzinfo=moment.tzinfo or UTC) - datetime.now(UTC)).total_seconds())


def _said(response: httpx.Response) -> tuple[str, str | None]:
    try:
        problem = Problem.read(response.content)
    except ValidationError:
        return f"{response.url} answered {response.status_code}", None
    return problem.title, problem.detail
