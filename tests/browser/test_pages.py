"""Every page in a real browser: it loads whole, without an error, and is accessible in light and dark."""

from __future__ import annotations

import base64
import re

import pytest
from axe_core_python.selenium import Axe
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from er3a.files.robot_library import load_robot
from er3a.pipeline.overview.index import FIRST
from testing import chromium
from tests.browser.pages import OVER_ALL, PAGES, PAGES_OF_EACH_KIND
from tests.conftest import ROBOTS


@pytest.mark.parametrize("page", [*PAGES_OF_EACH_KIND, "er3a_c60_article/workspace.html", "er3_600/workspace.html"])
def test_page_opens_clean(browser, small_study, page):
    path = small_study.folder / "reports" / page
    browser.get(path.as_uri())
    assert "er3a" in browser.title
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    images = browser.execute_script("return [...document.images].map(i => [i.alt, i.complete && i.naturalWidth > 0])")
    assert all(loaded for _, loaded in images)
    assert all(alt for alt, _ in images)
    figures = browser.execute_script("return document.querySelectorAll('figure, canvas').length")
    assert page in OVER_ALL or figures, "a robot's page shows at least one figure"
    loaded = browser.execute_script("return performance.getEntriesByType('resource').map(entry => entry.name)")
    assert [address for address in loaded if not address.startswith(("data:", "blob:"))] == []


@pytest.mark.parametrize("page", PAGES_OF_EACH_KIND)
def test_page_is_accessible(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    assert serious_faults(browser) == []
    with chromium.emulating(browser, prefers_color_scheme="dark"):
        assert browser.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(18, 23, 29)"
        assert serious_faults(browser, runOnly=["color-contrast"]) == []


def serious_faults(browser, **options) -> list[tuple[str, list[str]]]:
    """What axe-core calls serious or worse: the rule, and the first elements that break it."""
    found = Axe().run(browser, options=options)["violations"]
    serious = [fault for fault in found if fault["impact"] in ("serious", "critical")]
    return [(fault["id"], [node["html"][:200] for node in fault["nodes"][:3]]) for fault in serious]


@pytest.mark.long
def test_index_leads_to_every_page(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    links = browser.execute_script("return [...document.querySelectorAll('.stages a')].map(a => a.href)")
    found = {link.rsplit("/", 2)[-2] + "/" + link.rsplit("/", 1)[-1] for link in links}
    assert found == set(PAGES) - set(OVER_ALL)


def test_index_cells_are_links_as_a_whole_and_what_is_open_stands_first(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    browser.execute_script("document.querySelectorAll('.robot > details').forEach((part) => (part.open = true))")
    for width in (390, 1440, 2560):
        with chromium.emulating(browser, width):
            assert browser.execute_script(CELLS_THAT_ARE_NO_LINK) == []
    orders = browser.execute_script(STATUSES)
    assert len(orders) == len(ROBOTS)
    known = [[status for status in order if status != "no_verdict"] for order in orders]  # of a table not to be used
    assert all(order == sorted(order, key=FIRST.index) for order in known)
    assert sum(map(len, known)) > 2 * len(ROBOTS)
    drawn = browser.execute_script(
        "return [...document.querySelectorAll('.thumbnail polyline')].map(l => l.getBBox().height)"
    )
    assert len(drawn) >= 2 * len(ROBOTS)
    assert max(drawn) > 100


# In a corner of each cell, far from its words, the page's topmost element is the cell's link.
CELLS_THAT_ARE_NO_LINK = """
return [...document.querySelectorAll(".cells > li")].filter((cell) => {
  cell.scrollIntoView({ block: "end" });
  const box = cell.getBoundingClientRect();
  const hit = document.elementFromPoint(box.right - 4, box.bottom - 4);
  return hit?.tagName !== "A" || !cell.contains(hit);
}).map((cell) => cell.innerText);
"""
STATUSES = """
const statuses = (cells) => [...cells.children].map((cell) => cell.querySelector(".badge").classList[1]);
return [...document.querySelectorAll(".cells")].map(statuses);
"""


def test_index_prints_on_one_sheet(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    assert len(re.findall(rb"/Type ?/Page\b", pdf)) == 1


@pytest.mark.long
def test_comparison_shows_the_pair_that_is_picked(browser, small_study):
    browser.get((small_study.folder / "reports/compare.html").as_uri())

    def cells(what: str) -> list[str]:
        script = (
            "return [...document.querySelectorAll('#comparison tbody tr')].map(r => [...r.cells].map(c => c.innerText))"
        )
        return next(row[3:] for row in browser.execute_script(script) if row[1] == what)

    def shown() -> list[str]:
        groups = browser.find_elements(By.CSS_SELECTOR, "#borders g[data-robot]")
        return [
            group.get_attribute("data-robot")
            for group in groups
            if group.value_of_css_property("visibility") == "visible"
        ]

    assert cells("J2 a") == ["270", "650", "380"]
    assert shown() == ["er3a_c60", "er3a_c60_article"]
    key = browser.find_elements(By.CSS_SELECTOR, ".borders-key span")
    assert [each.text for each in key] == [load_robot(name).title for name in shown()]
    widths = [
        browser.execute_script("return getComputedStyle(arguments[0], '::before').borderTopWidth", each) for each in key
    ]
    drawn = [
        browser.find_element(By.CSS_SELECTOR, f"#borders g.{side}").value_of_css_property("stroke-width")
        for side in ("a", "b")
    ]
    assert widths == drawn == ["5px", "2px"]  # a pair that coincides shows both
    Select(browser.find_element(By.ID, "robot-b")).select_by_value("er3_600")
    robots = [load_robot(name) for name in ("er3a_c60", "er3_600")]
    assert [float(text) for text in cells("J1 d")[:2]] == [round(robot.d[0] * 1000, 6) for robot in robots]
    assert shown() == ["er3a_c60", "er3_600"]
    browser.find_element(By.ID, "only-differences").click()
    address = browser.current_url
    assert address.endswith("#a=er3a_c60&b=er3_600&differs")
    browser.get("about:blank")
    browser.get(address)
    assert shown() == ["er3a_c60", "er3_600"]
    rows = [row for row in browser.find_elements(By.CSS_SELECTOR, "#comparison tbody tr") if row.is_displayed()]
    assert rows
    assert all(row.find_elements(By.TAG_NAME, "td")[5].text for row in rows)
