"""Every page in a real browser: it loads whole, without an error, and is accessible in light and dark."""

from __future__ import annotations

import base64
import re

import pytest
from axe_core_python.selenium import Axe
from selenium.webdriver.support.ui import WebDriverWait

from testing import chromium
from tests.browser.pages import OVER_ALL, PAGES, PAGES_OF_EACH_KIND


@pytest.mark.parametrize("page", [*PAGES_OF_EACH_KIND, "er3a_c60_article/workspace.html", "er3_600/workspace.html"])
def test_page_opens_clean(browser, small_study, page):
    path = small_study.folder / "reports" / page
    browser.get_log("browser")  # leave out what an earlier test's pages complained of
    browser.get(path.as_uri())
    assert "er3a" in browser.title
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    images = browser.execute_script(
        "return [...document.images].filter((i) => !i.matches('.still'))"
        ".map((i) => [i.alt, i.complete && i.naturalWidth > 0])"
    )
    assert all(loaded for _, loaded in images)
    assert all(alt for alt, _ in images)
    figures = browser.execute_script("return document.querySelectorAll('figure, canvas').length")
    assert page in OVER_ALL or figures, "a robot's page shows at least one figure"
    loaded = browser.execute_script("return performance.getEntriesByType('resource').map(entry => entry.name)")
    others = {address.rsplit("/", 1)[-1] for address in loaded if not address.startswith(("data:", "blob:"))}
    assert others <= {"marks.js"}  # what the index leaves for the marks in headers


@pytest.mark.parametrize("page", PAGES_OF_EACH_KIND)
def test_page_is_accessible(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    if page.endswith("teach.html"):  # its modules finish after the page has loaded
        WebDriverWait(browser, 20).until(lambda own: own.execute_script(USABLE))
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


@pytest.mark.long
def test_index_leads_to_every_page(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    links = browser.execute_script("return [...document.querySelectorAll('.matrix td a')].map(a => a.href)")
    found = {link.rsplit("/", 2)[-2] + "/" + link.rsplit("/", 1)[-1] for link in links}
    assert found == {page for page in PAGES if page not in OVER_ALL and not page.endswith("teach.html")}


def test_index_prints_on_one_sheet(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    assert len(re.findall(rb"/Type ?/Page\b", pdf)) == 1
