"""What measurements settle before a fit, and which poses are proposed."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.calibration.observations import Measurement
from er3a.calibration.plan import d_optimal, plan
from er3a.collision.along import clearance
from er3a.pipeline.cli import app
from er3a.robots.joint_limits import meant
from tests.calibration.test_points import Bench, reached
from tests.conftest import ROOT


def test_blocks_that_add_most_are_those_of_a_brute_force(random):
    blocks = list(random.normal(size=(12, 3, 4)))
    chosen = d_optimal(np.zeros((4, 4)), blocks, 3)
    information = 1e-9 * np.eye(4)
    for at in chosen:
        dets = [np.linalg.det(information + block.T @ block) for block in blocks]
        assert dets[at] == pytest.approx(max(dets))
        information = information + blocks[at].T @ blocks[at]


def test_proposed_poses_settle_what_a_calibration_settles_with_them(random):
    bench = Bench("six", random)
    bench.robot = bench.robot.replace(upper=bench.robot.upper - np.radians(0.1))  # limits that are no whole degrees
    q = np.clip(bench.joints(6), -0.4, 0.4)
    poses = np.degrees(q).tolist()
    rows = [
        Measurement(k, tuple(p), "tool", tuple(x))
        for k, (p, x) in enumerate(zip(poses, bench.positions(q).tolist()), 2)
    ]
    found = plan(bench.robot, rows, 20)
    assert found.lacking
    assert {each.joint for each in found.beyond} == set(range(1, 7))
    new = meant(bench.robot, np.array([each.pose for each in found.proposals]))
    assert ((new >= bench.robot.lower) & (new <= bench.robot.upper)).all()
    assert (clearance(bench.robot, new, None).distance > 0).all()
    more = [
        Measurement(k, each.pose, "tool", tuple(x))
        for k, (each, x) in enumerate(zip(found.proposals, bench.positions(new).tolist()), 20)
    ]
    stated = [Measurement(r.row, r.pose, r.point, r.xyz_mm, 0.1) for r in (*rows, *more)]
    fitted = er3a.calibrate(bench.robot, stated)
    assert {each.name for each in fitted.estimates} == {*found.settled, *found.lacking}
    widths = {each.name: each.then for each in found.widths}
    for each in fitted.estimates:
        assert each.half_width == pytest.approx(widths[each.name], rel=0.2)


@pytest.mark.parametrize("kind", ["place", "plane"])
def test_what_is_touched_is_touched_by_proposed_poses(kind, random):
    bench = Bench("six", random)
    robot = bench.robot
    bench.truth = robot
    target, normal = np.array([0.4, 0.1, 0.3]), np.array([0, 0, 1.0])
    poses = np.degrees(reached(bench, target, normal if kind == "plane" else None, 12)).tolist()
    rows = [Measurement(k, tuple(pose), "tool", (None,) * 3, **{kind: "own"}) for k, pose in enumerate(poses, 2)]
    found = plan(robot, rows, 5)
    new = er3a.forward(robot, meant(robot, np.array([each.pose for each in found.proposals])))[:, :3, 3]
    assert len(new) == 5
    (scale,) = (each.entry for each in found.held if each.code == "sets_scale")
    assert not {scale, "offset1"} & {*found.settled, *found.lacking}
    if kind == "place":
        assert new == pytest.approx(np.tile(target, (5, 1)), abs=1e-4)
    else:
        assert new[:, 2] == pytest.approx(0.3, abs=1e-4)


def test_the_command_plans_before_it_fits(tmp_path):
    lines = (ROOT / "data/measurements/wam.csv").read_text(encoding="utf-8").splitlines()[:9]
    (tmp_path / "few.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    words = ["calibrate", "data/measurements/wam.yaml", str(tmp_path / "few.csv"), "--plan", "3"]
    text = CliRunner().invoke(app, words).stdout
    assert "these measurements settle 19 of 29 numbers" in text
    assert "add poses with J1 beyond 111.4 deg" in text
    record = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert len(record["settled"]) == 19
    assert len(record["proposals"]) == 3
