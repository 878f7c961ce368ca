"""Every page without a mouse, and all its tables sorted."""

from __future__ import annotations

import re

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import staleness_of
from selenium.webdriver.support.wait import WebDriverWait

from testing import chromium
from tests.browser.pages import PAGES_WITH_EACH_CONTROL

pytestmark = pytest.mark.long


@pytest.mark.parametrize("page", PAGES_WITH_EACH_CONTROL)
def test_tab_key_reaches_everything_in_the_page_s_order(browser, small_study, page):
    browser.get((small_study.folder / "reports" / page).as_uri())
    WebDriverWait(browser, PAUSE).until(lambda shown: shown.execute_script(DRAWN))
    expected = browser.execute_script(CONTROLS)
    reached = []
    for _ in range(min(len(expected), MAX_TABS)):
        for kind in ("keyDown", "keyUp"):
            browser.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": kind, "key": "Tab", "windowsVirtualKeyCode": 9})
        number, outlined = browser.execute_script(FOCUSED)
        if number is None:
            continue
        reached.append(number)
        assert outlined, f"focus can't be seen on control {number}"
    assert reached == list(range(len(reached)))
    kinds = browser.execute_script(
        "return controls.slice(0, arguments[0]).map((c) => c.classList[0] || c.tagName)", MAX_TABS
    )
    assert kinds[0] == "brand"


MAX_TABS = 40
PAUSE = 5.0  # s to wait for what the page does at once on an idle machine
HAS_TABLES = """
const tables = [...document.querySelectorAll("table:not(.entries, .matrix table) tbody")];
return tables.some((body) => body.rows.length > 1);
"""
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


def test_figures_enlarge_and_give_the_focus_back(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/trajectory.html").as_uri())
    shown_row(browser)  # its chart is there, too
    browser.execute_script(UNFOLD)
    found = browser.find_elements(By.CSS_SELECTOR, "figure button")
    buttons = [button for button in found if browser.execute_script("return arguments[0].checkVisibility()", button)]
    for button in (buttons[0], buttons[-1]):
        button.send_keys(Keys.ENTER)
        dialog = browser.find_element(By.CSS_SELECTOR, "dialog[open]")
        assert browser.execute_script("return arguments[0].contains(document.activeElement)", dialog)
        browser.switch_to.active_element.send_keys(Keys.ESCAPE)
        WebDriverWait(browser, PAUSE).until(staleness_of(dialog))
        assert browser.switch_to.active_element == button


UNFOLD = "for (const fold of document.querySelectorAll('main details')) fold.open = true"


@pytest.mark.parametrize("stage", ["programs", "inverse"])
def test_a_row_of_the_list_shows_its_own_part(browser, small_study, stage):
    address = (small_study.folder / f"reports/er3a_c60/{stage}.html").as_uri()
    browser.get(address)
    browser.execute_script(UNFOLD)
    rows = browser.find_elements(By.CSS_SELECTOR, ".runs a")
    for row in (rows[1], rows[-1]):
        browser.execute_script("arguments[0].click()", row)
        name = row.get_attribute("href").partition("#")[2]
        WebDriverWait(browser, PAUSE).until(lambda _, name=name: browser.execute_script(SHOWN_PARTS) == [name])
        assert row.get_attribute("aria-current") == "true"
    name = rows[1].get_attribute("href").partition("#")[2]
    browser.get("about:blank")
    browser.get(f"{address}#{name}")
    WebDriverWait(browser, PAUSE).until(lambda _: browser.execute_script(SHOWN_PARTS) == [name])


def check_plots(browser) -> int:
    """Each plot with axes of the open page answers the pointer; how many axes there are."""
    silent, axes = browser.execute_script(SILENT_AXES)
    assert silent == []
    return axes


# In the middle of each of a page's axes the pointer gets numbers.
SILENT_AXES = r"""
const silent = [];
let count = 0;
for (const image of document.querySelectorAll("img[data-axes]")) {
  const answers = new Answers(image);
  const place = image.getBoundingClientRect();
  const { x: left, y: top, width: w, height: h } = drawnPart(image, place.left, place.top);
  for (const { box } of answers.axes) {
    const [u, v] = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    const lines = answers.at({ clientX: left + u * w, clientY: top + (1 - v) * h }).map(({ text }) => text);
    const told = lines.some((text) => /\d/.test(text)) && !lines.some((text) => /NaN|undefined|Infinity/.test(text));
    if (!told) silent.push([image.alt, box, lines]);
    count += 1;
  }
}
return [silent, count];
"""

SHOWN_PARTS = """
const shown = [...document.querySelectorAll("[data-one-of] > :not([hidden]) h2")];
return [...new Set(shown.map((heading) => heading.id.replace(/-(solutions|clearance)$/, "")))];
"""


def test_a_filter_stays_in_the_address(browser, small_study):
    """Which opens the fold that the table is in."""
    browser.get((small_study.folder / "reports/er3a_c60/validation.html").as_uri())
    browser.execute_script("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    field = browser.find_element(By.CSS_SELECTOR, "#table-entries-known + .tools input")
    table = "arguments[0].closest('.tools').previousElementSibling"
    shown = f"return [...{table}.querySelectorAll('tbody tr')].filter(row => !row.hidden).map(row => row.innerText)"
    everything = browser.execute_script(shown, field)
    browser.execute_script("arguments[0].value = 'α6'; arguments[0].dispatchEvent(new Event('input'))", field)
    kept = browser.execute_script(shown, field)
    assert 0 < len(kept) < len(everything)
    address = browser.current_url
    browser.get("about:blank")
    browser.get(address)
    field = browser.find_element(By.CSS_SELECTOR, "#table-entries-known + .tools input")
    assert field.is_displayed()
    assert field.get_property("value") == "α6"
    assert browser.execute_script(shown, field) == kept


def test_a_link_into_a_fold_opens_it(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60_article/validation.html").as_uri() + "#entry-a2")
    assert browser.find_element(By.ID, "entry-a2").is_displayed()


def test_a_cell_of_the_index_leads_to_its_place_in_the_picture(browser, small_study):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    browser.get(browser.find_element(By.CSS_SELECTOR, ".tile a[href$='#cell-a2']").get_attribute("href"))
    assert browser.execute_script("return scrollY") == 0
    assert sorted(browser.execute_script(MARKED)) == ["label wrong shown", "mark right shown", "mark wrong shown"]


def test_what_a_row_of_the_index_leads_to_has_the_whole_answer_in_one_screen(browser, small_study):
    """Verdict, cause, what to do instead, and the arm at that moment."""
    with chromium.emulating(browser, width=1400, height=1000):
        browser.get((small_study.folder / "reports/index.html").as_uri())
        link = browser.find_element(By.CSS_SELECTOR, '.tile a[href*="play=line_collides&"]')
        browser.get(link.get_attribute("href"))
        WebDriverWait(browser, PAUSE).until(
            lambda _: browser.execute_script("return performance.getEntriesByName('player').length")
        )
        told = browser.find_element(By.CSS_SELECTOR, ".player .now-shown").text
        assert "post" in told
        assert browser.find_element(By.CSS_SELECTOR, ".runs [aria-current] b").text == "line_collides"
        for part in ("h1", ".player canvas", ".player .now-shown", ".fix", ".runs"):
            top, bottom = browser.execute_script(
                "const { top, bottom } = document.querySelector(arguments[0]).getBoundingClientRect();"
                "return [top, bottom]",
                part,
            )
            assert 0 <= top < bottom <= 1000, part


def test_back_leads_to_where_one_was(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/trajectory.html").as_uri())
    fold = browser.find_element(By.ID, "judged")
    browser.execute_script("arguments[0].open = true; arguments[0].scrollIntoView()", fold)
    place = "return document.getElementById('judged').getBoundingClientRect().top"
    WebDriverWait(browser, PAUSE).until(lambda _: browser.find_elements(By.CSS_SELECTOR, ".player canvas"))
    before = browser.execute_script(place)
    browser.execute_script("document.querySelector('.chip a').click()")
    WebDriverWait(browser, PAUSE).until(lambda _: "validation.html" in browser.current_url)
    browser.back()
    WebDriverWait(browser, PAUSE).until(lambda _: browser.find_element(By.ID, "judged").get_property("open"))
    WebDriverWait(browser, PAUSE).until(lambda _: abs(browser.execute_script(place) - before) < 2)


def found_on(browser, address, text):
    """The links that the search of an open page has to a page."""
    browser.find_element(By.TAG_NAME, "body").send_keys("/")
    field = browser.find_element(By.CSS_SELECTOR, ".find input")
    WebDriverWait(browser, PAUSE).until(lambda _: browser.switch_to.active_element == field)
    field.send_keys(text)
    own = f'.find a[href*="{address}"]'
    WebDriverWait(browser, PAUSE).until(lambda _: browser.find_elements(By.CSS_SELECTOR, own))
    return browser.find_elements(By.CSS_SELECTOR, own)


def test_a_search_has_a_layer_of_its_own_and_leaves_the_page_as_it_is(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/trajectory.html").as_uri())
    laid = (
        "return [...document.querySelectorAll('main, .hero, .runs li')]"
        ".map((part) => Object.values(part.getBoundingClientRect().toJSON()))"
    )
    shown = "return performance.getEntriesByName('player').length > 0"
    WebDriverWait(browser, PAUSE).until(lambda own: own.execute_script(shown))
    browser.execute_script("scrollTo(0, 0)")  # browsers keep where a page was before
    before = browser.execute_script(laid)
    assert "er3a_c60/inverse.html" in found_on(browser, "er3a_c60/inverse.html", "solutions")[0].get_attribute("href")
    layer = browser.find_element(By.CSS_SELECTOR, ".find > div").rect
    assert layer["y"] >= browser.find_element(By.CSS_SELECTOR, ".find > summary").rect["y"] + 20
    assert layer["x"] >= 0
    assert browser.execute_script(laid) == before


@pytest.mark.parametrize(
    ("page", "text"),
    [
        ("er3a_c60/validation.html", "Five poses to read at the pendant"),
        ("er3a_c60_article/validation.html", "Failed, worst first"),
        ("er3a_c60/trajectory.html", "Verdict and figures in full"),
        ("er3a_c60/teach.html", "Tool pose"),
    ],
)
def test_a_search_finds_headings_and_captions_of_a_page_and_leads_to_them(browser, small_study, page, text):
    browser.get((small_study.folder / "reports/index.html").as_uri())
    place = found_on(browser, page, text)[1]  # behind the page's title
    assert text in place.text
    browser.get(place.get_attribute("href"))
    if page.endswith("teach.html"):
        return
    sought = browser.find_element(By.CLASS_NAME, "sought")
    assert text in sought.text
    top, bottom, height = browser.execute_script(
        "const box = arguments[0].getBoundingClientRect(); return [box.top, box.bottom, innerHeight]", sought
    )
    assert 0 <= top < bottom <= height


def test_a_place_inside_of_a_program_shows_that_program_whole_with_its_player(browser, small_study):
    page = (small_study.folder / "reports/er3a_c60/programs.html").as_uri()
    browser.get(f"{page}?at=1DEFsingular_line")
    assert "DEF singular_line" in browser.find_element(By.CLASS_NAME, "sought").text
    assert browser.find_element(By.CSS_SELECTOR, ".player canvas").is_displayed()
    assert browser.find_element(By.ID, "singular_line").is_displayed()
    assert not browser.find_element(By.ID, "out_of_reach").is_displayed()
    motion = browser.find_element(By.CSS_SELECTOR, ".player select.motion")
    WebDriverWait(browser, PAUSE).until(lambda _: motion.get_property("value") == "singular_line")


def test_a_row_that_an_address_leads_to_has_the_heads_of_its_columns(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/workspace.html").as_uri() + "#void-1")
    row = browser.find_element(By.ID, "void-1")
    heads = [head.text.replace("\n", " ") for head in browser.find_elements(By.CSS_SELECTOR, "#table-voids thead th")]
    shown = browser.execute_script(
        "return [...arguments[0].cells].map((cell) => getComputedStyle(cell, '::before').content)", row
    )
    assert [text.strip('"') for text in shown] == heads


def test_the_first_column_of_a_wide_table_stays_on_a_phone(browser, small_study):
    browser.set_window_size(500, 800)
    browser.get((small_study.folder / "reports/er3a_c60/workspace.html").as_uri())
    moved, left = browser.execute_script(
        "const box = document.querySelector('#table-voids');"
        "box.scrollLeft = 200;"
        "return [box.scrollLeft,"
        "  box.querySelector('tbody td').getBoundingClientRect().left - box.getBoundingClientRect().left]"
    )
    assert moved > 0
    assert abs(left) < 1


def test_a_table_of_joints_keeps_their_order(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/validation.html").as_uri())
    assert browser.find_elements(By.CSS_SELECTOR, "table.entries")
    assert not browser.find_elements(By.CSS_SELECTOR, "table.entries .sort")


def test_joint_vectors_lead_to_the_teach_panel(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/inverse.html").as_uri())
    link = browser.find_element(By.CSS_SELECTOR, 'tbody a[href^="teach.html#q="]')
    shown = [float(angle) for angle in link.get_attribute("href").partition("#q=")[2].split(",")]
    browser.get(link.get_attribute("href"))
    WebDriverWait(browser, 4 * PAUSE).until(
        lambda _: browser.execute_script("return performance.getEntriesByName('usable').length")
    )
    taken = browser.execute_script(
        "return [...document.querySelectorAll('.joint input[type=number]')].map(f => f.valueAsNumber)"
    )
    assert taken == pytest.approx(shown, abs=0.06)


def check_sorting(browser) -> None:
    """The open page's tables, by each column: numbers with units, signs, spreads, marks and "at least" by value, before
    words, empty cells last."""
    sorted_columns = browser.execute_script(SORT_ALL)
    assert bool(sorted_columns) == browser.execute_script(HAS_TABLES)
    for numeric, by_verdict, written, rising, falling in sorted_columns:
        assert sorted(rising) == sorted(falling) == sorted(written)
        led = [float(plain(found[1])) for text in rising if (found := LEADING_NUMBER.match(text))]
        numbered = [text for text in rising if re.search(r"\d", text)]
        assert not numeric or len(led) == len(numbered), "a column of numbers has no other cells with numbers"
        if by_verdict or 2 * len(led) <= len(numbered):
            continue
        assert led == sorted(led)
        assert all(LEADING_NUMBER.match(text) for text in [*rising[: len(led)], *falling[: len(led)]])
        assert [float(plain(LEADING_NUMBER.match(text)[1])) for text in falling[: len(led)]] == led[::-1]
        ends = [text for text in rising if text in ("", "–")]
        assert rising[len(rising) - len(ends) :] == ends


def test_cells_with_units_signs_and_marks_sort_by_value(browser, tmp_path, small_study):
    shown = {
        "unit": ["13.8 mm", "5.12 mm", "–", "−2 mm", "1\u202f200 ± 3 mm"],
        "sign": ["+352", "+10", "", "+19", "+12"],
        "mark": ["✓ 12 deg", "✗ 100 deg", "≥ 3 deg", "< 0.5 deg", "✓ 1.5·10⁻³ deg"],
        "name": ["6R", "pick 2", "2-axis", "pick 10", "arm_3"],
        "pair": ["30<br>20", "4<br>500", "0", "", "12 to 9"],
        "time": ["t = 10.00 s", "t = 4.00 s", "one round: 5.1 to 6 s", "7 s", "–"],
        "bound": ["no bound", "at least 9.42 to 10 mm", "none", "at least −9.5 mm", "9.5 mm"],
    }
    rising = {
        "unit": ["−2 mm", "5.12 mm", "13.8 mm", "1\u202f200 ± 3 mm", "–"],
        "sign": ["+10", "+12", "+19", "+352", ""],
        "mark": ["✓ 1.5·10⁻³ deg", "< 0.5 deg", "≥ 3 deg", "✓ 12 deg", "✗ 100 deg"],
        "pair": ["0", "4\n500", "12 to 9", "30\n20", ""],
        "time": ["t = 4.00 s", "one round: 5.1 to 6 s", "7 s", "t = 10.00 s", "–"],
        "bound": ["at least −9.5 mm", "at least 9.42 to 10 mm", "9.5 mm", "no bound", "none"],
    }
    browser.get(
        (small_study.folder / "reports/er3a_c60/validation.html").as_uri()
    )  # no player, which would miss its data
    rows = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in zip(*shown.values()))
    table = (
        f"<table><thead><tr>{''.join(f'<th>{name}</th>' for name in shown)}</tr></thead><tbody>{rows}</tbody></table>"
    )
    browser.execute_script(
        "document.body.innerHTML = arguments[0]; makeSortable(document.querySelector('table'))",
        table.replace("< 0", "&lt; 0"),
    )
    orders = dict(zip(shown, (column[3] for column in browser.execute_script(SORT_ALL))))
    assert orders | rising == orders
    assert sorted(orders["name"]) == sorted(shown["name"])
    assert orders["name"].index("pick 2") < orders["name"].index("pick 10")


SORT_ALL = """
for (const part of document.querySelectorAll("[data-one-of] > [hidden]")) part.hidden = false;
for (const part of document.querySelectorAll("details")) part.open = true;
const columns = [];
for (const table of document.querySelectorAll("table")) {
  [...table.querySelectorAll(".sort")].forEach((control, column) => {
    const texts = () => [...table.tBodies[0].rows].map((row) => row.cells[column].innerText.trim());
    const sorted = [...table.tBodies[0].rows].every((row) => row.cells[column]?.querySelector(".badge, .decision"));
    const orders = [control.closest("th").classList.contains("n"), sorted, texts()];
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


LEADING_NUMBER = re.compile(
    "(?:[a-z =]+[:=] )?(?:at least |at most |[✓✗<>≤≥±(⌀] ?)?"
    "([+−-]?\\d+(?:\u202f\\d{3})*(?:\\.\\d+)?(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?)(?![\\w.-])"
)


def plain(text: str) -> str:
    """A number of a page as Python writes it."""
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    return text.replace("\u202f", "").replace("−", "-").translate(superscripts).replace("·10", "e")


DRAWN = "return !document.getElementById('three') || performance.getEntriesByType('mark').length > 0"
PAINTED = """const canvas = document.querySelector("#turning canvas");
const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
copy.drawImage(canvas, 0, 0);
const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
return data.filter((value, i) => i % 4 === 3 && value > 0).length;"""


def test_the_figure_in_space_is_drawn_and_leaves_out_what_it_is_asked_to(browser, small_study):
    browser.get((small_study.folder / "reports/er3_600/workspace.html").as_uri())
    figure = browser.find_element(By.ID, "turning")
    WebDriverWait(browser, PAUSE).until(lambda _: figure.get_attribute("data-drawn") is not None)
    painted = browser.execute_script(PAINTED)
    checks = figure.find_elements(By.CSS_SELECTOR, ".key input")
    assert len(checks) > 1
    move = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'))"
    knife = figure.find_element(By.CSS_SELECTOR, ".cut")
    browser.execute_script(move, knife, 0)
    WebDriverWait(browser, PAUSE).until(lambda _: browser.execute_script(PAINTED) > painted)  # whole
    browser.execute_script(move, knife, 1)
    WebDriverWait(browser, PAUSE).until(lambda _: browser.execute_script(PAINTED) < painted)
    emptied = browser.execute_script(PAINTED)
    browser.execute_script("arguments[0].click()", checks[-1])
    WebDriverWait(browser, PAUSE).until(lambda _: browser.execute_script(PAINTED) < emptied)


CHOSEN = """return [
  document.querySelector(".runs [aria-current] b").textContent, document.querySelector(".player .motion").value,
  document.querySelector(".player .clock").textContent,
]"""


def shown_row(browser) -> list[str]:
    """The chosen row, the motion that is played, and its time."""
    WebDriverWait(browser, PAUSE).until(
        lambda _: browser.execute_script("return performance.getEntriesByName('player').length")
    )
    return browser.execute_script(CHOSEN)


@pytest.mark.parametrize("stage", ["trajectory", "collision"])
def test_the_chosen_row_is_in_the_address(browser, small_study, stage):
    """A reload and the way back lead to it and to its moment, though rows may share a motion."""
    browser.get((small_study.folder / f"reports/er3a_c60/{stage}.html").as_uri())
    shown_row(browser)
    rows = browser.find_elements(By.CSS_SELECTOR, ".runs a[data-play]")
    browser.execute_script("arguments[0].click()", rows[1])
    WebDriverWait(browser, PAUSE).until(lambda _: "play=" in browser.current_url)
    chosen = shown_row(browser)
    browser.refresh()
    assert shown_row(browser) == chosen
    browser.execute_script("document.querySelector('header nav a').click()")
    WebDriverWait(browser, PAUSE).until(lambda _: "validation.html" in browser.current_url)
    browser.back()
    assert shown_row(browser) == chosen


def test_the_chart_beside_the_player_is_of_the_motion_that_is_played(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/trajectory.html").as_uri())
    shown_row(browser)
    repaired = next(
        option.get_attribute("value")
        for option in browser.find_elements(By.CSS_SELECTOR, ".player .motion option")
        if option.get_attribute("value").endswith(", repaired")
    )
    row = repaired.removesuffix(", repaired")
    browser.execute_script("arguments[0].click()", browser.find_element(By.CSS_SELECTOR, f'a[data-play="{row}"]'))
    heading = ".curves [data-one-of] > :not([hidden]) h2"
    WebDriverWait(browser, PAUSE).until(
        lambda _: browser.find_element(By.CSS_SELECTOR, heading).get_attribute("data-motion") == row
    )
    browser.execute_script("document.querySelector('.hero .fix a').click()")
    WebDriverWait(browser, PAUSE).until(
        lambda _: browser.find_element(By.CSS_SELECTOR, heading).get_attribute("data-motion") == repaired
    )
    assert shown_row(browser)[:2] == [row, repaired]


MARKED = """
const parts = [...document.querySelectorAll("[data-entry].shown")];
const seen = parts.filter((part) => part.checkVisibility({ visibilityProperty: true }));
return seen.map((part) => part.getAttribute("class"));
"""
OUTLINED = "return document.querySelector('.entries a[data-shown]')?.hash"


def test_what_is_to_be_done_next_is_shown_in_the_picture(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/validation.html").as_uri())
    browser.execute_script("document.querySelector('.fix a').click()")
    WebDriverWait(browser, PAUSE).until(lambda page: page.execute_script(OUTLINED) == "#cell-direction1")
    told = "return document.querySelector('.now-shown').textContent"
    WebDriverWait(browser, PAUSE).until(lambda page: page.execute_script(told).startswith("+J1"))
    for entry, words in (("lower3", "lower limit 3"), ("d4", ""), ("direction4", "+J4")):
        browser.execute_script(f"document.querySelector('.grid a[href$=cell-{entry}]').click()")
        WebDriverWait(browser, PAUSE).until(lambda page, cell=f"#cell-{entry}": page.execute_script(OUTLINED) == cell)
        WebDriverWait(browser, PAUSE).until(lambda page, said=words: page.execute_script(told).startswith(said))
    assert "alpha 6" in browser.execute_script("return document.querySelector('.chip').textContent")


def test_an_entry_of_a_wrong_table_is_marked_in_both_arms(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60_article/validation.html").as_uri())
    row = browser.find_element(By.CSS_SELECTOR, ".runs a[href='#cell-offset2']")
    browser.execute_script("arguments[0].click()", row)
    WebDriverWait(browser, PAUSE).until(lambda page: page.execute_script(OUTLINED) == "#cell-offset2")
    assert sorted(browser.execute_script(MARKED)) == ["mark right shown", "mark wrong shown"]


@pytest.mark.parametrize("shown", ["tray-1", "hole-1"])
def test_boxes_below_the_reach_stay_as_the_reader_set_them(browser, small_study, shown):
    browser.get((small_study.folder / "reports/er3a_c60/workspace.html").as_uri())
    checked = "return [...document.querySelectorAll('#turning .key input')].map((box) => box.checked)"
    WebDriverWait(browser, PAUSE).until(lambda page: page.execute_script(checked) == [True] * 3)
    browser.execute_script("document.querySelector('#turning .key input').click()")
    browser.execute_script(f"document.querySelector(\".runs a[href='#{shown}']\").click()")
    WebDriverWait(browser, PAUSE).until(lambda page: page.execute_script("return location.hash") == f"#{shown}")
    assert browser.execute_script(checked) == [False, True, True]


def test_errors_are_those_of_the_grasp_that_succeeds_least(browser, small_study):
    browser.get((small_study.folder / "reports/er3a_c60/vision.html").as_uri())
    first = "return document.querySelector('.runs li.pass b').textContent"
    assert browser.execute_script("return document.querySelector('.budget h2').textContent").startswith(
        browser.execute_script(first)
    )
