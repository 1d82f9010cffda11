import pytest
from covista_schemas.errors import LinkError
from covista_service.link.session import open_session

from tests.service.deadline import free_endpoint
from tests.service.link.conftest import Air


def test_a_taken_port_is_one_line_with_the_port_and_the_flag(air: Air) -> None:
    with pytest.raises(LinkError) as caught:
        open_session([air.endpoint], [])
    line = str(caught.value)
    assert air.endpoint in line
    assert "--link (COVISTA_LINK)" in line
    assert "in use" in line
    assert "\n" not in line
    assert ".rs" not in line


def test_an_address_that_is_not_ours_is_named() -> None:
    with pytest.raises(LinkError, match=r"cannot listen on tcp/192\.0\.2\.1:7447"):
        open_session(["tcp/192.0.2.1:7447"], [])


def test_a_router_that_is_not_there_does_not_keep_the_station_from_starting() -> None:
    session = open_session([free_endpoint()], [free_endpoint()])
    session.close()
