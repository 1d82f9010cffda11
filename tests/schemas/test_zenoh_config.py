import pytest
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import check_endpoint, config

GOOD = [
    "tcp/127.0.0.1:7447",
    "tcp/station:7447",
    "tls/[::1]:7447",
    "udp/0.0.0.0:1",
    "unixsock-stream//tmp/x",
    "tcp/h:1#iface=lo",
]
BAD = [
    "",
    "nonsense",
    "tcp",
    "tcp/",
    "tcp/host",
    "tcp/:7447",
    "tcp/host:99999",
    "tcp/host:x",
    "foo/host:1",
    "http://host:1",
]


@pytest.mark.parametrize("endpoint", GOOD)
def test_end_points_are_taken(endpoint: str) -> None:
    assert check_endpoint(endpoint) == endpoint
    assert config("client", connect=[endpoint])
    assert config("router", listen=[endpoint])


@pytest.mark.parametrize("endpoint", BAD)
def test_what_cannot_be_an_end_point_is_refused_in_one_line(endpoint: str) -> None:
    with pytest.raises(LinkError, match="not an end point such as") as caught:
        config("client", connect=[endpoint])
    assert len(str(caught.value).splitlines()) == 1
