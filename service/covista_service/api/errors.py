"""What goes wrong, as RFC 9457 problem details: the only place that knows HTTP statuses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from http import HTTPStatus
from typing import Any

from covista_schemas.errors import CovistaError
from covista_schemas.reports import Problem
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from covista_service.answers import NotKnownError, problem_of
from covista_service.answers.past import CursorError, HistoryUnavailableError
from covista_service.api.negotiation import NotAcceptableError
from covista_service.loop.rooms import FullError

# What a status means here.
_MEANINGS: Mapping[int, str] = {
    400: "The body is no JSON",
    404: "What the question names is not known",
    406: "There is nothing that fits Accept",
    409: "Parts of the question contradict each other",
    422: "Malformed request",
    500: "A bug of the station's",
    503: "Not now: try again after Retry-After seconds",
}
PROBLEM_JSON = "application/problem+json"
# What to do about it, where the framework has no more to say than the status.
_UNROUTED: Mapping[int, str] = {
    404: "there is no such path; /openapi.json and /docs list those that there are",
    405: "this path does not know that method; Allow names those that it knows",
}


class ContradictionError(CovistaError):
    """A question whose parts are well formed and contradict each other."""


# What each error comes to, and when to try again.
_KINDS: Mapping[type[Exception], tuple[int, str, int | None]] = {
    CursorError: (422, "Malformed request", None),
    ContradictionError: (409, "Contradiction", None),
    NotAcceptableError: (406, "Not Acceptable", None),
    FullError: (503, "Too many ask", 1),
    HistoryUnavailableError: (503, "The history cannot be read", 5),
    TimeoutError: (503, "The station is too busy", 5),
}


def install(app: FastAPI, methods_of: Callable[[str], Sequence[str]]) -> None:
    """Have every error of the app answered with a problem; `methods_of` tells what may be done with a path."""

    def refused(request: Request, error: Exception) -> Response:
        response = _refused(request, error)
        if response.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
            # That of the first route alone is what the framework knows.
            response.headers["allow"] = ", ".join(methods_of(request.url.path))
        return response

    app.add_exception_handler(NotKnownError, _not_known)
    for kind in _KINDS:
        app.add_exception_handler(kind, _gone_wrong)
    app.add_exception_handler(RequestValidationError, _not_valid)
    app.add_exception_handler(HTTPException, refused)
    app.add_exception_handler(Exception, _broken)


def describe(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The answers with these statuses, for a route's description."""
    return {status: {"model": Problem, "description": _MEANINGS[status]} for status in statuses}


def refuse(problem: Problem, headers: Mapping[str, str] | None = None) -> Response:
    """The problem as an answer."""
    return Response(
        problem.model_dump_json(exclude_none=True),
        problem.status,
        headers=None if headers is None else dict(headers),
        media_type=PROBLEM_JSON,
    )


def _not_known(request: Request, error: Exception) -> Response:
    if not isinstance(error, NotKnownError):
        raise error
    return refuse(problem_of(error, request.url.path))


def _gone_wrong(request: Request, error: Exception) -> Response:
    status, title, again_s = next(_KINDS[kind] for kind in type(error).__mro__ if kind in _KINDS)
    headers = None if again_s is None else {"retry-after": f"{again_s}"}
    detail = str(error) or None
    return refuse(Problem(title=title, status=status, detail=detail, instance=request.url.path), headers)


def _not_valid(request: Request, error: Exception) -> Response:
    if not isinstance(error, RequestValidationError):
        raise error
    reasons = [f"{'.'.join(str(part) for part in each['loc'])}: {each['msg']}" for each in error.errors()]
    return refuse(Problem(title="Malformed request", status=422, detail="; ".join(reasons), instance=request.url.path))


def _refused(request: Request, error: Exception) -> Response:
    if not isinstance(error, HTTPException):
        raise error
    title = HTTPStatus(error.status_code).phrase
    detail = error.detail if error.detail != title else _UNROUTED.get(error.status_code)
    return refuse(
        Problem(title=title, status=error.status_code, detail=detail, instance=request.url.path), error.headers
    )


def _broken(request: Request, _error: Exception) -> Response:
    """Our own bug: the server logs it with its traceback, the client learns no more than that."""
    return refuse(Problem(title="Internal error", status=500, instance=request.url.path))
