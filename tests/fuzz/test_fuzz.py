"""The laws of the fuzzer, over what hypothesis thinks of and over the corpus."""

import random
from pathlib import Path

import pytest
from covista_schemas import codec, keys
from covista_schemas.errors import KeyExpressionError
from covista_schemas.keys import RobotTopic
from covista_service.link import mailbox
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz import mutation, seeds
from tests.fuzz.codec_law import check_payload, check_text
from tests.fuzz.ingest_law import MAX_ROBOTS, ROBOTS, Line, Record, check_script, parts, records, script_of
from tests.schemas.strategies import ids, keyframes, pose_updates

MOST_CORPUS_BYTES = 100_000
VALID = [data for _, data in seeds.payloads()]


@st.composite
def changed(draw: st.DrawFn) -> bytes:
    """A message with some fields changed, or bytes cut, doubled or drawn anew."""
    data = draw(
        st.one_of(st.sampled_from(VALID), keyframes().map(codec.encode_keyframe), pose_updates.map(codec.encode_pose))
    )
    rng = random.Random(draw(st.integers(0, 2**32)))
    for _ in range(draw(st.integers(0, 3))):
        data = mutation.changed(data, rng) or data
    match draw(st.sampled_from(["whole", "cut", "flipped", "twice"])):
        case "cut":
            return data[: draw(st.integers(0, len(data)))]
        case "flipped":
            at = draw(st.integers(0, len(data)))
            return data[:at] + draw(st.binary(max_size=4)) + data[at + 1 :]
        case "twice":
            return data + draw(st.sampled_from(VALID))
    return data


payloads = st.one_of(changed(), st.sampled_from(VALID), st.binary(max_size=60))
topics = st.sampled_from(["keyframe", "pose"])
robots = st.sampled_from(ROBOTS)


@st.composite
def robot_keys(draw: st.DrawFn) -> str:
    """Keys of robots, and what is not quite one."""
    robot = draw(robots)
    return draw(
        st.one_of(
            topics.map(lambda topic: f"covista/default/robots/{robot}/{topic}"),
            st.text(max_size=80),
            st.lists(st.sampled_from(["covista", "robots", "default", robot, "pose", "alive", "b0", ""])).map("/".join),
        )
    )


@st.composite
def tokens(draw: st.DrawFn) -> Record:
    """A token that appears or vanishes."""
    boot = draw(st.one_of(ids, st.sampled_from(["b0", "b1", ""]), st.text(max_size=5)))
    return Record(f"covista/default/robots/{draw(robots)}/alive/{boot}", b"", appears=draw(st.booleans()))


@st.composite
def messages(draw: st.DrawFn) -> Record:
    """A message, at once or later, after which the loop comes or does not."""
    pause_ns = draw(st.sampled_from([0, 0, 60_000_000, -(10**9)]))
    return Record(draw(robot_keys()), draw(payloads), pause_ns, draw(st.booleans()))


@given(payloads, robots)
@settings(max_examples=60)
def test_any_bytes_are_a_message_or_one_error_from_the_list(data: bytes, robot: str) -> None:
    check_payload(data)
    check_payload(data, robot)


@given(st.one_of(st.text(max_size=100), robot_keys()), ids)
def test_any_key_is_read_or_refused_in_one_line(key: str, site: str) -> None:
    for parse in (keys.parse_robot_key, lambda key: keys.parse_station_query(site, key)):
        try:
            parse(key)
        except KeyExpressionError as error:
            check_text(str(error))


@given(ids, ids, ids, st.sampled_from(RobotTopic))
def test_a_key_is_read_only_if_it_is_written_so(site: str, robot: str, boot: str, topic: RobotTopic) -> None:
    key = keys.alive(site, robot, boot) if topic is RobotTopic.ALIVE else f"covista/{site}/robots/{robot}/{topic}"
    assert keys.parse_robot_key(key).topic is topic
    for other in (key + "/", "/" + key, key.upper(), key.replace("/", "//", 1), key + "\n", f"{key}/x/y"):
        with pytest.raises(KeyExpressionError):
            keys.parse_robot_key(other)


@given(
    st.lists(st.one_of(messages(), messages(), tokens()), max_size=12),
    st.sampled_from([mailbox.MAX_BYTES, 700]),
    st.sampled_from([mailbox.MAX_NAMES, 2]),
)
@settings(max_examples=40)
def test_whatever_comes_on_whatever_key_has_one_fate_and_nothing_is_kept(
    stream: list[Record], most_bytes: int, most_names: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mailbox, "MAX_NAMES", most_names)
        line = Line(most_bytes)
        for record in stream:
            line.take(record)
        line.end()


@pytest.mark.parametrize("count", [mailbox.MAX_TOKENS, mailbox.MAX_TOKENS + 1, 3 * mailbox.MAX_TOKENS])
def test_a_robot_whose_tokens_all_vanish_at_once_does_not_live_for_ever(count: int) -> None:
    line, keys_of = Line(), [f"covista/default/robots/r1/alive/b{number}" for number in range(count)]
    for key in keys_of:
        line.take(Record(key, b"", pause_ns=60_000_000, turn=True))
    for key in keys_of:
        line.take(Record(key, b"", appears=False))
    line.rest()
    line.check_forgotten()


def corpus(target: str) -> list[Path]:
    return sorted((seeds.CORPUS / target).iterdir())


@pytest.mark.parametrize("file", corpus("codec"), ids=lambda file: file.name)
def test_what_the_codec_s_corpus_holds_keeps_the_law(file: Path) -> None:
    check_payload(file.read_bytes())


@pytest.mark.parametrize("file", corpus("ingest"), ids=lambda file: file.name)
def test_what_ingest_s_corpus_holds_keeps_the_law(file: Path) -> None:
    assert check_script(file.read_bytes()) == len(list(records(file.read_bytes())))


def test_the_corpus_has_more_robots_than_there_is_room_for() -> None:
    line = Line()
    for record in records((seeds.CORPUS / "ingest" / "crowd").read_bytes()):
        line.take(record)
    # Two that have a place, two ends of tokens, and no more: neither another end nor another pose.
    assert line.boxes.depths().robots == 2 * MAX_ROBOTS
    assert line.boxes.turned_away == {mailbox.TOO_MANY_ROBOTS: 2}
    line.end()


def test_the_corpus_is_small_and_starts_from_what_robots_rightly_say() -> None:
    assert sum(file.stat().st_size for target in ("codec", "ingest") for file in corpus(target)) < MOST_CORPUS_BYTES
    for _, data in seeds.payloads():
        topic_reads = [codec.decode_keyframe, codec.decode_pose]
        assert any(_reads(read, data) for read in topic_reads)


@given(st.lists(st.tuples(st.integers(0, 255), st.binary(max_size=20))))
def test_a_script_is_its_parts(messages: list[tuple[int, bytes]]) -> None:
    assert list(parts(script_of(messages))) == messages


def _reads(read, data: bytes) -> bool:
    try:
        read(data, robot="r1")
    except codec.DecodeError:
        return False
    return True
