"""Every page without a mouse, and all its tables sorted."""

from __future__ import annotations

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of
from selenium.webdriver.support.wait import WebDriverWait

from er3a.pipeline.viewing.figure_3d import WORDS
from tests.browser.pages import PAGES, STAGE_PAGES


@pytest.mark.parametrize("page", PAGES)
def test_tab_key_reaches_everything_in_the_page_s_order(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    sortable = page in STAGE_PAGES and browser.execute_script(HAS_TABLES)
    if sortable:  # the page's script adds its controls when it gets to run
        WebDriverWait(browser, PAUSE).until(lambda shown: shown.find_elements(By.CSS_SELECTOR, ".sort"))
    expected = browser.execute_script(CONTROLS)
    reached = []
    for _ in range(min(len(expected), MOST_TABS)):
        for kind in ("keyDown", "keyUp"):
            browser.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": "Tab", "windowsVirtualKeyCode": 9})
        number, outlined = browser.execute_script(FOCUSED)
        if number is None:
            continue
        reached.append(number)
        assert outlined, f"focus can't be seen on control {number}"
    assert reached == list(range(len(reached)))
    kinds = browser.execute_script(
        "return controls.slice(0, arguments[0]).map((c) => c.classList[0] || c.tagName)", MOST_TABS
    )
    assert kinds[0] == "A" or page == "index.html"
    if sortable:
        assert {"sort", "tool", "scroll"} <= set(kinds)


MOST_TABS = 60
PAUSE = 5.0  # s to wait for what the page does at once on an idle machine
HAS_TABLES = "return [...document.querySelectorAll('tbody')].some((body) => body.rows.length > 1)"
CONTROLS = """
window.controls = [...document.querySelectorAll("a[href], button, input, select, summary, [tabindex='0']")].filter(
  (control) => control.checkVisibility({ visibilityProperty: true }) && !control.disabled && control.tabIndex >= 0 &&
    !control.closest("#turning") && !(control.type === "radio" && !control.checked));
return controls.map((control) => control.tagName);
"""
FOCUSED = """
if (document.activeElement.closest("#turning")) return [null, null];
const { outlineStyle, outlineWidth } = getComputedStyle(document.activeElement);
return [controls.indexOf(document.activeElement), outlineStyle !== "none" && parseFloat(outlineWidth) >= 1];
"""


@pytest.mark.parametrize("page", STAGE_PAGES)
def test_figures_enlarge_and_give_the_focus_back(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    buttons = browser.find_elements(By.CSS_SELECTOR, "figure button")
    for button in (buttons[0], buttons[-1]):
        button.send_keys(Keys.ENTER)
        dialog = browser.find_element(By.CSS_SELECTOR, "dialog[open]")
        assert browser.execute_script("return arguments[0].contains(document.activeElement)", dialog)
        browser.switch_to.active_element.send_keys(Keys.ESCAPE)
        WebDriverWait(browser, PAUSE).until(staleness_of(dialog))
        assert browser.switch_to.active_element == button


@pytest.mark.parametrize("page", ["compare.html", *STAGE_PAGES])
def test_every_table_sorts_by_every_column(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    sorted_columns = browser.execute_script(SORT_ALL)
    assert bool(sorted_columns) == browser.execute_script(HAS_TABLES)
    for written, rising, falling in sorted_columns:
        assert sorted(rising) == sorted(falling) == sorted(written)
        numbers = [value for value in map(shown_number, rising) if value is not None]
        assert numbers == sorted(numbers)
        if len(numbers) == len(rising):
            assert list(map(shown_number, falling)) == sorted(numbers, reverse=True)


SORT_ALL = """
const columns = [];
for (const table of document.querySelectorAll("table")) {
  [...table.querySelectorAll(".sort")].forEach((control, column) => {
    const texts = () => [...table.tBodies[0].rows].map((row) => row.cells[column].innerText.trim());
    const orders = [texts()];
    for (let press = 0; press < 2; press++) {
      control.click();
      orders.push(texts());
    }
    control.click();
    columns.push(orders);
  });
}
return columns;
"""


def shown_number(text: str) -> float | None:
    """The value of a number as the pages write it; None for other texts."""
    plain = text.replace("\u202f", "").replace("−", "-").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    try:
        return float(plain.replace("·10", "e"))
    except ValueError:
        return None


@pytest.mark.parametrize("page", ["er3_600/workspace.html", "er3_600/trajectory.html"])
def test_the_3d_figure_offers_nothing_that_needs_the_network(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    figure = browser.find_element(By.ID, "turning")
    browser.execute_script("arguments[0].scrollIntoView()", figure)
    WebDriverWait(browser, PAUSE).until(lambda _: figure.find_elements(By.CSS_SELECTOR, ".modebar-btn"))
    buttons = figure.find_elements(By.CSS_SELECTOR, ".modebar-btn")
    assert {button.get_attribute("data-title") for button in buttons} == set(WORDS)
