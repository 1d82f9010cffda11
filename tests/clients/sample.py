"""One answer of each kind, as a station with two robots in one group and a third without a pose would give."""

from covista_schemas.reports import (
    FoundBy,
    Group,
    GroupsReport,
    Health,
    KeyframeId,
    LiveSettings,
    PairKeyframes,
    PairReport,
    PairsReport,
    PairSummary,
    PartHealth,
    PoseReport,
    Report,
    RobotsReport,
    Score,
    SimilarityReport,
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
STARTING = Health(status="starting", parts={"link": PartHealth(status="starting", detail="no router")})

ANSWERS: dict[str, Report] = {
    "/api/v1/robots": ROBOTS,
    "/api/v1/robots/r1": ROBOTS.robots[0],
    "/api/v1/pairs": PAIRS,
    "/api/v1/pairs/r1/r2": PAIR,
    "/api/v1/similarity": SIMILARITY,
    "/api/v1/groups": GROUPS,
    "/api/v1/groups/g1": GROUPS.groups[0],
    "/healthz": Health(status="ready"),
    "/readyz": STARTING,
}
