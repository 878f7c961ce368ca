"""The workspace stage as a whole: its tables, and arms that are out of the ordinary."""

from __future__ import annotations

import html
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from er3a.errors import InputError
from er3a.finding import is_one
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.pipeline.messages.say import say
from er3a.pipeline.results import read_stage, write_results
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.workspace.compute import compute
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.report import report
from er3a.pipeline.study import load_study
from er3a.pipeline.tables import table_types
from tests.stages.workspace_arms import locked_file, make_study, skew_file

pytestmark = pytest.mark.long  # whole stages, and kernels that take forty seconds to compile

TABLES = ["section", "cloud", "proof", "border", "void_vertices", "void_triangles", "capability", "places"]

# --- the stage ---


@pytest.fixture(scope="module")
def found() -> WorkspaceResults:
    return compute(make_study(), "er3_600")


def test_tables_agree_with_the_summary(found):
    summary = found.summary
    assert found.section.samples.sum() == summary.samples == 60_001
    assert len(found.cloud) == 500
    assert (found.cloud.manipulability_m3 >= 0).all()


def test_what_is_read_is_what_was_computed(found, tmp_path):
    write_results(tmp_path, make_study(), "er3_600", STAGES["workspace"], found)
    tables = {f"{name}.parquet" for name in TABLES}
    assert {path.name for path in tmp_path.iterdir()} == {*tables, "summary.json", "SHA256SUMS"}
    text = (tmp_path / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} in summary.json"))
    assert {"volume_m3", "samples", "voids", "verdict", "figures", "provenance"} <= set(summary)
    assert 4 <= len(summary["figures"]) <= 8
    read = read_stage(tmp_path, STAGES["workspace"]).results
    assert read.summary == found.summary
    for name in table_types(WorkspaceResults):
        getattr(read, name).write(tmp_path / "again.parquet")
        assert (tmp_path / "again.parquet").read_bytes() == (tmp_path / f"{name}.parquet").read_bytes(), name


def litres_outwards(bound_m3: float) -> float:
    return np.floor(1e5 * bound_m3) / 100


def test_a_void_has_the_same_bounds_wherever_it_is_and_a_contradicted_table_has_no_place(small_results, tmp_path):
    study, name = load_study("config/small.yaml"), "er3a_c60"
    stored = read_stage(small_results("workspace", name, study), STAGES["workspace"])
    (void,) = (each for each in stored.results.summary.enclosed_voids if each.holds_shoulder)
    low, high = (litres_outwards(bound) for bound in (void.volume_m3.lower, -void.volume_m3.upper))
    for status in ("caution", "fail"):
        report(study, replace(stored, table=status), tmp_path / "page.html")
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert (f"It is {low:.2f} L at least" in page) == (status == "caution")
        assert f">{low:.2f} to {-high:.2f}</td>" in page  # the same bounds, outwards, wherever they stand
        assert ("<dt>Payload there</dt>" in page, 'id="placement"' in page) == (status != "fail",) * 2
        assert "dynamics.html#payload" not in page  # it lies not beside these results
        assert ("scene file as boxes, and run again" in page) == (status != "fail")


def test_void_centres_have_no_inverse_solution(small_results, random):
    """The closed form, over random orientations, is an independent witness of what the samples left out."""
    study, name = load_study("config/small.yaml"), "er3a_c60_article"
    summary = read_stage(small_results("workspace", name, study), STAGES["workspace"]).results.summary
    robot = study.robot(name)
    assert is_one(summary.verdict.finding, "workspace.void_unexpected")
    assert summary.verdict.status == "caution"
    (void,) = (void for void in summary.enclosed_voids if not void.holds_shoulder)

    def solvable(position):
        T = np.eye(4)
        T[:3, 3] = position
        for rotation in Rotation.random(150, rng=random).as_matrix():
            T[:3, :3] = rotation
            if inverse(robot, T).within_limits.any():
                return True
        return False

    assert not solvable(void.centroid_m)
    assert solvable([0.9, 0.1, 0.5])
    low, high = void.low_m[2], void.high_m[2]

    def meets(z):
        """Whether an optimizer finds joints that take the tool to that height of axis 1."""
        starts, bounds = random.uniform(robot.lower, robot.upper, (15, 6)), (robot.lower, robot.upper)
        return any(
            least_squares(lambda q: forward(robot, q)[:3, 3] - [0, 0, z], start, bounds=bounds).cost < 1e-12
            for start in starts
        )

    lost = [z for z in np.linspace(low - 0.05, high + 0.05, 12) if not meets(z)]
    assert low <= min(lost) < low + 0.3 * (high - low)
    assert high - 0.3 * (high - low) < max(lost) <= high


@pytest.mark.parametrize(
    ("locked", "code"),
    [
        ({1: 0, 2: 0, 3: 0, 4: 0, 5: 0, 6: 90}, "workspace.flat"),
        ({1: 10, 4: 0, 6: 0}, "workspace.flat"),
    ],
)
def test_locked_joints_run_through_all_three_verbs(tmp_path, locked, code):
    study = make_study({"locked": locked_file(tmp_path, locked)}, samples=5000)
    run.compute("workspace", study, "locked", tmp_path / "results")
    verdict = read_stage(tmp_path / "results", STAGES["workspace"]).results.summary.verdict
    assert code == verdict.finding.code
    for verb, output in (("report", "workspace.html"), ("record", "workspace.rrd")):
        run.show(verb, "workspace", study, "locked", tmp_path / "results", tmp_path / output)
    assert say(verdict.finding) in html.unescape((tmp_path / "workspace.html").read_text(encoding="utf-8"))
    assert (tmp_path / "workspace.rrd").stat().st_size > 10_000


def test_an_arm_without_a_spherical_wrist_gets_the_general_proof(tmp_path):
    study = make_study({"skew": skew_file(tmp_path)}, samples=10_000, cells_across=64)
    found = compute(study, "skew")
    summary = found.summary
    assert summary.verdict.finding.code in {"workspace.void_at_shoulder", "workspace.no_void", "workspace.unsettled"}
    assert 0 < summary.volume_m3.lower < summary.volume_m3.upper
    assert summary.proof.points_in_empty_cells == 0


# --- bad input ---


@pytest.mark.parametrize(("field", "value"), [("samples", 0), ("cells_across", 4000)])
def test_settings_that_make_no_sense_are_named(tmp_path, field, value):
    content = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    content["workspace"][field] = value
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(InputError, match=rf"study\.yaml.*workspace\.{field}"):
        load_study(path)
