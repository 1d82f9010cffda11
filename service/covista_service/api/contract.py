"""The OpenAPI description, with problems under the media type that they are sent with."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from covista_schemas.reports import EventsMissed, Problem
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from covista_service.api.errors import PROBLEM_JSON

Description = dict[str, Any]
_PROBLEM = {"$ref": "#/components/schemas/Problem"}
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
    for name in _UNUSED:
        schemas.pop(name, None)
    return description


def _responses(description: Description) -> Iterator[tuple[str, Description]]:
    for path in description["paths"].values():
        for operation in path.values():
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
