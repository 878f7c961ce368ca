"""Every page in a real browser: it loads whole, without an error, and is accessible in light and dark."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import pytest
from axe_core_python.selenium import Axe
from selenium.webdriver.support.ui import WebDriverWait

from testing import chromium
from tests.browser.pages import OVER_ALL, PAGES, PAGES_OF_EACH_KIND, PAGES_WITH_SORTED_TABLES
from tests.browser.test_page_sizes import check_fit, check_print
from tests.browser.test_page_use import check_plots, check_sorting

pytestmark = pytest.mark.long


WITH_PLOTS = {f"er3a_c60/{stage}.html" for stage in ("workspace", "trajectory", "dynamics", "vision")}
WITH_JOINT_VECTORS = {f"er3a_c60/{stage}.html" for stage in ("inverse", "vision", "collision")}


@pytest.fixture(scope="module", params=PAGES_OF_EACH_KIND)
def page(request, browser, small_study) -> str:
    """A page of each kind, loaded once for all tests of it; the last one changes it."""
    open_page(browser, small_study.folder / "reports" / request.param)
    return request.param


def open_page(browser, path: Path) -> None:
    """Load a page; the browser's log then holds only what it complained of."""
    browser.get_log("browser")
    browser.get(path.as_uri())


def test_page_opens_clean(browser, page):
    check_clean(browser)
    figures = browser.execute_script("return document.querySelectorAll('figure, canvas').length")
    assert page in OVER_ALL or figures, "a robot's page shows at least one figure"
    to_panel = browser.execute_script("return document.querySelectorAll('main a[href^=\"teach.html#q=\"]').length")
    assert to_panel or page not in WITH_JOINT_VECTORS
    if not page.endswith("teach.html"):
        assert check_plots(browser) or page not in WITH_PLOTS


@pytest.mark.parametrize("name", ["er3a_c60_article/workspace.html", "er3_600/workspace.html"])
def test_other_arms_page_opens_clean(browser, small_study, name):
    open_page(browser, small_study.folder / "reports" / name)
    check_clean(browser)


def check_clean(browser) -> None:
    """The open page has a title, no error, all pictures with words for them, and asks for no file beside it."""
    assert "er3a" in browser.title
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    images = browser.execute_script(
        "return [...document.images].filter((i) => !i.matches('.still'))"
        ".map((i) => [i.alt, i.complete && i.naturalWidth > 0])"
    )
    assert all(loaded for _, loaded in images)
    assert all(alt for alt, _ in images)
    loaded = browser.execute_script("return performance.getEntriesByType('resource').map(entry => entry.name)")
    others = {address.rsplit("/", 1)[-1] for address in loaded if not address.startswith(("data:", "blob:"))}
    assert others <= {"marks.js"}  # what the index leaves for headers


def test_page_is_accessible(browser, page):
    if page.endswith("teach.html"):  # its modules finish after the page has loaded
        WebDriverWait(browser, 20).until(lambda own: own.execute_script(USABLE))
    check_access(browser)


def test_page_fits_a_phone_and_4k(browser, page):
    check_fit(browser)


def test_what_the_menus_of_the_header_open_is_seen(browser, page):
    seen = browser.execute_script(MENUS)
    assert seen or page in OVER_ALL
    assert all(seen)


def test_page_prints_on_a4_with_nothing_cut(browser, page):
    check_print(browser)


@pytest.mark.parametrize("page", PAGES_WITH_SORTED_TABLES, indirect=True, scope="module")
def test_every_table_sorts_by_every_column(browser, page):
    """The last test of a page: what it sorts stays so. Tables of the teach panel are the arm's, in its order."""
    check_sorting(browser)


MENUS = """
return [...document.querySelectorAll(".top .menu")].map((menu) => {
  menu.open = true;
  const { left, top, width, height } = menu.querySelector(":scope > :not(summary)").getBoundingClientRect();
  const shown = document.elementFromPoint(left + width / 2, top + Math.min(height, 40) / 2);
  menu.open = false;
  return height > 20 && menu.contains(shown);
});
"""


def check_access(browser) -> None:
    """The open page in light and dark, by axe-core."""
    assert serious_faults(browser) == []
    with chromium.emulating(browser, prefers_color_scheme="dark"):
        assert browser.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(18, 23, 29)"
        assert serious_faults(browser, runOnly=["color-contrast"]) == []


USABLE = "return performance.getEntriesByName('usable').length > 0"


def serious_faults(browser, **options) -> list[tuple[str, list[str]]]:
    """What axe-core calls serious or worse: the rule, and the first elements that break it."""
    found = Axe().run(browser, options={"resultTypes": ["violations"], **options})["violations"]
    serious = [fault for fault in found if fault["impact"] in ("serious", "critical")]
    return [(fault["id"], [node["html"][:200] for node in fault["nodes"][:3]]) for fault in serious]


def test_index_leads_to_every_page(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    links = browser.execute_script("return [...document.querySelectorAll('.matrix td a')].map(a => a.href)")
    found = {link.rsplit("/", 2)[-2] + "/" + link.rsplit("/", 1)[-1] for link in links}
    assert found == {page for page in PAGES if page not in OVER_ALL and not page.endswith("teach.html")}


def test_index_prints_on_one_sheet(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    assert len(re.findall(rb"/Type ?/Page\b", pdf)) == 1
