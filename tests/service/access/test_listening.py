import pytest
from covista_service.access import AccessError, check_listening, is_local, is_loopback


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_loopback_is_this_machine(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.4", "", "station", "localhost.example"])
def test_all_else_is_beyond(host: str) -> None:
    assert not is_loopback(host)


@pytest.mark.parametrize(
    ("endpoint", "local"),
    [
        ("tcp/127.0.0.1:7447", True),
        ("tcp/[::1]:7447", True),
        ("tls/localhost:7447?so_sndbuf=65000", True),
        ("unixsock-stream//tmp/covista.sock", True),
        ("tcp/0.0.0.0:7447", False),
        ("tcp/[::]:7447#iface=lo", False),
        ("udp/10.0.0.1:7447", False),
        ("nonsense", False),
    ],
)
def test_an_end_point_is_local_by_its_address(endpoint: str, local: bool) -> None:
    assert is_local(endpoint) is local


def test_only_the_operator_opens_the_station_to_the_network() -> None:
    with pytest.raises(AccessError, match=r"api = 0\.0\.0\.0 .* and link = tcp/0\.0\.0\.0:1 .* insecure \(--insecure"):
        check_listening("0.0.0.0", ["tcp/127.0.0.1:7447", "tcp/0.0.0.0:1"], insecure=False)
    check_listening("0.0.0.0", ["tcp/0.0.0.0:1"], insecure=True)
    check_listening("127.0.0.1", ["tcp/127.0.0.1:7447"], insecure=False)


def test_a_token_opens_the_api_to_the_network_and_not_the_link() -> None:
    check_listening("0.0.0.0", ["tcp/127.0.0.1:1"], insecure=False, has_tokens=lambda: True)
    with pytest.raises(AccessError) as caught:
        check_listening("0.0.0.0", ["tcp/0.0.0.0:1"], insecure=False, has_tokens=lambda: True)
    assert "api" not in str(caught.value)
    assert "it is plain" in str(caught.value)


def test_an_end_point_of_tls_may_be_open_to_the_network_but_not_one_that_knows_no_list() -> None:
    check_listening("127.0.0.1", ["tls/0.0.0.0:1"], insecure=False)
    with pytest.raises(AccessError, match=r"link = tls/0\.0\.0\.0:1 would be open"):
        check_listening("127.0.0.1", ["tls/0.0.0.0:1#listen_certificate=mine.pem"], insecure=False)


def test_a_plain_link_that_others_reach_is_told_of(caplog: pytest.LogCaptureFixture) -> None:
    check_listening("127.0.0.1", ["tcp/127.0.0.1:1", "tls/0.0.0.0:1"], insecure=True)
    assert not caplog.records
    check_listening("127.0.0.1", ["tcp/0.0.0.0:1"], insecure=True)
    (record,) = caplog.records
    assert "everybody who reaches it can publish as any robot" in record.message


def test_whether_there_are_tokens_is_asked_only_where_it_matters() -> None:
    def unreadable() -> bool:
        raise AssertionError("asked")

    check_listening("127.0.0.1", [], insecure=False, has_tokens=unreadable)
    check_listening("0.0.0.0", [], insecure=True, has_tokens=unreadable)
