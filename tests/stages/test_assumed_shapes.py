"""Where no document gives an arm's shapes, what is said of collisions says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from er3a.collision.pairs import ASSUMED_MARGIN
from er3a.collision.scene import Plane, Scene
from er3a.collision.shapes import arm_shapes, shapes_assumed
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import Verdict, read_results
from er3a.pipeline.stages.collision.compute import compute as collision
from er3a.pipeline.stages.trajectory.model import RESULTS, MinClearance, is_safe
from er3a.pipeline.stages.trajectory.page.played import faults
from er3a.pipeline.stages.trajectory.page.record import runs_of_path
from er3a.pipeline.stages.trajectory.page.report import report
from er3a.pipeline.stages.trajectory.written_programs import near_assumed_shapes
from er3a.pipeline.study import load_study
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.languages import read_program
from er3a.programs.writing import head_line

HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])


def documented(grade="official"):
    """The ER3A-C60 as if a drawing gave its shapes."""
    robot = load_robot("er3a_c60")
    source = robot.sources["envelopes"]
    return robot.replace(sources={**robot.sources, "envelopes": replace(source, grade=grade)})


def test_shapes_that_a_document_gives_need_no_word():
    inferred, drawn = load_robot("er3a_c60"), documented()
    assert arm_shapes(inferred).assumed
    assert arm_shapes(documented("claim")).assumed  # what an article says, on which no verdict rests
    assert not arm_shapes(drawn).assumed
    assert shapes_assumed(drawn, 0.02, {"a": 0.001}) is None
    assert not shapes_assumed(inferred.replace(envelopes=()), 0.02, {}).given


@pytest.mark.parametrize(("least", "near"), [(0.0, ("a",)), (0.019, ("a",)), (0.021, ()), (-0.001, ()), (None, ())])
def test_what_comes_near_to_assumed_shapes_is_a_caution(least, near):
    shapes = shapes_assumed(load_robot("er3a_c60"), 0.02, {"a": least})
    assert shapes.near == near
    verdict = Verdict("pass", fact("collision.free_space")).with_assumed_shapes(shapes)
    assert verdict.status == ("caution" if near else "pass")
    assert say(verdict.findings[-1]).startswith("Link shapes are assumed")
    assert ("of assumed shapes: a." in say(shapes)) == bool(near)


def test_the_stages_say_so(small_results):
    study = load_study("config/small.yaml")
    stored = read_results(small_results("trajectory", "er3a_c60", study), RESULTS)
    shapes = stored.results.summary.verdict.shapes
    assert (shapes.given, shapes.margin_mm) == (True, 1000 * ASSUMED_MARGIN)
    paths = stored.results.summary.paths
    near = [each.name for each in paths if each.expect is None and 0 <= each.clearance.least_mm < shapes.margin_mm]
    assert list(shapes.near) == near
    summary = stored.results.summary
    count, (tile,) = summary.verdict.finding.safe, (each for each in summary.figures if each.name == "safe")
    assert count == tile.value == len(paths) - len(faults(stored.results))  # which the index counts
    sound = next(path for path in paths if path.verdict == "safe" and path.name not in near)
    nearer = shapes.but(near=(*near, sound.name))
    assert (is_safe(sound, shapes), is_safe(sound, nearer)) == (True, False)
    closer = replace(summary, verdict=replace(summary.verdict, shapes=nearer))
    assert len(faults(replace(stored.results, summary=closer))) == len(faults(stored.results)) + 1


def test_recordings_call_no_path_safe_without_saying_of_what(small_results):
    study = load_study("config/small.yaml")
    results = read_results(small_results("trajectory", "er3a_c60", study), RESULTS).results
    summary = results.summary
    sound = [each for each in summary.paths if is_safe(each, summary.verdict.shapes)]
    nearer = replace(summary.verdict, shapes=summary.verdict.shapes.but(near=(sound[0].name,)))
    close = replace(results, summary=replace(summary, verdict=nearer))
    for found, status, words in (
        (results, "plain", "pass"),
        (close, "caution", f"{sound[0].clearance.least_mm:.1f} mm clear (assumed)"),
    ):
        run = next(runs_of_path(load_robot("er3a_c60"), found, sound[0]))
        assert (run.status, run.outcome) == (status, words)
        assert f"**{words}**" in run.text


def test_the_page_of_paths_says_once_that_shapes_are_assumed(small_results, tmp_path):
    """Of shapes that a document gives, it does not say so."""
    study = load_study("config/small.yaml")
    stored = read_results(small_results("trajectory", "er3a_c60", study), RESULTS)
    summary = stored.results.summary
    drawn = replace(summary, verdict=replace(summary.verdict, shapes=None))
    for found, of_assumed in ((summary, True), (drawn, False)):
        report(study, replace(stored, results=replace(stored.results, summary=found)), tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert ("Link shapes are assumed" in page) == of_assumed


def test_a_program_of_a_path_near_assumed_shapes_says_so_in_its_head():
    robot, least = load_robot("er3a_c60"), MinClearance(11.2, 0.4, fact("link_pair", first=1, second=3))
    (near,) = near_assumed_shapes(robot, "a", least, 0.02)
    assert head_line(near).startswith("NOT SETTLED: the path a is clear by 11.2 mm of assumed shapes only")
    assert near_assumed_shapes(robot, "a", least, 0.01) == near_assumed_shapes(documented(), "a", least, 0.02) == ()


@pytest.mark.long
def test_a_wider_margin_turns_a_pass_into_a_caution():
    study = load_study("config/small.yaml")
    quick = study.collision.model_copy(update={"samples": 1000, "cells_across": 4, "rounds": 0})
    for margin, status in ((0, "pass"), (1000, "caution")):
        paths = study.trajectory.model_copy(update={"assumed_margin_mm": margin})
        wide = study.model_copy(update={"collision": quick, "trajectory": paths})
        verdict = collision(wide, "er3a_c60").summary.verdict
        assert verdict.finding.shapes_assumed
        assert verdict.status == status


@pytest.mark.parametrize(("nearer", "level"), [(-0.05, "pass"), (-0.01, "note"), (0.01, "caution"), (0.03, "fail")])
def test_a_motion_near_assumed_shapes_is_named_and_fails_only_by_what_is_deep(tmp_path, nearer, level):
    (tmp_path / "a.script").write_text("movej([0.3, -0.3, -0.2, 0.0, -1.2, 0.0])\n")
    program = read_program(tmp_path / "a.script")
    robot = load_robot("er3a_c60")
    free = check_program(program, robot, CheckOptions(start=HOME, scene=Scene("far", (plane(-5.0),))))
    on_floor = check_program(program, robot, CheckOptions(start=HOME, scene=Scene("floor", (plane(0.2),))))
    (motion,) = on_floor.motions.values()
    options = CheckOptions(start=HOME, scene=Scene("floor", (plane(0.2 + motion.clearance + nearer),)))
    found = check_program(program, robot, options)
    assert free.level == "pass"
    assert found.level == level
    assert found.shapes is not None
    drawn = check_program(program, documented(), options)
    assert drawn.level == ("fail" if nearer > 0 else "pass")
    assert drawn.shapes is None


def plane(height: float) -> Plane:
    """A floor."""
    return Plane("floor", np.array([0.0, 0.0, 1.0]), height)
