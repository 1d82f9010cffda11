"""The OpenAPI description, with problems under the media type that they are sent with."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from covista_schemas.reports import EventsMissed, Problem
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from covista_service.api.errors import PROBLEM_JSON
from covista_service.api.guard import wanted_scope

Description = dict[str, Any]
_PROBLEM = {"$ref": "#/components/schemas/Problem"}
_SECURITY = "token"
_SCHEME = {
    "type": "http",
    "scheme": "bearer",
    "description": "A token of the station, made with `covista-station token add NAME`. Scope `read` is enough to ask, "
    "`operate` to change something too. A station without any token, which listens on loopback, asks for none.",
}
_CHALLENGE = {"WWW-Authenticate": {"schema": {"type": "string"}, "description": "What is needed (RFC 6750)."}}
_PATIENCE = {"Retry-After": {"schema": {"type": "integer"}, "description": "Seconds until it is worth another try."}}
# What comes before any route, by status: why, and with which headers.
_REFUSALS: dict[str, tuple[str, Description]] = {
    "401": ("No token, or one that is not known or revoked", _CHALLENGE),
    "403": ("The token does not allow this", _CHALLENGE),
    "429": ("Too many requests without a good token from this address", _PATIENCE),
    "503": ("Too many clients, or nobody can be let in yet", _PATIENCE),
}
_BODY_REFUSALS = {"408": "The body did not come in time", "413": "The body is too long"}
_UNUSED = ("HTTPValidationError", "ValidationError")


def describe(app: FastAPI) -> Callable[[], Description]:
    """A function that gives the app's description, made once."""

    def openapi() -> Description:
        if app.openapi_schema is None:
            app.openapi_schema = _corrected(
                get_openapi(
                    title=app.title,
                    version=app.version,
                    description=app.description,
                    routes=app.routes,
                    openapi_version="3.1.0",
                )
            )
        return app.openapi_schema

    return openapi


def without_tokens(description: Description) -> Description:
    """The description of a station that nobody needs a token for: one may be sent along."""
    paths = {
        path: {
            method: {**operation, "security": [{}, *operation["security"]] if operation["security"] else []}
            for method, operation in operations.items()
        }
        for path, operations in description["paths"].items()
    }
    return {**description, "paths": paths}


def _corrected(description: Description) -> Description:
    for path in description["paths"].values():
        for operation in path.values():
            _given(operation)
    for status, response in _responses(description):
        content = response.get("content", {})
        if status == "422":
            response["description"] = "Malformed request"
            response["content"] = {PROBLEM_JSON: {"schema": _PROBLEM}}
        elif content.get("application/json", {}).get("schema") == _PROBLEM:
            response["content"] = {PROBLEM_JSON: content["application/json"]}
    schemas = description["components"]["schemas"]
    for model in (Problem, EventsMissed):
        schemas.setdefault(model.__name__, model.model_json_schema())
    description["components"]["securitySchemes"] = {_SECURITY: _SCHEME}
    for path, method, operation in _operations(description):
        _secure(path, method, operation)
    for name in _UNUSED:
        schemas.pop(name, None)
    return description


def _secure(path: str, method: str, operation: Description) -> None:
    """Say which token an operation needs, and what is answered without it."""
    wanted = wanted_scope(method.upper(), path)
    operation["security"] = [] if wanted is None else [{_SECURITY: [str(wanted)]}]
    responses = operation["responses"]
    content = {PROBLEM_JSON: {"schema": _PROBLEM}}
    for status, (why, headers) in _REFUSALS.items() if wanted is not None else ():
        responses.setdefault(status, {"description": why, "content": content})
        responses[status].setdefault("headers", headers)
    for status, why in _BODY_REFUSALS.items() if "requestBody" in operation else ():
        responses.setdefault(status, {"description": why, "content": content})


def _operations(description: Description) -> Iterator[tuple[str, str, Description]]:
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            yield path, method, operation


def _responses(description: Description) -> Iterator[tuple[str, Description]]:
    for _, _, operation in _operations(description):
        yield from operation["responses"].items()


def _given(operation: Description) -> None:
    """What is left out of a question is no null, as models have it."""
    for parameter in operation.get("parameters", []):
        schema = parameter["schema"]
        kinds = [kind for kind in schema.get("anyOf", []) if kind != {"type": "null"}]
        if len(kinds) == 1:
            del schema["anyOf"]
            schema.update(kinds[0])


def methods_of(description: Description, path: str) -> list[str]:
    """What may be done with a path: with itself if it is told of, else with those that it is one of. GET means HEAD."""
    fitting = [template for template in description["paths"] if _fits(template, path)]
    named = [path] if path in fitting else fitting
    found = {method.upper() for template in named for method in description["paths"][template]}
    return sorted(found | ({"HEAD"} if "GET" in found else set()))


def _fits(template: str, path: str) -> bool:
    return re.fullmatch(re.sub(r"\\{[^}]*\\}", "[^/]+", re.escape(template)), path) is not None
