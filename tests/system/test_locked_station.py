"""A station and a router that ask for certificates, as their processes run, and what a rover sees of them."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
from covista_clients import MissionControl, Rover
from covista_clients.__main__ import main
from covista_schemas.errors import LinkError
from covista_schemas.messages import Pose
from covista_service.link.admission import Lock
from covista_service.link.inbox import Inbox
from covista_service.link.mailbox import Mailboxes
from covista_service.link.station import LinkOptions, StationLink
from covista_service.link.switchboard import opening
from covista_service.router_command import open_router
from covista_service.serve import run
from covista_service.station.events import KeyframeArrived

from tests.service.deadline import free_endpoint, wait_until
from tests.service.wall import CAMERA, seen_from
from tests.system.certificates import make_certificates, tls_of
from tests.system.running_station import running_station, settings_for
from tests.system.station_commands import COMMAND, command, environment

# A machine that compiles takes its time until a station is ready.
COMPILES_S = 100


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_certificates(tmp_path_factory.mktemp("certs"), "r1", "r2", "r3")
    make_certificates(folder / "foreign", "r1")
    return folder


@pytest.fixture
def robots(tmp_path: Path) -> Path:
    """The list of robots that are let in."""
    path = tmp_path / "robots.txt"
    path.write_text("r1\nr2\n")
    return path


def tls_endpoint() -> str:
    return free_endpoint().replace("tcp/", "tls/")


def files(certs: Path, name: str) -> dict[str, str]:
    """Settings with the files of one of them."""
    tls = tls_of(certs, name)
    return {"zenoh_tls_ca": str(tls.ca), "zenoh_tls_cert": str(tls.cert), "zenoh_tls_key": str(tls.key)}


@contextmanager
def process(folder: Path, log: Path, *words: str, **settings: str) -> Iterator["subprocess.Popen[str]"]:
    """A command that says a line when it listens, and ends in time when it is told to."""
    variables = {f"COVISTA_{name.upper()}": value for name, value in settings.items()}
    with log.open("a") as file:
        started = subprocess.Popen(
            [*COMMAND, *words], cwd=folder, env=environment(**variables), stdout=subprocess.PIPE, stderr=file, text=True
        )
    assert started.stdout is not None
    with started.stdout:
        try:
            yield started
        finally:
            if started.poll() is None:
                started.kill()
            started.wait()


def line_of(started: "subprocess.Popen[str]") -> str:
    assert started.stdout is not None
    return started.stdout.readline().strip()


def received(control: MissionControl, robot: str) -> int:
    return next((each.keyframes.received for each in control.robots().robots if each.id == robot), 0)


def rover(robot: str, endpoint: str, certs: Path) -> Rover:
    return Rover(robot, CAMERA, endpoint, tls=tls_of(certs, robot))


def test_robots_come_and_go_by_the_list_while_the_station_runs(tmp_path: Path, certs: Path, robots: Path) -> None:
    endpoint = tls_endpoint()
    locked = files(certs, "station") | {"zenoh_tls_robots": str(robots)}
    with ExitStack() as stack:
        station = stack.enter_context(running_station(settings_for(tmp_path, link=(endpoint,), **locked)))
        control = stack.enter_context(MissionControl(station.url))
        wait_until(lambda: control.health().status == "ready", "the station is ready", deadline_s=COMPILES_S)
        told: list[list[str]] = []
        first = stack.enter_context(rover("r1", endpoint, certs))
        first.on_group(lambda group: told.append(group.robots))
        first.send_keyframe(seen_from(0.0), Pose((0, 0, 0)))
        wait_until(lambda: received(control, "r1") == 1 and told, "r1 is heard, and told of its group")
        third = stack.enter_context(rover("r3", endpoint, certs))
        third.send_keyframe(seen_from(0.5), Pose((0.5, 0, 0)))
        wait_until(lambda: metric(station.url, "unlisted") == 1, "r3 is counted")
        assert received(control, "r3") == 0
        before = len(told)
        robots.write_text("r1\nr3\n")
        wait_until(lambda: received(control, "r3") == 1, "r3 is let in")
        wait_until(lambda: len(told) > before, "r1 is told again")
        first.send_keyframe(seen_from(0.1), Pose((0.1, 0, 0)))
        wait_until(lambda: received(control, "r1") == 2, "and r1 is heard as before: its account goes on")
        robots.write_text("r1\nr3\n*\n")
        wait_until(lambda: "line 3" in str(link_detail(control)), "a list that is none is told of")
        assert control.health().status == "degraded"
        robots.write_text("r1\n")
        wait_until(lambda: metric(station.url, "unlisted") == 2, "r3 is shut out")
        third.close(wait_s=0)
        wait_until(lambda: control.health().parts["link"].status == "ready", "all is well")


def link_detail(control: MissionControl) -> str | None:
    return control.health().parts["link"].detail


def test_a_robot_under_another_one_s_name_is_not_heard_and_told_of(
    certs: Path, robots: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("covista_service.link.strangers._MUTE_AFTER_S", 0.1)
    endpoint, mailboxes = tls_endpoint(), Mailboxes()
    with ExitStack() as stack:
        link = StationLink(LinkOptions((endpoint,), (), "default", Lock(tls_of(certs, "station"), robots)))
        stack.callback(link.switchboard.close)
        stack.callback(link.plug_ingest(mailboxes))
        second = stack.enter_context(closing(rover("r2", endpoint, certs)))
        liar = stack.enter_context(closing(Rover("r2", CAMERA, endpoint, tls=tls_of(certs, "r1"))))
        liar.send_keyframe(seen_from(0.0), Pose((0, 0, 0)))
        wait_until(lambda: link.refused["mute"] == 1 and liar.keyframes_sent, "it is told of")
        second.send_keyframe(seen_from(0.0), Pose((0, 0, 0)))
        heard = wait_until(lambda: keyframes_in(mailboxes), "the other one is heard")
        assert {each.keyframe.id.boot for each in heard} == {second.boot}


def keyframes_in(mailboxes: Mailboxes) -> list[KeyframeArrived]:
    return [each for each in Inbox(mailboxes).drain(10, time.time_ns())[0] if isinstance(each, KeyframeArrived)]


def metric(url: str, reason: str) -> float:
    text = httpx.get(f"{url}/metrics", timeout=10).text
    found = re.search(rf'covista_link_refused_total{{reason="{reason}"}} (\S+)', text)
    return float(found[1]) if found else 0.0


def test_a_station_waits_for_its_router_and_finds_it_again(tmp_path: Path, certs: Path, robots: Path) -> None:
    endpoint, log, mailboxes = tls_endpoint(), tmp_path / "router.log", Mailboxes()
    routing = ("router", "--listen", endpoint, "--zenoh-tls-robots", str(robots))
    heard: list[str] = []

    def hears(robot: str, count: int) -> bool:
        heard.extend(each.keyframe.id.robot for each in keyframes_in(mailboxes))
        return heard.count(robot) >= count

    with ExitStack() as stack:
        link = StationLink(LinkOptions((), (endpoint,), "default", Lock(tls_of(certs, "station"))))
        stack.callback(link.switchboard.close)
        stack.callback(link.plug_ingest(mailboxes))
        assert link.health().status == "degraded"
        assert "no router answers" in str(link.health().detail)
        with process(tmp_path, log, *routing, **files(certs, "router")) as router:
            assert line_of(router) == f"zenoh router on {endpoint}"
            wait_until(lambda: link.health().status == "ready", "they are joined")
            first, third = (stack.enter_context(closing(rover(name, endpoint, certs))) for name in ("r1", "r3"))
            first.send_keyframe(seen_from(0.0), Pose((0, 0, 0)))
            third.send_keyframe(seen_from(0.5), Pose((0.5, 0, 0)))
            wait_until(lambda: hears("r1", 1), "r1 is heard")
            wait_until(lambda: "robot=r3" in log.read_text(), "the router tells of r3")
            assert not hears("r3", 1)
            robots.write_text("r1\nr3\n")
            router.send_signal(signal.SIGHUP)
            wait_until(lambda: hears("r3", 1), "r3 is let in")
            stranger = stack.enter_context(closing(Rover("r1", CAMERA, endpoint, tls=tls_of(certs / "foreign", "r1"))))
            wait_until(lambda: "somebody who connects is refused" in log.read_text(), "what zenoh says is told")
            router.kill()
        wait_until(lambda: "no router answers" in str(link.health().detail), "the router is missed")
        with process(tmp_path, log, *routing, **files(certs, "router")) as router:
            assert line_of(router)
            count = heard.count("r1") + 1
            first.send_keyframe(seen_from(0.1), Pose((0.1, 0, 0)))
            wait_until(lambda: hears("r1", count), "r1 is heard again")
            assert stranger.keyframes_sent == 0
            router.send_signal(signal.SIGTERM)
            assert router.wait(10) == 0


@contextmanager
def closing(made: Rover) -> Iterator[Rover]:
    """Nobody confirms what it says."""
    try:
        yield made
    finally:
        made.close(wait_s=0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--connect", "tcp/127.0.0.1:1"), "covista: --connect: 'tcp/127.0.0.1:1' is a plain end point"),
        (
            ("--connect", "tls/127.0.0.1:1", "--tls-ca", "absent.pem"),
            "covista: the authority absent.pem cannot be read",
        ),
    ],
)
@pytest.mark.parametrize("name", ["send", "watch", "swarm"])
def test_a_command_says_in_one_line_what_is_wrong(
    certs: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, words: tuple[str, ...], said: str, name: str
) -> None:
    given = sending(tmp_path) if name == "send" else [name]
    with pytest.raises(SystemExit) as caught:
        main([*given, *flags(certs), *words])
    assert caught.value.code == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith(said)


def flags(certs: Path) -> list[str]:
    """How r1 shows its certificate."""
    tls = tls_of(certs, "r1")
    return ["--tls-ca", str(tls.ca), "--tls-cert", str(tls.cert), "--tls-key", str(tls.key)]


def sending(folder: Path) -> list[str]:
    """A keyframe by hand."""
    camera = folder / "camera.json"
    camera.write_text('{"fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, "width": 64, "height": 48}')
    return ["send", str(camera), "--robot", "r1", "--camera", str(camera), "--pose", "0 0 0 0 0 0 1"]


def test_a_keyframe_that_nobody_answers_says_what_it_may_be(
    certs: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    with pytest.raises(SystemExit):
        main([*sending(tmp_path), *flags(certs), "--connect", "tls/127.0.0.1:1", "--wait", "0.2"])
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("covista: no router at tls/127.0.0.1:1 within 0.2 s: nobody answers")


def test_certificates_come_together_or_not_at_all(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["watch", "--connect", "tls/127.0.0.1:1", "--tls-ca", "ca.pem"])
    assert capsys.readouterr().err == "covista: --tls-ca needs --tls-cert, --tls-key\n"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"zenoh_tls_key": "absent.key"}, "the key absent.key cannot be read"),
        ({"zenoh_tls_robots": "absent.txt"}, "the list of robots absent.txt cannot be read"),
    ],
)
def test_a_station_that_cannot_lock_its_link_does_not_open_it(
    certs: Path, robots: Path, tmp_path: Path, changes: dict[str, str], said: str
) -> None:
    locked = files(certs, "station") | {"zenoh_tls_robots": str(robots)} | changes
    with pytest.raises(LinkError, match=said):
        run(settings_for(tmp_path, link=(tls_endpoint(),), **locked))


def test_a_router_that_cannot_lock_says_so_in_one_line(certs: Path, tmp_path: Path) -> None:
    settings = {f"COVISTA_{name.upper()}": value for name, value in files(certs, "router").items()}
    done = command(tmp_path, "router", "--listen", "tcp/127.0.0.1:1", **settings)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("setting link (--listen, COVISTA_LINK): 'tcp/127.0.0.1:1' is a plain end point")


def test_a_router_tells_of_a_robot_under_another_one_s_name(
    tmp_path: Path, certs: Path, robots: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("covista_service.link.strangers._MUTE_AFTER_S", 0.5)
    # The output of this process is not the router's.
    monkeypatch.setattr("covista_service.link.zenoh_log.follow_zenoh_log", lambda: None)
    endpoint = tls_endpoint()
    locked = files(certs, "router") | {"zenoh_tls_robots": str(robots), "zenoh_tls_peers": "station"}
    switchboard = open_router(settings_for(tmp_path, link=(endpoint,), **locked))
    with ExitStack() as stack:
        stack.callback(switchboard.close)
        stack.enter_context(closing(rover("r2", endpoint, certs)))
        stack.enter_context(closing(Rover("r2", CAMERA, endpoint, tls=tls_of(certs, "r1"))))
        refused = switchboard.strangers.refused
        wait_until(lambda: refused["mute"], "it is told of")
        assert refused == {"mute": 1, "unlisted": 0}
    (told,) = (each for each in caplog.records if each.message.endswith("under the name of its certificate"))
    assert told.fields["robot"] == "r1"


def test_a_router_is_open_to_the_network_only_when_told_so(tmp_path: Path) -> None:
    endpoint = free_endpoint().replace("127.0.0.1", "0.0.0.0")
    done = command(tmp_path, "router", "--listen", endpoint)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"link = {endpoint} would be open to the network")
    for words, settings in ((["--insecure"], {}), ([], {"insecure": "true"})):
        log = tmp_path / "router.log"
        with process(tmp_path, log, "router", "--listen", endpoint, *words, **settings) as router:
            assert line_of(router) == f"zenoh router on {endpoint}"
            router.send_signal(signal.SIGTERM)
            assert router.wait(10) == 0
        assert "the zenoh link is plain" in log.read_text()


def test_a_router_loads_nothing_that_computes() -> None:
    script = """
import sys
import covista_service.__main__
from covista_service.access import check_listening
from covista_service.link.alive import Alive
from covista_service.link.switchboard import Switchboard
from covista_service.link.zenoh_log import follow_zenoh_log
print(*({"cv2", "dask", "fastapi", "numba", "scipy"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == ""


def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have nobody wait for long before it says what it may be."""
    for module in ("link", "rover"):
        monkeypatch.setattr(f"covista_clients.rover.{module}.PATIENCE_S", 0.1)
    monkeypatch.setattr("covista_clients.rover.link.OPEN_TIMEOUT_MS", 200)


def test_a_rover_says_what_it_may_be_that_nobody_answers(
    certs: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    patient(monkeypatch)
    with_rover(lambda: rover("r1", tls_endpoint(), certs), caplog, "nobody answers at tls/")
    with_rover(lambda: Rover("r1", CAMERA, free_endpoint()), caplog, "does it take links without a certificate?")


def test_a_rover_that_is_not_listed_says_what_it_may_be(
    certs: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    patient(monkeypatch)
    endpoint, lock = tls_endpoint(), Lock(tls_of(certs, "station"))
    with opening([endpoint], [], "default", lock)(lock.read()):
        with_rover(lambda: rover("r3", endpoint, certs), caplog, "no station listens to r3")


def with_rover(make: Callable[[], Rover], caplog: pytest.LogCaptureFixture, said: str) -> None:
    made = make()
    made.send_keyframe(seen_from(0.0), Pose((0, 0, 0)))
    wait_until(lambda: said in caplog.text, said)
    made.close(wait_s=0)


def test_a_rover_with_another_one_s_certificate_is_warned_and_with_none_that_fits_refused(
    certs: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    patient(monkeypatch)
    made = Rover("r2", CAMERA, "tls/127.0.0.1:1", tls=tls_of(certs, "r1"))
    made.close(wait_s=0)
    assert "r2 shows the certificate of r1" in caplog.text
    with pytest.raises(LinkError, match="is a plain end point"):
        Rover("r1", CAMERA, "tcp/127.0.0.1:1", tls=tls_of(certs, "r1"))
    with pytest.raises(LinkError, match="needs certificates"):
        Rover("r1", CAMERA, "tls/127.0.0.1:1")
    with pytest.raises(LinkError, match="cannot be read"):
        rover("r9", "tls/127.0.0.1:1", certs)
