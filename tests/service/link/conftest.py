from collections.abc import Iterator
from dataclasses import dataclass

import pytest
import zenoh
from covista_schemas.zenoh_config import config
from covista_service.link.session import open_session

from tests.service.deadline import free_endpoint


@dataclass(frozen=True)
class Air:
    """The station's session and a rover's, joined."""

    station: zenoh.Session
    rover: zenoh.Session
    endpoint: str


@pytest.fixture(scope="module")
def air() -> Iterator[Air]:
    endpoint = free_endpoint()
    station = open_session([endpoint], [])
    rover = zenoh.open(config("client", connect=[endpoint]))
    yield Air(station, rover, endpoint)
    rover.close()
    station.close()
