"""The vision stage on the study's cells: verdict, tables, page and recording, and equal bytes."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
import yaml
from PIL import Image

from er3a.files.kept_files import ROOT
from er3a.geometry.transforms import inverted
from er3a.pipeline.messages import vision  # noqa: F401
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import read_results
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.vision.compute import compute, figures_of, verdict_of
from er3a.pipeline.stages.vision.model import VisionResults
from er3a.pipeline.stages.vision.page.played import placed
from er3a.pipeline.stages.workspace.page.tray import sound_motions
from er3a.pipeline.study import load_study
from testing.hand_eye_sets import pose
from testing.on_demand import OnDemand
from tests.vision.test_boards import CHARUCO, board_places, rendered
from tests.vision.test_hand_eye_file import HEAD, columns, write

pytestmark = pytest.mark.long

STAGE = STAGES["vision"]
ARTICLE = "er3a_c60_article"


@pytest.fixture(scope="module")
def study():
    """The small study, in which the article's table goes through this stage, too."""
    small = load_study(ROOT / "config/small.yaml")
    entry = small.entry(ARTICLE).model_copy(update={"vision": small.entry("er3a_c60").vision, "stages": None})
    return small.model_copy(update={"robots": small.robots | {ARTICLE: entry}})


@pytest.fixture(scope="module")
def folders(study, small_results):
    return OnDemand(lambda name: small_results("vision", name, study))


def test_objects_are_grasped_as_expected_and_the_turned_board_is_named(folders):
    summary = read_results(folders["er3a_c60"], VisionResults).results.summary
    assert summary.verdict.status == "caution"  # no gripper has a shape
    assert [gap.reason for each in summary.verdict.missed for gap in each.gaps] == ["bare_tool", "gripper"]
    assert summary.verdict.finding.left_out == ("pose_12",)
    assert summary.verdict.finding.simulated
    assert summary.verdict.shapes.near == ()
    assumed = {each.reason for each in summary.assumed}
    assert {"real_camera", "tool"} <= assumed
    assert "touched_points" not in assumed
    assert {each.name: each.outcome for each in summary.objects} == {
        "can": "grasped",
        "box": "grasped",
        "box_by_the_post": "not graspable",
        "box_far_off": "not graspable",
    }
    assert {each.refusal.code for each in summary.objects if each.refusal} == {"grasp_collides", "grasp_out_of_reach"}


def test_an_object_that_is_moved_as_advised_is_grasped(study, folders, tmp_path):
    summary = read_results(folders["er3a_c60"], VisionResults).results.summary
    missed = [each for each in summary.objects if not each.grasp]
    file = ROOT / "data/vision/er3a_c60.yaml"
    cell = yaml.safe_load(file.read_text(encoding="utf-8"))
    cell["calibration"] = str(file.parent / cell["calibration"])
    cell["objects"] = [each for each in cell["objects"] if each["name"] in {one.name for one in missed}]
    to_camera = inverted(placed(summary.calibration.hand_eye))
    for entry, each in zip(cell["objects"], missed):
        assert each.moved_to_mm[2] == pytest.approx(each.xyz_mm[2])
        entry["xyz_mm"] = (1000 * to_camera[:3, 3] + to_camera[:3, :3] @ each.moved_to_mm).tolist()
    (tmp_path / "moved.yaml").write_text(yaml.safe_dump(cell), encoding="utf-8")
    entry = study.entry("er3a_c60").model_copy(update={"vision": tmp_path / "moved.yaml"})
    moved = compute(study.model_copy(update={"robots": {"er3a_c60": entry}}), "er3a_c60").summary.objects
    assert [each.outcome for each in moved] == ["grasped", "grasped"]
    for each, where in zip(moved, missed):
        assert each.xyz_mm == pytest.approx(where.moved_to_mm)
        assert each.grasp.q_deg == pytest.approx(where.moved_q_deg, abs=0.01)


def test_objects_within_the_margin_of_assumed_shapes_count_apart(folders):
    summary = read_results(folders["er3a_c60"], VisionResults).results.summary
    for near, clear in (((), 2), (("can",), 1), (("can", "box"), 0)):
        verdict = verdict_of(summary.calibration, summary.objects, near)
        assert (verdict.finding.objects, verdict.finding.grasped, verdict.finding.assumed) == (2, clear, near)
        assert f"{clear} of 2 objects can be grasped" in say(verdict.finding)
        assert ("Only if undocumented shapes are right" in say(verdict.finding)) == bool(near)
        figures = {each.name: each.value for each in figures_of(summary.calibration, summary.objects, near)}
        assert figures["objects_grasped"] == clear


def test_only_grasps_that_pass_are_told_to_succeed(folders):
    results = read_results(folders["er3a_c60"], VisionResults).results
    verdict, (can, *others) = results.summary.verdict, results.summary.objects

    def told(near=(), expect="grasped"):
        objects, shapes = (replace(can, expect=expect), *others), verdict.shapes.but(near=near)
        summary = replace(results.summary, objects=objects, verdict=replace(verdict, shapes=shapes))
        return sound_motions(replace(results, summary=summary))

    assert told() == ["can", "box"]
    assert told(near=("box",)) == ["can"]
    assert told(expect="not graspable") == ["box"]


def test_an_object_without_a_grasp_is_not_grasped_whatever_refuses_it(folders):
    summary = read_results(folders["er3a_c60"], VisionResults).results.summary
    (can, *_), none = summary.objects, {"grasp": None, "refusal": None, "expect": None}
    lost = replace(can, **none, outcome="not graspable")
    for objects, status, grasped in (((can, lost), "caution", 1), ((lost,), "fail", 0)):
        verdict = verdict_of(replace(summary.calibration, warnings=()), objects, ())
        assert (verdict.status, verdict.finding.grasped) == (status, grasped)


def test_the_verdict_names_the_least_success_whatever_level_the_study_asks_for(folders):
    """A study that asks for no level counts a grasp that fails 199 times in 200, and says so."""
    summary = read_results(folders["er3a_c60"], VisionResults).results.summary
    likely, *others = (each for each in summary.objects if each.grasp)
    for probability, words in ((0.00499, "at least 0.4 %"), (0.9999, "at least 99.9 %")):
        objects = (replace(likely, grasp=replace(likely.grasp, probability=probability)),)
        assert f"Probability of success: {words}" in say(verdict_of(summary.calibration, objects, ()).finding)
        both = verdict_of(summary.calibration, (*objects, *others), ()).finding
        assert both.probability == min(probability, *(each.grasp.probability for each in others))
    assert "Probability" not in say(verdict_of(summary.calibration, (), ()).finding)


def test_a_wrong_table_shows_in_the_calibration(folders):
    """The same recording, its joint angles turned into poses by the article's table."""
    summary = read_results(folders[ARTICLE], VisionResults).results.summary
    assert summary.verdict.status == "fail"
    assert "no_majority" in {each.code for each in summary.verdict.finding.warnings}
    assert summary.objects == ()


def test_tables_say_what_the_summary_says(folders):
    results = read_results(folders["er3_600"], VisionResults).results
    found = results.summary.calibration
    assert results.samples.used.sum() == found.used
    for each in results.summary.objects:
        last = results.ways.take((results.ways.target == each.name) & (results.ways.part == "approach")).q_deg[-1]
        np.testing.assert_allclose(last, each.grasp.q_deg)
        assert each.error_mm.together >= max(each.error_mm.camera, each.error_mm.calibration, each.error_mm.table)


@pytest.mark.parametrize("name", ["er3a_c60", ARTICLE, "er3_600"])
def test_the_page_is_written(study, folders, tmp_path, name):
    run.show("report", "vision", study, name, folders[name], tmp_path / "report")
    page = (tmp_path / "report").read_text(encoding="utf-8")
    assert "T_flange_board" in page or "T_base_board" in page


def test_images_come_with_their_reprojected_corners(study, tmp_path):
    """Rendered boards, one of them taken with the arm 5 mm beside where it says it was: its lines all point one way.

    Before each of them an image was taken that shows no board: these are counted, and listed together.
    """
    random = np.random.default_rng(3)
    Y, X = pose([3, -4, 20], [0.02, 0.03, 0.05]), pose([150, 5, 30], [0.7, 0.1, 1.2])
    places = board_places(random, 14)
    flange = np.array([X @ T @ np.linalg.inv(Y) for T in places])
    for number, T in enumerate(places):
        Image.fromarray(shown := rendered(CHARUCO, T, random)).save(tmp_path / f"{2 * number + 1}.png")
        Image.fromarray(np.full_like(shown, 90)).save(tmp_path / f"{2 * number}.png")
    flange[3, :3, 3] += [0.005, 0, 0]
    head = HEAD.format(setup="eye_to_hand") + (
        "images:\n  board: {pattern: charuco, squares: [7, 5], square_mm: 30, marker_mm: 22}\n"
        "  intrinsics: {fx: 1100.0, fy: 1105.0, cx: 640.0, cy: 470.0}\n  pixel_standard_deviation: 0.3\n"
    )
    table = columns(np.repeat(flange, 2, axis=0), "flange", "quaternion") | {
        "image": np.array([f"{n}.png" for n in range(28)])
    }
    made = write(tmp_path, table, head)
    text = (ROOT / "data/vision/er3a_c60.yaml").read_text(encoding="utf-8")
    (tmp_path / "vision.yaml").write_text(text.replace("fixed_camera.yaml", made.name), encoding="utf-8")
    entry = study.robots["er3a_c60"].model_copy(update={"vision": str(tmp_path / "vision.yaml")})
    own = study.model_copy(update={"robots": {"er3a_c60": entry}})
    folder = tmp_path / "results"
    folder.mkdir()
    run.compute("vision", own, "er3a_c60", folder)
    results = read_results(folder, VisionResults).results
    corners, blank = results.corners, [f"{n}.png" for n in range(0, 28, 2)]
    calibration = results.summary.calibration
    assert (calibration.samples, calibration.used) == (28, 13)
    assert [each.image for each in calibration.boardless] == blank
    assert set(corners.image) == {f"{n}.png" for n in range(1, 28, 2)}
    sound = corners.used
    assert set(corners.image[~sound]) == {"7.png"}
    assert np.sqrt(((corners.by_board_px - corners.seen_px)[sound] ** 2).sum(axis=1).mean()) < 0.5
    off = corners.by_arm_px - corners.seen_px
    assert np.sqrt((off[sound] ** 2).sum(axis=1).mean()) < 1.5
    aside = off[~sound]
    assert np.linalg.norm(aside.mean(axis=0)) > 0.8 * np.linalg.norm(aside, axis=1).mean() > 4
    run.show("report", "vision", own, "er3a_c60", folder, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "detected and reprojected corners" in page
    assert "magnified" in page


@pytest.mark.parametrize("turning", [False, True])
def test_samples_without_a_calibration_leave_every_object_unexamined(study, tmp_path, turning):
    """All samples at one pose determine nothing; with some, but a wrong one, no grasp rests on it either."""
    for file in (ROOT / "data/vision").glob("fixed_camera*"):
        shutil.copy(file, tmp_path)
    content = yaml.safe_load((ROOT / "data/vision/er3a_c60.yaml").read_text(encoding="utf-8"))
    (tmp_path / "vision.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    head, *rows = (tmp_path / "fixed_camera.csv").read_text(encoding="utf-8").splitlines()
    if turning:
        poses = [row.split(",") for row in rows]
        k = head.split(",").index("target_x_mm")
        mixed = [[*row[:k], str(float(row[k]) + 200 * (-1) ** n), *row[k + 1 :]] for n, row in enumerate(poses)]
        rows = [",".join(row) for row in mixed]
    else:
        rows = [f"p{n}" + rows[0][rows[0].index(",") :] for n in range(6)]
    (tmp_path / "fixed_camera.csv").write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    entry = study.entry("er3a_c60").model_copy(update={"vision": str(tmp_path / "vision.yaml")})
    given = study.model_copy(update={"robots": {"er3a_c60": entry}})
    summary = STAGE.module("compute").compute(given, "er3a_c60").summary
    assert summary.verdict.status == "fail"
    assert (summary.calibration is not None) == turning
    missed = {each.check for each in summary.verdict.missed}
    assert "camera" in missed or turning
    assert "scene_collision" in missed
