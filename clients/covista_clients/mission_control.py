"""Mission control's questions to the station over HTTP."""

from __future__ import annotations

from types import TracebackType
from typing import Literal, Self, TypeVar
from urllib.parse import quote

import httpx
from covista_schemas.errors import ApiError
from covista_schemas.reports import (
    Group,
    GroupsReport,
    Health,
    PairReport,
    PairsReport,
    Problem,
    Report,
    RobotReport,
    RobotsReport,
    SimilarityReport,
)
from pydantic import ValidationError

_R = TypeVar("_R", bound=Report)
_Parameters = dict[str, str | float]


class MissionControl:
    """Asks a station about robots, pairs and groups; use it as a context manager, or close it.

    Every question raises ApiError where the station answers with a problem, or does not answer.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        token: str | None = None,
        *,
        timeout_s: float = 10.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        try:
            self._client = httpx.Client(base_url=url, headers=headers, timeout=timeout_s, transport=transport)
        except httpx.InvalidURL as error:
            raise ApiError(f"{url!r} is not a URL", detail=str(error)) from error
        except UnicodeEncodeError as error:
            raise ApiError("the token holds what no token holds", detail="only ASCII can be sent") from error

    def robots(self) -> RobotsReport:
        """All robots."""
        return self._ask(RobotsReport, "/api/v1/robots")

    def robot(self, robot: str) -> RobotReport:
        """One robot."""
        return self._ask(RobotReport, f"/api/v1/robots/{_part(robot)}")

    def pairs(self, robot: str | None = None, min_overlap: float | None = None) -> PairsReport:
        """Pairs, each once; those of one robot, or of a least overlap in either image, where asked."""
        asked: dict[str, str | float | None] = {"robot": robot, "min_overlap": min_overlap}
        return self._ask(PairsReport, "/api/v1/pairs", {k: v for k, v in asked.items() if v is not None})

    def pair(self, a: str, b: str) -> PairReport:
        """One pair in full, in the order asked."""
        return self._ask(PairReport, f"/api/v1/pairs/{_part(a)}/{_part(b)}")

    def overlay(self, a: str, b: str, side: Literal["a", "b"] = "a") -> bytes:
        """A PNG of one side's keyframe with the common field drawn in."""
        return self._get(f"/api/v1/pairs/{_part(a)}/{_part(b)}/overlay.png", {"side": side}).content

    def similarity(self) -> SimilarityReport:
        """The similarity matrix, and what it is made of."""
        return self._ask(SimilarityReport, "/api/v1/similarity")

    def groups(self) -> GroupsReport:
        """The grouping in force."""
        return self._ask(GroupsReport, "/api/v1/groups")

    def group(self, label: str) -> Group:
        """One group."""
        return self._ask(Group, f"/api/v1/groups/{_part(label)}")

    def health(self) -> Health:
        """Whether the station runs."""
        return self._ask_health("/healthz")

    def ready(self) -> Health:
        """Whether the station is of use, part by part; not an error where it is not."""
        return self._ask_health("/readyz")

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _ask(self, report: type[_R], path: str, parameters: _Parameters | None = None) -> _R:
        return _read(report, self._get(path, parameters))

    def _ask_health(self, path: str) -> Health:
        # 503 is an answer here, with the same model.
        return _read(Health, self._get(path, well=(200, 503)))

    def _get(self, path: str, parameters: _Parameters | None = None, well: tuple[int, ...] = (200,)) -> httpx.Response:
        try:
            response = self._client.get(path, params=parameters)
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            detail = str(error) or type(error).__name__
            raise ApiError(f"no answer from {self._client.base_url}", detail=detail) from error
        if response.status_code not in well:
            raise _problem(response)
        return response


def _part(name: str) -> str:
    """One part of a path: what a person typed may hold anything."""
    return quote(name, safe="")


def _read(report: type[_R], response: httpx.Response) -> _R:
    try:
        return report.read(response.content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        detail = f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"
        raise ApiError(f"{response.url} does not answer as a station does", detail=detail) from error


def _problem(response: httpx.Response) -> ApiError:
    try:
        problem = Problem.read(response.content)
    except ValidationError:
        return ApiError(f"{response.url} answered {response.status_code}", status=response.status_code)
    return ApiError(problem.title, status=response.status_code, detail=problem.detail)
