import gc

import psutil
import pytest
from covista_schemas import codec, keys, names, zenoh_config
from covista_schemas import robot_pb2 as pb
from covista_schemas.errors import DecodeError, KeyExpressionError
from covista_schemas.names import KeyReader, NameReader
from hypothesis import given
from hypothesis import strategies as st

ROBOTS = st.sampled_from(["r1", "r2", "R1", "", "r" * 64, "ü"])
BOOTS = st.sampled_from(["b0", "b1", "", "Boot!", "b" * 63, "b" * 64])
NUMBERS = st.one_of(st.integers(0, 2**64 - 1), st.sampled_from([2**63 - 1, 2**63]))


@st.composite
def intact(draw: st.DrawFn) -> bytes:
    """A pose, or what another topic or another version of ours would have sent."""
    kind = draw(st.sampled_from([pb.Pose, pb.Keyframe, pb.Camera]))
    if kind is pb.Camera:
        return pb.Camera(fx=1.5, width=4).SerializeToString()
    message = kind(
        robot=draw(ROBOTS), boot=draw(BOOTS), sequence=draw(NUMBERS), time_ns=draw(st.integers(0, 2**63 - 1))
    )
    message.world_from_camera.position_m.extend([1.0, 2.0, 3.0])
    return bytes(message.SerializeToString())


@st.composite
def payloads(draw: st.DrawFn) -> bytes:
    """Whole, cut, with other fields before or after, out of order, or of random bytes."""
    data = draw(intact())
    match draw(st.sampled_from(["whole", "cut", "more", "twice", "flipped", "random", "large"])):
        case "cut":
            return data[: draw(st.integers(0, len(data)))]
        case "more":
            unknown = b"\xfa\x3e\x03abc"
            return draw(st.sampled_from([unknown + data, data + unknown, data + b"\x9a\x06\x01"]))
        case "twice":
            # The last of each field counts, wherever it stands.
            return data + draw(intact())
        case "flipped":
            at = draw(st.integers(0, max(0, len(data) - 1)))
            return data[:at] + draw(st.binary(max_size=3)) + data[at + 1 :]
        case "random":
            return draw(st.binary(max_size=60))
        case "large":
            return data + b"\xfa\x3e\xff\x7f" + b"x" * 16383
    return data


def peeked(data: bytes, topic: str) -> tuple[str, int] | str:
    peek = codec.peek_pose if topic == "pose" else codec.peek_keyframe
    try:
        _, boot, sequence = peek(data, robot="r1")
    except DecodeError as error:
        return error.code
    return boot, sequence


@given(st.lists(payloads(), max_size=6), st.sampled_from(["pose", "keyframe"]))
def test_a_reader_says_what_peeking_says_whatever_it_read_before(stream: list[bytes], topic: str) -> None:
    reader = NameReader(pb.Pose if topic == "pose" else pb.Keyframe)
    for data in stream:
        said = peeked(data, topic)
        assert reader.read(data, "r1") == said
        assert bool(reader.complain(data, "r1")) == isinstance(said, str)


def test_what_is_wrong_is_said_in_the_words_of_the_codec() -> None:
    reader = NameReader(pb.Pose)
    stranger = pb.Pose(robot="r2", boot="b0").SerializeToString()
    assert reader.read(stranger, "r1") == codec.WRONG_ID
    assert reader.complain(stranger, "r1") == "robot: 'r2' inside, but 'r1' in the key"
    assert reader.read(bytes(codec.MAX_POSE_BYTES + 1), "r1") == codec.TOO_LARGE
    assert "more than the 16384 that it may" in reader.complain(bytes(codec.MAX_POSE_BYTES + 1), "r1")
    endless = pb.Pose(robot="r1", boot="b0", sequence=2**63).SerializeToString()
    assert reader.read(endless, "r1") == codec.MALFORMED
    assert reader.complain(endless, "r1") == "sequence: 9223372036854775808, more than 9223372036854775807"


@pytest.fixture
def few_ids(monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(names, "_MAX_IDS", 3)
    return 3


def test_what_is_remembered_is_bounded_and_forgetting_changes_nothing(few_ids: int) -> None:
    boots, robots = NameReader(pb.Pose), KeyReader()
    for _ in range(2):
        for number in range(10):
            data = pb.Pose(robot="r1", boot=f"b{number}", sequence=number).SerializeToString()
            assert boots.read(data, "r1") == (f"b{number}", number)
            assert robots.read(keys.pose("s", f"r{number}")) == f"r{number}"
    assert len(boots._boots) <= few_ids
    assert len(robots._robots) <= few_ids


@given(
    st.lists(
        st.sampled_from(["covista", "s", "S!", "robots", "r1", "R 1", "pose", "keyframe", "alive", ""]), max_size=6
    )
)
def test_keys_are_read_as_parsing_reads_them(chunks: list[str]) -> None:
    key, reader = "/".join(chunks), KeyReader()
    try:
        robot = keys.parse_robot_key(key).robot
    except KeyExpressionError:
        robot = None
    assert reader.read(key) == reader.read(key) == robot


def test_wrong_keys_without_end_are_not_remembered(few_ids: int) -> None:
    reader = KeyReader()
    assert reader.read(keys.pose("s", "r1")) == "r1"
    for number in range(2 * few_ids):
        assert reader.read(f"covista/s/robots/R{number}/pose") is None
    assert list(reader._robots) == [keys.pose("s", "r1")]


def test_a_keyframe_may_be_as_large_as_zenoh_hands_over() -> None:
    reader = NameReader(pb.Keyframe)
    assert codec.MAX_KEYFRAME_BYTES == zenoh_config.MAX_MESSAGE_BYTES
    head = pb.Keyframe(robot="r1", boot="b0").SerializeToString()
    room = codec.MAX_KEYFRAME_BYTES - len(head) - 6
    whole = pb.Keyframe(robot="r1", boot="b0", image=bytes(room)).SerializeToString()
    assert codec.MAX_KEYFRAME_BYTES - 4 <= len(whole) <= codec.MAX_KEYFRAME_BYTES
    assert reader.read(whole, "r1") == ("b0", 0)
    assert reader.read(whole + bytes(6), "r1") == codec.TOO_LARGE
    assert "more than the 4194304" in reader.complain(whole + bytes(6), "r1")


@pytest.mark.parametrize(
    ("data", "kind", "count"),
    [
        (pb.Keyframe(robot="r1", boot="b0", image=bytes(100_000)).SerializeToString(), pb.Keyframe, 2000),
        (pb.Pose(robot="r1", boot="b0", covariance=[0.1] * 36).SerializeToString(), pb.Pose, 200_000),
        (b"\x0a\x02r1" + bytes(16_000), pb.Pose, 5000),
    ],
    ids=["keyframes", "poses", "garbage"],
)
def test_reading_without_end_takes_no_more_memory(
    data: bytes, kind: type[pb.Keyframe] | type[pb.Pose], count: int
) -> None:
    reader, process = NameReader(kind), psutil.Process()
    for _ in range(count // 100):
        reader.read(data, "r1")
    gc.collect()
    before = process.memory_info().rss
    for _ in range(count):
        reader.read(data, "r1")
    assert process.memory_info().rss - before < 20_000_000
