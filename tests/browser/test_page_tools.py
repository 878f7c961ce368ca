"""What a page's tables and figures do in a real browser: sorting, CSV, enlarging, keyboard."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of
from selenium.webdriver.support.wait import WebDriverWait

from er3a.pipeline.messages.pages import GLOSSARY
from er3a.pipeline.results import Provenance
from er3a.pipeline.viewing.figures import new_figure
from er3a.pipeline.viewing.page import Picture, render

pytestmark = pytest.mark.long

TEMPLATE = """{% extends "base.html.j2" %}
{% block title %}Test{% endblock %}
{% block header %}<h1>Test page</h1>{% endblock %}
{% block content %}{{ ui.table(["name", "value (mm)>"], rows, "Lengths") }}{{ ui.picture(picture) }}
<p>Some branches of an arm's branch have a <em>Wrist centre</em>.</p>{% endblock %}"""
ROWS = [["b, long", "−1\u202f234.5"], ["a", "20"], ['"c"', "–"], ["d", "3"], ["e", "5.0·10⁻³"]]


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    """A page with one table and one figure."""
    figure, axes = new_figure()
    axes.plot([0, 1], [0, 1])
    folder = tmp_path_factory.mktemp("written")
    template = folder / "page.html.j2"
    template.write_text(TEMPLATE, encoding="utf-8")
    render(
        template,
        folder / "page.html",
        command="make run",
        provenance=Provenance(inputs=(), code="0" * 64),
        rows=ROWS,
        picture=Picture(figure, "A line", "It rises."),
    )
    return folder / "page.html"


@pytest.fixture
def page(browser, written):
    """The page with one table and one figure, open in the browser."""
    browser.get(written.as_uri())
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


def test_csv_holds_no_formulas(page):
    cells = ["=1+1", "+cmd", "@SUM(A1)", "-cmd", "−5", "a=b", '=HYPERLINK("x","y")']
    table = "<table class='formulas'>" + "".join(f"<tr><td>{cell}</td></tr>" for cell in cells) + "</table>"
    text = page.execute_script(
        "document.querySelector('main').insertAdjacentHTML('beforeend', arguments[0]);"
        "return csvOf(document.querySelector('table.formulas'))",
        table,
    )
    formulas = ["'=1+1", "'+cmd", "'@SUM(A1)", "'-cmd", "-5", "a=b", '\'=HYPERLINK("x","y")']
    assert [row[0] for row in csv.reader(io.StringIO(text))] == formulas


def test_branch_and_bound_is_not_explained_as_a_branch(browser, tmp_path):
    template = tmp_path / "page.html.j2"
    template.write_text(
        '{% extends "base.html.j2" %}{% block title %}T{% endblock %}{% block header %}<h1>T</h1>{% endblock %}'
        "{% block content %}<p>A bound by branch and bound, and a branch.</p>{% endblock %}",
        encoding="utf-8",
    )
    render(template, tmp_path / "page.html", command=None, provenance=Provenance(inputs=(), code="0" * 64))
    browser.get((tmp_path / "page.html").as_uri())
    terms = browser.find_elements(By.CSS_SELECTOR, ".term")
    told = {each.text: browser.find_element(By.ID, each.get_attribute("aria-describedby")) for each in terms}
    assert {name: tip.get_attribute("textContent") for name, tip in told.items()} == {
        name: GLOSSARY[name] for name in ("branch and bound", "branch")
    }


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
    assert link.get_attribute("download") == "test_a_line.svg"
    assert link.get_attribute("href").startswith("data:image/svg+xml")


@pytest.fixture(scope="module")
def plots(browser, tmp_path_factory):
    """A page with a curve, bars, a map with its colour bar and a drawing to scale, and what each shows."""
    folder = tmp_path_factory.mktemp("plots")
    figure, (curve, bars, shades, drawing) = new_figure(1, 4, width=16.0)
    curve.plot(np.linspace(0, 4, 41), np.linspace(0, 4, 41) ** 2, label="square")
    curve.set(xlabel="time (s)", ylabel="way (m)", ylim=(-4, 20))
    bars.bar([0, 1], [5.0, 0.25], label="used")
    bars.set(xticks=[0, 1], xticklabels=["J1", "J2"], ylabel="torque (N m)", yscale="log", ylim=(0.1, 10))
    mesh = shades.pcolormesh([0, 1, 2], [0, 1], [[2.0, 8.0]], vmin=0, vmax=10, rasterized=True)
    figure.colorbar(mesh, ax=shades, label="share (%)")
    shades.set(xlabel="x (mm)", ylabel="y (mm)")
    drawing.plot([0, 100, 100], [0, 0, 100], label="border")
    drawing.set(xlabel="x (mm)", ylabel="z (mm)", aspect=1.0, xlim=(-50, 150), ylim=(-50, 150))
    template = folder / "plots.html.j2"
    template.write_text(
        '{% extends "base.html.j2" %}{% block title %}Test{% endblock %}{% block header %}<h1>Test</h1>{% endblock %}'
        "{% block content %}{{ ui.picture(picture) }}{% endblock %}",
        encoding="utf-8",
    )
    render(
        template,
        folder / "plots.html",
        command="make run",
        provenance=Provenance(inputs=(), code="0" * 64),
        picture=Picture(figure, "Plots", "They answer."),
    )
    browser.set_window_size(1400, 900)
    browser.get((folder / "plots.html").as_uri())
    return browser


@pytest.mark.parametrize(
    ("axes", "place", "said"),
    [
        pytest.param(0, (3.0, 15.0), {"time (s)": 3.0, "square": 9.0}, id="a curve over the pointer's place"),
        pytest.param(1, (0.05, 1.0), {"used": 5.0}, id="a bar on a logarithmic axis"),
        pytest.param(1, (1.0, 0.2), {"used": 0.25}, id="another bar"),
        pytest.param(2, (0.5, 0.5), {"x (mm)": 0.5, "y (mm)": 0.5}, id="a place of a map"),
        pytest.param(3, (98.0, 1.0), {"x (mm)": 100.0, "z (mm)": 0.0}, id="a corner of a drawing"),
        pytest.param(3, (20.0, 80.0), {"x (mm)": 20.0, "z (mm)": 80.0}, id="an empty place of a drawing"),
    ],
)
def test_a_figure_tells_the_pointer_the_values_that_were_drawn(plots, axes, place, said):
    image = plots.find_element(By.CSS_SELECTOR, "figure img")
    own = json.loads(image.get_attribute("data-axes"))[axes]
    left, bottom, right, top = own["box"]

    def part(scale, value):
        low, high = np.log([scale["from"], scale["to"]]) if scale.get("log") else (scale["from"], scale["to"])
        return ((np.log(value) if scale.get("log") else value) - low) / (high - low)

    u = left + part(own["x"], place[0]) * (right - left)
    v = bottom + part(own["y"], place[1]) * (top - bottom)
    edge = plots.execute_script(
        "const s = getComputedStyle(arguments[0]); return parseFloat(s.paddingLeft) + parseFloat(s.borderLeftWidth)",
        image,
    )
    width, height = (image.size[side] - 2 * edge for side in ("width", "height"))
    ActionChains(plots).move_to_element_with_offset(
        image, round((u - 0.5) * width), round((0.5 - v) * height)
    ).perform()
    lines = dict(line.text.rpartition(": ")[::2] for line in plots.find_elements(By.CSS_SELECTOR, ".reading div"))
    found = {name: float(lines[name].replace("≈ ", "").replace("−", "-")) for name in said}
    pixel = {"x": abs(own["x"]["to"] - own["x"]["from"]) / (right - left) / width}
    loose = {"square": 6 * pixel["x"] + 0.05, "used": 0.0, "share (%)": 0.1}
    for name, value in said.items():
        assert found[name] == pytest.approx(value, abs=loose.get(name, 2 * pixel["x"])), (name, lines)


def test_a_figure_says_nothing_beside_its_axes(plots):
    image = plots.find_element(By.CSS_SELECTOR, "figure img")
    ActionChains(plots).move_to_element_with_offset(image, 0, 0).perform()
    ActionChains(plots).move_to_element_with_offset(image, -image.size["width"] // 2 + 12, 0).perform()
    assert not plots.find_element(By.CSS_SELECTOR, ".reading").is_displayed()
