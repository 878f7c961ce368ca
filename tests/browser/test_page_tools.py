"""What a page's tables and figures do in a real browser: sorting, CSV, enlarging, keyboard."""

from __future__ import annotations

import csv
import io

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of
from selenium.webdriver.support.wait import WebDriverWait

from er3a.pipeline.results import Provenance
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.page import Picture, render

TEMPLATE = """{% extends "base.html.j2" %}
{% block title %}Test{% endblock %}
{% block header %}<h1>Test page</h1>{% endblock %}
{% block content %}{{ ui.table(["name", "value (mm)>"], rows, "Lengths") }}{{ ui.picture(picture) }}{% endblock %}"""
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


def test_figure_is_offered_for_download(page):
    link = page.find_element(By.CSS_SELECTOR, "figure .tools a")
    assert link.get_attribute("download") == "test_page_a_line.svg"
    assert link.get_attribute("href").startswith("data:image/svg+xml")
