"""The player in a real browser: it draws the poses that it was given; events and plots lead to their moments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from er3a.collision.scene import Scene, Sphere
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward, frames
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion
from er3a.pipeline.player.player import drawing_head, moment, player, stretch
from er3a.pipeline.results import Provenance
from er3a.pipeline.viewing.page import render
from er3a.robots.robot import LinkMesh
from testing import chromium
from testing.small_study import ROOT

pytestmark = pytest.mark.long

TEMPLATE = """{% extends "base.html.j2" %}
{% block head %}{{ drawing_head }}{% endblock %}
{% block title %}Test{% endblock %}
{% block header %}<h1>Test page</h1>{% endblock %}
{% block content %}{{ player }}<p>{{ link }}</p>
<figure data-play="bow" data-panels="[[0.1, 0.1, 0.9, 0.9, 0.0, 2.0]]"><img alt="" src="data:image/svg+xml,%3Csvg
xmlns='http://www.w3.org/2000/svg' width='400' height='200'/%3E"></figure>
<p class="stretch" {{ stretch }}>bent</p><p style="height: 300vh"></p>{% endblock %}"""
T = np.linspace(0.0, 2.0, 50)
READ = """const [i, done] = arguments;
Promise.all([import("er3a/kinematics"), import("er3a/values")]).then(([kinematics, shown]) => {
  const { motions: [{ times, values }], table } = JSON.parse(document.getElementById("player-data").textContent);
  const q = shown.valuesAt(times, shown.decodeValues(values[0], times.length), times[i]);
  done(shown.posesOf({ table, links: kinematics.constantLinks(table) }, q).slice(1));
});"""


WRITTEN = """const [id, at, done] = arguments;
document.querySelector(".motion").value = id;
document.querySelector(".motion").dispatchEvent(new Event("change"));
document.querySelector(".time").value = at;
document.querySelector(".time").dispatchEvent(new Event("input"));
requestAnimationFrame(() => requestAnimationFrame(() => {
  done([...document.querySelectorAll(".player .words text")].map((word) => {
    const [x, y] = ["x", "y"].map((name) => Number(word.getAttribute(name)));
    return [word.textContent, x, y, word.getBBox().width, word.getBBox().height, word.getAttribute("fill")];
  }));
}));"""
PAINTED = """const [done] = arguments;
requestAnimationFrame(() => requestAnimationFrame(() => done(document.querySelector("canvas.arm").toDataURL())));"""


def bow(robot) -> PlayedMotion:
    q = np.linspace(0.2, 0.8, len(T))[:, None] * robot.upper
    return PlayedMotion("bow", "It bows.", T, q, [PlayedEvent(1.2, 1.3, "stretched", "caution")])


def written(folder, shown) -> None:
    (folder / "page.html.j2").write_text(TEMPLATE, encoding="utf-8")
    render(
        folder / "page.html.j2",
        folder / "page.html",
        command=None,
        provenance=Provenance(inputs=(), code="0" * 64),
        player=shown,
        drawing_head=drawing_head(),
        link=moment("bow", 1.25, "the event"),
        stretch=stretch("way", 2.0, 4.0),
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    robot, folder = load_robot("er3a_c60"), tmp_path_factory.mktemp("player")
    still = PlayedMotion("still", "It stands.", np.array([0.0, 1.0]), np.zeros((2, 6)))
    way = PlayedMotion("way", "It goes.", np.arange(9.0), np.zeros((9, 6)))
    scene = load_scene(ROOT / "data/scenes/table_and_post.yaml")
    written(folder, player(robot, [bow(robot), still, way], scene))
    return folder / "page.html"


@pytest.fixture
def page(browser, file):
    """The page as it opens."""
    browser.get_log("browser")
    browser.get("about:blank")  # an address that differs in its fragment alone loads nothing
    browser.get(file.as_uri())
    WebDriverWait(browser, 10).until(lambda _: clock(browser))
    return browser


@pytest.fixture
def used(request, browser, file):
    """The page as another test has left it, for those that choose a motion's moment themselves."""
    return browser if browser.current_url.startswith(file.as_uri()) else request.getfixturevalue("page")


def at_the_event(browser) -> None:
    browser.execute_script("document.querySelector('[data-t]').click()")
    until(browser, lambda: clock(browser).startswith("1.250"))


def clock(browser) -> str:
    """What it says, which is hidden while the arm rests."""
    return browser.find_element(By.CSS_SELECTOR, ".player .clock").get_attribute("textContent")


def told(browser) -> str:
    return browser.find_element(By.CSS_SELECTOR, ".player .now-shown").text


def until(browser, seen) -> None:
    WebDriverWait(browser, 10).until(lambda _: seen())


def test_it_draws_the_poses_of_forward_kinematics(page):
    robot = load_robot("er3a_c60")
    page.set_script_timeout(10)
    for i in (0, 17, 49):
        drawn = np.array(page.execute_async_script(READ, i))
        np.testing.assert_allclose(drawn, frames(robot, bow(robot).q[i]), atol=1e-6)
    assert [line for line in page.get_log("browser") if line["level"] == "SEVERE"] == []


def test_an_event_leads_to_its_moment_and_the_plot_s_cursor_follows(used):
    at_the_event(used)
    assert told(used) == "stretched"
    cursor = used.find_element(By.CSS_SELECTOR, ".cursor")
    image = used.find_element(By.CSS_SELECTOR, "figure[data-panels] img")
    edge = used.execute_script(
        "const s = getComputedStyle(arguments[0]); return parseFloat(s.paddingLeft) + parseFloat(s.borderLeftWidth)",
        image,
    )
    width = image.rect["width"] - 2 * edge
    expected = image.rect["x"] + edge + (0.1 + 0.8 * 1.25 / 2.0) * width
    assert cursor.rect["x"] == pytest.approx(expected, abs=1.5)


def test_it_plays_to_the_end_and_stops(page):
    page.execute_script("document.querySelector('.player .speed').value = '2'")
    button = page.find_element(By.CSS_SELECTOR, ".player .play")
    button.click()
    until(page, lambda: clock(page).startswith("2.000"))
    until(page, lambda: button.text == "Play")
    assert told(page) == "It bows."


def test_it_plays_no_further_than_the_address_says(page):
    page.get(f"{page.current_url}?play=bow&t=1.7&until=1.9")
    button = page.find_element(By.CSS_SELECTOR, ".player .play")
    until(page, button.is_displayed)
    button.click()
    until(page, lambda: button.text == "Play")
    assert clock(page).startswith("1.900")


def crowded(browser, tmp_path, crowd: int) -> list[tuple[str, float, float, float, float, str]]:
    """Words (text, x, y, width, height of letters, colour) of a path that touches the first of a crowd of balls."""
    robot = load_robot("er3a_c60")
    q = bow(robot).q
    touched = forward(robot, q[25])[:3, 3]
    ball = np.eye(4)
    ball[:3, 3] = touched
    solids = [Sphere(f"ball_{k}", ball, 0.02 + 0.001 * k) for k in range(crowd)]  # all in one place
    contact = tuple(touched.tolist())
    event = PlayedEvent(0.9, 1.1, "collision", "fail", ("ball_0", "link_6"))
    path = PlayedMotion("path", "", T, q, [event], [Mark(0.9, 1.1, contact, contact, "first contact")])
    written(tmp_path, player(robot, [path], Scene("crowd", tuple(solids))))
    browser.get((tmp_path / "page.html").as_uri())
    WebDriverWait(browser, 10).until(lambda _: clock(browser))
    return browser.execute_async_script(WRITTEN, "path", "1.0")


@pytest.mark.parametrize("width", [390, 1280])
def test_words_in_the_picture_don_t_overlap_and_what_matters_is_named(browser, tmp_path, width):
    """Where a crowd of bodies has its names in one place, what matters is named, and the others give way."""
    with chromium.emulating(browser, width=width):
        words = crowded(browser, tmp_path, 30)
        again = browser.execute_async_script(WRITTEN, "path", "0.5")
    texts = [text for text, *_ in words]
    assert {"first contact", "ball_0"} <= set(texts)
    assert len(texts) < 32  # others gave way
    colours = {text: colour for text, *_, colour in words}
    named = {colour for text, colour in colours.items() if text not in ("ball_0", "first contact")}
    assert colours["ball_0"] not in named  # what is touched is red
    assert "first contact" not in [text for text, *_ in again]
    for i, (one, x, y, width_of_one, height, _) in enumerate(words):
        for other, u, v, width_of_other, other_height, _ in words[:i]:
            assert abs(x - u) >= (width_of_one + width_of_other) / 2 or abs(y - v) >= (height + other_height) / 2, (
                one,
                other,
            )


def test_a_motion_s_start_and_end_are_named(used):
    """One that stays where it is has neither."""
    ends = {"start", "end"}
    assert ends <= {text for text, *_ in used.execute_async_script(WRITTEN, "bow", "1.0")}
    assert not ends & {text for text, *_ in used.execute_async_script(WRITTEN, "still", "0.5")}


JOINTS = """return [...document.querySelectorAll(".player .joints dl > div")].map((cell) => {
  return [cell.querySelector(".value").textContent, cell.querySelector(".room").textContent, cell.className];
})"""


def test_it_tells_the_joint_values_and_how_far_each_is_from_its_nearer_limit(used):
    robot = load_robot("er3a_c60")
    lower, upper = np.degrees(robot.lower), np.degrees(robot.upper)
    at_the_event(used)
    q = (0.2 + 0.6 * 1.25 / 2.0) * upper
    room = np.minimum(q - lower, upper - q)
    told = used.execute_script(JOINTS)
    for i, (value, margin, mark) in enumerate(told):
        assert abs(float(value.removesuffix("°").replace("−", "-")) - q[i]) < 0.07
        assert abs(float(margin.split()[0]) - room[i]) < 0.07
        assert (mark == "least") == (i == room.argmin())
    assert told[0][1].endswith("to limit")


NEAREST = "return document.querySelector('.player .ranges .least + b').textContent"
SIGN = "return getComputedStyle(document.querySelector('.player .joints .least .room'), '::before').content"


def test_without_a_fault_the_joint_nearest_its_limit_is_marked_and_bears_no_sign_of_one(used):
    at_the_event(used)
    cells = used.execute_script(JOINTS)
    (least,) = (j for j, (_, _, mark) in enumerate(cells, 1) if mark == "least")
    assert used.execute_script(NEAREST) == cells[least - 1][0]
    assert used.execute_script(SIGN) == "none"


def test_joint_values_keep_their_place_while_it_plays(page):
    page.execute_script("document.querySelector('.player .joints').open = true")
    frame = "const r = document.querySelector('.player .joints').getBoundingClientRect(); return [r.height, r.width]"
    cells = (
        "return [...document.querySelectorAll('.player .joints dl > div')].map((c) => [c.offsetLeft, c.offsetWidth])"
    )
    met = set()
    for t in np.linspace(0.0, 2.0, 9):
        page.execute_script(
            "const bar = document.querySelector('.player .time'); bar.value = arguments[0];"
            "bar.dispatchEvent(new Event('input'))",
            float(t),
        )
        until(page, lambda t=t: clock(page).startswith(f"{t:.3f}"))
        met.add(str((page.execute_script(frame), page.execute_script(cells))))
    assert len(met) == 1


def test_a_joint_beyond_its_limit_is_marked(browser, tmp_path):
    robot = load_robot("er3a_c60")
    q = np.zeros((2, 6))
    q[1, 2] = robot.upper[2] + np.radians(35)
    far = PlayedMotion("far", "It leaves a limit.", np.array([0.0, 1.0]), q)
    (tmp_path / "page.html.j2").write_text(TEMPLATE, encoding="utf-8")
    given = {"player": player(robot, [far]), "drawing_head": drawing_head(), "stretch": stretch("far", 0.0, 1.0)}
    link, origin = moment("far", 1.0, "there"), Provenance(inputs=(), code="0" * 64)
    output = tmp_path / "page.html"
    render(tmp_path / "page.html.j2", output, command=None, provenance=origin, link=link, **given)
    browser.get(output.as_uri())
    WebDriverWait(browser, 10).until(lambda _: clock(browser))
    browser.execute_script("document.querySelector('[data-t]').click()")
    until(browser, lambda: clock(browser).startswith("1.000"))
    assert browser.execute_script(JOINTS)[2] == ["140.0°", "35.0 beyond", "least past"]


def test_the_joints_that_fail_are_marked_instead_of_the_one_nearest_its_limit(browser, tmp_path):
    q = bow(load_robot("er3a_c60")).q
    events = [
        PlayedEvent(0.5, 1.0, "too fast", "caution", joints=((4, "2.1 × its speed"), (6, "1.2 × its acc."))),
        PlayedEvent(0.8, 1.0, "leaves limits", "fail", joints=((4, ""),)),
        PlayedEvent(1.5, 1.6, "collision", "fail", ("link_6",)),
    ]
    written(tmp_path, player(load_robot("er3a_c60"), [PlayedMotion("path", "", T, q, events)]))
    browser.get((tmp_path / "page.html").as_uri())
    WebDriverWait(browser, 10).until(lambda _: clock(browser))
    found = {}
    for t in ("0.2", "0.6", "0.9", "1.5"):
        words = browser.execute_async_script(WRITTEN, "path", t)
        found[t] = [(room, mark) for _, room, mark in browser.execute_script(JOINTS)]
        named = {text for text, *_ in words if text.startswith("J")}
        assert named == {"0.6": {"J4", "J6"}, "0.9": {"J4"}}.get(t, set())  # the gravest fault's
    assert [mark for _, mark in found["0.2"]].count("least") == 1
    assert found["0.6"][3] == ("2.1 × its speed", "doubtful")
    assert found["0.6"][5] == ("1.2 × its acc.", "doubtful")
    assert found["0.9"][3][1] == "past"
    assert found["0.9"][3][0].endswith("to limit")
    assert "least" not in {mark for t in ("0.6", "0.9", "1.5") for _, mark in found[t]}


def test_another_motion_starts_at_its_start(used):
    used.execute_script(
        "const chooser = document.querySelector('.player .motion');"
        "chooser.value = 'still'; chooser.dispatchEvent(new Event('change'))"
    )
    until(used, lambda: told(used) == "It stands.")
    assert clock(used) == "0.000 of 1.000 s"
    assert not used.find_element(By.CSS_SELECTOR, ".player .play").is_displayed()  # it has nothing to play
    assert not used.find_element(By.CSS_SELECTOR, ".cursor").is_displayed()


def test_the_page_s_address_names_a_moment(page):
    page.get(page.current_url.split("#")[0] + "?play=still&t=0.5")
    until(page, lambda: clock(page) == "0.500 of 1.000 s")
    assert told(page) == "It stands."


def test_it_stays_in_sight_and_covers_nothing_that_leads_to_it(page):
    page.execute_script(
        "const link = document.querySelector('a[data-t]'); document.body.append(link);"
        "link.scrollIntoView({ block: 'end' }); link.click()"
    )
    until(page, lambda: "docked" in page.find_element(By.ID, "player").get_attribute("class"))
    link, stand = page.execute_script(
        "return ['a[data-t]', '.player .stand'].map((name) => document.querySelector(name).getBoundingClientRect())"
    )
    assert 0 <= link["top"] < link["bottom"] <= stand["top"] < stand["bottom"]
    assert stand["bottom"] <= page.execute_script("return innerHeight")


def test_what_is_played_is_framed(page):
    stretch = page.find_element(By.CSS_SELECTOR, ".stretch")
    assert "now" not in stretch.get_attribute("class")
    page.execute_script("arguments[0].click()", stretch)
    until(page, lambda: clock(page).startswith("4.000"))
    assert "now" in stretch.get_attribute("class")
    page.execute_script("document.querySelector('.player .forward').click()")
    until(page, lambda: clock(page).startswith("5.000"))
    assert "now" not in stretch.get_attribute("class")


def test_an_arm_with_meshes_is_drawn_as_them_as_the_shapes_checked_or_as_both(browser, tmp_path):
    corners = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.4)])
    robot = load_robot("er3a_c60")
    written(
        tmp_path, player(robot.replace(visuals=(LinkMesh(2, corners, ConvexHull(corners).simplices),)), [bow(robot)])
    )
    browser.get((tmp_path / "page.html").as_uri())
    WebDriverWait(browser, 10).until(lambda _: clock(browser))
    pictures = set()
    for look in ("visual", "checked", "both"):
        browser.find_element(By.CSS_SELECTOR, f".looks option[value={look}]").click()
        pictures.add(browser.execute_async_script(PAINTED))
    assert len(pictures) == 3
    assert browser.get_log("browser") == []


def test_an_arm_without_meshes_has_one_look(used):
    assert used.find_elements(By.CSS_SELECTOR, ".looks") == []
