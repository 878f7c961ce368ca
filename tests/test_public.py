"""What ``import er3a`` gives: names that complete, refusals in words, objects that show themselves in a few lines."""

from __future__ import annotations

import ast
import copy
import html.parser
import multiprocessing
import pickle
import tempfile
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import er3a
from er3a.by_value import Displayed, Sheet, as_html, as_text
from er3a.calibration.observations import Measurement
from er3a.collision.scene import Box, Plane, Scene
from er3a.diagnosis.diagnose import diagnosis_of
from er3a.files.reference_sets import load_references
from er3a.kinematics import forward as forward_module
from er3a.pipeline.stages.workspace.model import Border
from er3a.robots.masses import Drives, Masses
from er3a.robots.robot import Robot
from er3a.robots.usable import check_robot
from testing.made_once import made_once
from testing.simulated_measurements import measured

PACKAGE = Path(er3a.__file__).parent
Q = np.radians([20, 10, 15, 30, 40, 50])
MAX_LETTERS = 4000
MEASURED = np.random.default_rng(0).uniform(-0.4, 0.4, (20, 6))
ROWS = measured(er3a.load_robot("er3_600"), MEASURED, 0.05, np.random.default_rng(1))


@pytest.fixture(scope="module")
def arm() -> Robot:
    return er3a.load_robot("er3_600")


@pytest.fixture(scope="module")
def pose(arm: Robot) -> np.ndarray:
    return er3a.forward(arm, Q)


# Calls with a robot and a pose: each public function that takes a robot, by its name.
CALLS: dict[str, Callable[[Any, np.ndarray], Any]] = {
    "forward": lambda robot, T: er3a.forward(robot, Q),
    "jacobian": lambda robot, T: er3a.jacobian(robot, Q),
    "torques": lambda robot, T: er3a.torques(robot, Q, Q, Q),
    "mass_matrix": lambda robot, T: er3a.mass_matrix(robot, Q),
    "gravity": lambda robot, T: er3a.gravity(robot, Q),
    "inverse": lambda robot, T: er3a.inverse(robot, T),
    "inverse_batch": lambda robot, T: er3a.inverse_batch(robot, T[None]),
    "solve": lambda robot, T: er3a.solve(robot, T, restarts=0),
    "conditioning": lambda robot, T: er3a.conditioning(robot, Q),
    "follow": lambda robot, T: er3a.follow(robot, er3a.line(T, T, 1.0), np.array([0.0, 1.0])),
    "plot": lambda robot, T: er3a.plot(robot, Q),
    "clearance": lambda robot, T: er3a.clearance(robot, Q, None),
    "select": lambda robot, T: er3a.select(robot, er3a.inverse(er3a.load_robot("er3_600"), T), "nearest", Q),
    "select_sequence": lambda robot, T: er3a.select_sequence(robot, [er3a.inverse(er3a.load_robot("er3_600"), T)], Q),
    "load_targets": lambda robot, T: er3a.load_targets("data/targets/er3_600.yaml", robot),
    "diagnose": lambda robot, T: er3a.diagnose(robot, "er3_600"),
    "evidence": lambda robot, T: er3a.evidence(robot, load_references("er3_600").references[:1]),
    "confirm": lambda robot, T: er3a.confirm(robot, np.tile(Q, (4, 1)), np.tile(T, (4, 1, 1))),
    "calibrate": lambda robot, T: er3a.calibrate(robot, ROWS),
    "load_calibration": lambda robot, T: er3a.load_calibration("mine.json", robot),
    "to_modified": lambda robot, T: er3a.to_modified(robot),
    "to_standard": lambda robot, T: er3a.to_standard(robot),
    "export_urdf": lambda robot, T: er3a.export_urdf(robot),
    "check_program": lambda robot, T: er3a.check_program(er3a.read_program("data/programs/weld_seam.src"), robot),
}


def with_entry(name: str, value: float, joint: int = 3) -> Callable[[Robot], Robot]:
    """A robot with one entry changed."""

    def change(robot: Robot) -> Robot:
        column = getattr(robot, name).copy()
        column[joint - 1] = value
        return robot.replace(**{name: column})

    return change


def with_tool(change: Callable[[np.ndarray], None]) -> Callable[[Robot], Robot]:
    """A robot with a changed tool."""

    def tool(robot: Robot) -> Robot:
        T = np.eye(4)
        change(T)
        return robot.replace(tool=T)

    return tool


def mirrored(T: np.ndarray) -> None:
    T[0, 0] = -1.0


def stretched(T: np.ndarray) -> None:
    T[0, 0] = 1.01


def holed(T: np.ndarray) -> None:
    T[1, 3] = np.nan


UNUSABLE: dict[str, tuple[Callable[[Robot], Any], str]] = {
    "text": (lambda robot: "er3_600", "robot is the text 'er3_600'"),
    "none": (lambda robot: None, "robot is None"),
    "array": (lambda robot: np.eye(4), "robot is of type ndarray"),
    "nan": (with_entry("a", np.nan), "a of joint 3 is nan"),
    "infinite": (with_entry("alpha", np.inf), "alpha of joint 3 is inf"),
    "endless limit": (with_entry("upper", np.inf), "upper of joint 3 is inf"),
    "speed": (with_entry("speed", -1.0), "speed of joint 3 is -1"),
    "mirrored tool": (with_tool(mirrored), "left-handed"),
    "stretched tool": (with_tool(stretched), "not orthonormal"),
    "tool with a hole": (with_tool(holed), "NaN or infinity"),
}


def refusal(call: Callable[[], Any]) -> str:
    """The message of the error that a call must end with."""
    with pytest.raises(er3a.Er3aError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_calls_cover_every_public_function_that_takes_a_robot():
    taking = {
        name
        for name in er3a.__all__
        if not isinstance(getattr(er3a, name), type)
        and getattr(er3a, name).__wrapped__.__annotations__.get("robot") == "Robot"
    }
    assert taking == set(CALLS)


@pytest.mark.parametrize("unusable", UNUSABLE)
@pytest.mark.parametrize("name", CALLS)
def test_every_public_function_refuses_an_unusable_robot(arm, pose, name, unusable):
    make, message = UNUSABLE[unusable]
    assert message in refusal(lambda: CALLS[name](make(arm), pose))


@pytest.mark.parametrize("name", sorted(set(CALLS) - {"diagnose"}))
def test_crossed_limits_are_refused(arm, pose, name):
    crossed = arm.replace(lower=arm.upper, upper=arm.lower)
    assert "limits of joint 1 are crossed: lower 170 deg, upper -170 deg" in refusal(lambda: CALLS[name](crossed, pose))


def test_crossed_limits_are_what_diagnosis_looks_for(arm):
    crossed = arm.replace(lower=arm.upper, upper=arm.lower)
    assert "wrong_limits" in repr(er3a.diagnose(crossed, "er3_600")[0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"convention": "craig"}, "convention is 'craig'; expected one of"),
        ({"convention": None}, "convention is None"),
        ({"direction": [1, 1, 2, 1, 1, 1]}, "direction of joint 3 is 2; expected 1 or -1"),
        ({"direction": [1, 1, np.nan, 1, 1, 1]}, "direction of joint 3 is nan"),
        ({"a": "0 1 2"}, "no real number"),
        ({"a": np.zeros(5)}, r"a has shape (5,); expected (6,)"),
        ({"tool": np.eye(3)}, r"tool has shape (3, 3); expected (4, 4)"),
    ],
)
def test_a_robot_is_refused_where_no_source_could_print_it(arm, changes, message):
    assert message in refusal(lambda: arm.replace(**changes))


NO_POSE = {
    "not orthonormal": (lambda T: T @ np.diag([1.002, 1, 1, 1]), "not orthonormal"),
    "left-handed": (lambda T: T @ np.diag([-1.0, 1, 1, 1]), "left-handed"),
    "shape": (lambda T: T[:3], "has shape"),
    "NaN": (lambda T: np.where(np.arange(4) == 3, np.nan, T), "NaN or infinity"),
    "text": (lambda T: "pose", "no real number"),
    "none": (lambda T: None, "T "),
    "mm": (lambda T: T + 1000 * np.eye(4, k=3), "divide it by 1000"),
}


@pytest.mark.parametrize("kind", NO_POSE)
@pytest.mark.parametrize("name", ["inverse", "inverse_batch", "solve"])
def test_a_matrix_that_is_no_pose_is_refused(arm, pose, name, kind):
    make, message = NO_POSE[kind]
    batch = [make(pose)] if name == "inverse_batch" and kind not in ("text", "none") else make(pose)
    assert message in refusal(lambda: getattr(er3a, name)(arm, batch))


def test_a_pose_with_three_decimals_is_taken_and_said_to_be_rounded(arm, pose):
    with pytest.warns(er3a.InputWarning, match=r"rounded: the nearest is taken, 0\.000\d off"):
        found = er3a.inverse(arm, np.round(pose, 3))
    reached = er3a.forward(arm, found.q)
    np.testing.assert_allclose(
        reached[:, :3, :3] @ reached[:, :3, :3].swapaxes(1, 2), [np.eye(3)] * len(reached), atol=1e-9
    )
    np.testing.assert_allclose(reached, np.tile(np.round(pose, 3), (len(reached), 1, 1)), atol=1e-3)


def test_one_bad_pose_of_a_large_batch_is_named(arm, pose):
    T = np.tile(pose, (5000, 1, 1))
    T[4321, 0, 0] += 0.1
    assert refusal(lambda: er3a.inverse_batch(arm, T)).startswith("T[4321] ")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda arm, T: er3a.select(arm, T, "nearest", Q), "solutions is of type ndarray; expected a Solutions"),
        (lambda arm, T: er3a.select(arm, er3a.inverse(arm, T), "nearest", Q, scene="wall"), "scene is the text 'wall'"),
        (lambda arm, T: er3a.select(arm, er3a.inverse(arm, T), None, Q), "the rule is None"),
        (lambda arm, T: er3a.select_sequence(arm, [T], Q), "poses[0] is of type ndarray"),
        (lambda arm, T: er3a.select_sequence(arm, er3a.inverse(arm, T), Q), "poses is of type Solutions"),
        (lambda arm, T: er3a.diagnose(arm, None), "references is None"),
        (lambda arm, T: er3a.calibrate(arm, [1]), "measurements[0] is of type int; expected a Measurement"),
        (lambda arm, T: er3a.load_robot(None), "name_or_path is None; expected a text or a path"),
        (lambda arm, T: er3a.load_robot("er3"), "there is no robot 'er3'"),
        (lambda arm, T: er3a.load_scene(3), "path is of type int"),
        (lambda arm, T: er3a.load_targets(None, arm), "path is None"),
        (lambda arm, T: er3a.load_measurements(None), "path is None"),
        (lambda arm, T: er3a.load_references(None), "name_or_folder is None"),
        (lambda arm, T: er3a.import_urdf(None), "path is None"),
        (lambda arm, T: er3a.forward(arm, "abc"), "q holds something that is no real number"),
        (lambda arm, T: er3a.forward(arm, None), "q has shape"),
        (lambda arm, T: er3a.forward(arm, Q, frame="tool"), "frame is 'tool'"),
        (lambda arm, T: er3a.forward(arm, Q, out=1), "out is of type int"),
        (lambda arm, T: er3a.jacobian(arm, Q[:5]), "q has shape (5,)"),
        (lambda arm, T: er3a.solve(arm, T, position_tolerance="fine"), "position_tolerance is 'fine'"),
        (lambda arm, T: er3a.inverse_batch(arm, T[None], threads=0), "threads is 0"),
        (lambda arm, T: er3a.inverse(arm, T, q_ref=Q * np.nan), "q_ref holds NaN"),
        (lambda arm, T: Box("box", 2 * np.eye(4), np.ones(3)), "the place of 'box'"),
        (lambda arm, T: Box("box", np.eye(4), np.zeros(3)), "'box' needs sizes above 0"),
        (lambda arm, T: Plane("floor", np.array([0.0, 0.0, 2.0]), 0.0), "'floor' needs a normal of length 1"),
    ],
)
def test_unusable_arguments_are_refused_by_name(arm, pose, call, message):
    assert message in refusal(lambda: call(arm, pose))


def test_positional_and_named_arguments_are_checked_alike(pose):
    assert refusal(lambda: er3a.forward(robot="er3_600", q=Q)) == refusal(lambda: er3a.forward("er3_600", Q))


def test_whether_a_robot_is_usable_is_found_out_once(arm, monkeypatch):
    robot = arm.replace(title="asked twice")
    check_robot(robot)
    monkeypatch.setattr("er3a.robots.usable.check_poses", lambda *_: pytest.fail("asked again"))
    check_robot(robot)


def test_public_functions_give_what_those_of_the_library_give(arm):
    assert (er3a.forward(arm, Q) == forward_module.forward(arm, Q)).all()
    assert er3a.forward.__doc__ == forward_module.forward.__doc__
    assert pickle.loads(pickle.dumps(er3a.forward)) is er3a.forward


def test_names_complete_and_type_checkers_see_the_same():
    assert set(dir(er3a)) == {*er3a.__all__, "__version__"}
    assert (PACKAGE / "py.typed").is_file()
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    (seen,) = (node for node in tree.body if isinstance(node, ast.If))
    imported = {alias.asname: node.module for node in seen.body for alias in node.names}
    assert imported == er3a._PUBLIC


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'forwards'"):
        er3a.forwards  # noqa: B018


def exported(arm: Robot) -> Path:
    """A robot as a URDF file."""
    file = Path(tempfile.mkdtemp()) / "arm.urdf"
    file.write_text(er3a.export_urdf(arm), encoding="utf-8")
    return file


def shown_objects(arm: Robot, pose: np.ndarray) -> dict[str, Any]:
    """Objects of every type that a user gets."""
    far = pose.copy()
    far[0, 3] = 9.0
    solutions = er3a.inverse(arm, pose)
    read = er3a.read_program("data/programs/weld_seam.src")
    points = [Measurement(k, tuple(np.degrees(Q) + k), "flange", (None, 0.0, 1.0), 0.1) for k in range(5000)]
    return {
        "robot": arm,
        "robot that can't be": arm.replace(a=np.full(6, np.nan)),
        "solutions": solutions,
        "self-motions": er3a.inverse(arm, er3a.forward(arm, np.zeros(6))),
        "no solutions": er3a.inverse(arm, far),
        "batch": er3a.inverse_batch(arm, np.tile(pose, (20_000, 1, 1))),
        "search": er3a.solve(arm, np.tile(pose, (300, 1, 1))),
        "failed search": er3a.solve(arm, far, restarts=1),
        "ranking": er3a.select(arm, solutions, {"nearest": 1, "limits": 1}, Q),
        "empty ranking": er3a.select(arm, er3a.inverse(arm, far), "nearest", Q),
        "sequence": er3a.select_sequence(arm, [solutions] * 40, Q),
        "hypotheses": er3a.diagnose(er3a.load_robot("er3a_c60_article"), "er3a_c60"),
        "no hypotheses": er3a.diagnose(arm, "er3_600"),
        "diagnosis": diagnosis_of(arm, load_references("er3_600")),
        "calibration": er3a.calibrate(arm, ROWS),
        "references": er3a.load_references("er3_600"),
        "scene": er3a.load_scene("data/scenes/table_and_post.yaml"),
        "calibration set": er3a.load_hand_eye("data/vision/carried_camera.yaml", arm),
        "hand-eye": er3a.calibrate_hand_eye(er3a.load_hand_eye("data/vision/carried_camera.yaml", arm)),
        "evidence": er3a.evidence(arm, load_references("er3_600").references[:1]),
        "imported": er3a.import_urdf(exported(arm)),
        "program": read,
        "execution": er3a.execute(read),
        "check": er3a.check_program(read, arm),
        "options": er3a.CheckOptions(start=Q),
        "load": er3a.Load(2.0, (0.0, 0.0, 0.1)),
        "target": er3a.load_targets("data/targets/er3_600.yaml", arm)[0],
        "measurement": points[0],
        "empty scene": Scene("nothing", ()),
    }


@pytest.fixture(scope="module")
def shown(arm: Robot, pose: np.ndarray) -> dict[str, Any]:
    return shown_objects(arm, pose)


class Cells(html.parser.HTMLParser):
    """The numbers of cells in the rows of a table."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[int] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag == "tr":
            self.rows.append(0)
        elif tag in ("td", "th"):
            self.rows[-1] += 1


@pytest.mark.long
def test_objects_show_themselves_in_a_few_lines_and_as_tables(shown):
    for name, each in shown.items():
        if not isinstance(each, Displayed | Measurement):
            continue
        text = repr(each)
        assert len(text) < MAX_LETTERS, name
        assert text.count("\n") < 40, name
        assert str(each) == text
        if isinstance(each, Displayed):
            cells = Cells()
            cells.feed(each._repr_html_())
            assert len(set(cells.rows)) <= 1, name
            assert len(each._repr_html_()) < 2 * MAX_LETTERS, name


COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda each: pickle.loads(pickle.dumps(each)),
    "deep copy": copy.deepcopy,
}


@pytest.mark.long
def test_every_public_object_equals_its_copies_and_hashes_alike(shown):
    for name, each in shown.items():
        for way, made in COPIES.items():
            again = made(each)
            assert again is not each, (name, way)
            assert again == each, (name, way)
            if not isinstance(each, list):
                assert hash(again) == hash(each), (name, way)


@pytest.mark.long
def test_all_that_public_objects_hold_can_be_compared(shown):
    left, met = list(shown.values()), list[Any]()
    seen: set[int] = set()
    while left:
        each = left.pop()
        if id(each) in seen:
            continue
        seen.add(id(each))
        met.append(each)
        if isinstance(each, Mapping):
            left += each.values()
        elif isinstance(each, list | tuple):
            left += each
        elif isinstance(each, np.ndarray) and each.dtype == object:
            left += each.ravel().tolist()
        elif is_dataclass(each):
            assert type(each).__eq__ is not object.__eq__, type(each).__name__
            assert (each == pickle.loads(pickle.dumps(each))) is True, type(each).__name__
            left += [getattr(each, part.name) for part in fields(each) if part.compare]
    assert {type(each).__name__ for each in met} >= {"Robot", "Masses", "Box", "Family", "CheckedMotion", "MotionPath"}


def test_copies_are_as_read_only_and_as_useful_as_the_robot(arm, pose):
    for made in COPIES.values():
        again = made(arm)
        with pytest.raises(ValueError, match="read-only"):
            again.a[0] = 1.0
        with pytest.raises(TypeError):
            again.sources["dh"] = None
        assert (er3a.forward(again, Q) == pose).all()
        assert er3a.inverse(again, pose) == er3a.inverse(arm, pose)


@pytest.mark.parametrize(
    "change",
    [
        {"title": "another"},
        {"a": np.arange(6.0)},
        {"speed": np.full(6, np.nan)},
        {"sources": {}},
        {"coupling": np.eye(6)},
        {"masses": Masses(drives=Drives.unknown(6))},
    ],
)
def test_robots_that_differ_are_unequal(arm, change):
    other = arm.replace(**change)
    assert other != arm
    assert other == arm.replace(**change)
    assert len({arm, other, arm.replace(**change), arm.replace()}) == 2


def test_a_robot_is_no_array(arm):
    assert arm != np.eye(4).tolist()
    assert arm != "er3_600"


@pytest.mark.long
def test_robots_and_results_reach_a_process_that_is_started_anew(arm, pose):
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert (pool.submit(er3a.forward, arm, Q).result() == pose).all()
        assert pool.submit(er3a.inverse, arm, pose).result() == er3a.inverse(arm, pose)


NOT_FINITE = {"one row": ([0, 0, np.nan, 0, 0, 0], "q holds NaN"), "batch": (np.full((3, 6), np.inf), "q[0] holds NaN")}


@pytest.mark.parametrize("kind", NOT_FINITE)
@pytest.mark.parametrize("name", ["forward", "jacobian"])
def test_joint_values_that_are_not_finite_are_refused(arm, name, kind):
    values, message = NOT_FINITE[kind]
    assert refusal(lambda: getattr(er3a, name)(arm, values)).startswith(message)
    assert refusal(lambda: getattr(er3a, name)(q=values, robot=arm)).startswith(message)


@pytest.mark.parametrize(
    "q", [[20, 10, 15, 30, 40, 50], [0, -90, 90, 0, 45, 0], np.full((2000, 6), 60), np.eye(6) * 90]
)
def test_joint_values_that_can_only_be_degrees_are_warned_of(arm, q):
    with pytest.warns(er3a.InputWarning, match=r"takes rad: np\.radians\(q\)") as caught:
        er3a.forward(arm, q)
    assert caught[0].filename == __file__
    with pytest.warns(er3a.InputWarning, match="q_ref"):
        er3a.inverse(arm, er3a.forward(arm, np.zeros(6)), np.array([0, -90, 90, 0, 45, 0]))


def test_joint_values_that_can_be_radians_are_not_warned_of(arm, random):
    turns = arm.replace(lower=np.full(6, -2 * np.pi), upper=np.full(6, 2 * np.pi))
    endless = arm.replace(continuous=np.ones(6, dtype=bool))
    sliding = arm.replace(sliding=np.arange(6) == 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        er3a.forward(arm, random.uniform(arm.lower, arm.upper, (5000, 6)))
        er3a.forward(arm, random.uniform(arm.lower - 4 * np.pi, arm.upper + 4 * np.pi, (5000, 6)))
        er3a.forward(turns, random.uniform(turns.lower - 2 * np.pi, turns.upper + 2 * np.pi, (5000, 6)))
        er3a.forward(endless, random.uniform(-300, 300, (5000, 6)))
        er3a.forward(sliding, [0, 0, 250, 0, 0, 0])
        er3a.forward(arm, [400, 0, 0, 0, 0, 0])  # neither rad nor deg


@pytest.mark.long
def test_evidence_is_a_table_of_a_screen(arm):
    found = made_once(f"evidence_{arm.name}", lambda: er3a.evidence(arm))
    lines = str(found).splitlines()
    assert len(lines) < 15
    assert max(map(len, lines)) <= 100
    (open_row,) = (line.replace(",", "").split() for line in lines if line.split()[0] == "open")
    assert open_row == ["open", "6", "alpha6", "offset6", *(f"direction{joint}" for joint in (1, 4, 5, 6))]
    counts = {line.split()[0]: int(line.split()[1]) for line in lines if line.split()[1].isdigit()}
    assert sum(counts.values()) == len(found.entries) + len(found.combinations)


def test_a_table_of_results_is_read_back(tmp_path):
    table = Border.of_rows([(1.0, 2.0, 3), (4.0, 5.0, 6)])
    table.write(tmp_path / "border.parquet")
    described = pq.read_schema(tmp_path / "border.parquet").field("rho_m").metadata
    assert described == {b"unit": b"m", b"meaning": b"distance from axis 1"}
    assert Border.read((tmp_path / "border.parquet").read_bytes()) == table


def test_a_robot_s_table_reads_as_its_file_does(arm):
    rows = repr(arm).splitlines()
    assert rows[1].split()[:4] == ["joint", "a_mm", "alpha_deg", "d_mm"]
    assert rows[3].split()[:8] == ["2", "295", "0", "0", "-1", "-90", "-135", "85"]


def test_solutions_name_branch_limits_and_the_reason_of_a_refusal(arm):
    narrow = arm.replace(upper=np.where(np.arange(6) == 3, 0.2, arm.upper))
    text = repr(er3a.inverse(narrow, er3a.forward(arm, Q)))
    assert "front_elbow_up_no_flip" in text
    assert "limit_exceeded: joint 4, side above" in text


def test_hypotheses_remain_a_list(arm):
    assert er3a.diagnose(arm, "er3_600") == []


def test_what_files_hold_is_escaped_in_tables(arm):
    hostile = arm.replace(title="<script>alert(1)</script>\x1b[31m")
    assert "<script>" not in hostile._repr_html_()
    assert "\x1b" not in repr(hostile)


def test_rows_left_out_are_counted():
    sheet = Sheet("Heading", ("a", "b"), (("1", "22"), ("333", "4")), 7, ("a fact",))
    assert as_text(sheet).splitlines() == ["Heading", "    a   b", "    1  22", "  333   4", "  ... 7 more", "  a fact"]
    assert "<p>... 7 more</p>" in as_html(sheet)


def test_scenes_are_found_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert er3a.load_scene("table_and_post") == er3a.load_scene("data/scenes/table_and_post.yaml")
    with pytest.raises(er3a.Er3aError, match="no such file"):
        er3a.load_scene("nowhere")
