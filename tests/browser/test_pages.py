"""Every page in a real browser: it loads whole, without an error, and is accessible in light and dark."""

from __future__ import annotations

import base64
import re

import pytest
from axe_core_python.selenium import Axe

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
