"""What the demo reads from the station over REST, as mission control would."""

from __future__ import annotations

import os
from typing import TypeVar

import httpx
from covista_schemas.errors import ApiError
from covista_schemas.reports import Counters, GroupsReport, PairsReport, Report, RobotsReport

_TIMEOUT_S = 5.0
_R = TypeVar("_R", bound=Report)


class Watch:
    """A client of the station's REST interface; raises ApiError when it does not answer.

    A database that is given to the demo may hold tokens: one of them has to be in COVISTA_TOKEN then.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        token = os.environ.get("COVISTA_TOKEN")
        headers = {"authorization": f"Bearer {token}"} if token else {}
        self._client = httpx.Client(base_url=f"{url}/api/v1", headers=headers, timeout=_TIMEOUT_S)

    def ready(self) -> bool:
        """Does the station say that it is ready? False where it does not answer in time, too."""
        try:
            return self._client.get(f"{self._url}/readyz").is_success
        except httpx.HTTPError:
            return False

    def groups(self) -> GroupsReport:
        """The groups that stand."""
        return self._get("/groups", GroupsReport)

    def pairs(self) -> PairsReport:
        """All pairs."""
        return self._get("/pairs", PairsReport)

    def robots(self) -> RobotsReport:
        """All robots, and what became of their messages."""
        return self._get("/robots", RobotsReport)

    def keyframes(self) -> Counters:
        """What became of all robots' keyframes, as one sum."""
        counters = [robot.keyframes for robot in self.robots().robots]
        return Counters(
            received=sum(each.received for each in counters),
            missing=sum(each.missing for each in counters),
            waiting=sum(each.waiting for each in counters),
        )

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def _get(self, path: str, model: type[_R]) -> _R:
        try:
            response = self._client.get(path)
        except httpx.HTTPError as error:
            raise ApiError("The station does not answer", detail=str(error)) from error
        if response.is_error:
            raise ApiError("The station has a problem", status=response.status_code, detail=response.text[:200])
        return model.model_validate_json(response.content)
