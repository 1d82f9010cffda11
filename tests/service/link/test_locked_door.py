"""Attempts on a link that asks for certificates, and what comes of them: real sessions, and openssl's certificates."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import pytest
import zenoh
from covista_clients.rover.link import follow
from covista_schemas.zenoh_config import config
from covista_schemas.zenoh_tls import Tls
from covista_service.link.admission import Lock
from covista_service.link.switchboard import opening
from zenoh import ext

from tests.service.deadline import free_endpoint, wait_until
from tests.system.certificates import make_certificates, sign, tls_of

SITE = "default"
ROBOTS, STATION = f"covista/{SITE}/robots", f"covista/{SITE}/station"
BLOCK = zenoh.CongestionControl.BLOCK
_numbers = count()


def word() -> str:
    """What was not said before."""
    return f"word {next(_numbers)}"


def tls_endpoint() -> str:
    return free_endpoint().replace("tcp/", "tls/")


@dataclass
class Ears:
    """Keys and words that somebody heard."""

    heard: list[tuple[str, str]] = field(default_factory=list)
    deleted: list[str] = field(default_factory=list)

    def take(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            self.deleted.append(str(sample.key_expr))
        self.heard.append((str(sample.key_expr), sample.payload.to_string()))

    def wait(self, said: str) -> None:
        wait_until(lambda: said in [each for _, each in self.heard], f"{said!r} is heard")


class Station:
    """What a station declares, and what it hears."""

    def __init__(self, session: zenoh.Session) -> None:
        self.ears, self.alive = Ears(), Ears()
        for topic in ("pose", "keyframe", "pose/**"):
            session.declare_subscriber(f"{ROBOTS}/*/{topic}", self.ears.take)
        session.liveliness().declare_subscriber(f"{ROBOTS}/*/alive/*", self.alive.take, history=True)
        for key in ("groups", "similarity", "pairs/*/*", "robots/*"):
            session.declare_queryable(f"{STATION}/{key}", _answer, complete=True)
        self._publishers = {
            key: ext.declare_advanced_publisher(
                session, f"{STATION}/{key}", cache=ext.CacheConfig(1), publisher_detection=True
            )
            for key in ("groups", "events", "robots/r1/group", "robots/r2/group")
        }

    def tell(self, key: str, said: str) -> None:
        self._publishers[key].put(said)


def _answer(query: zenoh.Query) -> None:
    with query:
        query.reply(str(query.key_expr), "the station's")


@dataclass
class Scene:
    """A station that lets r1 and r2 in, and whoever connects to it."""

    station: Station
    endpoint: str
    certs: Path
    sessions: dict[str, zenoh.Session] = field(default_factory=dict)

    def of(self, name: str) -> zenoh.Session:
        if name not in self.sessions:
            self.sessions[name] = self.open(name)
        return self.sessions[name]

    def open(self, name: str) -> zenoh.Session:
        return zenoh.open(config("client", connect=[self.endpoint], tls=tls_of(self.certs, name)))

    def listens(self, name: str, key: str) -> Ears:
        ears = Ears()
        self.of(name).declare_subscriber(key, ears.take)
        return ears

    def arrives(self, name: str, key: str) -> bool:
        """Whether what this one puts comes to the station, told by what comes behind it."""
        said, behind = word(), word()
        self.of(name).put(key, said, congestion_control=BLOCK)
        fence, own = (name, f"{ROBOTS}/{name}/pose") if name in ("r1", "r2") else ("r1", f"{ROBOTS}/r1/pose")
        self.of(fence).put(own, behind, congestion_control=BLOCK)
        self.station.ears.wait(behind)
        return said in [each for _, each in self.station.ears.heard]

    def answers(self, name: str, key: str) -> list[str]:
        replies = self.of(name).get(key, timeout=5)
        return [reply.ok.payload.to_string() for reply in replies if reply.ok is not None]

    def matches(self, name: str, key: str) -> bool:
        publisher = self.of(name).declare_publisher(key)
        self.answers(name, f"{STATION}/groups")
        matching: bool = publisher.matching_status.matching  # type: ignore[attr-defined]
        publisher.undeclare()
        return matching


@pytest.fixture(scope="module")
def certs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_certificates(tmp_path_factory.mktemp("certs"), "r1", "r2", "r3")
    (folder / "robots.txt").write_text("# who is let in\nr1\n\nr2  # the old one\n")
    return folder


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("foreign"), "r1")


@pytest.fixture(scope="module")
def scene(certs: Path) -> Iterator[Scene]:
    endpoint = tls_endpoint()
    lock = Lock(tls_of(certs, "station"), certs / "robots.txt")
    session = opening([endpoint], [], SITE, lock)(lock.read())
    scene = Scene(Station(session), endpoint, certs)
    yield scene
    for each in scene.sessions.values():
        each.close()
    session.close()


@pytest.mark.parametrize(
    ("who", "key", "arrives"),
    [
        ("r1", "r1/pose", True),
        ("r1", "r1/keyframe", True),
        ("r1", "r2/pose", False),
        ("r1", "r2/keyframe", False),
        ("r2", "r1/pose", False),
        ("r3", "r3/pose", False),
        ("r3", "r1/pose", False),
        ("r1", "*/pose", False),
        ("r1", "**", False),
        ("r1", "r1/*", False),
        ("r1", "r1/pose/deeper", False),
        ("station", "r1/pose", True),
        ("station", "*/pose", True),
        ("station", "r1/pose/deeper", True),
        ("router", "r1/pose", False),
    ],
)
def test_a_robot_publishes_under_its_own_id_alone(scene: Scene, who: str, key: str, arrives: bool) -> None:
    assert scene.arrives(who, f"{ROBOTS}/{key}") is arrives


@pytest.mark.parametrize(
    ("who", "key", "heard"),
    [
        ("r1", f"{STATION}/groups", True),
        ("r1", f"{STATION}/events", True),
        ("r1", f"{STATION}/robots/r1/group", True),
        ("r1", f"{STATION}/robots/r2/group", False),
        ("r1", f"{STATION}/robots/*/group", False),
        ("r1", f"{STATION}/robots/r2/group/@adv/**", False),
        ("r1", f"{STATION}/**/@adv/**", False),
        ("r1", f"{ROBOTS}/r2/pose", False),
        ("r1", f"{ROBOTS}/*/*", False),
        ("r1", "covista/**", False),
        ("r1", "**", False),
        ("r3", f"{STATION}/groups", False),
        ("station", f"{ROBOTS}/*/*", True),
    ],
)
def test_a_robot_hears_what_is_meant_for_it_alone(scene: Scene, who: str, key: str, heard: bool) -> None:
    # A session of its own: another subscription would bring what this one does not.
    listener = scene.open(who)
    ears, fence, said = Ears(), scene.listens("r2", f"{STATION}/groups"), word()
    listener.declare_subscriber(key, ears.take)
    _ask_once(listener)
    # The other robot says it, and the station tells it wherever it tells something.
    assert scene.arrives("r2", f"{ROBOTS}/r2/pose")
    scene.of("r2").put(f"{ROBOTS}/r2/pose", said, congestion_control=BLOCK)
    scene.station.ears.wait(said)
    for own in ("events", "robots/r1/group", "robots/r2/group", "groups"):
        scene.station.tell(own, said)
    fence.wait(said)
    # Whatever was on its way to the listener itself is there before this is answered.
    _ask_once(listener)
    if heard:
        ears.wait(said)
    else:
        assert not ears.heard
    listener.close()


def _ask_once(session: zenoh.Session) -> None:
    list(session.get(f"{STATION}/groups", timeout=5))


@pytest.mark.parametrize(
    ("who", "key", "answered"),
    [
        ("r1", f"{STATION}/groups", True),
        ("r1", f"{STATION}/similarity", True),
        ("r1", f"{STATION}/pairs/r1/r2", True),
        ("r1", f"{STATION}/robots/r2", True),
        ("r1", f"{STATION}/**", False),
        ("r1", "covista/elsewhere/station/groups", False),
        ("r1", "covista/*/station/groups", False),
        ("r3", f"{STATION}/groups", False),
        ("station", f"{STATION}/**", True),
    ],
)
def test_a_robot_asks_what_the_station_answers(scene: Scene, who: str, key: str, answered: bool) -> None:
    assert bool(scene.answers(who, key)) is answered


@pytest.mark.parametrize(
    ("who", "key", "answered"),
    [
        ("r1", "robots/r1/group/@adv/**", True),
        ("r1", "robots/r2/group/@adv/**", False),
        ("r2", "robots/r2/group/@adv/**", True),
        ("r1", "robots/*/group/@adv/**", False),
        ("r1", "**/@adv/**", False),
        ("station", "**/@adv/**", True),
    ],
)
def test_a_robot_asks_for_what_it_missed_of_its_own(scene: Scene, who: str, key: str, answered: bool) -> None:
    for robot in ("r1", "r2"):
        scene.station.tell(f"robots/{robot}/group", word())
    # The answers are of another key than the question.
    assert bool(scene.answers(who, f"{STATION}/{key}?_anyke")) is answered


@pytest.mark.parametrize(("robot", "alive"), [("r1", True), ("r2", False)])
def test_a_robot_is_alive_under_its_own_id_alone(scene: Scene, robot: str, alive: bool) -> None:
    key = f"{ROBOTS}/{robot}/alive/{word().replace(' ', '')}"
    token = scene.of("r1").liveliness().declare_token(key)
    behind = f"{ROBOTS}/r1/alive/{word().replace(' ', '')}"
    fence = scene.of("r1").liveliness().declare_token(behind)

    def shown() -> list[str]:
        return [each for each, _ in scene.station.alive.heard]

    wait_until(lambda: behind in shown(), "the second token")
    assert (key in shown()) is alive
    token.undeclare()
    fence.undeclare()


@pytest.mark.parametrize(
    ("who", "key", "arrives"),
    [("r1", "r1/pose", False), ("r1", "r2/pose", False), ("r1", "*/*", False), ("station", "r1/pose", True)],
)
def test_a_robot_deletes_nothing(scene: Scene, who: str, key: str, arrives: bool) -> None:
    before = len(scene.station.ears.deleted)
    scene.of(who).delete(f"{ROBOTS}/{key}", congestion_control=BLOCK)
    assert scene.arrives(who, f"{ROBOTS}/r1/pose")
    assert (len(scene.station.ears.deleted) > before) is arrives


def test_a_robot_does_not_learn_who_is_alive(scene: Scene) -> None:
    key = f"{ROBOTS}/r2/alive/{word().replace(' ', '')}"
    token = scene.of("r2").liveliness().declare_token(key)
    wait_until(lambda: key in [each for each, _ in scene.station.alive.heard], "the station sees it")
    with scene.open("r1") as r1:
        ears = Ears()
        for others in (key, f"{ROBOTS}/*/alive/*", f"{ROBOTS}/r2/alive/*", "**"):
            r1.liveliness().declare_subscriber(others, ears.take, history=True)
            assert not [each for each in r1.liveliness().get(others, timeout=0.5) if each.ok is not None]
        _ask_once(r1)
        assert not ears.heard
    with scene.open("station") as another:
        assert [each for each in another.liveliness().get(f"{ROBOTS}/*/alive/*", timeout=5) if each.ok is not None]
    token.undeclare()


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_a_robot_that_calls_itself_a_peer_or_a_router_may_do_no_more(scene: Scene, certs: Path, mode: str) -> None:
    made = config("client", connect=[scene.endpoint], tls=tls_of(certs, "r1"))
    made.insert_json5("mode", f'"{mode}"')
    before, ears = len(scene.station.ears.heard), Ears()
    with zenoh.open(made) as opened:
        for key in ("**", f"{ROBOTS}/**", f"{STATION}/robots/r2/group"):
            opened.declare_subscriber(key, ears.take)
        opened.declare_queryable(f"{STATION}/robots/*", lambda query: query.reply(str(query.key_expr), "a lie"))
        wait_until(lambda: opened.info.transports(), "it is connected")
        wait_until(lambda: list(opened.get(f"{STATION}/groups", timeout=1)), "it is answered")
        mine, others = word(), word()
        opened.put(f"{ROBOTS}/r2/pose", others, congestion_control=BLOCK)
        opened.put(f"{STATION}/groups", others, congestion_control=BLOCK)
        opened.put(f"{ROBOTS}/r1/pose", mine, congestion_control=BLOCK)
        scene.station.ears.wait(mine)
        assert others not in [said for _, said in scene.station.ears.heard[before:]]
        assert scene.arrives("r2", f"{ROBOTS}/r2/pose")
        scene.station.tell("robots/r2/group", others)
        assert set(scene.answers("r2", f"{STATION}/robots/r1")) == {"the station's"}
        _ask_once(opened)
        # A session hears itself, and nobody else.
        own = [(f"{ROBOTS}/r2/pose", others), (f"{STATION}/groups", others), (f"{ROBOTS}/r1/pose", mine)]
        assert set(ears.heard) == set(own)


def test_a_robot_cannot_speak_for_the_station(scene: Scene) -> None:
    ears, said, fence = scene.listens("r2", f"{STATION}/groups"), word(), word()
    scene.answers("r2", f"{STATION}/groups")
    scene.of("r1").put(f"{STATION}/groups", said, congestion_control=BLOCK)
    scene.of("r1").declare_queryable(f"{STATION}/robots/*", lambda query: query.reply(str(query.key_expr), "a lie"))
    assert scene.arrives("r1", f"{ROBOTS}/r1/pose")
    scene.station.tell("groups", fence)
    ears.wait(fence)
    assert said not in [each for _, each in ears.heard]
    assert set(scene.answers("r2", f"{STATION}/robots/r1")) == {"the station's"}


def test_a_robot_that_comes_late_hears_what_was_told_last(scene: Scene) -> None:
    said, ears = word(), Ears()
    scene.station.tell("robots/r1/group", said)
    with follow(scene.of("r1"), f"{STATION}/robots/r1/group", ears.take):
        ears.wait(said)


def test_a_robot_is_told_that_it_is_heard_and_who_is_not_listed_is_not(scene: Scene) -> None:
    assert scene.matches("r1", f"{ROBOTS}/r1/pose")
    assert not scene.matches("r3", f"{ROBOTS}/r3/pose")


@pytest.mark.parametrize(
    "attempt",
    [
        "plain",
        "foreign authority",
        "foreign certificate",
        "trusts a foreign authority",
        "expired",
        "version 1",
        "for a listener",
    ],
)
def test_without_a_certificate_of_the_authority_nobody_connects(
    scene: Scene, certs: Path, foreign: Path, attempt: str
) -> None:
    own, other = tls_of(certs, "r1"), tls_of(foreign, "r1")
    shown: dict[str, Tls | None] = {
        "plain": None,
        "foreign authority": other,
        "foreign certificate": Tls(own.ca, other.cert, other.key),
        "trusts a foreign authority": Tls(other.ca, own.cert, own.key),
        "expired": sign(certs, "r1", days=-1),
        "version 1": sign(certs, "r1", usage=None),
        "for a listener": sign(certs, "r1", usage="serverAuth"),
    }
    tls = shown[attempt]
    endpoint = scene.endpoint if tls else scene.endpoint.replace("tls/", "tcp/")
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        zenoh.open(config("client", connect=[endpoint], tls=tls, timeout_ms=400))


def test_what_the_expired_certificate_was_is_let_in(scene: Scene, certs: Path) -> None:
    # Made as those above that are refused are, but for the days.
    with zenoh.open(config("client", connect=[scene.endpoint], tls=sign(certs, "r1", days=1), timeout_ms=5000)) as r1:
        assert r1.info.routers_zid()


def test_a_robot_cannot_pretend_to_be_the_station(certs: Path) -> None:
    endpoint = tls_endpoint()
    with (
        zenoh.open(config("router", listen=[endpoint], tls=tls_of(certs, "r2"))),
        pytest.raises(zenoh.ZError, match="Unable to connect"),
    ):
        zenoh.open(config("client", connect=[endpoint], tls=tls_of(certs, "r1"), timeout_ms=400))
