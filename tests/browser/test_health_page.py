"""How the station is, in plain words: what needs somebody comes first, and what was is told from what is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page, Route

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
    names = page.locator("section[aria-labelledby=cv-waiting] tbody th").all_inner_texts()
    assert {"Mail", "Jobs under way", "News for history"} <= {name.split("\n")[0] for name in names}
    received = int(row(page, "cv-fates", "came")[1].split()[0])
    counted = page.request.get(f"{station.url}/api/v1/robots").json()["robots"]
    assert 6 <= received <= sum(robot["keyframes"]["received"] for robot in counted)


def test_when_all_is_well_the_first_line_says_so(page: Page, station: Place) -> None:
    told(page, as_it_is)
    opened(page)
    headline(page).get_by_text("All is well: every part of the station works, and nothing is being dropped.").wait_for()
    assert page.locator(".cv-needs").count() == 0


def test_what_was_dropped_before_is_told_and_is_no_alarm(page: Page, station: Place) -> None:
    told(page, dropped(40, 0))
    opened(page)
    page.wait_for_function("document.querySelector('#cv-drops + table td.cv-number').innerText === '0'")
    what, *numbers = row(page, "cv-drops", "bad_image")
    assert numbers == ["0", "40"]
    assert what.startswith("Dropped a keyframe: bad_image")
    assert what.endswith("The picture cannot be decoded. Look at the camera. Most from r2 (40).")
    assert headline(page).inner_text().startswith("All is well")


def test_what_is_dropped_now_comes_first_with_how_much_and_from_whom(page: Page, station: Place) -> None:
    told(page, dropped(40, 3))
    opened(page)
    headline(page).get_by_text("Every part of the station works. One thing needs attention.").wait_for()
    need = page.locator(".cv-needs li").first
    words = need.inner_text()
    assert "Dropped a keyframe (bad_image): " in words
    assert "a minute now. The picture cannot be decoded. Look at the camera." in words
    assert (need.get_by_role("link", name="r2").get_attribute("href") or "").endswith("/dashboard/robots/r2")
    now, since = row(page, "cv-drops", "bad_image")[1:3]
    assert 30 <= float(now) <= 120
    assert int(since) > 40


def test_counts_of_another_start_are_no_continuation(page: Page, station: Place) -> None:
    """What fell to little was not lost, and what it grew from there is no flood."""

    def restarted(found: Answer, asked: int) -> None:
        found["station"] = "before" if asked == 0 else "after"
        dropped(0 if asked == 0 else 5000, 0)(found, 0)

    told(page, restarted)
    opened(page)
    page.wait_for_function("document.querySelectorAll('#cv-drops + table tbody tr').length > 0")
    page.wait_for_function("document.querySelector('#cv-drops + table td.cv-number').innerText === '0'")
    assert row(page, "cv-drops", "bad_image")[1:3] == ["0", "5000"]


def test_a_part_that_does_not_work_is_said_first_with_what_to_do(page: Page, station: Place) -> None:
    def away(found: Answer, _asked: int) -> None:
        found["status"] = "degraded"
        found["sentence"] = "The station goes on, but something is wrong: Database."
        found["attention"] = [
            {"level": "note", "says": "No robot has been heard yet.", "todo": "", "robots": []},
            {
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

    told(page, slower)
    opened(page)
    page.get_by_text("Groups come late: 900 ms after a keyframe on average, 80 % of them").wait_for()
    page.get_by_text("900 ms on average in the last minute").wait_for()


def test_before_the_first_keyframe_no_latency_is_made_up(page: Page, station: Place) -> None:
    def silent(found: Answer, _asked: int) -> None:
        found["latency"] = {"p50_ms": None, "p99_ms": None, "sum_s": 0.0, "count": 0, "slow": 0}

    told(page, silent)
    opened(page)
    page.get_by_text("No keyframe has shown in the groups yet.").wait_for()
    assert " ms" not in page.locator("section[aria-labelledby=cv-latency]").inner_text()


def test_all_numbers_are_a_link_away(page: Page, station: Place) -> None:
    opened(page)
    for name, words in (("metrics", "covista_messages_total"), ("what programs can ask", "swagger")):
        address = page.get_by_role("link", name=name, exact=True).get_attribute("href")
        answer = page.request.get(f"{station.url}{address}")
        assert answer.ok
        assert words in answer.text()


def test_on_a_phone_nothing_is_wider_than_the_page(page: Page, station: Place) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    told(page, dropped(40, 3))
    opened(page)
    page.locator(".cv-needs li").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
