"""A page's size, on a phone, a laptop and a 4K screen, and on sheets of A4."""

from __future__ import annotations

import base64
import re

import pytest
from selenium.webdriver.common.by import By

from testing import chromium
from tests.browser.pages import PAGES

pytestmark = pytest.mark.long

LARGEST_PAGE = 2_000_000


@pytest.mark.parametrize("page", PAGES)
def test_page_is_small_enough(small_study, page):
    assert (small_study.folder / "reports" / page).stat().st_size < LARGEST_PAGE


def check_fit(browser) -> None:
    """The open page on a phone and on a screen as wide as 4K; other tests have widths between."""
    for width, height, letters in ((390, 844, 16), (3840, 900, 26)):
        with chromium.emulating(browser, width, height):
            assert browser.execute_script("return document.documentElement.scrollWidth") <= width
            size, filled, line = browser.execute_script(MEASURES, NOT_PROSE)
            assert size == pytest.approx(letters, abs=0.5)
            assert filled > (0.85 if width < 1500 else 0.75)
            assert line <= 46 * size + 1


def test_a_contradicted_table_takes_six_screens_and_none_of_its_tables_is_cut(browser, small_study):
    with chromium.emulating(browser, 1280, 900):
        browser.get((small_study.folder / "reports/er3a_c60_article/validation.html").as_uri())
        assert browser.execute_script("return document.documentElement.scrollHeight") <= 6 * 900
        assert browser.execute_script(CUT) == []


CUT = "return [...document.querySelectorAll('.scroll')].filter((e) => e.scrollWidth > e.clientWidth).map((e) => e.id)"


NOT_PROSE = ".answer p, .arms p, .fix, .before, .now-shown, .tools, .warning, .turns, .pickers, td p"
MEASURES = """
const size = parseFloat(getComputedStyle(document.documentElement).fontSize);
const widths = [...document.querySelectorAll(`main p:not(${arguments[0]})`)].map((p) => p.offsetWidth);
const { paddingLeft, paddingRight } = getComputedStyle(document.body);
const inner = document.body.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
return [size, inner / innerWidth, Math.max(0, ...widths)];
"""
A4 = (595, 842)  # points
SHEET = 688  # CSS px that are left of A4 between the margins
RIGHT_EDGES = """
const parts = [...document.querySelectorAll("table, figure, img, svg, canvas, dl")];
return parts.filter((part) => !part.closest("#turning")).map((part) => part.getBoundingClientRect().right);
"""


def check_print(browser) -> None:
    """The open page on sheets of A4, with nothing cut."""
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    sizes = re.findall(rb"/MediaBox ?\[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert sizes
    assert {(round(float(width)), round(float(height))) for width, height in sizes} == {A4}
    with chromium.emulating(browser, SHEET, type="print"):
        ends = browser.execute_script(RIGHT_EDGES)
        assert max(ends) <= SHEET + 1
        shown = browser.execute_script(
            "return [...document.querySelectorAll('nav, .tools')].filter((e) => e.offsetHeight)"
        )
        assert shown == []
        assert browser.find_element(By.CSS_SELECTOR, ".provenance dl").is_displayed()
    if browser.find_elements(By.ID, "turning"):
        assert browser.find_elements(By.CSS_SELECTOR, "#turning canvas"), "drawn for the printer too"
