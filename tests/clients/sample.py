"""One answer of each kind, as a station with two robots in one group and a third without a pose would give."""

from covista_schemas.reports import (
    EventKind,
    EventReport,
    EventsHistory,
    FoundBy,
    Gap,
    Group,
    GroupsHistory,
    GroupsReport,
    Health,
    KeyframeId,
    LiveSettings,
    PairHistory,
    PairKeyframes,
    PairMoment,
    PairReport,
    PairsReport,
    PairSummary,
    PartHealth,
    PoseReport,
    Report,
    RobotsReport,
    RobotTrack,
    Score,
    SimilarityReport,
    TrackPoint,
    Ungrouped,
    time_of,
)

from tests.clients.ground import report_on

PNG = b"\x89PNG and so on"
ROBOTS = RobotsReport(
    robots=[
        report_on(
            "r1",
            group="g1",
            pose=PoseReport(position_m=(1, 2, 3), orientation_xyzw=(0, 0, 0, 1), time=time_of(0)),
            keyframes={"received": 5, "used": 3, "dropped": {"bad_pose": 2}},
            last_problem="pose: length [bold]2[/bold], not 1",
        ),
        report_on("r2", group="g1"),
        report_on("r3"),
    ]
)
PAIR = PairReport(
    a="r1",
    b="r2",
    overlap_a=0.25,
    overlap_b=None,
    interval_a=(0.2, 0.3),
    found_by=FoundBy.IMAGE,
    outcome="measured",
    inliers=77,
    pose_source="images",
    age_s=1.5,
    keyframes=PairKeyframes(a=KeyframeId(boot="b", sequence=1), b=KeyframeId(boot="c", sequence=2)),
    regions_a=[[(0, 0), (1, 0), (1, 1)]],
    regions_b=[],
    planes=[],
)
PAIRS = PairsReport(pairs=[PairSummary.model_validate(PAIR.model_dump(include=set(PairSummary.model_fields)))])
SIMILARITY = SimilarityReport(
    revision=4,
    robots=["r1", "r2"],
    similarity=[[1, 0.5], [0.5, 1]],
    overlap=[[1, 0.25], [None, 1]],
    closeness=[[1, 0.75], [0.75, 1]],
    distance_m=[[0, 2], [2, 0]],
)
GROUPS = GroupsReport(
    revision=7,
    time=time_of(3_600_000_000_000),
    groups=[Group(label="g1", robots=["r1", "r2"])],
    ungrouped=[Ungrouped(robot="r3", reason="no_pose")],
    criterion="fiedler",
    scores=[Score(groups=1, score=0.5)],
    settings=LiveSettings(),
)
EVENTS = [
    EventReport(
        id=number,
        event=EventKind.JOIN,
        time=time_of(number * 1_000_000_000),
        robots=["r1"],
        labels=["g1"],
        revision_after=number,
        by="ada" if number == 3 else None,
        text=f"r1 joined g1 [{number}]",
    )
    for number in range(1, 6)
]
GAP = Gap(since=time_of(0), until=time_of(10**9), lost=4, reason="the database could not be used")
EVENTS_HISTORY = EventsHistory(items=EVENTS, gaps=[GAP])
GROUPS_HISTORY = GroupsHistory(items=[GROUPS])
PAIR_HISTORY = PairHistory(
    a="r1",
    b="r2",
    items=[PairMoment(time=time_of(5_000_000_000), overlap_a=0.5, overlap_b=None, found_by=FoundBy.PREDICTED)],
)
TRACK = RobotTrack(
    robot="r1", items=[TrackPoint(position_m=(1, 2, 3), orientation_xyzw=(0, 0, 0, 1), time=time_of(7_000_000_000))]
)
PREVIEW = GROUPS.model_copy(
    update={"groups": [Group(label="g1", robots=["r1"]), Group(label="g2", robots=["r2"])], "criterion": "gain"}
)
STARTING = Health(status="starting", parts={"link": PartHealth(status="starting", detail="no router")})

ANSWERS: dict[str, Report] = {
    "/api/v1/robots": ROBOTS,
    "/api/v1/robots/r1": ROBOTS.robots[0],
    "/api/v1/pairs": PAIRS,
    "/api/v1/pairs/r1/r2": PAIR,
    "/api/v1/similarity": SIMILARITY,
    "/api/v1/groups": GROUPS,
    "/api/v1/groups/g1": GROUPS.groups[0],
    "/api/v1/groups/at": GROUPS,
    "/api/v1/groups/history": GROUPS_HISTORY,
    "/api/v1/events/history": EVENTS_HISTORY,
    "/api/v1/pairs/r1/r2/history": PAIR_HISTORY,
    "/api/v1/robots/r1/track": TRACK,
    "/api/v1/settings": GROUPS.settings,
    "/healthz": Health(status="ready"),
    "/readyz": STARTING,
}
