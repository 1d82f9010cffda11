"""Labels stay with their groups, and what happened to groups has a name."""

from collections import Counter

from covista_service.grouping.continuity import COLOURS, Change, changes, follow
from hypothesis import given
from hypothesis import strategies as st

ROBOTS = [f"r{number}" for number in range(8)]


def group(members: str) -> frozenset[str]:
    return frozenset(members)


def groups(**members: str) -> dict[str, frozenset[str]]:
    return {label: group(names) for label, names in members.items()}


def groupings_of(most: int) -> st.SearchStrategy[list[frozenset[str]]]:
    """Robots in so many groups at most."""
    return st.dictionaries(st.sampled_from(ROBOTS), st.integers(1, most)).map(
        lambda chosen: [
            frozenset(robot for robot, held in chosen.items() if held == number)
            for number in sorted(set(chosen.values()))
        ]
    )


groupings = groupings_of(5)


def test_the_first_groups_are_numbered_by_their_first_robots() -> None:
    following = follow({}, [group("cd"), group("ab")], 1)
    assert following.groups == groups(g1="ab", g2="cd")
    assert following.next_label == 3


def test_labels_follow_the_most_robots() -> None:
    following = follow(groups(g1="abc", g2="def"), [group("cdef"), group("ab")], 3)
    assert following.groups == groups(g1="ab", g2="cdef")


def test_the_assignment_is_the_best_over_all_groups() -> None:
    # Greedily, g1 would take "abc" and leave g2 without any of its robots.
    following = follow(groups(g1="abcd", g2="ef"), [group("abef"), group("cd")], 3)
    assert following.groups == groups(g2="abef", g1="cd")


def test_a_new_label_is_never_one_that_was_used() -> None:
    first = follow(groups(g1="ab", g2="cd"), [group("abcd")], 3)
    second = follow(first.groups, [group("ab"), group("cd")], first.next_label)
    assert first.groups == groups(g1="abcd")
    assert second.groups == groups(g1="ab", g3="cd")


def test_a_group_without_any_of_its_robots_is_another_group() -> None:
    assert follow(groups(g1="ab"), [group("cd")], 2).groups == groups(g2="cd")


def test_among_equals_the_oldest_label_goes_to_the_first_cluster() -> None:
    assert follow(groups(g2="ab", g10="cd"), [group("abcd")], 11).groups == groups(g2="abcd")
    assert follow(groups(g1="abcd"), [group("cd"), group("ab")], 2).groups == groups(g1="ab", g2="cd")


def test_a_new_label_leaves_out_numbers_that_would_look_like_a_group_that_is_there() -> None:
    assert follow(groups(g1="abcd"), [group("ab"), group("cd")], 8).groups == groups(g1="ab", g9="cd")
    # Another label than that of a group that ends may look like it.
    assert follow(groups(g1="ab"), [group("cd")], 8).groups == groups(g8="cd")


@given(st.lists(groupings_of(COLOURS), min_size=1, max_size=20))
def test_groups_that_are_there_together_differ_modulo_the_colours(history: list[list[frozenset[str]]]) -> None:
    following = follow({}, [], 1)
    for clusters in history:
        following = follow(following.groups, clusters, following.next_label)
        assert len({int(label[1:]) % COLOURS for label in following.groups}) == len(clusters)


def test_more_groups_than_colours_are_spread_evenly() -> None:
    many = [frozenset({f"y{number:02}"}) for number in range(20)]
    worn = Counter(int(label[1:]) % COLOURS for label in follow(groups(g1="x"), [group("x"), *many], 9).groups)
    assert set(worn.values()) == {3}


@given(before=groupings, after=groupings)
def test_following_keeps_every_cluster_once(before: list[frozenset[str]], after: list[frozenset[str]]) -> None:
    first = follow({}, before, 1)
    second = follow(first.groups, after, first.next_label)
    assert sorted(map(sorted, second.groups.values())) == sorted(map(sorted, after))
    fresh = second.groups.keys() - first.groups.keys()
    assert all(int(label[1:]) >= first.next_label for label in fresh)
    assert second.next_label == 1 + max([first.next_label - 1, *(int(label[1:]) for label in fresh)])
    assert all(first.groups[label] & second.groups[label] for label in second.groups.keys() - fresh)
    assert follow(second.groups, after, second.next_label) == second


def test_nothing_happens_to_what_stays() -> None:
    assert changes(groups(g1="ab", g2="c"), groups(g1="ab", g2="c")) == []


def test_robots_join_and_leave() -> None:
    assert changes(groups(g1="ab"), groups(g1="bc", g2="d")) == [
        Change("leave", ("a",), ("g1",)),
        Change("join", ("c",), ("g1",)),
        Change("join", ("d",), ("g2",)),
    ]


def test_a_group_splits_in_two_and_in_three() -> None:
    assert changes(groups(g1="abc"), groups(g1="ab", g2="c")) == [Change("split", ("c",), ("g1", "g2"))]
    assert changes(groups(g1="abcd"), groups(g1="ab", g2="c", g3="d")) == [
        Change("split", ("c", "d"), ("g1", "g2", "g3"))
    ]


def test_groups_merge() -> None:
    assert changes(groups(g1="ab", g2="cd", g3="e"), groups(g1="abcde")) == [
        Change("merge", ("c", "d", "e"), ("g1", "g2", "g3"))
    ]


def test_a_robot_moves_from_group_to_group() -> None:
    assert changes(groups(g1="abc", g2="de"), groups(g1="ab", g2="cde")) == [Change("moved", ("c",), ("g1", "g2"))]


def test_a_new_group_of_robots_from_several_groups_is_moves() -> None:
    assert changes(groups(g1="abc", g2="def"), groups(g1="ab", g2="de", g3="cf")) == [
        Change("moved", ("c",), ("g1", "g3")),
        Change("moved", ("f",), ("g2", "g3")),
    ]


def test_a_newcomer_in_a_part_that_splits_off_joins_it() -> None:
    assert changes(groups(g1="abc"), groups(g1="ab", g2="cx")) == [
        Change("split", ("c",), ("g1", "g2")),
        Change("join", ("x",), ("g2",)),
    ]


@given(before=groupings, after=groupings)
def test_every_robot_that_stands_elsewhere_is_told_of_once(
    before: list[frozenset[str]], after: list[frozenset[str]]
) -> None:
    first = follow({}, before, 1)
    second = follow(first.groups, after, first.next_label)
    old = {robot: label for label, members in first.groups.items() for robot in members}
    new = {robot: label for label, members in second.groups.items() for robot in members}
    told = [robot for change in changes(first.groups, second.groups) for robot in change.robots]
    assert sorted(told) == sorted(robot for robot in old.keys() | new.keys() if old.get(robot) != new.get(robot))
