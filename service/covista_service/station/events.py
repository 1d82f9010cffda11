"""What happens to the station (events), what it wants done (effects), and what it tells of (happenings)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from covista_schemas.reports import EventKind

from covista_service.perception.camera import Camera, Features, Pose, View
from covista_service.perception.comparison import Comparison
from covista_service.perception.extent import UNTOLD, Doubt
from covista_service.perception.scene import Evidence, Settled, Sight
from covista_service.station.ledger import Run
from covista_service.station.options import GroupingOptions

Topic = Literal["keyframe", "pose"]
Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class KeyframeId:
    """Names a keyframe for ever."""

    robot: str
    boot: str
    sequence: int


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A keyframe inside the station; `features` is None until they are extracted from `image` (encoded bytes).

    `thumbnail` is a small grey JPEG of it, if there is one; `doubt` is how far the pose may be off.
    """

    id: KeyframeId
    time_ns: int
    arrived_ns: int
    camera: Camera
    pose: Pose
    image: bytes | None = None
    features: Features | None = None
    thumbnail: bytes | None = None
    doubt: Doubt = UNTOLD


# Events


@dataclass(frozen=True, slots=True)
class MessagesReceived:
    """Messages of one robot and topic that arrived since the last such event, in order of arrival.

    `sequences` names each (boot, sequence); `kept` is the one that follows as an event of its own, if any: the others
    were replaced in the mailbox, or are duplicates. Messages so broken that not even their sequence could be read
    come as MessageDropped with `counted=False`.
    """

    robot: str
    topic: Topic
    sequences: tuple[tuple[str, int], ...]
    kept: tuple[str, int] | None
    arrived_ns: int


@dataclass(frozen=True, slots=True)
class MessageDropped:
    """A message that cannot be used; `counted` says whether a MessagesReceived has named it before.

    `runs` names messages that were given up unread, all `count` of them.
    """

    robot: str
    topic: Topic
    code: str
    text: str
    arrived_ns: int
    counted: bool
    count: int = 1
    runs: tuple[Run, ...] = ()


@dataclass(frozen=True, slots=True)
class KeyframeArrived:
    """A decoded keyframe, the newest of its robot."""

    keyframe: Keyframe


@dataclass(frozen=True, slots=True)
class PoseArrived:
    """A decoded pose."""

    robot: str
    boot: str
    sequence: int
    time_ns: int
    arrived_ns: int
    pose: Pose


@dataclass(frozen=True, slots=True)
class TokenSeen:
    """A robot's liveliness token appeared."""

    robot: str
    boot: str


@dataclass(frozen=True, slots=True)
class TokenLost:
    """A robot's liveliness token vanished; without a boot perhaps all of them, of too many to tell."""

    robot: str
    boot: str | None


@dataclass(frozen=True, slots=True)
class FeaturesExtracted:
    """A worker has extracted a keyframe's features, or says why the image cannot be used (`code`, `problem`)."""

    keyframe: KeyframeId
    features: Features | None
    thumbnail: bytes | None = None
    code: str = ""
    problem: str = ""


@dataclass(frozen=True, slots=True)
class SurveyDone:
    """A worker has surveyed a pair, or failed to (`found` None, `problem` says why)."""

    first: KeyframeId
    second: KeyframeId
    found: Comparison | None
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class SurfacesBuilt:
    """A worker has built the surfaces of `job`, in the order of its sights, or failed to (`settled` None)."""

    job: BuildSurfaces
    settled: tuple[Settled, ...] | None
    evidence: Mapping[tuple[int, int], Evidence] = field(default_factory=dict)
    problem: str = ""


@dataclass(frozen=True, slots=True)
class SettingsGiven:
    """The live settings are to be these from now on; `text` says what changes, `by` who wants it.

    `patch` is what was asked for, by name, as JSON has it: for whoever writes it down.
    """

    options: GroupingOptions
    text: str
    by: str | None = None
    patch: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ForgetRobot:
    """All that is known of a robot is to be dropped; `by` wants it."""

    robot: str
    by: str | None = None


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed, or a burst of events is over: presence, agenda and groups are brought up to date."""


Event = (
    MessagesReceived
    | MessageDropped
    | KeyframeArrived
    | PoseArrived
    | TokenSeen
    | TokenLost
    | FeaturesExtracted
    | SurveyDone
    | SurfacesBuilt
    | SettingsGiven
    | ForgetRobot
    | Tick
)


# Effects


@dataclass(frozen=True, slots=True, eq=False)
class ExtractFeatures:
    """Extract the features of this keyframe's image; the answer is FeaturesExtracted."""

    keyframe: Keyframe


@dataclass(frozen=True, slots=True, eq=False)
class SurveyPair:
    """Survey this pair of keyframes: compare their images. The answer is SurveyDone.

    Both may be one robot's: an earlier and a new one, for the parallax of its own motion.
    """

    first: KeyframeId
    second: KeyframeId
    first_view: View
    second_view: View


@dataclass(frozen=True, slots=True, eq=False)
class BuildSurfaces:
    """Settle poses and surfaces of the open ones among these keyframes; the answer is SurfacesBuilt.

    `keyframes`, `sights` and `thumbnails` (encoded, or None) go together; `evidence` is by their indices.
    """

    keyframes: tuple[KeyframeId, ...]
    sights: tuple[Sight, ...]
    thumbnails: tuple[bytes | None, ...]
    evidence: Mapping[tuple[int, int], Evidence]


@dataclass(frozen=True, slots=True)
class GroupsEvaluated:
    """Groups were evaluated with these keyframes' first surveys: (keyframe, its arrival time)."""

    keyframes: tuple[tuple[KeyframeId, int], ...]


@dataclass(frozen=True, slots=True)
class GroupsChanged:
    """A new revision of the groups stands; `robots` are those whose own group is not what they were told last."""

    revision: int
    robots: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Happened:
    """Something that mission control and the history should know."""

    kind: EventKind
    time_ns: int
    text: str
    robots: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    revision_before: int | None = None
    revision_after: int | None = None
    by: str | None = None


Effect = ExtractFeatures | SurveyPair | BuildSurfaces | GroupsEvaluated | GroupsChanged | Happened


class InterruptedTickError(Exception):
    """A part of a Tick has failed; the `effects` of the others are to be carried out all the same."""

    def __init__(self, effects: list[Effect]) -> None:
        super().__init__("a part of a tick failed")
        self.effects = effects
