from __future__ import annotations

import io
import json
import re
from base64 import b64encode
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

# Without it there is no browser, and nothing to test here.
expect = pytest.importorskip("playwright.sync_api").expect

SIMILARITY = "/dashboard/similarity"
MATRIX = ".cv-matrix canvas"
PAIR = "#cv-pair"


def opened(page: Page, query: str = "") -> Page:
    page.goto(SIMILARITY + query)
    page.wait_for_selector(f"{MATRIX}[data-drawn]")
    return page


def saved(values: np.ndarray, names: list[str]) -> bytes:
    """A matrix as the station sends it."""
    file = io.BytesIO()
    np.save(file, values)
    np.save(file, np.array([name.encode() for name in names], np.bytes_))
    return file.getvalue()


def test_the_matrix_is_ordered_by_group(page: Page) -> None:
    opened(page).get_by_text("The same as a table").click()
    # Groups may change while one looks: both are of one moment sooner or later.
    page.wait_for_function("""async () => {
        const { groups } = await (await fetch('/api/v1/groups')).json();
        groups.sort((p, q) => Number(p.label.slice(1)) - Number(q.label.slice(1)));
        const shown = [...document.querySelectorAll('.cv-cells thead th')].map((cell) => cell.textContent);
        return shown.length > 2 && String(shown) === String(groups.flatMap((group) => group.robots));
    }""")
    first = page.locator(".cv-cells tbody tr").first.locator("td")
    expect(first.first).to_have_text("1.00")


def test_arrow_keys_choose_a_pair_which_the_address_names(page: Page) -> None:
    opened(page, "?a=r1&b=r1")
    expect(page.locator(PAIR)).to_contain_text("r1 and r1")
    page.locator(MATRIX).focus()
    page.keyboard.press("End")
    page.wait_for_function("document.querySelector('#cv-pair').textContent.startsWith('r1 and ')")
    page.keyboard.press("Home")
    before = page.locator(PAIR).text_content()
    page.keyboard.press("ArrowRight")
    expect(page.locator(PAIR)).not_to_have_text(before or "")
    one, other = re.findall(r"r\d+", page.locator(PAIR).text_content() or "")
    expect(page).to_have_url(re.compile(rf"a={one}&b={other}$"))
    expect(page.locator("[aria-live=polite].cv-hidden")).to_contain_text(f"{one} and {other}: similarity")
    page.reload()
    expect(page.locator(PAIR)).to_contain_text(f"{one} and {other}")


def test_pointing_at_a_cell_tells_of_the_pair_and_leads_to_its_page(page: Page) -> None:
    opened(page, "?a=r1&b=r2")
    page.locator(MATRIX).hover(position=last_cell(page))
    heading = page.locator(PAIR)
    expect(heading).not_to_contain_text("r1 and r2")
    page.locator(MATRIX).press("Home")
    page.locator(MATRIX).press("ArrowRight")
    facts = page.locator("section", has=heading)
    expect(facts).to_contain_text("'s view is seen by")
    expect(facts).to_contain_text("Age")
    name = (heading.text_content() or "").split(":")[0].replace(" and ", "/")
    expect(facts.get_by_role("link", name="What both see")).to_have_attribute("href", f"/dashboard/pairs/{name}")


def last_cell(page: Page) -> Any:
    box = page.locator(MATRIX).bounding_box()
    assert box is not None
    return {"x": box["width"] - 8, "y": box["height"] - 8}


def test_who_leaves_at_once_finds_the_last_choice_on_the_way_back(page: Page) -> None:
    opened(page, "?a=r1&b=r1")
    page.locator(MATRIX).focus()
    # Faster than addresses are written.
    page.evaluate(
        """selector => { for (const key of ["Home", "ArrowRight", "ArrowRight", "ArrowRight", "Enter"])
        document.querySelector(selector).dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true })); }""",
        MATRIX,
    )
    page.wait_for_url("**/pairs/*/*")
    pair = page.url.rsplit("/", 2)[1:]
    page.go_back()
    expect(page.locator(PAIR)).to_contain_text(" and ".join(pair))


def test_another_matrix_has_its_own_numbers_and_its_own_address(page: Page) -> None:
    opened(page, "?a=r1&b=r2").get_by_text("distance", exact=True).click()
    expect(page.locator(PAIR)).to_contain_text(" m")
    expect(page.locator(".cv-ticks span").last).to_contain_text(" m")
    expect(page).to_have_url(re.compile("matrix=distance_m"))
    page.get_by_text("overlap", exact=True).click()
    expect(page.locator(".cv-ticks span")).to_have_text(["0 %", "25 %", "50 %", "75 %", "100 %"])


def test_the_score_of_every_number_of_groups_is_drawn_with_the_one_that_is_shown(page: Page) -> None:
    opened(page)
    page.wait_for_function("""async () => {
        const { groups, scores } = await (await fetch('/api/v1/groups')).json();
        const label = document.querySelector('.cv-label')?.textContent;
        return scores.length === document.querySelectorAll('.cv-dot').length && label === `${groups.length} shown`;
    }""")
    expect(page.locator("#cv-number")).to_contain_text("Why")
    expect(page.locator("section", has=page.locator("#cv-number"))).to_contain_text("adaptive: Small groups are formed")


def test_a_phone_shows_all_without_scrolling_sideways(page: Page) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    opened(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.parametrize("count", [0, 1, 5])
def test_files_of_numpy_are_read_as_they_were_written(page: Page, count: int) -> None:
    opened(page)
    values = np.random.default_rng(count).normal(size=(count, count))
    names = [f"robot-{'x' * k}" for k in range(count)]
    read = page.evaluate(
        """async (text) => {
            const { matrixOf } = await import('covista/npy.js');
            const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
            const { robots, values } = matrixOf(bytes.buffer);
            return { robots, values: [...values] };
        }""",
        b64encode(saved(values, names)).decode(),
    )
    assert read["robots"] == names
    np.testing.assert_array_equal(np.array(read["values"]).reshape(count, count), values)


@pytest.mark.parametrize("dark", [False, True])
def test_colours_are_in_order_for_eyes_that_see_lightness_alone(page: Page, dark: bool) -> None:
    opened(page)
    colours = page.evaluate(
        """async (dark) => {
            const { colourAt } = await import('covista/colour_scale.js');
            return Array.from({ length: 101 }, (_, k) => colourAt(k / 100, dark));
        }""",
        dark,
    )
    shares = np.array(colours) / 255
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    lightness = np.where(luminance > 0.008856, 116 * np.cbrt(luminance) - 16, 903.3 * luminance)
    steps = np.diff(lightness) * (1 if dark else -1)
    assert (steps > 0.2).all()
    assert steps.max() < 3 * steps.mean()
    assert abs(lightness[-1] - lightness[0]) > 70


def swarm_of(page: Page, count: int) -> None:
    """Answer for a large swarm in the place of the station."""
    names = [f"r{number}" for number in range(count)]
    values = np.random.default_rng(0).uniform(size=(count, count))
    values[::7, ::3] = np.nan
    groups = [{"label": f"g{k + 1}", "robots": names[10 * k : 10 * k + 10]} for k in range(count // 10)]

    scores = [{"groups": k, "score": 1 / k} for k in range(1, 301)]
    told = page.request.get("/api/v1/groups").json() | {"groups": groups, "ungrouped": [], "scores": scores}
    page.route("**/api/v1/groups", lambda route: route.fulfill(json=told))
    page.route("**/api/v1/similarity*", lambda route: route.fulfill(body=saved(values, names)))
    page.route("**/data/pair?*", lambda route: route.fulfill(body=json.dumps({"problem": "not now"})))


def test_a_thousand_robots_can_still_be_walked_through(page: Page) -> None:
    swarm_of(page, 1000)
    opened(page, "?matrix=overlap&a=r0&b=r1")
    page.locator(MATRIX).focus()
    page.keyboard.press("ArrowDown")
    expect(page.locator(PAIR)).to_contain_text("r1 and r1: overlap")
    page.get_by_role("combobox", name="Show").select_option("g7")
    expect(page.locator(MATRIX)).to_have_attribute("aria-label", re.compile("Matrix of 10 robots"))
    expect(page).to_have_url(re.compile("group=g7"))
