"""What a page's tables and figures do in a real browser: sorting, CSV, enlarging, keyboard."""

from __future__ import annotations

import csv
import io

import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of
from selenium.webdriver.support.wait import WebDriverWait

from er3a.pipeline.messages.glossary import GLOSSARY
from er3a.pipeline.results import Provenance
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.page import Picture, render

TEMPLATE = """{% extends "base.html.j2" %}
{% block title %}Test{% endblock %}
{% block header %}<h1>Test page</h1>{% endblock %}
{% block content %}{{ ui.table(["name", "value (mm)>"], rows, "Lengths") }}{{ ui.picture(picture) }}
<p>Some branches of an arm's branch have a <em>Wrist centre</em>.</p>{% endblock %}"""
ROWS = [["b, long", "−1\u202f234.5"], ["a", "20"], ['"c"', "–"], ["d", "3"], ["e", "5.0·10⁻³"]]


@pytest.fixture
def page(browser, tmp_path):
    """A page with one table and one figure, open in the browser."""
    figure, axes = new_figure()
    axes.plot([0, 1], [0, 1])
    template = tmp_path / "page.html.j2"
    template.write_text(TEMPLATE, encoding="utf-8")
    render(
        template,
        tmp_path / "page.html",
        command="make run",
        provenance=Provenance(inputs=(), code="0" * 64),
        rows=ROWS,
        picture=Picture(figure, "A line", "It rises."),
    )
    browser.get((tmp_path / "page.html").as_uri())
    return browser


def column(page, number: int) -> list[str]:
    return [cell.text for cell in page.find_elements(By.CSS_SELECTOR, f"tbody td:nth-child({number})")]


def test_sorting_by_keyboard_goes_by_value_and_back(page):
    button = page.find_elements(By.CSS_SELECTOR, "th .sort")[1]
    header = page.find_elements(By.CSS_SELECTOR, "th")[1]
    written = column(page, 2)
    button.send_keys(Keys.ENTER)
    assert column(page, 2) == ["−1\u202f234.5", "5.0·10⁻³", "3", "20", "–"]
    assert header.get_attribute("aria-sort") == "ascending"
    button.send_keys(Keys.ENTER)
    assert column(page, 2) == ["20", "3", "5.0·10⁻³", "−1\u202f234.5", "–"]
    button.send_keys(Keys.ENTER)
    assert column(page, 2) == written
    assert header.get_attribute("aria-sort") is None


def test_csv_holds_the_table_with_plain_numbers(page):
    rows = list(csv.reader(io.StringIO(page.execute_script("return csvOf(document.querySelector('table'))"))))
    assert rows[0] == ["name", "value (mm)"]
    assert rows[1:] == [["b, long", "-1234.5"], ["a", "20"], ['"c"', "–"], ["d", "3"], ["e", "5.0e-3"]]


def test_figure_is_enlarged_and_closed_by_keyboard(page):
    page.find_element(By.CSS_SELECTOR, "figure button").send_keys(Keys.ENTER)
    dialog = page.find_element(By.CSS_SELECTOR, "dialog")
    assert (
        dialog.find_element(By.TAG_NAME, "img").size["height"]
        > page.find_element(By.CSS_SELECTOR, "figure img").size["height"]
    )
    page.switch_to.active_element.send_keys(Keys.ESCAPE)
    WebDriverWait(page, 5).until(staleness_of(dialog))


def test_a_term_of_the_glossary_explains_itself_to_keys_and_pointer(page):
    term = page.find_element(By.CSS_SELECTOR, ".term")
    tip = page.find_element(By.ID, term.get_attribute("aria-describedby"))
    assert not tip.is_displayed()
    page.execute_script("arguments[0].focus()", term)
    assert tip.is_displayed()
    assert tip.text in GLOSSARY.values()
    term.send_keys(Keys.ESCAPE)
    assert not tip.is_displayed()
    ActionChains(page).move_to_element(term).perform()
    assert tip.is_displayed()
    box = tip.rect
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= page.execute_script("return innerWidth")


def test_each_term_is_explained_once_and_by_its_own_meaning(page):
    found = page.execute_script(
        "return [...document.querySelectorAll('.term')].map(t => "
        "[t.textContent, document.getElementById(t.getAttribute('aria-describedby')).textContent])"
    )
    assert [text for text, _ in found] == ["branches", "Wrist centre"]
    assert len({meaning for _, meaning in found}) == len(found)
    for text, meaning in found:
        assert any(text.lower().startswith(term) and GLOSSARY[term] == meaning for term in GLOSSARY)


def test_figure_is_offered_for_download(page):
    link = page.find_element(By.CSS_SELECTOR, "figure .tools a")
    assert link.get_attribute("download") == "test_page_a_line.svg"
    assert link.get_attribute("href").startswith("data:image/svg+xml")
