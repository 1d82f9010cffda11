"""What goes wrong, as RFC 9457 problem details: the only place that knows HTTP statuses."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from covista_schemas.reports import Problem
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException

from covista_service.answers import NotKnownError, problem_of

PROBLEM_JSON = "application/problem+json"


def install(app: FastAPI) -> None:
    """Have every error of the app answered with a problem."""
    app.add_exception_handler(NotKnownError, _not_known)
    app.add_exception_handler(RequestValidationError, _not_valid)
    app.add_exception_handler(HTTPException, _refused)
    app.add_exception_handler(Exception, _broken)


def describe(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The answers with these statuses, for a route's description."""
    return {status: {"model": Problem, "description": HTTPStatus(status).phrase} for status in statuses}


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


def _not_valid(request: Request, error: Exception) -> Response:
    if not isinstance(error, RequestValidationError):
        raise error
    reasons = [f"{'.'.join(str(part) for part in each['loc'])}: {each['msg']}" for each in error.errors()]
    return refuse(Problem(title="Malformed request", status=422, detail="; ".join(reasons), instance=request.url.path))


def _refused(request: Request, error: Exception) -> Response:
    if not isinstance(error, HTTPException):
        raise error
    title = HTTPStatus(error.status_code).phrase
    detail = error.detail if error.detail != title else None
    return refuse(
        Problem(title=title, status=error.status_code, detail=detail, instance=request.url.path), error.headers
    )


def _broken(request: Request, _error: Exception) -> Response:
    """Our own bug: the server logs it with its traceback, the client learns no more than that."""
    return refuse(Problem(title="Internal error", status=500, instance=request.url.path))
