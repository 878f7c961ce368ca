"""The teach panel as a person uses it: keys, typing, links, solutions, warnings; every word translatable."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select
from selenium.webdriver.support.wait import WebDriverWait

import er3a.pipeline.messages.kinematics
import er3a.pipeline.messages.validation  # noqa: F401
from er3a.collision.along import clearance
from er3a.files.path_file import load_paths
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.kinematics.solutions import branch_labels
from er3a.pipeline import language
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.pages import FOUNDATIONS
from er3a.pipeline.messages.say import say
from er3a.pipeline.study import load_study
from er3a.pipeline.teach import panel as teach_page
from er3a.pipeline.teach.panel import WORDS
from er3a.pipeline.viewing.still import FLAT
from er3a.planning.commands import CommandSource
from er3a.programs.languages import execute, read_program
from er3a.programs.solving import Resolver
from er3a.robots.joint_limits import meant, within
from testing.arms import five_axis, gantry, make_arm, palletiser, pose_errors, scara
from testing.small_study import ROOT
from tests.viewing.untranslated import wide_letters

pytestmark = pytest.mark.long

LARGEST_PAGE = 1_000_000
PIXELS = """const c = document.getElementById('arm'), copy = new OffscreenCanvas(c.width, c.height).getContext('2d');
copy.drawImage(c, 0, 0);
const d = copy.getImageData(0, 0, c.width, c.height).data;"""
SELECT_ALL = Keys.CONTROL + "a" + Keys.NULL
KEYS_AND_CODES = {"Shift", "Page", "Down", "Home", "End", "ZYX", "ZYZ", "JavaScript", "RPL"}
OBSTACLES = {"table", "post", "lamp", "floor"}  # names of the scene's file
HOME = [0, 20, -20, 0, -90, 0]  # deg, where the arm waits for its camera
PAUSE = 5.0  # s to wait for what the page does within 0.3 s on an idle machine


class Panel:
    """A teach panel opened in the browser."""

    def __init__(self, browser, file: Path, name: str = "er3a_c60"):
        self.browser, self.file = browser, file
        if not file.exists():
            teach_page.write_teach_page(load_study("config/small.yaml"), name, Path("results"), file)

    def open(self, fragment: str = "") -> Panel:
        self.browser.get("about:blank")
        self.browser.get(self.file.as_uri() + fragment)
        self.joints()
        return self

    def at(self, *values: float) -> Panel:
        """Take joint values as an address names them, in degrees and mm, on the page as it stands."""
        fragment = "#q=" + ",".join(map(str, values))
        self.browser.execute_script("location.hash = arguments[0]; dispatchEvent(new Event('hashchange'))", fragment)
        shown = "return [...document.querySelectorAll('.joint input[type=number]')].map((field) => field.valueAsNumber)"
        self.until(lambda: self.browser.execute_script(shown) == pytest.approx(values, abs=0.06))
        return self

    def one(self, selector: str):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def text(self, selector: str) -> str:
        return self.one(selector).text

    def joints(self) -> list[float]:
        """Joint angles in degrees."""
        ask = "const done = arguments[0]; import('er3a/panel').then((panel) => done(panel.joints()))"
        return np.degrees(self.browser.execute_async_script(ask)).tolist()

    def move(self, *degrees: float) -> None:
        ask = "const [q, done] = arguments; import('er3a/panel').then((panel) => done(panel.moveTo(q)))"
        self.browser.execute_async_script(ask, np.radians(degrees).tolist())

    def until(self, holds: Callable[[], Any]) -> None:
        WebDriverWait(self.browser, PAUSE, 0.05).until(lambda _: holds())

    def texts(self) -> list[str]:
        """All that the panel says, in writing or aloud."""
        return self.browser.execute_script(
            """for (const term of document.querySelectorAll(".term")) term.replaceWith(...term.childNodes);
            document.querySelector("main").normalize();
            const walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
            const texts = [...document.querySelectorAll("main [aria-label]")].map((e) => e.ariaLabel);
            while (walker.nextNode()) {
              if (!walker.currentNode.parentNode.closest("script, .chip")) texts.push(walker.currentNode.data.trim());
            }
            return texts;"""
        )

    def clean(self) -> bool:
        """Whether the console has no error but for the marks that an index leaves, where there is none."""
        severe = [entry["message"] for entry in self.browser.get_log("browser") if entry["level"] == "SEVERE"]
        return [message for message in severe if "marks.js" not in message] == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("teach")


@pytest.fixture
def closed(browser, folder) -> Panel:
    return Panel(browser, folder / "er3a_c60.html")


@pytest.fixture
def panel(closed) -> Panel:
    return closed.open()


@pytest.fixture
def used(closed) -> Panel:
    """The panel as another test has left it, for those that say where the arm is to be."""
    return closed if closed.browser.current_url.startswith(closed.file.as_uri()) else closed.open()


def test_opens_clean_in_one_small_file(browser, folder):
    browser.get_log("browser")  # what other tests left there
    panel = Panel(browser, folder / "er3_600.html", "er3_600").open()
    panel.until(lambda: panel.browser.find_elements(By.CSS_SELECTOR, "#branches .solution"))
    assert panel.clean()
    assert panel.file.stat().st_size < LARGEST_PAGE
    text = panel.file.read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=.?(https?:)?//", text)
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    colours = browser.execute_script(PIXELS + "return new Set(new Uint32Array(d.buffer)).size")
    assert colours > 50, "the picture shows a shaded arm"


def test_keys_move_a_joint_and_stop_at_its_limits(used):
    used.move(0, 0, 0, 0, 0, 0)
    slider = used.one("#joint-J2 input[type=range]")
    slider.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, Keys.ARROW_LEFT, Keys.ARROW_UP)
    assert used.joints()[1] == pytest.approx(2)
    slider.send_keys(Keys.SHIFT + Keys.ARROW_RIGHT)
    assert used.joints()[1] == pytest.approx(2.1)
    slider.send_keys(Keys.PAGE_DOWN)
    assert used.joints()[1] == pytest.approx(-7.9)
    slider.send_keys(Keys.END, Keys.ARROW_RIGHT)
    assert used.joints()[1] == pytest.approx(90)
    assert used.text("#joint-J2 .room") == WORDS["at_limit"]
    slider.send_keys(Keys.HOME)
    assert used.joints()[1] == pytest.approx(-130)
    assert slider.get_attribute("aria-valuetext") == "−130.0 degrees"


def test_typing_moves_a_joint_and_says_why_not(panel):
    field = panel.one("#joint-J3 input[type=number]")
    field.send_keys(SELECT_ALL, "42.5", Keys.ENTER)
    assert panel.joints()[2] == pytest.approx(42.5)
    field.send_keys(SELECT_ALL, "106")
    assert panel.joints()[2] == pytest.approx(42.5)
    assert panel.text("#message") == "J3 stays between −75.0° and 105.0°."
    assert field.get_attribute("aria-invalid") == "true"
    field.send_keys(Keys.TAB)
    assert field.get_attribute("value") == "42.5"


def test_a_link_restores_the_joints(panel):
    angles = [12.5, -30.25, 7, 100, -45.123456, 200]
    panel.move(*angles)
    panel.until(lambda: "#q=" in panel.browser.current_url)
    link = panel.browser.current_url
    panel.browser.get("about:blank")
    panel.browser.get(link)
    assert panel.joints() == pytest.approx(angles, abs=1e-8)
    panel.browser.execute_script("location.hash = '#q=1,2,3,4,5,6'")
    panel.until(lambda: panel.joints() == pytest.approx([1, 2, 3, 4, 5, 6]))
    panel.move(*angles)
    panel.one("#link").click()
    panel.until(lambda: panel.text("#message"))
    assert panel.text("#message") == WORDS["link_copied"] or link in panel.text("#message")


def test_the_view_turns_by_pointer_keys_and_buttons(panel):
    def picture() -> str:
        return panel.browser.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() =>"
            "done(document.getElementById('arm').toDataURL())))"
        )

    canvas = panel.one("#arm")
    pictures = [picture()]
    ActionChains(panel.browser).drag_and_drop_by_offset(canvas, 60, 20).perform()
    pictures.append(picture())
    canvas.send_keys(Keys.ARROW_LEFT)
    pictures.append(picture())
    canvas.send_keys("+")
    pictures.append(picture())
    panel.one("[data-view=top]").click()
    pictures.append(picture())
    assert len(set(pictures)) == len(pictures)
    assert panel.joints() == pytest.approx(HOME)


@pytest.mark.parametrize(
    ("fragment", "told"),
    [
        ("#q=0,0,106,0,0,0", "J3 stays between −75.0° and 105.0°."),
        ("#q=0,0,0,0,0", "it names 5 numbers where 6 are needed."),
        ("#q=0,0,,0,0,0", "J3 needs a number, in degrees."),
    ],
)
def test_a_link_that_can_t_be_taken_is_refused_with_its_reason(closed, fragment, told):
    panel = closed.open(fragment)
    assert told in panel.text("#message")
    assert panel.joints() == pytest.approx(HOME)


def test_the_joints_are_copied(panel):
    panel.move(1.5, 2, 3, 4, 5, -6)
    panel.one("#copy").click()
    panel.until(lambda: panel.text("#message"))
    assert "[1.5, 2, 3, 4, 5, -6]" in panel.text("#message")


def test_every_solution_keeps_the_tool_in_place(used):
    robot = load_robot("er3a_c60")
    start = [30, -20, 15, 40, 60, 10]
    used.move(*start)
    used.until(lambda: used.text("#count") == "2 of 4 within the limits")
    T = forward(robot, np.radians(start))
    visited = []
    for _ in range(4):
        used.one("#next").click()
        visited.append(used.joints())
        for errors in pose_errors(forward(robot, np.radians(visited[-1])), T):
            assert errors.max() < 1e-9
        pressed = used.browser.find_elements(By.CSS_SELECTOR, '[aria-pressed="true"]')
        assert len(pressed) == 1
    assert len({tuple(np.round(q, 6)) for q in visited}) == 4
    assert visited[-1] == pytest.approx(start)
    outside = used.one('.solution[aria-disabled="true"]')
    assert re.search(r"J3 \d+° over", outside.text)
    used.browser.execute_script("arguments[0].click()", outside)
    assert used.joints() == pytest.approx(start)
    assert re.search(r"The arm does not move: .*J3 at 138\.\d° is \d+\.\d° above", used.text("#refused"))


def type_pose(panel, *values: float) -> None:
    for field, value in zip(panel.browser.find_elements(By.CSS_SELECTOR, "#pose-form input"), values):
        field.send_keys(SELECT_ALL, str(value))
    panel.one("#pose-form button[type=submit]").click()


def tool(panel) -> tuple[np.ndarray, np.ndarray]:
    """Position (mm) and rotation of the tool by er3a's forward kinematics at the panel's joints."""
    T = forward(load_robot("er3a_c60"), np.radians(panel.joints()))
    return T[:3, 3] * 1000, T[:3, :3]


def test_a_typed_pose_is_reached_or_refused_in_words(used):
    used.move(10, 20, -10, 5, 30, 0)
    type_pose(used, 380, 120, 300, 180, -15, 30)
    position, rotation = tool(used)
    np.testing.assert_allclose(position, [380, 120, 300], atol=1e-6)
    turn = Rotation.from_euler("ZYX", [30, -15, 180], degrees=True).as_matrix()
    np.testing.assert_allclose(rotation, turn, atol=1e-9)
    reached = used.joints()
    type_pose(used, 1800, 0, 300, 180, 0, 0)
    assert used.joints() == pytest.approx(reached)
    assert re.search(
        r"The arm does not move: the wrist centre would be .* too far from axis 2", used.text("#pose-message")
    )
    assert "did you mean" not in used.text("#pose-message")
    type_pose(used, 0.5, 0.2, 0.7, 180, 0, 0)
    assert used.text("#pose-message").endswith("did you mean (500, 200, 700)?")
    used.one("#pose-form input").send_keys(SELECT_ALL, Keys.DELETE)
    used.one("#pose-form button[type=submit]").click()
    assert "needs a number" in used.text("#pose-message")
    click_jog(used, 0)
    assert used.text("#pose-message") == ""  # the arm has moved since


@pytest.mark.parametrize("frame", ["base", "tool", "joints"])
def test_jogging_moves_along_and_about_the_frame_s_axes(used, frame):
    used.move(10, 20, -10, 5, 30, 0)
    used.browser.execute_script("document.querySelector(`input[value=${arguments[0]}]`).click()", frame)
    for axis in range(6):
        joints, (position, rotation) = np.array(used.joints()), tool(used)
        used.browser.execute_script(
            "document.querySelector(`[data-jog='${arguments[0]}'][data-sign='+']`).click()", axis
        )
        moved, turned = tool(used)
        if frame == "joints":
            np.testing.assert_allclose(np.array(used.joints()) - joints, 5 * np.eye(6)[axis], atol=1e-9)
            continue
        along = 10 * np.eye(3)[axis] if axis < 3 else np.zeros(3)
        about = Rotation.from_rotvec(np.radians(5) * np.eye(3)[axis - 3] if axis >= 3 else np.zeros(3)).as_matrix()
        np.testing.assert_allclose(moved - position, along if frame == "base" else rotation @ along, atol=1e-6)
        np.testing.assert_allclose(turned, about @ rotation if frame == "base" else rotation @ about, atol=1e-9)


def test_way_points_become_a_path_file_and_a_program_that_er3a_reads(panel, tmp_path):
    panel.browser.execute_script("localStorage.clear()")
    panel.open()
    assert not panel.one("#export-path").is_enabled()
    kept = [(10, 20, -10, 5, 30, 0), (-30.5, 10, 20, 0, 45.123456, 90)]
    for joints in kept:
        panel.move(*joints)
        panel.one("#save-point").click()
    panel.move(0, 0, 0, 0, 0, 0)
    panel.one("#points button").click()
    assert panel.joints() == pytest.approx(kept[0])
    texts = {}
    for what in ("pathFile", "program"):
        ask = "const [what, done] = arguments; import('er3a/panel').then((panel) => done(panel.points[what]()))"
        texts[what] = panel.browser.execute_async_script(ask, what)
    assert all("er3a: Run no path or program on the arm until" in text for text in texts.values())
    robot = load_robot("er3a_c60")
    (tmp_path / "taught.yaml").write_text(texts["pathFile"], encoding="utf-8")
    (path,) = load_paths(tmp_path / "taught.yaml").paths
    np.testing.assert_allclose(path.points_deg, kept, atol=1e-8)
    (tmp_path / "taught.pgm").write_text(texts["program"], encoding="utf-8")
    execution = execute(read_program(tmp_path / "taught.pgm"), robot)
    assert execution.complete
    resolver = Resolver(robot, None)
    motions = execution.listing().motions
    for motion in motions:
        resolver.ready(motion)
    found = [resolver.joints_after(number) for number in range(len(motions))]
    np.testing.assert_allclose(np.degrees(found), kept, atol=1e-5)
    panel.open()
    assert len(panel.browser.find_elements(By.CSS_SELECTOR, "#points li")) == 2
    panel.one("#clear-points").click()
    assert not panel.browser.find_elements(By.CSS_SELECTOR, "#points li")
    assert panel.clean()


@pytest.mark.parametrize(
    ("degrees", "state", "told"),
    [
        ((10, 20, 30, 40, 3, 0), "near", "Near the wrist singularity: axes 4 and 6 are 3.0° from parallel."),
        ((10, 20, 30, 40, 0, 0), "at", "At the wrist singularity"),
        ((0, 0, 76.824, 0, 50, 0), "near", "Near the elbow singularity"),
        ((0, 0, 0, 0, 50, 0), "clear", "Clear. Inside all limits, not singular."),
        ((0, 60.5, -30, 0, 50, 0), "clear", "Clear. Inside all limits, not singular."),
    ],
)
def test_the_warning_names_what_is_near(used, degrees, state, told):
    used.move(*degrees)
    used.until(lambda: used.one("#warning").get_attribute("data-state") == state)
    assert used.text("#warning").startswith(told)


def test_an_arm_outside_the_class_says_why_it_has_no_solutions(browser, folder, monkeypatch):
    skew = make_arm(alpha=np.radians([-90, 5, -90, 90, -90, 0]))
    monkeypatch.setattr("er3a.pipeline.study.Study.robot", lambda study, name: skew)
    panel = Panel(browser, folder / "skew.html").open("#q=10,20,30,40,50,60")
    assert "axes 2 and 3 are not parallel" in panel.text(".solutions")
    assert panel.text("#warning") == WORDS["touch"]["at"]
    assert panel.joints() == pytest.approx([10, 20, 30, 40, 50, 60])
    assert panel.clean()


def test_every_word_of_the_panel_is_in_the_dictionary(browser, folder):
    with wide_letters():  # as a stand-in for another language
        panel = Panel(browser, folder / "marked.html").open()
    assumed = browser.find_element(By.CSS_SELECTOR, ".chip").get_attribute("textContent")
    scene = load_scene(ROOT / "data/scenes/table_and_post.yaml")
    names = re.compile("|".join(solid.name for solid in scene.solids))
    for degrees in ([0] * 6, [30, -20, 15, 40, 60, 10], [167, 90, 105, 180, 2, 360]):
        panel.move(*degrees)
        time.sleep(0.3)
        texts = panel.texts()
        assert len(texts) > 100
        words = [text for text in texts if re.search("[A-Za-z]{3}", names.sub("", text))]
        known = {
            "EFORT ER3A-C60",
            *map(branch_word, branch_labels(load_robot("er3a_c60"))),
            *FOUNDATIONS.values(),
            FLAT,
        }
        assert {text for text in words if text not in assumed} <= known


@pytest.fixture
def chinese():
    language.use("zh")
    yield
    language.use("en")


def english(texts: list[str]) -> set[str]:
    told = [re.sub(r"er3a (check-program|check)", "", text) for text in texts]  # commands
    return (
        {word for text in told for word in re.findall("[A-Za-z]{3,}", text)}
        - KEYS_AND_CODES
        - OBSTACLES
        - {"EFORT", "WebGL", "made"}
    )


def test_the_chinese_panel_warns_in_chinese_alone(browser, folder, chinese):
    panel = Panel(browser, folder / "chinese.html").open()
    for degrees, told in (
        ((0, 0, 0, 0, 0, 0), "处于腕部奇异：轴 4 与轴 6 平行"),
        ((10, 20, 30, 40, 3, 0), "接近腕部奇异：轴 4 与轴 6 距平行还差 3.0°。"),
        ((30, -20, 15, 40, 60, 10), "无碰触。各关节在限位内，非奇异。"),
    ):
        panel.move(*degrees)
        panel.until(lambda told=told: panel.text("#warning").startswith(told))
        panel.until(lambda: panel.browser.find_elements(By.CSS_SELECTOR, "#branches .solution"))
        assert english(panel.texts()) == set()


def test_the_chinese_panel_says_why_an_arm_has_no_solutions(browser, folder, chinese, monkeypatch):
    offset_wrist = make_arm(d=[0.3, 0, 0, 0.35, 0.02, 0.08])
    monkeypatch.setattr("er3a.pipeline.study.Study.robot", lambda study, name: offset_wrist)
    panel = Panel(browser, folder / "chinese_offset_wrist.html").open("#q=10,20,30,40,50,60")
    assert "因为轴 4、5、6 不交于一点，相差 10 mm" in panel.text(".solutions")
    assert english(panel.texts()) == set()


def test_the_table_is_shown_row_by_row_on_the_arm(used):
    used.move(0, 0, 12, 0, 0, 0)
    chooser = Select(used.one("#frames"))
    assert len(chooser.options) == 8
    chooser.select_by_value("3")
    used.until(lambda: used.text("#row"))
    assert used.text("#row").startswith("Row 3: turn by θ = −12.0° about z, go 0.00 mm along z and 70.00 mm along")
    chooser.select_by_value("all")
    used.until(lambda: used.text("#row") == "")
    assert used.clean()


OTHER_ARMS = {
    "scara": (scara, (30, 40, 100, 20)),
    "gantry": (gantry, (500, 300, 200)),
    "palletiser": (palletiser, (10, -60, 60, 15)),
    "five_axis": (five_axis, (10, 40, 60, 30, 50)),
    "iiwa": (lambda: load_robot("lbr_iiwa_14"), (0, 30, 0, -60, 0, 60, 0)),
    "ur5e": (lambda: load_robot("ur5e"), (10, -70, 80, -60, -90, 20)),
}


@pytest.fixture
def other(request, browser, folder, monkeypatch):
    """A panel of an arm that has no closed form there: the arm, its joints (deg, mm), the panel at them."""
    make, at = OTHER_ARMS[request.param]
    robot = make()
    monkeypatch.setattr("er3a.pipeline.study.Study.robot", lambda study, name: robot)
    panel = Panel(browser, folder / f"{request.param}.html").open("#q=" + ",".join(map(str, at)))
    return robot, at, panel


def values(panel) -> np.ndarray:
    ask = "const done = arguments[0]; import('er3a/panel').then((panel) => done(panel.joints()))"
    return np.array(panel.browser.execute_async_script(ask))


def click_jog(panel, axis: int) -> None:
    panel.browser.execute_script("document.querySelector(`[data-jog='${arguments[0]}'][data-sign='+']`).click()", axis)


@pytest.mark.parametrize("other", ["gantry", "palletiser", "ur5e"], indirect=True)
def test_any_arm_goes_where_the_link_says_and_lists_solutions_that_meet_the_pose(other):
    robot, at, panel = other
    assert values(panel) == pytest.approx(meant(robot, at))
    panel.until(lambda: "found by iteration" in panel.text("#count"))
    rows = panel.browser.find_elements(By.CSS_SELECTOR, "#branches .row-joints")
    T = forward(robot, meant(robot, at))
    for row in rows:
        q = [float(span.text.replace("−", "-")) for span in row.find_elements(By.TAG_NAME, "span")]
        position, rotation = pose_errors(forward(robot, meant(robot, q)), T)
        assert position.max() < 2e-3
        assert rotation.max() < 1e-2
    assert panel.clean()


@pytest.mark.parametrize("other", ["scara", "five_axis", "iiwa"], indirect=True)
def test_any_arm_is_jogged_along_the_axes_that_its_joints_can_follow(other):
    robot, at, panel = other
    T = forward(robot, values(panel))
    for axis in range(3):
        click_jog(panel.at(*at), axis)
        moved = forward(robot, values(panel))
        assert moved[:3, 3] - T[:3, 3] == pytest.approx(0.01 * np.eye(3)[axis], abs=1e-6), panel.text("#jog-message")
    if robot.joints < 6:
        panel.at(*at)
        told = []
        for axis in range(3, 6):
            click_jog(panel, axis)
            told.append(panel.text("#jog-message"))
            named = f"about {'XYZ'[axis - 3]} of the base"
            assert panel.one(f"[data-jog='{axis}']").get_attribute("title").startswith(f"A{named[1:]}: ")
            if told[-1].startswith("The arm does not move: its joints"):
                assert told[-1].endswith(f"turn the tool {named}.")
        assert any(told)
    panel.browser.execute_script("document.querySelector('input[value=joints]').click()")
    before = values(panel)
    click_jog(panel, robot.joints - 1)
    step = 0.01 if robot.slides[-1] else np.radians(5)
    assert (values(panel) - before)[-1] == pytest.approx(step)


@pytest.mark.parametrize("other", ["scara"], indirect=True)
def test_each_joint_warns_of_its_end_by_its_own_unit(other):
    """Within 5 mm of the end of a slide, as within 5 deg of a limit."""
    _, _, panel = other
    for q, states in (
        ((125.5, 40, 4.5, 20), ("near", "near")),
        ((124.5, 40, 5.5, 20), ("clear", "clear")),
        ((130, 40, 180, 20), ("at", "at")),
    ):
        panel.at(*q)
        rows = panel.browser.execute_script(
            "return [...document.querySelectorAll('.joint')].map((r) => r.dataset.state)"
        )
        assert (rows[0], rows[2]) == states


@pytest.mark.parametrize("other", ["scara"], indirect=True)
def test_any_arm_refuses_values_in_words_and_in_the_joint_s_unit(other):
    robot, _, panel = other
    before = values(panel)
    for k in range(robot.joints):
        field = panel.one(f"#joint-J{k + 1} input[type=number]")
        field.send_keys(SELECT_ALL, "5000")
        unit = "\u202fmm" if robot.slides[k] else "°"
        assert re.fullmatch(rf"J{k + 1} stays between \S+{unit} and \S+{unit}\.", panel.text("#message"))
        assert values(panel) == pytest.approx(before)
        field.send_keys(Keys.TAB)


@pytest.mark.parametrize("other", ["scara", "ur5e"], indirect=True)
def test_any_arm_s_way_points_become_a_path_file(other, tmp_path):
    robot, at, panel = other
    panel.browser.execute_script("localStorage.clear()")
    panel.open("#q=" + ",".join(map(str, at)))
    panel.one("#save-point").click()
    panel.one("#joint-J1 input[type=range]").send_keys(Keys.ARROW_RIGHT)
    panel.one("#save-point").click()
    ask = "const done = arguments[0]; import('er3a/panel').then((panel) => done(panel.points.pathFile()))"
    (tmp_path / "taught.yaml").write_text(panel.browser.execute_async_script(ask), encoding="utf-8")
    (path,) = load_paths(tmp_path / "taught.yaml").paths
    command = path.command(CommandSource(path.name, "taught"), robot)
    np.testing.assert_allclose(command.points[0], meant(robot, at), atol=1e-9)
    assert len(command.points) == 2
    programs = panel.browser.find_elements(By.ID, "export-program")
    assert len(programs) == int(robot.joints == robot.rows == 6 and not robot.sliding.any())
    panel.one("#clear-points").click()


def test_the_panel_names_the_nearest_pair_and_turns_red_where_links_touch(used):
    used.until(lambda: used.text("#clearance"))
    robot, scene = load_robot("er3a_c60"), load_scene(ROOT / "data/scenes/table_and_post.yaml")
    for degrees, state in (((0, 0, 0, 0, 50, 0), "clear"), ((0, -90, 0, 0, 0, 0), "at")):
        used.move(*degrees)
        used.until(lambda state=state: used.one("#clearance").get_attribute("data-state") == state)
        found = clearance(robot, np.radians([degrees]), scene)
        (distance,), (pair,) = found.distance * 1000, found.pair
        told = "Collision" if distance <= 0 else f"Clearance {distance:.1f}\u202fmm"
        assert used.text("#clearance").startswith(told)
        assert say(pair) in used.text("#clearance")
    each = "n += d[i] > 100 && d[i + 1] < 60 && d[i + 2] < 70"
    count = f"let n = 0; for (let i = 0; i < d.length; i += 4) {each}; return n"
    assert used.browser.execute_script(PIXELS + count) > 200
    assert used.clean()


@pytest.mark.parametrize("degrees", [(40, -30, 20, 10, 60, 0), (73, -68, 49, -34, 82, 37)])
def test_solutions_say_what_they_collide_with_before_they_are_chosen(used, degrees):
    robot, scene = load_robot("er3a_c60"), load_scene(ROOT / "data/scenes/table_and_post.yaml")
    used.move(*degrees)
    here = "const here = document.querySelector('.solution[aria-pressed=true] .row-joints span');"
    used.until(lambda: used.browser.execute_script(here + "return here?.textContent") == f"{degrees[0]:.1f}")
    ask = """return [...document.querySelectorAll(".branch > .solution")].map((one) => [
      [...one.querySelectorAll(".row-joints span")].map((angle) => Number(angle.textContent.replace("−", "-"))),
      one.textContent.includes("collision")])"""
    shown = used.browser.execute_script(ask)
    q = np.radians([angles for angles, _ in shown])
    collides = (clearance(robot, q, scene).distance <= 0) & within(robot, q)  # of others the limit is said
    assert [told for _, told in shown] == collides.tolist()
    assert (", of these" in used.text("#count")) == bool(collides.any())


SPACE = """const canvas = document.createElement("canvas"), frame = document.createElement("div");
frame.innerHTML = '<svg class="words"></svg>';
frame.append(canvas);
document.body.append(frame);
canvas.style = "width: 800px; height: 600px; font-size: 16px";
const space = new module.Space(canvas, [0, 0, 0], 1, () => {});
Object.assign(space, { azimuth: 0, elevation: 0, distance: 5 });
space.begin();
"""


def test_what_would_hide_the_arm_lets_it_through(used):
    ask = """const [arm, places, done] = arguments;
      Promise.all([import("er3a/space"), import("er3a/algebra")]).then(([module, { translation }]) => {
        SPACE
        const ball = { frame: 0, kind: "sphere", radius: 0.1, colour: "#888888" };
        const balls = space.add(places.map((at, name) => ({ ...ball, name, T: translation(...at) })));
        const hiding = space.hiding(balls, arm.map((at) => translation(...at)));
        done([...hiding].map(({ shape }) => shape.name));
      });""".replace("SPACE", SPACE)
    arm, places = [[0, 0, 0], [0, 0, 1]], [[2, 0, 0.3], [2, 0.6, 0.3], [-2, 0, 0.5]]  # before it, beside it, behind it
    assert used.browser.execute_async_script(ask, arm, places) == [0]


def test_words_keep_off_the_arm_and_a_line_leads_from_afar(used):
    ask = """const [radius, needed, done] = arguments;
      import("er3a/space").then((module) => {
        SPACE
        if (radius) space.keepClear([[0, 0, 0]], radius);
        space.word("name", [0, 0, 0], "#000000", needed);
        const at = (made) => [Number(made.getAttribute("x")) - 400, Number(made.getAttribute("y")) - 300];
        done([space.words.map((made) => (made.localName === "text" ? at(made) : made.localName)), space.scale / 5]);
      });""".replace("SPACE", SPACE)
    ((at,), _) = used.browser.execute_async_script(ask, 0, True)
    assert at == [0, 0]
    (led, at), zoom = used.browser.execute_async_script(ask, 0.2, True)
    assert led == "line"
    assert max(abs(at[0]), abs(at[1])) > 0.2 * zoom  # beyond what is kept clear
    assert used.browser.execute_async_script(ask, 0.4, False)[0] == []  # no place near enough
