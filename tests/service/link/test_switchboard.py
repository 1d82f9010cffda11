"""A session that gives way to another when others are to be let in, and stays where that cannot be."""

import shutil
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
import zenoh
from covista_schemas.errors import LinkError
from covista_schemas.zenoh_config import config
from covista_schemas.zenoh_tls import Tls
from covista_service.link.admission import Admission, Lock
from covista_service.link.switchboard import Switchboard, opening

from tests.service.deadline import free_endpoint, wait_until
from tests.system.certificates import Pair, make_certificates, put, sign, tls_of

SITE = "default"
ROBOTS = f"covista/{SITE}/robots"


def tls_endpoint() -> str:
    return free_endpoint().replace("tcp/", "tls/")


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certs"), "r1", "r3")


class Visitor:
    """A robot's publisher, which knows whether it is heard."""

    def __init__(self, certs: Path, endpoint: str, name: str) -> None:
        self.session = zenoh.open(config("client", connect=[endpoint], tls=tls_of(certs, name)))
        self.publisher = self.session.declare_publisher(f"{ROBOTS}/{name}/pose")

    @property
    def heard(self) -> bool:
        matching: bool = self.publisher.matching_status.matching  # type: ignore[attr-defined]
        return matching


def plug(switchboard: Switchboard) -> Callable[[], list[str]]:
    """A subscription that moves from session to session; returns what was heard."""
    heard: list[str] = []

    def join(session: zenoh.Session) -> Callable[[], object]:
        return session.declare_subscriber(f"{ROBOTS}/*/pose", lambda s: heard.append(s.payload.to_string())).undeclare

    switchboard.plug(join)
    return lambda: heard


def test_a_robot_that_is_listed_is_let_in_and_one_that_is_not_any_more_is_shut_out(
    certs: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    endpoint, robots = tls_endpoint(), tmp_path / "robots.txt"
    robots.write_text("r1\n")
    lock = Lock(tls_of(certs, "station"), robots)
    switchboard = Switchboard(opening([endpoint], [], SITE, lock), lock, every_s=0.02)
    heard = plug(switchboard)
    r1, r3 = (Visitor(certs, endpoint, name) for name in ("r1", "r3"))
    try:
        wait_until(lambda: r1.heard, "r1 is heard")
        wait_until(lambda: switchboard.strangers.refused["unlisted"] == 1, "r3 is seen")
        assert not r3.heard
        robots.write_text("r1\nr3\n")
        wait_until(lambda: r3.heard and r1.heard, "both are heard")
        r3.publisher.put("now")
        wait_until(lambda: heard() == ["now"], "what r3 says")
        robots.write_text("r1\nNOT A ROBOT\n")
        wait_until(lambda: switchboard.problem, "the list is not taken")
        assert "line 2: robot 'NOT A ROBOT' does not match" in str(switchboard.problem)
        robots.unlink()
        wait_until(lambda: "cannot be read" in str(switchboard.problem), "the list is gone")
        assert r3.heard
        robots.write_text("r1\n")
        switchboard.renew()
        wait_until(lambda: not r3.heard and r1.heard and switchboard.problem is None, "r3 is out")
    finally:
        for each in (r1, r3):
            each.session.close()
        switchboard.close()
    said = [record.message for record in caplog.records]
    assert said.count("zenoh opens again for others to be let in") == 2
    assert said.count("zenoh is open; robots connect within seconds") == 2
    assert "covista-link" not in [thread.name for thread in threading.enumerate()]


def test_a_key_that_zenoh_does_not_take_leaves_the_session_as_it_was(certs: Path, tmp_path: Path) -> None:
    tls = Tls(*(shutil.copy(certs / name, tmp_path) for name in ("ca.pem", "station.pem", "station.key")))
    lock, endpoint = Lock(tls, certs / "robots.txt"), tls_endpoint()
    other = sign(certs, "station", usage="serverAuth,clientAuth", curve="secp521r1")
    assert other.common_name(listens=True) == "station"
    switchboard = Switchboard(opening([endpoint], [], SITE, lock), lock, every_s=0.02)
    heard = plug(switchboard)
    r1 = Visitor(certs, endpoint, "r1")
    try:
        wait_until(lambda: r1.heard, "r1 is heard")
        put(Pair(Path(other.cert), Path(other.key)), Pair(Path(tls.cert), Path(tls.key)))
        said = wait_until(lambda: switchboard.problem, "the key is not taken")
        assert said.startswith("who is let in stays as it was: zenoh does not take ")
        r1.publisher.put("still here")
        wait_until(lambda: heard() == ["still here"], "what r1 says")
        put(Pair(certs / "station.pem", certs / "station.key"), Pair(Path(tls.cert), Path(tls.key)))
        wait_until(lambda: switchboard.problem is None, "what it was is taken")
    finally:
        r1.session.close()
        switchboard.close()


@pytest.mark.parametrize("joins", [True, False])
def test_a_key_that_zenoh_does_not_take_is_told_of_at_the_start(certs: Path, joins: bool) -> None:
    listen, connect = ([], [tls_endpoint()]) if joins else ([tls_endpoint()], [])
    other = sign(certs, "station", usage="serverAuth,clientAuth", curve="secp521r1")
    with pytest.raises(LinkError, match="zenoh does not take"):
        Switchboard(opening(listen, connect, SITE, Lock(other)), Lock(other), waits=joins).close()


def test_what_cannot_open_again_is_tried_until_it_can(certs: Path, tmp_path: Path) -> None:
    robots = tmp_path / "robots.txt"
    robots.write_text("")
    lock, endpoint = Lock(tls_of(certs, "station"), robots), tls_endpoint()
    open_for, fails = opening([endpoint], [], SITE, lock), threading.Event()

    def open_or_fail(admission: Admission | None) -> zenoh.Session:
        if fails.is_set():
            raise LinkError("the port is taken")
        return open_for(admission)

    switchboard = Switchboard(open_or_fail, lock, every_s=0.02)
    heard = plug(switchboard)
    try:
        fails.set()
        robots.write_text("r1\n")
        wait_until(lambda: switchboard.problem == "cannot open: the port is taken", "it says so")
        assert (switchboard.sessions, switchboard.joined) == (0, False)
        fails.clear()
        wait_until(lambda: switchboard.problem is None, "it opens again")
        r1 = Visitor(certs, endpoint, "r1")
        wait_until(lambda: r1.heard, "r1 is heard")
        r1.publisher.put("here")
        wait_until(lambda: heard() == ["here"], "what r1 says")
        r1.session.close()
    finally:
        switchboard.close()
