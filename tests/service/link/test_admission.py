"""Who is let in, as files say it."""

import os
from pathlib import Path

import pytest
from covista_schemas.errors import LinkError
from covista_service.link.admission import MAX_ROBOTS, Lock, read_robots
from covista_service.link.rules import access_control

from tests.system.certificates import make_certificates, sign, tls_of


@pytest.mark.parametrize(
    ("text", "robots"),
    [
        ("", set()),
        ("# nobody yet\n\n", set()),
        ("r1\nr2", {"r1", "r2"}),
        ("  r1  # the old one\r\nr2\r\nr1\n", {"r1", "r2"}),
    ],
)
def test_a_list_has_a_robot_a_line(tmp_path: Path, text: str, robots: set[str]) -> None:
    (tmp_path / "robots.txt").write_text(text)
    assert read_robots(tmp_path / "robots.txt") == robots


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"r1\nr 2\n", r"line 2: robot 'r 2' does not match"),
        (b"r1, r2", "line 1"),
        (b"covista/**", "line 1"),
        (b"r1\nstation\n", "line 2: station is the name of a station or router"),
        (b"\xff\xfe", "not a text file in UTF-8"),
        (b"\n".join(b"r%d" % k for k in range(MAX_ROBOTS + 1)), f"longer than {MAX_ROBOTS} robots"),
        (b"#" * 2_000_000, "or 1000000 bytes"),
        (None, "cannot be read: No such file"),
    ],
)
def test_what_is_no_list_is_one_line_that_says_where(tmp_path: Path, content: bytes | None, said: str) -> None:
    path = tmp_path / "robots.txt"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LinkError, match=said) as caught:
        read_robots(path, ["station"])
    assert "\n" not in str(caught.value)


def test_a_lock_lets_in_the_list_and_the_owner_of_the_certificate(tmp_path: Path) -> None:
    certs = make_certificates(tmp_path, "r1")
    lock = Lock(tls_of(certs, "router"), certs / "robots.txt", ("station",))
    admission = lock.read()
    assert (admission.robots, admission.stations) == ({"r1"}, {"router", "station"})
    assert [admission.admits(name) for name in ("r1", "station", "r2", "", None)] == [True, True, False, False, False]
    before = lock.stamp()
    os.utime(certs / "router.pem", ns=(1, 1))
    assert lock.stamp() != before
    # What is in it is the same: nobody needs a new session.
    assert lock.read() == admission
    renewed = sign(certs, "router", usage="serverAuth,clientAuth")
    os.replace(renewed.cert, certs / "router.pem")
    assert lock.read() != admission


@pytest.mark.parametrize("name", ["ca.pem", "station.pem", "station.key", "robots.txt"])
def test_who_may_read_a_file_is_seen_to_change(tmp_path: Path, name: str) -> None:
    certs = make_certificates(tmp_path, "r1")
    lock = Lock(tls_of(certs, "station"), certs / "robots.txt")
    before = lock.stamp()
    (certs / name).chmod(0o640)
    assert lock.stamp() != before


def test_who_lets_robots_in_has_a_certificate_that_they_connect_to(tmp_path: Path) -> None:
    certs = make_certificates(tmp_path, "r1")
    joins = sign(certs, "station", usage="clientAuth")
    assert Lock(joins).read().stations == {"station"}
    with pytest.raises(LinkError, match="is none that robots connect to"):
        Lock(joins, certs / "robots.txt").read()


def test_without_robots_there_are_stations_alone() -> None:
    rules = access_control("default", [], ["station"])
    assert rules["default_permission"] == "deny"
    assert [subject["cert_common_names"] for subject in rules["subjects"]] == [["station"]]


def test_every_rule_allows_and_no_robot_has_another_one_s() -> None:
    rules = access_control("s", ["r1", "r2"], ["station"])
    assert {rule["permission"] for rule in rules["rules"]} == {"allow"}
    by_id = {rule["id"]: rule for rule in rules["rules"]}
    assert len(by_id) == len(rules["rules"])
    named = {subject["id"]: subject["cert_common_names"] for subject in rules["subjects"]}
    for policy in rules["policies"]:
        keys = [key for rule in policy["rules"] for key in by_id[rule]["key_exprs"]]
        if named[policy["subjects"][0]] == ["r1"]:
            assert keys
            assert not [key for key in keys if "r2" in key or key.startswith("*") or "robots/*" in key]
