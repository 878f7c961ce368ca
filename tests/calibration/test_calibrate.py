"""Corrections from measured positions: right, honest about their errors, and clear about what they can't tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import er3a
from er3a.calibration import calibrate as calibration
from er3a.calibration.fit import jacobian
from er3a.calibration.observations import Measurement, observed
from er3a.calibration.parameters import CalibrationError, parallel_pairs, parameters_of, placements_of
from er3a.errors import InputError
from er3a.files.by_name import COLUMNS, load_measurements
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.finding import fact, is_one
from er3a.pipeline.cli import app
from er3a.pipeline.messages import confirm, diagnosis  # noqa: F401
from er3a.pipeline.messages.calibration import lines_of
from er3a.pipeline.messages.confirm import JOINTS
from er3a.robots.robot import to_modified
from testing.simulated_measurements import covered, measured

TOUCHED = ("place", "plane")
HEADER = ",".join(name for name in COLUMNS if name not in TOUCHED) + "\n"
TRUSTED = ("er3a_c60", "er3_600")


def bent(robot: er3a.Robot, random: np.random.Generator) -> er3a.Robot:
    """The arm with small errors in every entry, axes 2 and 3 out of parallel both ways."""
    row = parallel_pairs(robot)[0][0]
    return robot.replace(
        a=robot.a + random.normal(0, 5e-4, 6),
        d=robot.d + random.normal(0, 5e-4, 6),
        alpha=robot.alpha + random.normal(0, 1e-3, 6),
        offset=robot.offset + random.normal(0, 2e-3, 6),
        beta=np.where(np.arange(1, 7) == row, 1.5e-3, 0.0),
    )


def poses_in(robot: er3a.Robot, random: np.random.Generator, count: int) -> np.ndarray:
    return random.uniform(robot.lower, robot.upper, (count, 6))


def exact(truth: er3a.Robot, robot: er3a.Robot, random: np.random.Generator):
    """Noise-free positions with a stated deviation of 0.05 mm."""
    rows = measured(truth, poses_in(robot, random, 40), 0.0, random)
    return tuple(type(row)(row.row, row.pose, row.point, row.xyz_mm, 0.05) for row in rows)


@pytest.mark.parametrize("convert", [lambda robot: robot, to_modified])
@pytest.mark.parametrize("name", TRUSTED)
def test_exact_positions_give_an_arm_with_the_same_positions_everywhere(name, convert, random):
    """But for terms of second order: entries that are held because they act alike do so at the nominal table."""
    robot = convert(load_robot(name))
    truth = bent(robot, random)
    rows = exact(truth, robot, random)
    found = er3a.calibrate(robot, rows)
    (x, _, z), row = rows[0].xyz_mm, rows[0]
    partly = type(row)(row.row, row.pose, row.point, (x + 3, None, z + 4))
    assert found.distances_mm((partly,)) == pytest.approx(5, abs=0.02)
    q = poses_in(robot, random, 500)
    gap = er3a.forward(found.robot, q)[:, :3, 3] - er3a.forward(truth.without_tool(), q)[:, :3, 3]
    assert found.level == "all_entries"
    assert np.abs(gap).max() < 1e-5
    assert found.rms_after_mm < 3e-3 < 0.3 < found.rms_before_mm


@pytest.mark.long
def test_estimates_are_those_of_an_independent_solver(random):
    robot = load_robot("er3a_c60")
    rows = measured(bent(robot, random), poses_in(robot, random, 30), 0.05, random)
    found = er3a.calibrate(robot, rows)
    for scatter, warned in ((found.scatter, False), (0.1, True)):  # deviations of metres explain anything
        assert ("far below the stated" in lines_of(replace(found, scatter=scatter))) == warned
    kept = [each.parameter for each in found.estimates]
    q = np.radians([row.pose for row in rows])
    seen = np.array([row.xyz_mm for row in rows])

    def weighted(amounts):
        columns = {key: getattr(robot, key).copy() for key in ("a", "alpha", "beta", "d", "offset")}
        base = dict.fromkeys(("base_x", "base_y", "base_z", "base_rx", "base_ry", "base_rz"), 0.0)
        for parameter, amount in zip(kept, amounts):
            if parameter.joint:
                columns[parameter.column][parameter.joint - 1] += amount
            else:
                base[parameter.name] = amount
        x, y, z, rx, ry, rz = base.values()
        turn = Rotation.from_euler("ZYX", [rz, ry, rx]).as_matrix()
        points = er3a.forward(robot.replace(**columns), q)[:, :3, 3] @ turn.T + [x, y, z]
        return ((points * 1000 - seen) / 0.05).ravel()

    theirs = least_squares(weighted, np.zeros(len(kept)), x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    error = np.sqrt(np.diag(np.linalg.inv(theirs.jac.T @ theirs.jac)))
    for estimate, parameter, amount, own in zip(found.estimates, kept, theirs.x, error):
        assert estimate.correction == pytest.approx(amount * parameter.in_unit, abs=1e-3 * estimate.standard_error)
        assert estimate.standard_error == pytest.approx(own * parameter.in_unit, rel=1e-3)
    assert found.scatter == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize(("deviation", "least", "most"), [(0.05, 0.99, 1.0), (5000.0, 0.0, 0.0)])
def test_what_intervals_leave_wider_than_a_table_may_be_off_is_not_settled(random, deviation, least, most):
    robot = load_robot("er3a_c60")
    rows = measured(robot, poses_in(robot, random, 30), 0.05, random)
    rows = [replace(row, deviation_mm=deviation) for row in rows]
    found = er3a.calibrate(robot, rows)
    estimated = len(found.estimates)
    settled = estimated - len(found.open)
    assert least <= settled / estimated <= most
    assert f"settle {settled} of {estimated + len(found.held)} numbers" in lines_of(found)
    if not settled:
        assert found.conclusion == fact("no_correction_found", intervals=estimated, open=found.open)


def test_what_positions_cannot_tell_apart_is_held(random):
    robot = load_robot("er3_600")
    held = er3a.calibrate(robot, measured(robot, poses_in(robot, random, 40), 0.05, random)).held
    assert (
        fact("not_told_apart", entries=("d3", "d2"), parallel_joints=(2, 3)) in held
        or fact("not_told_apart", entries=("d2", "d3"), parallel_joints=(2, 3)) in held
    )
    assert fact("moves_nothing", entry="offset6") in held


def test_held_and_estimated_entries_are_the_rank_of_the_jacobian(random):
    robot = load_robot("er3a_c60")
    rows = measured(robot, poses_in(robot, random, 40), 0.05, random)
    found = er3a.calibrate(robot, rows)
    seen = observed(rows, robot)
    parameters = (*placements_of(["base"]), *parameters_of(robot, "all_entries"))
    J = jacobian(robot, parameters, seen) / seen.deviation_mm[:, None]
    assert np.linalg.matrix_rank(J, tol=1e-6 * np.linalg.norm(J, 2)) == len(found.estimates)
    assert len(found.held) == len(parameters) - len(found.estimates)


def test_a_measured_tool_sees_more_than_the_flange(random):
    tool = np.eye(4)
    tool[:3, 3] = 0.05, 0.02, 0.1
    robot = load_robot("er3a_c60").replace(tool=tool)
    truth = bent(robot, random)
    q = poses_in(robot, random, 40)
    rows = [
        type(row)(row.row, row.pose, "tool", tuple(1000 * T[:3, 3]), 0.05)
        for row, T in zip(measured(truth, q, 0.0, random), er3a.forward(truth, q))
    ]
    found = er3a.calibrate(robot, rows, fixed=["base", "tool"])
    assert "offset6" in [estimate.name for estimate in found.estimates]
    q = poses_in(robot, random, 200)
    np.testing.assert_allclose(er3a.forward(found.robot, q)[:, :3, 3], er3a.forward(truth, q)[:, :3, 3], atol=1e-9)


@pytest.mark.long
def test_intervals_cover_the_truth_in_95_of_100_runs(random):
    names, inside, _ = covered(load_robot("er3_600"), 120, 25, 0.05, random)
    assert len(names) == 24
    assert 0.93 < inside.mean() < 0.97


def test_few_poses_give_fewer_entries_and_say_what_more_is_needed(random):
    robot = load_robot("er3_600")
    few = er3a.calibrate(robot, measured(robot, poses_in(robot, random, 5), 0.05, random))
    assert few.level == "lengths_and_offsets"
    assert few.more.fitted == "all_entries"
    assert few.more.determined + len(few.more.entries) == few.more.determinable
    with pytest.raises(CalibrationError) as caught:
        er3a.calibrate(robot, measured(robot, poses_in(robot, random, 1), 0.05, random))
    needed = caught.value.finding
    assert is_one(needed, "more_positions")
    assert (needed.poses, needed.determined, needed.determinable, needed.missing) == (1, 3, 5, 1)


@pytest.mark.long
def test_positions_of_another_arm_are_not_explained_away(random):
    robot, other = load_robot("er3a_c60_article"), load_robot("er3a_c60")
    rows = measured(other, random.uniform(-1, 1, (40, 6)), 0.05, random)
    with pytest.raises(CalibrationError) as caught:
        er3a.calibrate(robot, rows)
    assert is_one(caught.value.finding, "no_correction_fits")


def written(
    folder: Path,
    robot: er3a.Robot,
    random: np.random.Generator,
    frame: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> Path:
    rows = [(row, frame(row.xyz_mm)) for row in measured(robot, poses_in(robot, random, 30), 0.02, random)]
    lines = [",".join(map(repr, row.pose)) + ",flange," + ",".join(map(str, xyz)) + ",0.02" for row, xyz in rows]
    path = folder / "measured.csv"
    path.write_text(HEADER + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_command_writes_a_robot_file_that_has_the_corrected_kinematics(random, tmp_path):
    robot = load_robot("er3a_c60")
    truth = bent(robot, random)
    path = written(tmp_path, truth, random)
    done = CliRunner().invoke(app, ["calibrate", "er3a_c60", str(path), "--output", str(tmp_path / "mine.yaml")])
    assert done.exit_code == 0, done.output
    assert "d2, d3 can't be identified separately (axes 2, 3 are parallel)" in done.output
    mine = load_robot(tmp_path / "mine.yaml")
    assert mine.beta[1] != 0
    q = poses_in(robot, random, 200)
    gap = np.linalg.norm(er3a.forward(mine, q)[:, :3, 3] - er3a.forward(truth, q)[:, :3, 3], axis=1)
    before = np.linalg.norm(er3a.forward(robot, q)[:, :3, 3] - er3a.forward(truth, q)[:, :3, 3], axis=1)
    assert gap.max() < 2e-4 < 5e-4 < before.max()
    np.testing.assert_array_equal(er3a.calibrate(robot, path).robot.a.round(12), mine.a.round(12))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("0,0,0,0,0,0,flange,374,0,699.5,0", ["row 2", "standard_deviation_mm", "positive"]),
        ("0,0,0,0,0,0,flange,,,,0.1", ["row 2", "x_mm", "no coordinate"]),
        ("0,0,0,0,0,0,tip,374,0,699.5,0.1", ["row 2", "point", "tool"]),
        ("0,0,0,0,0,0,flange,0.374,0,0.6995,0.1", ["columns x_mm", "metres", "1000"]),
        (
            "0.5,0,0,0,0,0,flange,374,0,699,0.1\n1,0,0,0,0,0,flange,3,0,699,0.1\n2,0,0,0,0,0,flange,3,0,699,0.1",
            ["radians"],
        ),
        ("0,0,0,0,0,flange,374,0,699.5,0.1", ["row 2", "10 fields"]),
        ("", ["no rows"]),
    ],
)
def test_bad_measurements_are_one_clear_error(tmp_path, line, words):
    path = tmp_path / "measured.csv"
    path.write_text(HEADER + line + "\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_measurements(path)
    for word in [*words, str(path)]:
        assert word in str(caught.value)


def test_poses_outside_the_limits_name_row_and_joint(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(
        HEADER + "0,0,0,0,0,0,flange,374,0,699.5,0.1\n0,120,0,0,0,0,flange,3,0,699.5,0.1\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match="row 3, column q2_deg: 120 deg is outside the limits"):
        er3a.calibrate(load_robot("er3_600"), path)


def test_a_table_of_another_unit_or_seven_joints_is_named(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(HEADER.replace("x_mm", "x_m") + "0,0,0,0,0,0,flange,0.3,0,0.7,0.1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"x_m.*unit"):
        load_measurements(path)
    path.write_text(HEADER.replace("q6_deg", "q6_deg,q7_deg") + "0,0,0,0,0,0,0,flange,3,0,7,0.1\n", encoding="utf-8")
    with pytest.raises(InputError, match="q7_deg"):
        er3a.calibrate(load_robot("er3_600"), path)


def with_pose_errors(
    robot: er3a.Robot, random: np.random.Generator, poses: int, readings: int, deviation: float | None
) -> list[Measurement]:
    """Readings of the bent arm that err by 0.05 mm at each pose, the same each time, and by 0.005 mm besides."""
    rows = measured(bent(robot, random), poses_in(robot, random, poses), 0.05, random)
    every = [(row, row.xyz_mm + random.normal(0, 0.005, 3)) for _ in range(readings) for row in rows]
    return [
        replace(row, row=k, xyz_mm=tuple(xyz.tolist()), deviation_mm=deviation) for k, (row, xyz) in enumerate(every)
    ]


@pytest.mark.long
@pytest.mark.parametrize("deviation", [None, 0.05])
def test_readings_of_one_pose_count_once(deviation, random):
    """Intervals and the errors left out are those of the poses; no term is taken for what a pose errs by."""
    robot = load_robot("er3a_c60")
    rows = with_pose_errors(robot, random, 40, 5, deviation)
    found, once = er3a.calibrate(robot, rows), er3a.calibrate(robot, rows[:40])
    assert (found.poses, found.repeated, found.coordinates) == (40, 160, 120)
    assert not found.beyond
    assert not found.ratios
    widths = [[each.half_width for each in own.estimates] for own in (found, once)]
    assert widths[0] == pytest.approx(widths[1], rel=0.15)
    assert found.left_out.mean_mm == pytest.approx(once.left_out.mean_mm, rel=0.1)
    assert "40 distinct poses" in lines_of(found)


def test_joints_that_read_a_little_otherwise_are_one_pose(random):
    robot = load_robot("er3_600")
    rows = with_pose_errors(robot, random, 5, 3, None)
    rows = [replace(row, pose=tuple(np.add(row.pose, random.uniform(-1, 1, 6) * 1e-3))) for row in rows]
    seen = observed(rows, robot)
    merged = seen.merged()
    assert (seen.poses, len(seen.row_values), merged.poses, len(merged.row_values)) == (5, 15, 5, 5)
    assert merged.values_mm == pytest.approx(seen.values_mm.reshape(3, 15).mean(axis=0))
    assert merged.row_values == pytest.approx(seen.row_values.reshape(3, 5, 6).mean(axis=0))


@pytest.mark.long
@pytest.mark.parametrize(("poses", "deviation"), [(8, 0.05), (8, None), (5, 0.05)])
def test_entries_left_out_widen_the_intervals_of_the_others(poses, deviation, random):
    """As entries that aren't estimated may be off, too; that is no misfit."""
    robot = load_robot("er3a_c60")
    inside = []
    for _ in range(8):
        rows = measured(bent(robot, random), poses_in(robot, random, poses), 0.05, random)
        found = er3a.calibrate(robot, [replace(row, deviation_mm=deviation) for row in rows])
        assert found.level != "all_entries" or "base_x" not in [each.name for each in found.estimates]
        assert found.fits
        inside += [abs(each.correction) <= each.half_width for each in found.estimates if "base" in each.name]
    assert np.mean(inside) > 0.9


def test_one_coordinate_to_spare_settles_nothing(random):
    robot = load_robot("er3a_c60")
    rows = [
        replace(row, deviation_mm=None)
        for row in measured(bent(robot, random), poses_in(robot, random, 30), 0.05, random)
    ]
    numbers = len(er3a.calibrate(robot, rows).estimates)
    short = -(-(numbers + 1) // 3)
    row = replace(rows[short - 1], xyz_mm=(*rows[short - 1].xyz_mm[: 3 - (3 * short - numbers - 1)], None, None)[:3])
    found = er3a.calibrate(robot, [*rows[: short - 1], row])
    assert (found.freedom, len(found.estimates)) == (1, numbers)
    assert found.open == tuple(each.name for each in found.estimates)
    assert "Nothing is settled with one coordinate more" in lines_of(found)


def test_too_few_positions_ask_for_poses_that_settle_more(random):
    robot = load_robot("er3_600")
    q = poses_in(robot, random, 5)
    more = er3a.calibrate(robot, measured(robot, q, 0.05, random)).more
    others = poses_in(robot, random, more.missing)
    found = er3a.calibrate(robot, measured(robot, np.concatenate([q, others]), 0.05, random))
    assert found.level == more.fitted
    assert len(found.estimates) == more.determinable


def test_too_few_positions_are_no_gross_fault(random, monkeypatch):
    robot = load_robot("er3a_c60")
    rows = measured(robot, poses_in(robot, random, 6), 0.05, random)

    def never(*_):
        raise CalibrationError(fact("no_correction_fits", steps=100, rest_mm=9.0), "")

    monkeypatch.setattr(calibration, "fit", never)
    with pytest.raises(CalibrationError) as caught:
        er3a.calibrate(robot, rows)
    assert is_one(caught.value.finding, "more_positions")


@pytest.mark.long
@pytest.mark.parametrize(
    ("convert", "cause", "known"),
    [
        (lambda q: q[:, [0, 1, 2, 3, 5, 4]], fact("columns_swapped", first=5, second=6), True),
        (lambda q: q * [1, 1, 1, 1, -1, 1], fact("turns_other_way", joint=5), False),
    ],
)
def test_swapped_columns_and_a_joints_sign_are_named(convert, cause, known, random, tmp_path):
    tool = np.eye(4)
    tool[:3, 3] = 0.05, 0.02, 0.1
    robot = load_robot("er3a_c60").replace(tool=tool)
    truth, q = bent(robot, random), random.uniform(-1.2, 1.2, (60, 6))
    wrong = convert(q)
    rows = [
        Measurement(k, tuple(np.degrees(own)), "tool", tuple(1000 * T[:3, 3] + random.normal(0, 0.05, 3)), 0.05)
        for k, (own, T) in enumerate(zip(wrong, er3a.forward(truth, q)))
    ]
    rows = rows if known else [replace(row, deviation_mm=None) for row in rows]
    path, header = tmp_path / "measured.csv", HEADER.replace(",standard_deviation_mm", "") if not known else HEADER
    lines = [
        ",".join([*map(str, row.pose), "tool", *map(str, row.xyz_mm), *([str(row.deviation_mm)] if known else [])])
        for row in rows
    ]
    path.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")
    write_robot(robot.replace(name="own"), tmp_path / "own.yaml")
    done = CliRunner().invoke(app, ["calibrate", str(tmp_path / "own.yaml"), str(path)])
    assert done.exit_code == 1
    assert JOINTS[cause.code].format(**cause.params) in done.output
    advised = [replace(row, pose=tuple(own)) for row, own in zip(rows, np.degrees(convert(wrong)).tolist())]
    assert er3a.calibrate(robot, advised).fits


@pytest.mark.long
def test_a_joints_zero_that_is_far_off_is_named(random):
    robot = load_robot("er3a_c60")
    rows = measured(robot, random.uniform(-1, 1, (40, 6)), 0.05, random)
    rows = [replace(row, pose=tuple(np.add(row.pose, [0, 0, 0, 30, 0, 0])), deviation_mm=None) for row in rows]
    found = er3a.calibrate(robot, rows)
    assert found.wrong.entries == ("offset4",)
    assert "offset4" in lines_of(found)


@pytest.mark.parametrize(("size", "words"), [(0.1, "cm. Multiply by 10"), (1 / 25.4, "inches. Multiply by 25.4")])
def test_coordinates_of_another_unit_are_refused(size, words, random, tmp_path):
    robot = load_robot("er3a_c60")
    path = written(tmp_path, robot, random, lambda xyz: np.multiply(xyz, size) + 20.0)
    with pytest.raises(InputError, match=f"times as far apart .* these are {words}"):
        load_measurements(path, robot)


def test_a_frame_may_stand_at_a_measured_point(random, tmp_path):
    robot, seed = load_robot("er3a_c60"), random.integers(1000)
    first = load_measurements(written(tmp_path, robot, np.random.default_rng(seed)))[0].xyz_mm
    path = written(tmp_path, robot, np.random.default_rng(seed), lambda xyz: np.subtract(xyz, first))
    assert load_measurements(path, robot)[0].xyz_mm == (0, 0, 0)
    assert len(er3a.calibrate(robot, path).estimates) > 20


@pytest.mark.long
def test_a_tool_that_was_measured_instead_of_the_flange_is_named(random):
    robot, tool = load_robot("er3a_c60"), np.eye(4)
    tool[:3, 3] = 0.015, 0.0, 0.101
    q = random.uniform(-1, 1, (60, 6))
    points = 1000 * er3a.forward(robot.replace(tool=tool), q)[:, :3, 3] + random.normal(0, 0.05, (60, 3))
    rows = [
        Measurement(k, tuple(pose), "flange", tuple(xyz), None)
        for k, (pose, xyz) in enumerate(zip(np.degrees(q), points))
    ]
    found = er3a.calibrate(robot, rows)
    assert "d6" in found.wrong.entries
    assert not found.fits
