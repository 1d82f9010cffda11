"""A snapshot of the station as reports: what REST and zenoh both answer with."""

from covista_service.answers.grouping import (
    event_report,
    group_report,
    groups_report,
    own_group_report,
    similarity_report,
)
from covista_service.answers.matrices import Matrix, matrix_csv, matrix_npy
from covista_service.answers.pages import PAIR_CURSOR, ROBOT_CURSOR, pairs_page, robots_page
from covista_service.answers.pairs import (
    brief_pair_report,
    common_regions,
    explaining_survey,
    find_pair,
    pair_report,
    pair_view_report,
    pairs_report,
)
from covista_service.answers.pictures import pair_picture
from covista_service.answers.pieces import pairs_json, similarity_json
from covista_service.answers.robots import find_robot, robot_report, robots_report
from covista_service.answers.settings import changes, grouping_options, live_settings
from covista_service.answers.unknown import NotKnownError, problem_of

__all__ = [
    "PAIR_CURSOR",
    "ROBOT_CURSOR",
    "Matrix",
    "NotKnownError",
    "brief_pair_report",
    "changes",
    "common_regions",
    "event_report",
    "explaining_survey",
    "find_pair",
    "find_robot",
    "group_report",
    "grouping_options",
    "groups_report",
    "live_settings",
    "matrix_csv",
    "matrix_npy",
    "own_group_report",
    "pair_picture",
    "pair_report",
    "pair_view_report",
    "pairs_json",
    "pairs_page",
    "pairs_report",
    "problem_of",
    "robot_report",
    "robots_page",
    "robots_report",
    "similarity_json",
    "similarity_report",
]
