"""Tracks, overlaps, settings, gaps and numbers; what a station that starts remembers; tokens."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

_KEY = sa.BigInteger().with_variant(sa.Integer, "sqlite")
_ID = sa.String(63)
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def upgrade() -> None:
    """Make the tables."""
    op.create_index("ix_events_kind_time_us", "events", ["kind", "time_us"])
    _past()
    _present()
    op.create_table(
        "tokens",
        sa.Column("id", sa.Integer, primary_key=True, autoincrement=True),
        sa.Column("name", _ID, nullable=False, unique=True),
        sa.Column("digest", sa.String(64), nullable=False, unique=True),
        sa.Column("scopes", sa.String(64), nullable=False),
        sa.Column("created_us", sa.BigInteger, nullable=False),
        sa.Column("revoked_us", sa.BigInteger),
        sa.Column("last_used_us", sa.BigInteger),
    )


def _past() -> None:
    op.create_table(
        "tracks",
        sa.Column("id", _KEY, primary_key=True, autoincrement=True),
        sa.Column("robot", _ID, nullable=False),
        sa.Column("time_us", sa.BigInteger, nullable=False),
        *[sa.Column(name, sa.Double, nullable=False) for name in _POSE],
    )
    op.create_index("ix_tracks_robot_time_us", "tracks", ["robot", "time_us"])
    op.create_table(
        "pair_overlaps",
        sa.Column("id", _KEY, primary_key=True, autoincrement=True),
        sa.Column("a", _ID, nullable=False),
        sa.Column("b", _ID, nullable=False),
        sa.Column("time_us", sa.BigInteger, nullable=False),
        sa.Column("overlap_a", sa.Double),
        sa.Column("overlap_b", sa.Double),
        sa.Column("found_by", sa.String(16), nullable=False),
    )
    op.create_index("ix_pair_overlaps_a_b_time_us", "pair_overlaps", ["a", "b", "time_us"])
    op.create_table(
        "settings_changes",
        sa.Column("id", _KEY, primary_key=True, autoincrement=True),
        sa.Column("time_us", sa.BigInteger, nullable=False),
        sa.Column("by", _ID),
        sa.Column("patch", sa.Text, nullable=False),
        sa.Column("settings", sa.Text, nullable=False),
    )
    op.create_table(
        "gaps",
        sa.Column("id", _KEY, primary_key=True, autoincrement=True),
        sa.Column("since_us", sa.BigInteger, nullable=False),
        sa.Column("until_us", sa.BigInteger, nullable=False),
        sa.Column("lost", sa.BigInteger, nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
    )
    op.create_index("ix_gaps_until_us", "gaps", ["until_us"])


def _present() -> None:
    op.create_table(
        "numbers",
        sa.Column("name", sa.String(32), primary_key=True),
        sa.Column("reserved", sa.BigInteger, nullable=False),
    )
    op.create_table(
        "robots_now",
        sa.Column("robot", _ID, primary_key=True),
        sa.Column("last_seen_ns", sa.BigInteger, nullable=False),
        sa.Column("boot", sa.Text),
        sa.Column("pose_time_ns", sa.BigInteger),
        *[sa.Column(name, sa.Double) for name in _POSE],
        sa.Column("keyframe_boot", sa.Text),
        sa.Column("keyframe_sequence", sa.BigInteger),
        sa.Column("judged_ns", sa.BigInteger),
    )
    op.create_table(
        "keyframes_now",
        sa.Column("robot", _ID, primary_key=True),
        sa.Column("boot", sa.Text, primary_key=True),
        sa.Column("sequence", sa.BigInteger, primary_key=True, autoincrement=False),
        sa.Column("time_ns", sa.BigInteger, nullable=False),
        sa.Column("arrived_ns", sa.BigInteger, nullable=False),
        sa.Column("camera", sa.Text, nullable=False),
        *[sa.Column(name, sa.Double, nullable=False) for name in _POSE],
    )
    op.create_table(
        "pairs_now",
        sa.Column("a", _ID, primary_key=True),
        sa.Column("b", _ID, primary_key=True),
        sa.Column("computed_ns", sa.BigInteger),
        *[sa.Column(name, sa.Double) for name in ("overlap_a", "overlap_b", "low_a", "high_a", "low_b", "high_b")],
        sa.Column("boot_a", sa.Text),
        sa.Column("sequence_a", sa.BigInteger),
        sa.Column("boot_b", sa.Text),
        sa.Column("sequence_b", sa.BigInteger),
        sa.Column("pose_time_a_ns", sa.BigInteger),
        sa.Column("pose_time_b_ns", sa.BigInteger),
    )
