"""Measured points: base, tool and standard deviation are found with the table, terms beyond it only where they are, and
what is no noise is said."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.optimize import least_squares
from typer.testing import CliRunner

import er3a
from er3a.calibration.clustered import clustered_covariance
from er3a.calibration.fit import Fit
from er3a.calibration.held_back import held_back_findings
from er3a.calibration.observations import Measurement, PointObservations, spread
from er3a.calibration.parameters import CalibrationError, coupled, settles
from er3a.calibration.terms import JointErrors, JointTerm, candidates, starting_table
from er3a.errors import Er3aError, InputError
from er3a.files.by_name import load_measurements
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.finding import fact
from er3a.geometry.transforms import rot_x, rot_y, translation
from er3a.kinematics.chain import row_values
from er3a.pipeline.cli import app
from er3a.pipeline.messages.calibration import calibration_record, idle_texts, lines_of
from er3a.pipeline.messages.say import say
from er3a.robots.joint_limits import shown
from testing.plain_calibration import MeasuredArm, distances, measured_arm, plain_fit, positions
from testing.real_arms import MEASUREMENTS, load

TOOL = translation(0.05, 0.02, 0.1)


def sliding_arm() -> er3a.Robot:
    limits = np.array([2.5, 1.5, 0.4, 2.5, 1.8, 3.0])
    return load_robot("er3_600").replace(
        convention="standard",
        a=np.array([0.1, 0.3, 0, 0, 0, 0]),
        alpha=np.radians([-90, 90, 0, -90, 90, 0]),
        d=np.array([0.4, 0.1, 0.3, 0.2, 0, 0.1]),
        direction=np.ones(6),
        offset=np.zeros(6),
        lower=-limits,
        upper=limits,
        sliding=np.arange(6) == 2,
        envelopes=(),
        coupling=None,
        combined=(),
    )


def gantry() -> er3a.Robot:
    """Three slides along z, y and x, and a wrist that turns about z."""
    return er3a.Robot.from_dh(
        np.zeros(4),
        np.radians([-90, 90, 90, 0]),
        [0, 0, 0, -0.2],
        offset=[0, np.pi / 2, 0, 0],
        lower=[-1, -1, -1, -3.0],
        upper=[1, 1, 1, 3.0],
        sliding=[True, True, True, False],
    )


ARMS = {"six": lambda: load_robot("er3_600"), "seven": lambda: load_robot("lbr_iiwa_14"), "slide": sliding_arm}


def four() -> er3a.Robot:
    """Its longest length lies along the tool's z, which moves all points alike."""
    limits = np.array([2.8, 2.5, 2.5, 2.8])
    return er3a.Robot.from_dh(
        [0.05, 0.3, 0.05, 0], np.radians([-90, 0, -90, 0]), [0.3, 0.02, 0, 0.4], lower=-limits, upper=limits
    )


def planar() -> er3a.Robot:
    return er3a.Robot.from_dh([0.4, 0.3, 0.2], np.zeros(3), [0.1, 0, 0], lower=[-2.8] * 3, upper=[2.8] * 3)


TOUCHING = ARMS | {"gantry": gantry, "four": four, "planar": planar}


class Bench:
    """An arm that differs from its table in all it can, with errors of joints, seen with noise."""

    def __init__(self, name: str, random: np.random.Generator, errors: dict[JointTerm, list[float]] | None = None):
        self.robot, self.random = TOUCHING[name]().replace(tool=TOOL), random
        joints = self.robot.rows
        self.truth = self.robot.replace(
            a=self.robot.a + random.normal(0, 5e-4, joints),
            d=self.robot.d + random.normal(0, 5e-4, joints),
            alpha=self.robot.alpha + random.normal(0, 1e-3, joints),
            offset=self.robot.offset + random.normal(0, 2e-3, joints),
            base=translation(0.003, -0.002, 0.001) @ rot_x(0.004) @ rot_y(-0.003),
            tool=translation(0.002, 0.001, -0.002) @ TOOL,
        )
        errors = errors or {}
        self.errors = JointErrors(self.robot, tuple(errors), np.array([c for each in errors.values() for c in each]))

    def joints(self, count: int) -> np.ndarray:
        return self.random.uniform(
            np.maximum(self.robot.lower, -2), np.minimum(self.robot.upper, 2), (count, self.robot.joints)
        )

    def positions(self, q: np.ndarray) -> np.ndarray:
        """Where the points really are, mm."""
        points = np.broadcast_to(TOOL[:3, 3], (len(q), 3))
        return er3a.forward(self.truth, q + self.errors.amounts(q, points))[:, :3, 3] * 1000

    def measured(self, count: int, noise_mm: float, out: tuple[int, ...] = ()) -> list[Measurement]:
        q = self.joints(count)
        xyz = self.positions(q) + self.random.normal(0, noise_mm, (count, 3))
        xyz[list(out)] += 20 + 20 * noise_mm
        poses = shown(self.robot, q).tolist()
        return [Measurement(k + 2, tuple(p), "tool", tuple(x)) for k, (p, x) in enumerate(zip(poses, xyz.tolist()))]

    def error(self, found) -> float:
        """Mean distance at new poses between the model and where the points really are, mm."""
        q = self.joints(200)
        return float(np.linalg.norm(found.forward(q)[:, :3, 3] * 1000 - self.positions(q), axis=1).mean())


@pytest.mark.long
@pytest.mark.parametrize(("name", "noise"), list(zip(ARMS, [0.1, 0.01, 2.0], strict=True)))
def test_base_tool_table_and_deviation_are_found_and_no_term_that_is_not_there(name, noise, random):
    bench = Bench(name, random)
    out = (3, 77, 150)
    found = er3a.calibrate(bench.robot, bench.measured(200, noise, out))
    assert found.level == "all_entries"
    assert found.beyond is None
    assert found.tried
    assert found.deviation_mm == pytest.approx(noise, rel=0.15)
    assert [each.row for each in found.outliers] == [k + 2 for k in out]
    assert bench.error(found) < 0.6 * noise
    assert found.left_out.mean_mm == pytest.approx(2 * np.sqrt(2 / np.pi) * noise, rel=0.25)


@pytest.mark.parametrize("tool_off", [0.0, 0.136, 0.833])
def test_a_tracker_s_frame_and_the_tool_may_be_anywhere(tool_off, random):
    bench = Bench("six", random)
    bench.robot = bench.robot.replace(tool=translation(*tool_off * np.array([0.6, 0.48, -0.64])) @ TOOL)
    bench.truth = bench.truth.replace(base=translation(3, -1.5, 0.9) @ rot_x(2.0) @ rot_y(1.1) @ bench.truth.base)
    found = er3a.calibrate(bench.robot, bench.measured(36, 0.1))
    assert found.level == "all_entries"
    assert found.deviation_mm == pytest.approx(0.1, rel=0.2)
    assert bench.error(found) < 0.15


TERMS = [
    (JointTerm("ratio", 2), [2e-3]),
    (JointTerm("once", 4), [1e-3, 1e-3]),
    (JointTerm("twice", 2), [1.5e-3, 0.0]),
    (JointTerm("sag", 2), [3e-3]),
    (JointTerm("ripple", 1, 26), [2e-4, 1e-4]),
]


def test_a_joint_that_slides_has_no_turns_but_may_sag():
    kinds = {joint: {term.kind for term in candidates(sliding_arm()) if term.joint == joint} for joint in (2, 3)}
    assert kinds == {2: {"ratio", "once", "twice", "sag", "coupling"}, 3: {"ratio", "sag", "coupling"}}


@pytest.mark.long
@pytest.mark.parametrize(("name", "term"), list(zip(cycle(ARMS), range(len(TERMS)))))
def test_a_term_that_is_there_is_found_and_no_other(name, term, random):
    own, coefficients = TERMS[term]
    bench = Bench(name, random, {own: coefficients})
    found = er3a.calibrate(bench.robot, bench.measured(200, 0.05))
    assert [(each.kind, each.joint, each.turns) for each in found.beyond.terms] == [(own.kind, own.joint, own.turns)]
    for value, true, error in zip(
        found.beyond.terms[0].coefficients, coefficients, found.beyond.terms[0].standard_errors
    ):
        assert value == pytest.approx(1000 * true, abs=5 * error)
    assert bench.error(found) < 0.04
    assert found.beyond.deviation_mm == pytest.approx(0.05, rel=0.15)


@pytest.mark.long
def test_a_large_sag_is_no_smaller_than_its_interval_says(random):
    """A coefficient of several times its usual size, in an arm that is measured finely."""
    bench = Bench("slide", random, {JointTerm("sag", 2): [6e-3]})
    found = er3a.calibrate(bench.robot, bench.measured(200, 0.015))
    (term,) = found.beyond.terms
    assert term.coefficients[0] == pytest.approx(6, abs=3 * term.standard_errors[0])
    assert found.beyond.deviation_mm == pytest.approx(0.015, rel=0.1)


@pytest.mark.long
def test_a_load_that_lifts_the_arm_is_no_sag(random):
    bench = Bench("six", random, {JointTerm("sag", 2): [-3e-3]})
    found = er3a.calibrate(bench.robot, bench.measured(200, 0.05))
    assert ("sag", 2) not in [(each.kind, each.joint) for each in found.beyond.terms if found.beyond]


@pytest.mark.long
def test_what_is_a_choice_between_base_tool_and_table_is_said(random):
    bench = Bench("seven", random)
    rows = bench.measured(60, 0.05)
    free = er3a.calibrate(bench.robot, rows)
    assert fact("not_told_apart", entries=("offset1", "base_rz"), parallel_joints=None) in free.held
    names = {each.name for each in er3a.calibrate(bench.robot, rows, fixed=["base", "tool"]).estimates}
    assert {"d1", "offset1"} <= names
    assert not any(name.startswith(("base", "tool")) for name in names)
    with pytest.raises(Er3aError, match="fixed is the text 'base'"):
        er3a.calibrate(bench.robot, rows, fixed="base")


def test_a_coordinate_that_was_never_measured_leaves_open_what_moves_it_alone(random):
    """Positions of a planar arm in its plane, as a camera above sees them."""
    bench = Bench("planar", random)
    rows = [replace(row, xyz_mm=(*row.xyz_mm[:2], None)) for row in bench.measured(60, 0.02)]
    found = er3a.calibrate(bench.robot, rows)
    corrections = {each.name: each for each in found.estimates}
    for k in range(2):
        own = corrections[f"a{k + 1}"]
        assert own.correction == pytest.approx(1000 * (bench.truth.a - bench.robot.a)[k], abs=0.1)
    assert {fact("moves_nothing", entry="base_z"), fact("moves_nothing", entry="d1")} <= set(found.held)
    assert found.more is None


def test_a_stated_deviation_is_kept(random):
    bench = Bench("six", random)
    rows = [Measurement(r.row, r.pose, r.point, r.xyz_mm, 0.5) for r in bench.measured(60, 0.05)]
    found = er3a.calibrate(bench.robot, rows)
    assert found.deviation_mm is None
    assert found.scatter < 0.2


def test_another_number_of_joints_or_unit_is_one_clear_error(tmp_path, random):
    bench = Bench("slide", random)
    path = tmp_path / "slide.csv"
    path.write_text("q1_deg,q2_deg,q3_mm,point,x_mm,y_mm,z_mm\n1,2,300,tool,400,0,0\n", encoding="utf-8")
    assert load_measurements(path)[0].pose == (1.0, 2.0, 300.0)
    with pytest.raises(InputError, match="q4_deg: missing"):
        er3a.calibrate(bench.robot, path)
    path.write_text(
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,point,x_mm,y_mm,z_mm\n1,2,3,4,5,6,tool,400,0,0\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match=r"q3_deg.*q3_mm"):
        er3a.calibrate(bench.robot, path)
    with pytest.raises(InputError, match=r"2 joint values; .* has 7 joints"):
        er3a.calibrate(load_robot("lbr_iiwa_14"), [Measurement(2, (0.0, 1.0), "tool", (1.0, 2.0, 3.0))])


@pytest.mark.long
@pytest.mark.parametrize(("name", "model_mm"), [("wam", 2.05)])  # the campaign on real arms has more
def test_real_arms_at_poses_left_out_are_met_as_by_a_fit_without_er3a(name, model_mm):
    robot, rows = load(name)
    out = np.arange(len(rows)) % 5 == 2
    used = [row for row, left in zip(rows, out) if not left]
    found, alone = er3a.calibrate(robot, used), er3a.calibrate(robot, used, ["ratios"])
    others = [row for row, left in zip(rows, out) if left]
    arm = measured_arm(MEASUREMENTS / f"{name}.yaml", MEASUREMENTS / f"{name}.csv")
    plain = distances(arm, plain_fit(arm, ~out), out).mean()
    table, model = found.without_terms().distances_mm(others).mean(), found.distances_mm(others).mean()
    no_ratios = alone.without_terms().distances_mm(others).mean()
    assert alone.robot.coupling is None
    assert no_ratios == pytest.approx(plain, rel=0.03)
    assert table < 0.99 * no_ratios
    assert model < min(table, model_mm)
    predicted = found.forward(np.radians([row.pose for row in others]))[:, :3, 3] * 1000
    np.testing.assert_allclose(
        np.linalg.norm(predicted - [row.xyz_mm for row in others], axis=1), found.distances_mm(others), atol=1e-9
    )


@pytest.mark.long
def test_the_command_tells_positions_held_back(tmp_path):
    lines = (MEASUREMENTS / "wam.csv").read_text(encoding="utf-8").splitlines()
    used, held = tmp_path / "used.csv", tmp_path / "held.csv"
    used.write_text("\n".join([lines[0], *lines[21:]]) + "\n", encoding="utf-8")
    held.write_text("\n".join(lines[:21]) + "\n", encoding="utf-8")
    words = ["calibrate", str(MEASUREMENTS / "wam.yaml"), str(used), "--held-back", str(held)]
    record = tmp_path / "mine.json"
    record.write_text(CliRunner().invoke(app, [*words, "--json"]).stdout, encoding="utf-8")
    found, robot = json.loads(record.read_text(encoding="utf-8")), load_robot(MEASUREMENTS / "wam.yaml")
    assert found["held_back"]["positions"] == 20
    assert found["held_back"]["mean_mm"] < 3
    assert found["output"] is None
    text = CliRunner().invoke(app, [*words, "--output", str(tmp_path / "mine.yaml")]).stdout
    assert f"held back: 20 positions, {found['held_back']['mean_mm']:.4g} mm off on average" in text
    assert f"at worst (row {found['held_back']['worst_row']})" in text
    assert found["beyond"]["standard_deviation_mm"] < found["standard_deviation_mm"]
    assert text.startswith(f"the whole model errs at poses left out by {found['beyond']['left_out']['mean_mm']:.4g} mm")
    assert found["held_back"]["table_mean_mm"] > found["held_back"]["mean_mm"]
    assert f"the robot file alone errs at poses left out by {found['left_out']['mean_mm']:.4g} mm" in text
    assert text.index("mine_model.json: written; the whole model: er3a.load_calibration") < text.index("mine.yaml: wri")
    written = json.loads((tmp_path / "mine_model.json").read_text(encoding="utf-8"))
    assert written | {"output": None} == found
    words = ["predict", str(tmp_path / "mine_model.json"), str(held), "--robot", str(MEASUREMENTS / "wam.yaml")]
    assert f"er3a {' '.join(words).replace(str(held), 'JOINTS.csv')}" in text
    printed = list(csv.DictReader(CliRunner().invoke(app, words).stdout.splitlines()))
    by_command = np.array([[float(line[f"{c}_mm"]) for c in "xyz"] for line in printed])
    assert by_command == pytest.approx(np.array([each["xyz_mm"] for each in found["held_back"]["rows"]]), abs=1e-5)
    mine, rows = load_robot(tmp_path / "mine.yaml"), load_measurements(held, robot)
    model, q = er3a.load_calibration(record, robot), np.radians([row.pose for row in rows])
    for name, T in (("xyz_mm", model.forward(q)), ("table_xyz_mm", er3a.forward(mine, q))):
        said = np.array([each[name] for each in found["held_back"]["rows"]])
        assert 1000 * T[:, :3, 3] == pytest.approx(said, abs=1e-6)
    assert model.distances_mm(rows).max() == pytest.approx(found["held_back"]["worst_mm"], abs=1e-6)
    with pytest.raises(InputError, match="start, a: the calibration did not start from mine's a"):
        er3a.load_calibration(record, mine)
    with pytest.raises(InputError, match="is not a calibration file"):
        er3a.load_calibration(tmp_path / "mine.yaml", robot)


def test_a_table_of_which_nothing_is_settled_is_not_written(tmp_path, random):
    """Three positions in a tracker's frame: their fit takes lengths of metres for what its place does."""
    robot = load_robot("er3_600")
    q = random.uniform(-1, 1, (3, 6))
    T = translation(1.5, -0.4, 0.3) @ rot_x(0.1) @ rot_y(1.0) @ er3a.forward(robot, q)
    rows = [",".join(map(str, [*np.degrees(one), "flange", *xyz])) for one, xyz in zip(q, 1000 * T[:, :3, 3])]
    header = ",".join([f"q{k}_deg" for k in range(1, 7)] + ["point", "x_mm", "y_mm", "z_mm"])
    (tmp_path / "three.csv").write_text("\n".join([header, *rows]) + "\n")
    words = ["calibrate", "er3_600", str(tmp_path / "three.csv"), "--output", str(tmp_path / "mine.yaml")]
    done = CliRunner().invoke(app, words)
    assert "settle 0 of" in done.output
    assert isinstance(done.exception, Er3aError)
    assert "not written, as these measurements settle none of the table's numbers" in str(done.exception)
    assert not list(tmp_path.glob("mine*"))


def bare_record(robot: er3a.Robot) -> dict:
    term = {"kind": "once", "joint": 2, "turns": 0, "by": 0, "coefficients": [1.0, 2.0]}
    entry = {"name": "d1", "nominal": 1000 * robot.d[0], "correction": 2.0}
    return {"start": starting_table(robot), "entries": [entry], "ratios": [term], "beyond": None}


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda found: found["entries"].insert(0, {"name": "foo1", "correction": 0.1}), "entries"),
        (lambda found: found["entries"].insert(0, {"name": "1d", "correction": 0.1}), "entries"),
        (lambda found: found["entries"][0].update(name="d7"), "entries"),
        (lambda found: found["entries"][0].update(correction=np.nan), "not finite"),
        (lambda found: found["ratios"][0].update(joint=7), "terms"),
        (lambda found: found["ratios"][0].update(kind="coupling", by=7, coefficients=[1.0]), "terms"),
        (lambda found: found["ratios"][0].update(kind="play"), "terms"),
        (lambda found: found["ratios"][0].update(coefficients=[1.0]), "terms"),
        (lambda found: found.pop("start"), "is not a calibration file"),
    ],
)
def test_a_calibration_that_says_what_no_arm_has_is_refused(tmp_path, change, field):
    robot, file = load_robot("er3_600"), tmp_path / "mine.json"
    record = bare_record(robot)
    file.write_text(json.dumps(record), encoding="utf-8")
    q = np.full(6, 0.3)
    x = row_values(robot, q[None])[0].copy()
    x[1] += 1e-3 * np.sin(x[1]) + 2e-3 * np.cos(x[1])
    right = er3a.forward(robot.replace(d=robot.d + 0.002 * (np.arange(6) == 0), coupling=None), x)
    np.testing.assert_allclose(er3a.load_calibration(file, robot).forward(q), right, atol=1e-12)
    change(record)
    file.write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(InputError, match=field):
        er3a.load_calibration(file, robot)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("base", translation(0, 0, 0.1)),
        ("alpha", np.full(6, 0.1)),
        ("direction", -np.ones(6)),
        ("coupling", 2 * np.eye(6)),
        ("convention", "modified"),
    ],
)
def test_a_calibration_of_another_table_is_refused(tmp_path, name, value):
    robot, file = load_robot("er3_600"), tmp_path / "mine.json"
    file.write_text(json.dumps(bare_record(robot)), encoding="utf-8")
    with pytest.raises(InputError, match=f"start, {name}"):
        er3a.load_calibration(file, robot.replace(**{name: value}))


def test_an_interval_settles_a_table_whose_lengths_are_all_strokes():
    arm = gantry().replace(d=np.zeros(4))
    assert settles(arm, "mm", 1.0)
    assert not settles(arm, "mm", 400.0)


@pytest.mark.long
def test_held_back_positions_that_contradict_the_fit_are_told_first(random):
    """Others of the same arm; the same from 3 mm beside, as of another frame or tool point; and far from all fitted."""
    bench = Bench("six", random)
    rows = bench.measured(40, 0.05)
    found = er3a.calibrate(bench.robot, rows)
    inside = [each for each in bench.measured(20, 0.05) if np.abs(each.pose).max() < 100]
    beside = [replace(each, xyz_mm=tuple(np.add(each.xyz_mm, (3, 0, 0)))) for each in inside]

    def codes(fitted, others):
        return [each.code for each in held_back_findings(found, fitted, others)]

    assert codes(rows, inside) == []
    (against,) = held_back_findings(found, rows, beside)
    assert (against.code, against.count) == ("held_back_contradict", len(inside))
    assert against.mean_mm == pytest.approx(3.0, abs=0.2)
    assert lines_of(found, rows, beside).startswith(say(against))
    assert calibration_record(found, bench.robot, rows, beside)["held_back_warning"] == say(against)
    assert codes(rows, rows[:5]) == ["held_back_all_fitted"]
    assert codes(rows, [*rows[:5], *beside]) == ["held_back_fitted", "held_back_contradict"]
    near = [each for each in rows if each.pose[0] < 0]
    assert codes(near, [each for each in beside if each.pose[0] > 0]) == ["held_back_elsewhere"]


@pytest.mark.long
def test_two_lines_whose_points_are_swapped_are_set_aside(random):
    """They are so far out that no fit of all lines ends."""
    bench = Bench("six", random)
    rows = bench.measured(60, 0.05)
    far = max(range(1, 60), key=lambda k: np.linalg.norm(np.subtract(rows[k].xyz_mm, rows[0].xyz_mm)))
    points = rows[0].xyz_mm, rows[far].xyz_mm
    rows[0], rows[far] = replace(rows[0], xyz_mm=points[1]), replace(rows[far], xyz_mm=points[0])
    found = er3a.calibrate(bench.robot, rows)
    assert [each.row for each in found.outliers] == [2, far + 2]
    assert bench.error(found) < 0.1


def reached(bench: Bench, target: np.ndarray, normal: np.ndarray | None, count: int, length: float = 0.0) -> np.ndarray:
    """Joint values (count, 6) at which the real arm touches a point, m, or the plane through it; or is at a length from
    the point, in the plane if there is one."""
    found: list[np.ndarray] = []
    while len(found) < count:
        q = bench.joints(1)[0]
        for _ in range(60):
            off = target - er3a.forward(bench.truth, q)[:3, 3]
            across = np.zeros(3) if normal is None else normal * (off @ normal)
            if length:
                off = off - length * (off - across) / np.linalg.norm(off - across)
            elif normal is not None:
                off = across
            if np.linalg.norm(off) < 1e-12:
                break
            q = q + np.linalg.pinv(er3a.jacobian(bench.truth, q)[:3]) @ off * min(1.0, 0.1 / np.linalg.norm(off))
            q = np.clip(q, bench.truth.lower, bench.truth.upper)
        else:
            continue
        if (q > bench.truth.lower).all() and (q < bench.truth.upper).all():
            found.append(q)
    return np.array(found)


TOUCHED = {
    "place": [([0.4, 0.1, 0.3], None), ([0.3, -0.25, 0.5], None)],
    "plane": [([0.4, 0.1, 0.2], [0, 0, 1.0]), ([0.5, 0.1, 0.2], [1.0, 0, 0]), ([0.5, 0.3, 0.2], [0, 1.0, 0])],
}


@pytest.mark.long
@pytest.mark.parametrize(("kind", "arm"), [("place", "six"), ("plane", "gantry")])
def test_what_is_touched_at_unknown_places_corrects_a_table(kind, arm, random, tmp_path):
    """A joint that slides meanwhile sets the scale, else a length that nothing stands for; a touch that missed is set
    aside, and no other. Planes stay planes by whatever angles a gantry's slides are at, and come to one where these are
    not held."""
    bench = Bench(arm, random)
    columns = [f"q{k}_{'mm' if slides else 'deg'}" for k, slides in enumerate(bench.robot.slides, 1)]
    lines = [",".join([*columns, "point,x_mm,y_mm,z_mm,place,plane"])]
    for number, (target, normal) in enumerate(TOUCHED[kind]):
        q = reached(bench, np.array(target), None if normal is None else np.array(normal), 80)
        q = q + random.normal(0, 2e-5, q.shape)
        q[7, 0] += 0.03 * (kind == "place" and number == 0)
        q = shown(bench.robot, q)
        name = f"{kind}{number}," if kind == "place" else f",{kind}{number}"
        lines += [",".join(map(repr, row)) + f",tool,,,,{name}" for row in q.tolist()]
    path = tmp_path / "touched.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = er3a.calibrate(bench.robot, path)
    held = {each.code for each in found.held}
    assert ("sets_scale" in held) == (arm == "six")
    assert [each.row for each in found.outliers] == ([9] if kind == "place" else [])
    assert not any(each.name.startswith("base") for each in found.estimates)
    spread = []
    for robot in (bench.robot, found.robot):
        at = er3a.forward(robot, reached(bench, np.array([0.35, 0.2, 0.35]), None, 60))[:, :3, 3] * 1000
        spread.append(np.linalg.norm(at - at.mean(axis=0), axis=1).mean())
    assert spread[1] < 0.03 < 0.5 < spread[0]
    if arm != "six":  # a3 acts there as a2 does
        return
    truth = {"a": bench.truth.a, "d": bench.truth.d, "alpha": bench.truth.alpha, "offset": bench.truth.offset}
    (scale,) = (each.entry for each in found.held if each.code == "sets_scale")
    ratio = getattr(bench.robot, scale[0])[int(scale[1:]) - 1] / truth[scale[0]][int(scale[1:]) - 1]
    for each in found.estimates:
        if each.name in ("a2", "a3"):
            true = truth["a"][each.parameter.joint - 1] * ratio * 1000
            assert each.nominal + each.correction == pytest.approx(true, abs=3 * each.half_width)


@pytest.mark.long
def test_touches_that_quite_another_arm_meets_better_settle_nothing():
    """A slide and two joints, four touches of each ball, seen with 1 mm: least squares ran off to a tool of metres, and
    the table was refused as another arm's; elsewhere it took terms, or entries with intervals of 0."""
    random, tool, rows = np.random.default_rng(0), translation(0.03, 0.05, 0.12), []
    low, high = [0.05, -2.4, -2.4], [0.5, 2.4, 2.4]
    robot = er3a.Robot.from_dh(
        [0.1, 0.45, 0.3], [np.pi / 2, 0.3, 0], [0.2, 0.1, 0.08], lower=low, upper=high, sliding=[True, False, False]
    ).replace(tool=tool)
    true = robot.replace(alpha=robot.alpha + np.array([4e-3, 0, 0]))
    for number in range(34):
        at = er3a.forward(true, random.uniform(low, high))[:3, 3]
        for aim in at + random.normal(0, 1e-3, (4, 3)):
            off = lambda q, aim=aim: er3a.forward(true, q)[:3, 3] - aim  # noqa: E731
            found = least_squares(
                off, random.uniform(low, high), bounds=(low, high), max_nfev=60, xtol=1e-12, ftol=1e-14
            )
            if np.abs(found.fun).max() < 1e-8:
                pose = (1000 * found.x[0], *np.degrees(found.x[1:]).tolist())
                rows.append(Measurement(0, pose, "tool", (None,) * 3, place=str(number)))
    found = er3a.calibrate(robot, rows)
    assert found.beyond is None
    assert found.ratios == ()
    assert found.conclusion.code == "no_correction_found"
    assert set(found.open) == {each.name for each in found.estimates}


def test_a_calibration_s_own_poses_are_within_the_limits():
    """Poses in whole 5 deg were refused beside limits between these."""
    robot = load_robot("er3_600")
    robot = robot.replace(lower=np.radians(np.full(6, -154.7)), upper=np.radians(np.full(6, 154.7)))
    assert np.abs(spread(robot)).max() == pytest.approx(154.7)


def test_touches_that_no_entry_moves_are_refused():
    """A flange on the axes of all joints: nothing moves it, and there is nothing to fit."""
    random = np.random.default_rng(0)
    robot = er3a.Robot.from_dh([0, 0, 0], [0, 0, 0], [0.4, 0.3, 0.2])
    poses = np.degrees(random.uniform(-2, 2, (80, 3))).tolist()
    rows = [Measurement(0, tuple(q), "flange", (None,) * 3, plane=str(k % 2)) for k, q in enumerate(poses)]
    with pytest.raises(CalibrationError, match="no entry of the table moves"):
        er3a.calibrate(robot, rows)


def test_touches_of_joints_that_turn_points_in_one_plane_are_refused(random):
    """J2, J3 and J5 of six joints, one way up and the other, touch places in the plane of the upper arm."""
    bench, rows, middle = Bench("six", random), [], [1, 2, 4]
    for number in range(30):
        q = np.array([0.3, -0.4, 0.5, 0, 0.6, 0]) + random.uniform(-0.4, 0.4, 6) * np.isin(np.arange(6), middle)
        target = er3a.forward(bench.robot, q)[:3, 3]
        for turn in (0, 0.15, 0.3):
            own = q + turn * np.eye(6)[4]
            for _ in range(20):
                J = er3a.jacobian(bench.robot, own)[:3, 1:3]
                own[1:3] += np.linalg.lstsq(J, target - er3a.forward(bench.robot, own)[:3, 3], rcond=None)[0]
            rows.append(Measurement(0, tuple(np.degrees(own).tolist()), "tool", (None,) * 3, place=str(number)))
    with pytest.raises(InputError, match="take all points in one plane"):
        er3a.calibrate(bench.robot, rows)


@pytest.mark.parametrize("name", ["six", "planar"])
def test_points_without_noise_are_met_without_outliers_terms_or_warnings(name, random):
    bench = Bench(name, random)
    for truth in (bench.robot, bench.robot.replace(a=bench.robot.a + 1e-4)):
        bench.truth = truth
        found = er3a.calibrate(bench.robot, bench.measured(60, 0.0))
        assert found.outliers == found.ratios == ()
        assert found.beyond is None
        assert found.deviation_mm < 1e-9
        assert np.isfinite([each.half_width for each in found.estimates]).all()


@pytest.mark.parametrize("kind", ["place", "plane"])
def test_small_shifts_change_what_is_observed_by_its_derivative(kind, random):
    """Of points at a place, and in a plane."""
    away = random.normal(size=(20, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    on = {"place": 0 * away, "plane": away * [1, 1, 0]}[kind] + [0.4, 0.1, 0.2]
    whole = np.ones((20, 3), bool)
    whole[:, 1:] = kind == "place"
    seen = PointObservations(
        on,
        whole[:, 0],
        whole,
        np.zeros(whole.sum()),
        np.ones(whole.sum()),
        False,
        np.arange(20),
        (),
        np.zeros(20, int),
        np.tile(np.eye(3), (20, 1, 1)),
        (kind,),
    )
    shift, step = random.normal(size=(20, 3)), 1e-6
    slope = (seen.relative(on + step * shift) - seen.relative(on - step * shift)) / (2 * step)
    np.testing.assert_allclose(slope[whole], seen.relative_shift(shift, on)[whole], atol=1e-4)


def test_a_touch_beside_coordinates_is_one_clear_error(tmp_path):
    path = tmp_path / "touched.csv"
    path.write_text("q1_deg,point,x_mm,y_mm,z_mm,place,plane\n10,tool,1,2,300,ball,\n", encoding="utf-8")
    with pytest.raises(InputError, match="row 2, column place"):
        load_measurements(path)


def test_intervals_rest_on_as_many_degrees_of_freedom_as_two_means_have():
    """Welch's degrees of freedom of two groups' difference, at equal variances."""
    first, second = 4, 30
    J = np.column_stack([np.ones(first + second), np.arange(first + second) < first])
    rest = np.random.default_rng(1).normal(size=(first + second))
    off = rest - J @ np.linalg.lstsq(J, rest, rcond=None)[0]
    every = np.arange(first + second)
    found = Fit((), (), np.zeros(2), np.zeros(0), rest, off, J, off, np.ones(len(every)), every)
    covariance, freedom = clustered_covariance(J, off, found.covariance, every)
    variances = rest[:first].var(ddof=1) / first, rest[first:].var(ddof=1) / second
    assert covariance[1, 1] == pytest.approx(sum(variances))
    shares = 1 / (first**2 * (first - 1)), 1 / (second**2 * (second - 1))
    assert freedom == pytest.approx([second - 1, (1 / first + 1 / second) ** 2 / sum(shares)])


@pytest.mark.long
def test_two_poses_at_a_place_count_once(random):
    """An arm of three joints has few poses at a place: corrections, deviation and intervals are those of a fit without
    er3a to the differences of the two."""
    a, alpha, d, tool = [0.05, 0.4, 0.35], np.radians([-90, 0, 0]), [0.4, 0.02, 0], [0.03, 0.02, 0.05]
    robot = er3a.Robot.from_dh(a, alpha, d, tool=translation(*tool), lower=[-3.1] * 3, upper=[3.1] * 3)
    truth, q = robot.replace(alpha=alpha + np.array([1e-3, -8e-4, 0]), offset=np.array([0, 2e-3, 0])), []
    for one in random.uniform([-3, -1, -1.6], [3, 1, -0.6], (45, 3)):
        target, other = er3a.forward(truth, one)[:3, 3] + random.normal(0, 3e-5, 3), one * [1, 1, -1]
        other[1] += 2 * np.arctan2(0.35 * np.sin(one[2]), 0.4 + 0.35 * np.cos(one[2]))
        for _ in range(20):
            off = target - er3a.forward(truth, other)[:3, 3]
            other = other + np.linalg.solve(er3a.jacobian(truth, other)[:3], off)
        q += [one, other]
    rows = [
        Measurement(k, tuple(pose), "tool", (None,) * 3, place=f"p{k // 2}")
        for k, pose in enumerate(np.degrees(q).tolist())
    ]
    found, stated = er3a.calibrate(robot, rows), er3a.calibrate(robot, [replace(r, deviation_mm=0.02) for r in rows])
    arm = MeasuredArm(1000 * robot.a, robot.alpha, 1000 * robot.d, 1000 * robot.tool[:3, 3], np.array(q), np.empty(0))
    names = [f"base_{k}" for k in range(6)] + [f"tool_{c}" for c in "xyz"]
    names += [f"{column}{k}" for column in ("a", "d", "alpha", "beta", "offset") for k in (1, 2, 3)]
    own = [names.index(each.name) for each in found.estimates]

    def apart(values: np.ndarray) -> np.ndarray:
        numbers = np.zeros(len(names))
        numbers[own] = values
        return np.diff(positions(arm, numbers, arm.q).reshape(-1, 2, 3), axis=1).ravel() / np.sqrt(2)

    plain = least_squares(apart, np.zeros(len(own)), xtol=1e-12, ftol=1e-12)
    in_unit = np.array([1.0 if each.unit == "mm" else 180 / np.pi / 1000 for each in found.estimates])
    errors = in_unit * np.sqrt(np.diag(np.linalg.inv(plain.jac.T @ plain.jac)))
    deviation = np.sqrt(2 * plain.cost / (3 * 45 - len(own)))
    assert ([e.correction for e in found.estimates] - in_unit * plain.x) / (deviation * errors) == pytest.approx(
        0, abs=0.01
    )
    np.testing.assert_allclose([e.standard_error for e in stated.estimates], 0.02 * errors, rtol=1e-3)
    assert found.deviation_mm == pytest.approx(deviation, rel=1e-4)
    C, middle = np.linalg.inv(plain.jac.T @ plain.jac), 0
    for J, rest in zip(plain.jac.reshape(45, 3, -1), plain.fun.reshape(45, 3)):
        push = J.T @ np.linalg.inv(sqrtm(np.eye(3) - J @ C @ J.T)) @ rest
        middle = middle + np.outer(push, push)
    by_places = in_unit * np.sqrt(np.diag(C @ middle @ C))
    np.testing.assert_allclose([e.standard_error for e in found.estimates], by_places, rtol=0.01)
    assert found.left_out.mean_mm == pytest.approx(2 * np.sqrt(2 / np.pi) * deviation, rel=0.15)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "count", "least"), [("place", 1, 3), ("plane", 2, 7), ("plane", 60, None)])
def test_too_few_touches_say_how_many_it_takes(kind, count, least, random):
    """A thing that is touched too seldom beside others is named, and changes nothing."""
    rows = [
        Measurement(k, tuple(pose), "tool", (None,) * 3, **{kind: "own"})
        for k, pose in enumerate(random.uniform(-30, 30, (count, 6)).tolist())
    ]
    robot = load_robot("er3_600")
    if least:
        with pytest.raises(CalibrationError) as refused:
            er3a.calibrate(robot, rows)
        assert refused.value.finding.each == ((kind, 1, least),)
        assert str(least) in say(refused.value.finding)
        return
    lone = replace(rows[0], plane="lone"), replace(rows[9], plane="lone")
    found = er3a.calibrate(robot, [*rows, *lone])
    assert idle_texts(found) == ["plane lone: 2 poses; 4 needed"]
    alone = [each.correction for each in er3a.calibrate(robot, rows).estimates]
    assert [each.correction for each in found.estimates] == pytest.approx(alone, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(("name", "term", "poses"), [("seven", 0, 70), ("six", 1, 70)])
def test_few_poses_find_a_term_without_trying_all(name, term, poses, random):
    """Couplings are many: without them measurements are enough for the others, or for ratios."""
    own, coefficients = TERMS[term]
    bench = Bench(name, random, {own: coefficients})
    found = er3a.calibrate(bench.robot, bench.measured(poses, 0.05))
    terms = found.beyond.terms if found.beyond else found.ratios
    assert [(each.kind, each.joint) for each in terms] == [(own.kind, own.joint)]
    assert "coupling" not in {each.kind for each in found.tried}
    assert bench.error(found) < 0.06


@pytest.mark.long
@pytest.mark.parametrize("poses", [130, 80])
def test_a_coupling_of_joints_is_found_and_held_by_a_robot_file(poses, random, tmp_path):
    """J4 turns a little with J2; the arm's coupling holds it, beside that which it has. From few poses other terms are
    tried without couplings, and are left where they would stand for one."""
    bench = Bench("six", random, {JointTerm("coupling", 4, by=2): [1e-3]})
    found = er3a.calibrate(bench.robot, bench.measured(poses, 0.02))
    for terms in (found.ratios, found.beyond.terms if poses > 100 else found.ratios):
        assert [(each.kind, each.joint, each.by) for each in terms] == [("coupling", 4, 2)]
    tried = found.tried_for_file if poses > 100 else found.tried
    assert {each.kind for each in tried} == {"ratio", "coupling"}
    assert len(tried) == 6 + 6 * 5
    assert [(each.joint, each.by) for each in tried if each.verdict == "taken"] == [(4, 2)]
    assert (found.beyond is None) == (poses < 100)
    for model in (found, found.beyond or found):
        assert model.deviation_mm == pytest.approx(0.02, rel=0.2)
    robot = bench.robot.replace(coupling=np.eye(6) - np.eye(6, k=-1) * [0, 1, 0, 0, 0, 0])  # J3 - J2
    file, q = coupled(robot, {(4, 2): 1e-3}).replace(name="coupled"), bench.joints(20)
    write_robot(file, tmp_path / "coupled.yaml")
    assert row_values(file, q)[:, 3] == pytest.approx(row_values(robot, q) @ [0, 1e-3, 0, 1, 0, 0])
    assert er3a.forward(load_robot(tmp_path / "coupled.yaml"), q) == pytest.approx(er3a.forward(file, q), abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "term", "amount", "noise", "poses"),
    [("six", JointTerm("ratio", 5), 0.02, 0.2, 70), ("slide", JointTerm("coupling", 4, by=3), 0.05, 0.05, 70)],
)
def test_a_large_term_is_not_pulled_towards_nothing(name, term, amount, noise, poses, random):
    """Of noisy points, too, and of a joint that slides a little way: its interval holds it."""
    bench, off = Bench(name, random, {term: [amount]}), []
    for _ in range(5):
        found = er3a.calibrate(bench.robot, bench.measured(poses, noise))
        terms = found.beyond.terms if found.beyond else found.ratios
        own = next(each for each in terms if (each.kind, each.joint, each.by) == (term.kind, term.joint, term.by))
        off.append((own.coefficients[0] - 1000 * amount) / own.standard_errors[0])
    assert abs(np.mean(off)) < 1.5
    assert np.abs(off).max() < 3.5


def test_a_gantry_of_slides_alone_has_no_errors_that_return_in_a_turn(random):
    robot = gantry()
    slides = er3a.Robot.from_dh(
        robot.a[:3], robot.alpha[:3], robot.d[:3], offset=robot.offset[:3], lower=[-1] * 3, upper=[1] * 3,
        sliding=[True] * 3,
    )  # fmt: skip
    q = random.uniform(-1, 1, (60, 3))
    xyz = 1000 * er3a.forward(slides, q)[:, :3, 3] + random.normal(0, 0.05, (60, 3))
    rows = [
        Measurement(k, tuple(1000 * pose), "flange", tuple(point))
        for k, (pose, point) in enumerate(zip(q, xyz.tolist()))
    ]
    found = er3a.calibrate(slides, rows)
    assert found.deviation_mm == pytest.approx(0.05, rel=0.2)
    assert {each.kind for each in found.tried} == {"ratio", "sag", "coupling"}
