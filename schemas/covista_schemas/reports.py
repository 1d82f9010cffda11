"""The pydantic models of everything that the station tells: REST and zenoh say the same with these."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import Field

from covista_schemas.messages import Camera
from covista_schemas.report import Report as Report
from covista_schemas.report import RobotId as RobotId
from covista_schemas.report import Share as Share
from covista_schemas.report import Time as Time
from covista_schemas.report import time_of as time_of
from covista_schemas.settings import GroupBounds as GroupBounds
from covista_schemas.settings import Hysteresis as Hysteresis
from covista_schemas.settings import LiveSettings as LiveSettings
from covista_schemas.settings import SettingsPatch as SettingsPatch

Point = tuple[float, float]
Polygon = list[Point]
Cursor = Annotated[str | None, Field(description="Cursor of the next page; null on the last.")]


class Status(StrEnum):
    """Presence of a robot: live, stale (silent), gone (silent for long)."""

    LIVE = "live"
    STALE = "stale"
    GONE = "gone"


class FoundBy(StrEnum):
    """How an overlap was found, best first."""

    IMAGE = "image"
    PREDICTED = "predicted"
    DECAYED = "decayed"
    UNKNOWN = "unknown"


class KeyframeId(Report):
    """Which keyframe of a robot: boot id and sequence."""

    boot: str
    sequence: int


class Counters(Report):
    """What became of a robot's messages since the station first heard of it, all boots.

    sent = received + missing; received = used + replaced + duplicate + the sum of dropped + waiting.
    """

    received: int = 0
    used: int = 0
    replaced: int = 0
    duplicate: int = 0
    missing: int = 0
    waiting: int = Field(default=0, description="Received and not yet taken up.")
    dropped: dict[str, int] = Field(default_factory=dict, description="Count by reason.")


class PoseReport(Report):
    """Camera pose in the world: metres, unit quaternion world_from_camera."""

    position_m: tuple[float, float, float]
    orientation_xyzw: tuple[float, float, float, float]
    time: Time


class PoseCorrection(Report):
    """How far the images say that the reported pose is off."""

    deg: float
    m: float


class RobotReport(Report):
    """What the station knows of one robot."""

    id: RobotId
    status: Status
    group: str | None = Field(description="Label of its group, or null.", examples=["g1"])
    pose: PoseReport | None
    camera: Camera | None
    boot: str | None = Field(description="The boot that it was last heard from.")
    keyframe: KeyframeId | None = Field(description="Its newest keyframe in use.")
    heard: KeyframeId | None = Field(default=None, description="Its newest keyframe that arrived, usable or not.")
    last_seen: Time | None
    clock_offset_s: float | None = Field(description="Sensor time minus arrival time of its last message.")
    pose_correction: PoseCorrection | None
    keyframes: Counters
    poses: Counters
    last_problem: str | None = Field(description="Why its last dropped message was dropped.")


class RobotsReport(Report):
    """All robots, or a page of them."""

    robots: list[RobotReport]
    next: Cursor = None


class PairKeyframes(Report):
    """The two keyframes that an overlap was measured on."""

    a: KeyframeId
    b: KeyframeId


class PairTimes(Report):
    """When the two robots stood where an overlap is of, by their own clocks."""

    a: Time
    b: Time


class PairSummary(Report):
    """The overlap of two robots' views; `overlap_a` is the share of a's image that b sees."""

    a: RobotId
    b: RobotId
    overlap_a: Share | None
    overlap_b: Share | None
    interval_a: tuple[float, float] | None = Field(default=None, description="90 % interval; null until measured.")
    interval_b: tuple[float, float] | None = None
    found_by: FoundBy
    outcome: str = Field(description="What the last survey of the pair came to, by name.", examples=["measured"])
    inliers: int
    pose_source: Literal["reported", "images"] | None
    age_s: float | None = Field(description="Seconds since the answer was computed.")
    keyframes: PairKeyframes | None
    poses: PairTimes | None = Field(
        default=None,
        description="Sensor times of the poses that the overlap stands for: those of the keyframes, or newer ones "
        "where a robot has moved since. Regions and planes are always those of the keyframes.",
    )


class PlaneReport(Report):
    """One plane of a pair's scene, normal . X + offset_m = 0 in the world frame, and where both cameras see it."""

    normal: tuple[float, float, float]
    offset_m: float
    support: int = Field(description="Matched points on it.")
    polygon_a: Polygon
    polygon_b: Polygon


class PairReport(PairSummary):
    """One pair in full: the common field as polygons in pixels of each image, and the planes behind it."""

    regions_a: list[Polygon]
    regions_b: list[Polygon]
    planes: list[PlaneReport]


class PairsReport(Report):
    """Pairs of robots, each unordered pair once."""

    pairs: list[PairSummary]
    next: Cursor = None


Matrix = list[list[float]]


class SimilarityReport(Report):
    """The similarity matrix (Eq. 16), rows and columns in the order of `robots`; null is unknown.

    Similarity is made from overlaps smoothed over keyframes (hysteresis.smoothing); `overlap` is the newest.
    """

    revision: int
    robots: list[RobotId]
    similarity: Matrix
    overlap: list[list[float | None]] = Field(description="Row i: share of i's image seen by j.")
    closeness: Matrix = Field(description="Eq. 15.")
    distance_m: Matrix


class Group(Report):
    """A group: a label that follows it over time, and its robots."""

    label: str = Field(examples=["g1"])
    robots: list[RobotId]


class Ungrouped(Report):
    """A robot that stands in no group, and why."""

    robot: RobotId
    reason: Literal["no_pose", "gone"]


class Score(Report):
    """Score of one number of groups under the criterion in force."""

    groups: int
    score: float


class GroupsReport(Report):
    """The grouping in force, and why."""

    revision: int
    time: Time
    groups: list[Group]
    ungrouped: list[Ungrouped]
    criterion: str
    scores: list[Score] = Field(
        description="Of every number of groups that was looked at, by the criterion; the highest is proposed."
    )
    note: str | None = Field(
        default=None, description="Settings that so many robots cannot keep, or that are not meant for as many."
    )
    waiting: list[RobotId] = Field(
        default=[], description="Robots of groups that others are proposed for, which are shown if that lasts."
    )
    settings: LiveSettings


class OwnGroupReport(Report):
    """What a robot is told: its group, or none."""

    robot: RobotId
    label: str | None
    robots: list[RobotId] = Field(description="All members, the robot itself included.")
    revision: int
    time: Time


class EventKind(StrEnum):
    """Kinds of events."""

    GROUPS = "groups"
    JOIN = "join"
    LEAVE = "leave"
    SPLIT = "split"
    MERGE = "merge"
    MOVED = "moved"
    STATUS = "status"
    SETTINGS = "settings"
    WARNING = "warning"


class EventReport(Report):
    """Something that happened, with the robots and group labels concerned."""

    id: int
    event: EventKind
    time: Time
    robots: list[RobotId] = Field(default=[])
    labels: list[str] = Field(default=[])
    revision_before: int | None = None
    revision_after: int | None = None
    by: str | None = Field(default=None, description="Name of the token of whoever wanted it.")
    text: str


class EventsMissed(Report):
    """Events that a stream cannot give again: those from `first` to `last`, both included."""

    first: int
    last: int
    reason: str = Field(examples=["older than what is kept"])


class Gap(Report):
    """A time of which the history lacks entries that there were, and why."""

    since: Time
    until: Time
    lost: int = Field(ge=0, description="Entries that are missing; 0 where nobody could count them.")
    reason: str = Field(examples=["the database could not be used"])


class HistoryPage(Report):
    """What all pages of the history share; entries are in the order of time, the oldest first."""

    next: Cursor = None
    gaps: list[Gap] = Field(default=[], description="Gaps of the history within the time that this page is of.")


class GroupsHistory(HistoryPage):
    """Revisions of the groups."""

    items: list[GroupsReport]


class EventsHistory(HistoryPage):
    """Events, in the order of their ids."""

    items: list[EventReport]


class PairMoment(Report):
    """The overlap of a pair as it was from `time` on; null is unknown."""

    time: Time
    overlap_a: Share | None
    overlap_b: Share | None
    found_by: FoundBy


class PairHistory(HistoryPage):
    """The overlap of a pair over time, thinned: a moment is kept where it is news."""

    a: RobotId
    b: RobotId
    items: list[PairMoment]


class TrackPoint(PoseReport):
    """Where a robot's camera was; `time` is when the station heard of it."""


class RobotTrack(HistoryPage):
    """Where a robot was over time, thinned."""

    robot: RobotId
    items: list[TrackPoint]


class Problem(Report):
    """RFC 9457 problem details."""

    type: str = "about:blank"
    title: str = Field(examples=["Unknown robot"])
    status: int = Field(examples=[404])
    detail: str | None = None
    instance: str | None = None


class PartHealth(Report):
    """One part of the station: whether it works, and a word for a person."""

    status: Literal["ready", "degraded", "starting", "stopping"]
    detail: str | None = None


class Health(Report):
    """How the station is."""

    status: Literal["ready", "degraded", "starting", "stopping"]
    parts: dict[str, PartHealth] = Field(default={})
