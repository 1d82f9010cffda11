import pytest
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import check_endpoint, config
from covista_schemas.zenoh_tls import Tls

GOOD = [
    "tcp/127.0.0.1:7447",
    "tcp/station:7447",
    "tls/[::1]:7447",
    "tls/h:1#iface=lo;so_rcvbuf=65000;",
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
    tls = Tls("ca.pem", "r1.pem", "r1.key") if endpoint.startswith("tls/") else None
    assert config("client", connect=[endpoint], tls=tls)
    assert config("router", listen=[endpoint], tls=tls)


@pytest.mark.parametrize(
    ("endpoint", "tls", "said"),
    [
        ("tcp/10.0.0.1:7447", True, "is a plain end point"),
        ("unixsock-stream//tmp/covista.sock", True, "is a plain end point"),
        ("tls/station:7447", False, "needs certificates"),
        ("tls/station:7447#enable_mtls=false", True, "must not have certificates of its own"),
        ("tls/station:7447#listen_private_key_base64=secret", True, "must not have certificates of its own"),
        ("tls/station:7447#close_link_on_expiration=false", True, "the option 'close_link_on_expiration'"),
        ("tls/station:7447#iface=lo;tls_handshake_timeout_ms=1", True, "the option 'tls_handshake_timeout_ms'"),
        ("tls/station:7447#SO_SNDBUF=1", True, "the option 'SO_SNDBUF'"),
    ],
)
def test_end_points_are_all_locked_or_none(endpoint: str, tls: bool, said: str) -> None:
    files = Tls("ca.pem", "r1.pem", "r1.key") if tls else None
    for place in ("connect", "listen"):
        with pytest.raises(LinkError, match=said) as caught:
            config("router", **{place: [endpoint]}, tls=files)
        assert "secret" not in str(caught.value)


@pytest.mark.parametrize("endpoint", BAD)
def test_what_cannot_be_an_end_point_is_refused_in_one_line(endpoint: str) -> None:
    with pytest.raises(LinkError, match="not an end point such as") as caught:
        config("client", connect=[endpoint])
    assert len(str(caught.value).splitlines()) == 1
