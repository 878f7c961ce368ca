"""The SRDF beside an exported URDF, as Pinocchio reads it."""

from __future__ import annotations

import warnings

import pinocchio
import pytest
from typer.testing import CliRunner

from er3a.collision.matrix import collision_matrix
from er3a.collision.pairs import link_label
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.pipeline.cli import app
from er3a.robots.robot import CombinedLimit, Source


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_pairs_left_to_check_are_those_that_are_watched(name, tmp_path):
    urdf, srdf = tmp_path / "arm.urdf", tmp_path / "arm.srdf"
    done = CliRunner().invoke(app, ["export-urdf", name, "--output", str(urdf), "--srdf", str(srdf)])
    assert done.exit_code == 0, done.output
    robot = load_robot(name)
    model = pinocchio.buildModelFromUrdf(str(urdf))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pinocchio's conversions
        shapes = pinocchio.buildGeomFromUrdf(model, str(urdf), pinocchio.GeometryType.COLLISION, str(tmp_path))
    shapes.addAllCollisionPairs()
    pinocchio.removeCollisionPairs(model, shapes, str(srdf))
    joints = [shape.parentJoint for shape in shapes.geometryObjects]
    left = {tuple(sorted((joints[pair.first], joints[pair.second]))) for pair in shapes.collisionPairs}
    left = {pair for pair in left if pair[0] != pair[1]}
    numbers = {link_label(k): k for k in range(robot.rows + 1)}
    rows = collision_matrix(robot).rows
    watched = [row for row in rows if row.state in ("meets", "undecided", "watched")]
    assert left == {(numbers[row.first], numbers[row.second]) for row in watched}
    assert left


@pytest.mark.parametrize(
    ("grade", "told"),
    [("cad", ""), ("inferred", "by shapes that the robot's file assumes"), (None, "by shapes that er3a guesses from")],
)
def test_pairs_that_rest_on_assumed_shapes_say_so(grade, told, tmp_path):
    arm = load_robot("er3_600").replace(name="arm", references=())
    sources = {**arm.sources, "envelopes": Source("x", grade or "cad")}
    arm = arm.replace(sources=sources) if grade else arm.replace(envelopes=())
    write_robot(arm, tmp_path / "arm.yaml")
    asked = ["export-urdf", str(tmp_path / "arm.yaml"), "--output", str(tmp_path / "arm.urdf")]
    done = CliRunner().invoke(app, [*asked, "--srdf", str(tmp_path / "arm.srdf")])
    assert ("pairs are disabled" in done.stderr) == bool(told)
    assert told in done.stderr
    assert told in (tmp_path / "arm.srdf").read_text(encoding="utf-8")


def test_limits_on_sums_of_joints_are_told_to_be_left_out(tmp_path):
    for combined in ((), (CombinedLimit((0.0, 1.0, 1.0, 0.0, 0.0, 0.0), -1.0, 2.0),)):
        write_robot(load_robot("er3a_c60").replace(name="arm", combined=combined), tmp_path / "arm.yaml")
        asked = ["export-urdf", str(tmp_path / "arm.yaml"), "--output", str(tmp_path / "arm.urdf")]
        assert ("limits on sums of joints are left out" in CliRunner().invoke(app, asked).stderr) == bool(combined)
