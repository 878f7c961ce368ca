"""The page on the article: its numbers against the Robotics Toolbox and plain geometry, and all of its items shown."""

from __future__ import annotations

import base64
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from roboticstoolbox import DHRobot, RevoluteDH

import er3a
from er3a.files.robot_library import load_robot
from er3a.identifiability import continuous
from er3a.pipeline import language
from er3a.pipeline.article.article_numbers import EXAMPLE, agreements, article_numbers
from er3a.pipeline.article.article_page import write_article
from er3a.pipeline.messages.article import ITEMS
from er3a.pipeline.stages import run
from er3a.pipeline.study import load_study
from tests.browser.test_page_sizes import LARGEST_PAGE, check_fit, check_print
from tests.browser.test_pages import check_access, check_clean, open_page
from tests.conftest import ROOT

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore:Glyph")]  # of a machine without Chinese letters
FILES = {"en": "article.html", "zh": "article_zh.html"}
STAGES = ("validation", "workspace", "trajectory")
IN_THE_SMALL_STUDY = [*(("er3a_c60", stage) for stage in STAGES), ("er3a_c60_article", "workspace")]
SMALL = {"round_trips": 200, "reach_starts": 4, "map_cells": 20, "samples": 100_000, "blocks": 4, "cells_across": 16}
SMALL |= {"cloud_points": 1000, "proof_cells": 2000, "directions": 40, "rolls": 2}
SMALL |= {"checks_per_sample": 5}
TABLE = np.array([[0, -90, 169.77], [650, 0, 0], [0, -90, 0], [0, 90, 651.61], [0, -90, 0], [0, 0, 125.6]])


@pytest.fixture(scope="module")
def folder(tmp_path_factory, small_results) -> Path:
    """The article's study at small budgets, with what its page rests on; the small study has the real arm's."""
    place = tmp_path_factory.mktemp("article")
    shutil.copytree(ROOT / "data", place / "data")
    for name in ("er3a_c60_article", "er3a_c60_article_offset2"):  # the real arm's set takes diagnosis a minute
        robot = place / f"data/robots/{name}.yaml"
        text = robot.read_text(encoding="utf-8")
        assert "references: [er3a_c60_article, er3a_c60]" in text
        robot.write_text(text.replace("[er3a_c60_article, er3a_c60]", "[er3a_c60_article]"), encoding="utf-8")
    study = yaml.safe_load((ROOT / "config/article.yaml").read_text(encoding="utf-8"))
    for section in study.values():
        if isinstance(section, dict):
            section.update({key: SMALL[key] for key in section.keys() & SMALL.keys()})
    for entry in study["robots"].values():
        entry["stages"] = list(STAGES)
    (place / "article.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.setattr(continuous, "SPREAD", 8)  # the page shows nothing of tables that evidence finds far away,
        patch.setattr(continuous, "ROUNDS", 0)  # for which validation searches longest
        loaded = load_study("article.yaml")
        for robot in loaded.robots:
            for stage in STAGES:
                results = Path("results") / robot / stage
                if (robot, stage) in IN_THE_SMALL_STUDY:
                    shutil.copytree(small_results(stage, robot, loaded), results)
                else:
                    run.compute(stage, loaded, robot, results)
    return place


@pytest.fixture(scope="module")
def numbers(folder):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        study = load_study("article.yaml")
        return article_numbers(study, study.article, Path("results"))


@pytest.fixture(scope="module")
def pages(folder) -> dict[str, str]:
    """The page's text by language."""
    with pytest.MonkeyPatch.context() as patch, language.using("en"):
        patch.chdir(folder)
        reports = Path("reports")
        reports.mkdir()
        (reports / "article_en.html").write_text("of a run in Chinese", encoding="utf-8")
        (reports / "marks.js").touch()  # which the index writes
        study = load_study("article.yaml")
        write_article(study, study.article, Path("results"), reports)
        assert {path.name for path in reports.glob("*.html")} == set(FILES.values())
        return {code: (reports / name).read_text(encoding="utf-8") for code, name in FILES.items()}


@pytest.mark.parametrize("name", FILES.values())
def test_they_open_fit_and_print_as_all_pages_do(browser, pages, folder, name):
    path = folder / "reports" / name
    assert path.stat().st_size < LARGEST_PAGE
    open_page(browser, path)
    for check in (check_clean, check_access, check_fit, check_print):
        check(browser)


def toolbox(offset_2: float) -> DHRobot:
    links = [RevoluteDH(a=a / 1000, alpha=np.radians(alpha), d=d / 1000) for a, alpha, d in TABLE]
    links[1].offset = np.radians(offset_2)
    return DHRobot(links)


def test_poses_are_the_toolbox_s(numbers):
    for table, offset in ((numbers.printed, 0.0), (numbers.corrected, -90.0)):
        robot = toolbox(offset)
        assert np.allclose(table.tool_mm, 1000 * robot.fkine(np.zeros(6)).t, atol=1e-6)
        assert np.allclose(table.example_mm, 1000 * robot.fkine(EXAMPLE).t, atol=1e-6)


def test_one_entry_explains_the_article_s_text(numbers):
    assert (numbers.printed.statements_met, numbers.corrected.statements_met) == (18, 22)
    assert (numbers.fault, numbers.fault_deg) == ("wrong_offset2", pytest.approx(-90))
    assert (numbers.printed.within_limits, numbers.corrected.within_limits) == (0, 2)
    assert numbers.corrected.void_litres[1] < 0.01 * numbers.printed.void_litres[0]
    assert numbers.printed.void_mm[2] > 0
    assert numbers.printed.crossings_s == pytest.approx((0, 0.7400), abs=1e-4)  # as ctraj keeps time


def test_the_line_is_as_easy_as_its_joint_speeds_say(numbers):
    """By differences of closed-form solutions of ctraj's own poses, beside the stage's Jacobian."""
    arm, t = load_robot("er3a_c60_article"), np.linspace(0, 5, 5001)
    end = er3a.pose([0.6, 0.3, 0.5], [0, np.pi, 0])
    q = er3a.follow(arm, er3a.line(er3a.forward(arm, np.zeros(6)), end, 5.0, ramp=1 / 3), t).joints(t)
    speeds = np.degrees(np.abs(np.gradient(q, t, axis=0)))
    assert numbers.printed.line_speed_deg_s == pytest.approx(speeds.max(), rel=0.01)


def test_agreement_follows_the_numbers(numbers):
    found = agreements(numbers)
    assert {found[code] for code in ("zero_pose", "plot", "void")} == {"differs"}
    assert (found["hole"], found["unreachable"]) == ("in_part", "in_part")
    mended = agreements(replace(numbers, printed=numbers.corrected))
    assert {mended[code] for code in ("zero_pose", "plot", "unreachable")} == {"agrees"}
    failing = replace(numbers.printed, checks=86, checks_met=26)
    assert agreements(replace(numbers, printed=failing))["key_poses"] == "differs"
    assert agreements(replace(numbers, corrected=numbers.printed))["hole"] == "not_examined"


class Ids(HTMLParser):
    """The ids of a page, and where links within it lead."""

    def __init__(self, text: str):
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if "id" in given:
            self.ids.append(given["id"])
        if tag == "a" and (given.get("href") or "").startswith("#"):
            self.links.append(given["href"][1:])


@pytest.mark.parametrize("code", ["en", "zh"])
def test_every_item_figure_and_table_has_an_address(pages, code):
    found = Ids(pages[code])
    assert {f"item-{code}" for code in ITEMS} <= set(found.ids)
    assert {f"#item-{code}" for code in ITEMS} <= {f"#{link}" for link in found.links}
    assert len(found.ids) == len(set(found.ids))
    assert set(found.links) <= set(found.ids)


def test_no_field_of_a_text_is_left_unfilled(pages):
    for text in pages.values():
        shown = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.DOTALL)
        assert re.findall(r"\{\w+\}", shown) == []


def test_both_arms_stand_in_the_player(pages):
    data = re.search(r'id="player-data">(.*?)</script>', pages["en"], re.DOTALL)[1]
    shown = json.loads(data)
    assert [motion["name"] for motion in shown["motions"]] == ["article_joint", "article_line"]
    assert [len(motion["values"]) for motion in shown["motions"]] == [2, 2]
    assert [sign["text"] for sign in shown["signs"]] == ["the article's table", "the same with offset 2 = −90°"]
    arms = [load_robot(name) for name in ("er3a_c60_article", "er3a_c60_article_offset2")]
    q = [np.frombuffer(base64.b64decode(text), "<f4")[:6] for text in shown["motions"][1]["values"]]
    starts = [er3a.forward(arm, own)[2, 3] for arm, own in zip(arms, q)]
    assert starts == pytest.approx([-0.60744, 0.81977], abs=1e-4)
