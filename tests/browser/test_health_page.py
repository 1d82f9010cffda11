"""How the station is, in plain words: what needs somebody comes first, and what was is told from what is."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page, Route

    from tests.browser.visitor import Visitor

expect = pytest.importorskip("playwright.sync_api").expect

# Rates are judged after 20 s of answers: on a page whose clock runs so many times as fast, after a few.
FASTER = 5
JUDGED_MS = 20_000
HEALTH = "**/dashboard/data/health"
Answer = dict[str, Any]


class Place(Protocol):
    url: str


def opened(page: Page) -> Page:
    page.goto("/dashboard/health")
    page.get_by_role("heading", name="Parts", exact=True).wait_for()
    return page


def told(page: Page, change: Callable[[Answer, int], None]) -> None:
    """Have the station answer as it does, but for a change, which is told how often it was asked before.

    Latencies are as on a machine that has time.
    """
    asked = 0

    def answer(route: Route) -> None:
        nonlocal asked
        found = route.fetch().json()
        found |= {"latency": {"p50_ms": 40.0, "p99_ms": 90.0, "sum_s": 4.0, "count": 100, "slow": 0}, "turns_s": 1.0}
        change(found, asked)
        asked += 1
        route.fulfill(json=found)

    page.route(HEALTH, answer)


def quickly(page: Page, change: Callable[[Answer, int], None]) -> None:
    """The same, on a page by whose clock more time goes by between two answers."""
    page.add_init_script(f"const now = performance.now.bind(performance); performance.now = () => {FASTER} * now();")
    told(page, change)


def as_it_is(_found: Answer, _asked: int) -> None:
    pass


def dropped(total: int, each: int) -> Callable[[Answer, int], None]:
    """So many pictures, and so many more with each answer."""

    def change(found: Answer, asked: int) -> None:
        found["counts"].append(
            {
                "key": "Dropped a keyframe/bad_image",
                "about": "Dropped a keyframe",
                "reason": "bad_image",
                "total": total + asked * each,
                "means": "The picture cannot be decoded.",
                "todo": "Look at the camera.",
                "bearable": 0,
                "robots": [["r2", total]],
            }
        )

    return change


def headline(page: Page) -> Locator:
    return page.locator(".cv-headline")


def says(page: Page, words: str) -> None:
    """The first line does, once rates are known."""
    expect(headline(page)).to_contain_text(words, timeout=JUDGED_MS)


def rate(page: Page) -> Locator:
    """How much a minute comes of what was dropped most."""
    return page.locator("#cv-drops + table td.cv-number").first


def row(page: Page, section: str, name: str) -> list[str]:
    """The cells of a row, by the words that it begins with."""
    rows = page.locator(f"section[aria-labelledby={section}] tbody tr").filter(has_text=name)
    return rows.first.locator("th, td").all_inner_texts()


def test_parts_robots_and_queues_of_the_station_are_shown(page: Page, station: Place) -> None:
    opened(page)
    works = page.locator("section[aria-labelledby=cv-parts] tbody tr")
    assert works.count() == 5
    assert row(page, "cv-parts", "Database")[1].startswith("works; ")
    assert "6 robots (6 live) in 2 groups." in page.locator("#cv-main").inner_text()
    assert re.search(r"As of ([01]\d|2[0-3]):[0-5]\d:[0-5]\d\.", page.locator("#cv-main").inner_text())
    names = page.locator("section[aria-labelledby=cv-waiting] tbody th").all_inner_texts()
    assert {"Mail", "Jobs under way", "News for history"} <= {name.split("\n")[0] for name in names}
    received = int(row(page, "cv-fates", "came")[1].split()[0])
    counted = page.request.get(f"{station.url}/api/v1/robots").json()["robots"]
    assert 6 <= received <= sum(robot["keyframes"]["received"] for robot in counted)


def test_when_all_is_well_the_first_line_says_so(page: Page, station: Place) -> None:
    quickly(page, as_it_is)
    opened(page)
    expect(headline(page)).to_contain_text(
        "Every part of the station works. Whether anything is being dropped is known"
    )
    says(page, "All is well: every part of the station works, and nothing is being dropped.")
    assert page.locator(".cv-needs").count() == 0


def test_what_was_dropped_before_is_told_and_is_no_alarm(page: Page, station: Place) -> None:
    quickly(page, dropped(40, 0))
    opened(page)
    expect(rate(page)).to_have_text("0", timeout=JUDGED_MS)
    what, *numbers = row(page, "cv-drops", "bad_image")
    assert numbers == ["0", "40"]
    assert what.startswith("Dropped a keyframe: bad_image")
    assert what.endswith("The picture cannot be decoded. Look at the camera. Most from r2 (40).")
    assert headline(page).inner_text().startswith("All is well")


def test_what_is_dropped_now_comes_first_with_how_much_and_from_whom(page: Page, station: Place) -> None:
    quickly(page, dropped(40, 10))
    opened(page)
    says(page, "Every part of the station works. One thing needs attention.")
    need = page.locator(".cv-needs li").first
    words = need.inner_text()
    assert "Dropped a keyframe (bad_image): " in words
    assert "a minute now. The picture cannot be decoded. Look at the camera." in words
    assert (need.get_by_role("link", name="r2").get_attribute("href") or "").endswith("/dashboard/robots/r2")
    now, since = row(page, "cv-drops", "bad_image")[1:3]
    assert 5 <= float(now) <= 120
    assert int(since) > 40


def test_what_was_watched_for_a_moment_is_not_judged(page: Page, station: Place) -> None:
    """Three pictures in the first two seconds are not ninety a minute."""
    told(page, dropped(40, 3))
    opened(page)
    expect(page.locator("#cv-drops + table td.cv-number").nth(1)).not_to_have_text("40")
    assert rate(page).inner_text() == "..."
    assert {cell.split()[-1] for cell in row(page, "cv-fates", "came")[1:]} == {"..."}
    assert page.locator(".cv-needs").count() == 0


def test_who_stands_on_a_link_keeps_it_while_numbers_change(page: Page, station: Place) -> None:
    quickly(page, lambda found, asked: dropped(40 + asked**2, 0)(found, 0))
    opened(page)
    link = page.locator(".cv-needs li").get_by_role("link", name="r2")
    expect(link).to_be_visible(timeout=JUDGED_MS)
    link.focus()
    need = page.locator(".cv-needs li").element_handle()
    before = page.locator(".cv-needs li").inner_text()
    line = headline(page).inner_text()
    expect(page.locator(".cv-needs li")).not_to_have_text(before, use_inner_text=True)
    assert page.evaluate("need => need.isConnected && need.contains(document.activeElement)", need)
    assert headline(page).inner_text() == line


RATES = """async ([seconds, leastMs]) => {
    const { Samples } = await import('covista/samples.js');
    const samples = new Samples();
    for (const at of seconds) samples.take({ station: 's', drops: 40 + at, sum: 3 * at }, 1000 * at);
    return [samples.rate((each) => each.drops, leastMs), samples.ratio((each) => each.sum, (each) => each.drops)];
}"""


@pytest.mark.parametrize(
    ("seconds", "rate_per_min", "ratio"),
    [
        ([], None, None),
        ([0], None, None),
        ([0, 2], None, 3),
        ([0, 2, 19], None, 3),
        ([0, 2, 20], 60, 3),
        ([0, 30, 70], 60, 3),
        # A page that was hidden for long begins anew.
        ([0, 100], None, None),
        ([0, 100, 110], None, 3),
    ],
)
def test_a_rate_wants_a_least_time_and_a_ratio_none(
    page: Page, station: Place, seconds: list[int], rate_per_min: float | None, ratio: float | None
) -> None:
    opened(page)
    assert page.evaluate(RATES, [seconds, 20_000]) == [rate_per_min, ratio]


def test_counts_of_another_start_are_no_continuation(page: Page, station: Place) -> None:
    """What fell to little was not lost, and what it grew from there is no flood."""

    def restarted(found: Answer, asked: int) -> None:
        found["station"] = "before" if asked == 0 else "after"
        dropped(0 if asked == 0 else 5000, 0)(found, 0)

    quickly(page, restarted)
    opened(page)
    expect(rate(page)).to_have_text("0", timeout=JUDGED_MS)
    assert row(page, "cv-drops", "bad_image")[1:3] == ["0", "5000"]


def test_a_part_that_does_not_work_is_said_first_with_what_to_do(page: Page, station: Place) -> None:
    def away(found: Answer, _asked: int) -> None:
        found["status"] = "degraded"
        found["sentence"] = "The station goes on, but something is wrong: Database."
        found["attention"] = [
            {"key": "robots", "level": "note", "says": "No robot has been heard yet.", "todo": "", "robots": []},
            {
                "key": "part/store",
                "level": "bad",
                "says": "Database is off: <b>no such host</b>.",
                "todo": "See the disk.",
                "robots": [],
            },
        ]

    told(page, away)
    opened(page)
    headline(page).get_by_text("something is wrong: Database").wait_for()
    needs = page.locator(".cv-needs > li").all_inner_texts()
    assert needs[0].split("\n")[0].startswith("Wrong")
    assert "Database is off: <b>no such host</b>. See the disk." in needs[0]
    assert "No robot has been heard yet." in needs[1]


def test_groups_that_come_late_are_told_while_they_do(page: Page, station: Place) -> None:
    def slower(found: Answer, asked: int) -> None:
        found["latency"] |= {"count": 100 + 10 * asked, "sum_s": 4 + 9.0 * asked, "slow": 8 * asked}

    quickly(page, slower)
    opened(page)
    expect(page.get_by_text("900 ms on average in the last minute")).to_be_visible()
    late = page.get_by_text("Groups come late: 900 ms after a keyframe on average, 80 % of them")
    expect(late).to_be_visible(timeout=JUDGED_MS)


def test_before_the_first_keyframe_no_latency_is_made_up(page: Page, station: Place) -> None:
    def silent(found: Answer, _asked: int) -> None:
        found["latency"] = {"p50_ms": None, "p99_ms": None, "sum_s": 0.0, "count": 0, "slow": 0}

    told(page, silent)
    opened(page)
    page.get_by_text("No keyframe has shown in the groups yet.").wait_for()
    assert " ms" not in page.locator("section[aria-labelledby=cv-latency]").inner_text()


def test_what_is_shown_when_no_answer_comes_any_more_is_said_to_be_old(visitor: Visitor, station: Place) -> None:
    visitor.allow("503")
    page = opened(visitor.page())
    page.route(HEALTH, lambda route: route.fulfill(status=503, json={"detail": "the station is busy"}))
    expect(page.get_by_role("alert")).to_contain_text("What you see is from before")
    expect(page.get_by_role("alert")).to_contain_text("the station is busy")
    page.unroute(HEALTH)
    expect(page.get_by_role("alert")).to_have_count(0)


def test_all_numbers_are_a_link_away(page: Page, station: Place) -> None:
    opened(page)
    for name, words in (("metrics", "covista_messages_total"), ("what programs can ask", "swagger")):
        address = page.get_by_role("link", name=name, exact=True).get_attribute("href")
        answer = page.request.get(f"{station.url}{address}")
        assert answer.ok
        assert words in answer.text()


def test_on_a_phone_nothing_is_wider_than_the_page(page: Page, station: Place) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    quickly(page, dropped(40, 10))
    opened(page)
    expect(page.locator(".cv-needs li").first).to_be_visible(timeout=JUDGED_MS)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
