"""What is stored. Times are microseconds (_us) since the epoch, or nanoseconds (_ns) where a robot has named them so.

A change here needs a new revision in `migrations`; a test holds the two against each other.
"""

from __future__ import annotations

from sqlalchemy import BigInteger, Column, Double, Index, Integer, MetaData, String, Table, Text

metadata = MetaData()

# A key of our own: numbers may come twice if a database was out of reach when the station started.
KEY = BigInteger().with_variant(Integer, "sqlite")
ID = String(63)
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def _pose(*, nullable: bool) -> list[Column[float]]:
    """Position of a camera in metres and its orientation, the unit quaternion world_from_camera."""
    return [Column(name, Double, nullable=nullable) for name in POSE]


group_revisions = Table(
    "group_revisions",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("revision", BigInteger, nullable=False, index=True),
    Column("time_us", BigInteger, nullable=False, index=True),
    Column("report", Text, nullable=False),
)

events = Table(
    "events",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("number", BigInteger, nullable=False, index=True),
    Column("time_us", BigInteger, nullable=False, index=True),
    Column("kind", String(32), nullable=False),
    Column("report", Text, nullable=False),
    Index("ix_events_kind_time_us", "kind", "time_us"),
)

tracks = Table(
    "tracks",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("robot", ID, nullable=False),
    Column("time_us", BigInteger, nullable=False),
    *_pose(nullable=False),
    Index("ix_tracks_robot_time_us", "robot", "time_us"),
)

# The smaller id is a.
pair_overlaps = Table(
    "pair_overlaps",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("a", ID, nullable=False),
    Column("b", ID, nullable=False),
    Column("time_us", BigInteger, nullable=False),
    Column("overlap_a", Double),
    Column("overlap_b", Double),
    Column("found_by", String(16), nullable=False),
    Index("ix_pair_overlaps_a_b_time_us", "a", "b", "time_us"),
)

settings_changes = Table(
    "settings_changes",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("time_us", BigInteger, nullable=False),
    Column("by", ID),
    Column("patch", Text, nullable=False),
    Column("settings", Text, nullable=False),
)

gaps = Table(
    "gaps",
    metadata,
    Column("id", KEY, primary_key=True, autoincrement=True),
    Column("since_us", BigInteger, nullable=False),
    Column("until_us", BigInteger, nullable=False, index=True),
    Column("lost", BigInteger, nullable=False),
    Column("reason", Text, nullable=False),
)

# Up to which number names may have been used.
numbers = Table(
    "numbers",
    metadata,
    Column("name", String(32), primary_key=True),
    Column("reserved", BigInteger, nullable=False),
)

# What a station that starts remembers: the last state of robots and pairs, and the keyframes that they name.
robots_now = Table(
    "robots_now",
    metadata,
    Column("robot", ID, primary_key=True),
    Column("last_seen_ns", BigInteger, nullable=False),
    Column("boot", Text),
    Column("pose_time_ns", BigInteger),
    *_pose(nullable=True),
    Column("keyframe_boot", Text),
    Column("keyframe_sequence", BigInteger),
    Column("judged_ns", BigInteger),
)

keyframes_now = Table(
    "keyframes_now",
    metadata,
    Column("robot", ID, primary_key=True),
    Column("boot", Text, primary_key=True),
    Column("sequence", BigInteger, primary_key=True, autoincrement=False),
    Column("time_ns", BigInteger, nullable=False),
    Column("arrived_ns", BigInteger, nullable=False),
    Column("camera", Text, nullable=False),
    *_pose(nullable=False),
)

# All but the two ids is null while nothing is known of a pair.
pairs_now = Table(
    "pairs_now",
    metadata,
    Column("a", ID, primary_key=True),
    Column("b", ID, primary_key=True),
    Column("computed_ns", BigInteger),
    *[Column(name, Double) for name in ("overlap_a", "overlap_b", "low_a", "high_a", "low_b", "high_b")],
    Column("boot_a", Text),
    Column("sequence_a", BigInteger),
    Column("boot_b", Text),
    Column("sequence_b", BigInteger),
    Column("pose_time_a_ns", BigInteger),
    Column("pose_time_b_ns", BigInteger),
)

tokens = Table(
    "tokens",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    Column("name", ID, nullable=False, unique=True),
    Column("digest", String(64), nullable=False, unique=True),
    Column("scopes", String(64), nullable=False),
    Column("created_us", BigInteger, nullable=False),
    Column("revoked_us", BigInteger),
    Column("last_used_us", BigInteger),
)
