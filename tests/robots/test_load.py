"""Robot files: the three that ship, and one clear refusal for each way to get one wrong."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from er3a.errors import DoubtfulUnit, InputError, InputWarning, ShapeError
from er3a.files.robot_file import Envelopes
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.files.robot_writer import write_robot
from er3a.files.yaml_file import parse
from er3a.robots.robot import GRADES
from testing.arms import make_arm, placement

GROUPS = ("dh", "zero", "limits", "speeds")
Change = Callable[[dict[str, Any]], Any]


@pytest.fixture
def write(tmp_path: Path):
    """Writes arm.yaml: the real arm's file under that name, changed."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    content["name"] = "arm"

    def write(change: Change | str | bytes, name: str = "arm.yaml") -> Path:
        path = tmp_path / name
        if callable(change):
            changed = copy.deepcopy(content)
            change(changed)
            path.write_text(yaml.safe_dump(changed, sort_keys=False, allow_unicode=True), encoding="utf-8")
        else:
            path.write_bytes(change if isinstance(change, bytes) else change.encode())
        return path

    return write


def refusal(path: Path) -> InputError:
    """The error that loading the file raises; checked for what all of them have in common."""
    with pytest.raises(InputError) as caught:
        load_robot(path)
    error = caught.value
    text = str(error)
    assert "\n" not in text
    assert len(text) < 400
    assert text.startswith(f"{path}: ")
    assert error.file == str(path)
    assert error.remedy
    for jargon in ("Traceback", "pydantic", "Error", "<class", "object at", "RobotFile", "DhTable"):
        assert jargon not in text
    return error


GROUP = {"source": "x", "grade": "claim"}


def set_in(*keys: str | int, to: Any) -> Change:
    """Sets one entry."""

    def change(content):
        for key in keys[:-1]:
            content = content[key]
        content[keys[-1]] = to

    return change


def delete(*keys: str | int) -> Change:
    """Deletes one entry."""

    def change(content):
        for key in keys[:-1]:
            content = content[key]
        del content[keys[-1]]

    return change


def rename(group: str, row: int, old: str, new: str) -> Change:
    """Gives a key of one row another name."""

    def change(content):
        content[group]["rows"][row][new] = content[group]["rows"][row].pop(old)

    return change


def scale(group: str, keys: tuple[str, ...], factor: float) -> Change:
    """Multiplies these keys in all rows."""

    def change(content):
        for row in content[group]["rows"]:
            for key in keys:
                row[key] = row[key] * factor

    return change


def do(*changes: Change) -> Change:
    """All of these changes."""
    return lambda content: [change(content) for change in changes]


def with_tool(**values: Any) -> Change:
    """Adds a tool."""
    return set_in("tool", to={"source": "test", "grade": "inferred", **values})


EXPECTED_MM_DEG = {
    "er3a_c60": {
        "a": [50, 270, 70, 0, 0, 0],
        "alpha": [-90, 0, -90, 90, -90, 0],
        "d": [321.5, 0, 0, 299, 0, 78.5],
        "direction": [1, -1, -1, 1, -1, 1],
        "offset": [0, -90, 0, 0, 0, 0],
        "lower": [-167, -130, -75, -180, -110, -360],
        "upper": [167, 90, 105, 180, 110, 360],
        "speed": [np.nan] * 6,
    },
    "er3a_c60_article": {
        "a": [0, 650, 0, 0, 0, 0],
        "alpha": [-90, 0, -90, 90, -90, 0],
        "d": [169.77, 0, 0, 651.61, 0, 125.6],
        "direction": [1] * 6,
        "offset": [0] * 6,
        "lower": [-180, -90, -180, -200, -120, -360],
        "upper": [180, 155, 75, 200, 120, 360],
        "speed": [np.nan] * 6,
    },
    "er3_600": {
        "a": [0, 295, 37, 0, 0, 0],
        "alpha": [-90, 0, -90, 90, -90, 0],
        "d": [367.5, 0, 0, 295.5, 0, 78.5],
        "direction": [1, -1, -1, 1, 1, 1],
        "offset": [0, -90, 0, 0, 0, 0],
        "lower": [-170, -135, -65, -190, -130, -360],
        "upper": [170, 85, 185, 190, 130, 360],
        "speed": [400, 300, 520, 500, 530, 840],
    },
}


def test_the_three_files_hold_the_gathered_numbers(robot):
    for key, values in EXPECTED_MM_DEG[robot.name].items():
        factor = {"a": 1e-3, "d": 1e-3, "direction": 1.0}.get(key, np.pi / 180)
        np.testing.assert_allclose(getattr(robot, key), np.array(values) * factor, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(robot.base, np.eye(4))
    np.testing.assert_array_equal(robot.tool, np.eye(4))
    assert robot.convention == "standard"
    assert robot.zero_pose


def test_every_group_has_a_source_and_a_grade(robot):
    speeds = {"speeds"} if np.isfinite(robot.speed).all() else set()
    envelopes = {"envelopes"} if robot.envelopes else set()
    masses = robot.masses
    known = {"inertia": masses.links, "drives": masses.drives, "wrist_load": masses.wrist}
    known["weight"] = np.isfinite(masses.weight)
    more = {group for group, there in known.items() if there}
    assert set(robot.sources) == {"dh", "zero", "limits"} | speeds | envelopes | more
    for source in robot.sources.values():
        assert source.grade in GRADES
        assert len(source.source) > 10


def test_the_article_is_a_claim_and_checked_against_the_real_arm_too():
    article = load_robot("er3a_c60_article")
    assert {source.grade for source in article.sources.values()} == {"claim"}
    assert article.references == ("er3a_c60_article", "er3a_c60")


def test_robot_is_frozen_and_its_arrays_read_only(robot):
    with pytest.raises(dataclasses.FrozenInstanceError):
        robot.a = np.zeros(6)
    for key in ("a", "alpha", "d", "direction", "offset", "lower", "upper", "speed", "base", "tool"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(robot, key)[0] = 1.0
    with pytest.raises(TypeError):
        robot.sources["dh"] = None


def test_a_robot_keeps_its_own_copy_of_arrays():
    a = np.array([0.1, 0.4, 0.05, 0, 0, 0])
    arm = make_arm(a=a)
    a[0] = 9.0
    assert arm.a[0] == 0.1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("a", np.zeros(5)),
        ("lower", np.zeros((6, 1))),
        ("tool", np.eye(3)),
        ("coupling", np.eye(5)),
        ("sliding", [True]),
        ("direction", np.ones(11)),
    ],
)
def test_a_robot_of_another_shape_is_refused(key, value):
    with pytest.raises(ShapeError, match=r"has shape"):
        make_arm(**{key: value})


def test_loading_by_path_and_by_name_agree():
    by_path = load_robot(ROBOTS / "er3_600.yaml")
    np.testing.assert_array_equal(by_path.d, load_robot("er3_600").d)


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("er3_60", "er3_600;"),
        ("IRB46", "irb4600_20_250, irb4600_40_255, irb4600_60_205;"),
        ("ABB IRB 4600-20", "irb4600_20_250;"),
        ("er3_600\0", "er3_600;"),
        *((name, "er3_600, er3a_c60, er3a_c60_article") for name in ("", "../robots/er3_600")),
    ],
)
def test_an_unknown_name_lists_the_known_ones(name, known):
    with pytest.raises(InputError, match=f"there is no robot .* Known: {known}"):
        load_robot(name)


def test_base_and_tool_in_a_file(write):
    base = {"source": "test", "grade": "inferred", "xyz_mm": [0, 0, 500], "rpy_deg": [180, 0, 30]}
    robot = load_robot(write(do(set_in("base", to=base), with_tool(xyz_mm=[0.0, 12.5, 150.0]))))
    np.testing.assert_allclose(robot.base, placement([0, 0, 0.5], np.radians([180, 0, 30])), atol=1e-15)
    np.testing.assert_allclose(robot.tool, placement([0, 0.0125, 0.15], [0, 0, 0]), atol=1e-15)
    assert robot.sources["tool"].grade == "inferred"


def test_modified_tables_load(write):
    assert load_robot(write(set_in("dh", "convention", to="modified"))).convention == "modified"


def test_calibrated_tables_may_hold_short_lengths(write):
    short = set_in("dh", "rows", 1, "d_mm", to=0.3215)
    assert "looks like metres" in refusal(write(short)).problem
    robot = load_robot(write(do(short, set_in("dh", "calibrated", to=True))))
    assert robot.d[1] == pytest.approx(0.3215e-3)


@pytest.mark.parametrize("key", ["base", "flange"])
def test_what_er3a_writes_it_does_not_doubt(key, tmp_path):
    """A URDF's flange may be 0.24 mm off the last axis, as the KUKA KR 210 L150's is."""
    T = np.eye(4)
    T[0, 3] = 2.4e-4
    write_robot(load_robot("er3_600").replace(name="arm", **{key: T}), tmp_path / "arm.yaml")
    np.testing.assert_allclose(getattr(load_robot(tmp_path / "arm.yaml"), key), T, atol=1e-12)  # and no warning


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        (lambda c: c["dh"]["rows"].pop(2), "dh.rows", "joint 3 is missing"),
        (lambda c: c["limits"]["rows"].pop(), "limits.rows", "joint 6 is missing"),
        (lambda c: c["zero"]["rows"].reverse(), "zero.rows", "joints come as [6, 5, 4, 3, 2, 1]"),
        (set_in("speeds", "rows", 3, "joint", to=3), "speeds.rows", "joint 4 is missing"),
        (set_in("dh", "rows", 5, "joint", to=11), "dh.rows[5].joint", "11 is refused"),
        (lambda c: c["dh"]["rows"].append(dict(c["dh"]["rows"][5])), "dh.rows", "joint 7 is missing"),
        (lambda c: c["limits"]["rows"].pop(), "limits.rows", "joint 6 is missing. Write one row for each joint"),
        (set_in("dh", "rows", 1, "beta_deg", to=0.1), "dh.rows[1].beta_deg", "not calibrated. Set dh.calibrated: true"),
        (rename("dh", 1, "a_mm", "a_m"), "dh.rows[1].a_m", "unknown key 'a_m'. Did you mean 'a_mm'?"),
        (set_in("payload_kg", to=5), "payload_kg", "unknown key 'payload_kg'. It belongs elsewhere in the file"),
        (set_in("tol", to={}), "tol", "unknown key 'tol'. Did you mean 'tool'?"),
        (set_in("colour", to="red"), "colour", "unknown key 'colour'"),
        (delete("dh", "grade"), "dh.grade", "missing. Add the key 'grade'"),
        (delete("limits"), "limits", "missing. Add the key 'limits'"),
        (delete("zero_pose"), "zero_pose", "missing"),
        (set_in("dh", "grade", to="rumour"), "dh.grade", "'rumour' is refused"),
        (set_in("dh", "convention", to="craig"), "dh.convention", "'standard' or 'modified'"),
        (set_in("limits", "rows", 1, "lower_deg", to=90), "limits.rows[1]", "lower_deg 90 above upper_deg 85. Swap"),
        (set_in("limits", "rows", 1, "upper_deg", to=4000), "limits.rows[1]", "turns more than ten times"),
        (set_in("dh", "rows", 1, "a_mm", to=float("nan")), "dh.rows[1].a_mm", "nan is not a finite number"),
        (set_in("zero", "rows", 1, "offset_deg", to=float("-inf")), "zero.rows[1].offset_deg", "-inf is not a finite"),
        (set_in("dh", "rows", 0, "d_mm", to=0.3675), "dh.rows[0].d_mm", "0.3675 mm looks like metres. Write 367.5"),
        (scale("dh", ("a_mm", "d_mm"), 1e-3), "dh.rows[0].d_mm", "looks like metres"),
        (do(scale("dh", ("a_mm", "d_mm"), 1e-3), set_in("dh", "calibrated", to=True)), "dh.rows", "only be metres"),
        (scale("dh", ("a_mm", "d_mm"), 1e3), "dh.rows[0].d_mm", "longer than any robot's link"),
        (with_tool(xyz_mm=[0, 150]), "tool.xyz_mm", "at least 3 items"),
        (set_in("dh", "rows", 0, "d_mm", to="367.5"), "dh.rows[0].d_mm", "'367.5' is refused. Write a number"),
        (set_in("dh", "rows", 0, "d_mm", to="367,5"), "dh.rows[0].d_mm", "'367,5' is refused. Write a number"),
        (set_in("dh", "rows", 0, "d_mm", to=None), "dh.rows[0].d_mm", "None is refused"),
        (set_in("dh", "rows", 0, "d_mm", to=True), "dh.rows[0].d_mm", "True is refused"),
        (set_in("dh", "rows", 0, "joint", to=1.0), "dh.rows[0].joint", "1.0 is refused. Write a whole number"),
        (set_in("dh", "rows", to={}), "dh.rows", "refused. Write a list"),
        (set_in("dh", to=[1, 2]), "dh", "refused. Write `key: value` lines"),
        (set_in("dh", "rows", 0, to=5), "dh.rows[0]", "5 is refused. Write `key: value` lines"),
        (set_in("title", to=600), "title", "600 is refused. Write a text"),
        (set_in("title", to=""), "title", "at least 1 character"),
        (set_in("zero", "rows", 0, "direction", to=0), "zero.rows[0].direction", "0 is not a direction. Write 1 or -1"),
        (set_in("zero", "rows", 0, "direction", to=-0.5), "zero.rows[0].direction", "refused"),
        (set_in("zero", "rows", 0, "direction", to=True), "zero.rows[0].direction", "True is refused"),
        (set_in("speeds", "rows", 0, "speed_deg_s", to=0), "speeds.rows[0].speed_deg_s", "greater than 0"),
        (set_in("coupling", to=[2, 3]), "coupling", "is refused. Write `key: value` lines"),
        (
            set_in("coupling", to=GROUP | {"rows": [{"row": 3, "joints": [2], "factors": [1]}]}),
            "coupling.rows",
            "joints move nothing by themselves",
        ),
        (set_in("dh", "parallelogram", to=True), "dh.parallelogram", "Write coupled joints as `coupling:`"),
        (set_in("name", to="other"), "name", "'other' is not the file's name. Write arm"),
        (set_in("name", to="Arm 1"), "name", "'Arm 1' is refused"),
        (set_in("references", to="er3_600"), "references", "refused. Write a list"),
        (set_in("references", to=["../secret"]), "references[0]", "refused"),
        (set_in("kind", to="study"), "kind", "'study' is refused. Input should be 'robot'"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused_with_field_and_remedy(write, change, field, words):
    error = refusal(write(change))
    assert error.field == field
    assert words in str(error)


def test_several_faults_are_counted(write):
    error = refusal(write(do(delete("title"), delete("zero_pose"), set_in("tol", to=1))))
    assert error.field == "tol"
    assert "(2 more to correct after this one)" in error.remedy


def test_a_key_written_twice_is_refused_with_its_line(write):
    text = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("er3_600\n", "arm\n", 1)
    line = text.splitlines().index("title: EFORT ER3-600") + 2
    error = refusal(write(text.replace("title: EFORT ER3-600\n", "title: EFORT ER3-600\ntitle: again\n")))
    assert error.field == f"line {line}, column 1"
    assert "the key 'title' is given twice" in error.problem
    row = "{joint: 2, a_mm: 295, alpha_deg: 0, d_mm: 0}"
    error = refusal(write(text.replace(row, row.replace("d_mm: 0", "a_mm: 37"))))
    assert "the key 'a_mm' is given twice" in error.problem


@pytest.mark.parametrize("text", ["0295", "1:30", "0x127", "1_000"])
def test_numbers_that_other_readers_take_for_something_else_are_refused(write, text):
    """YAML 1.1 reads 0295 as octal, 1:30 in sixties, 0x127 as 295."""
    content = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("name: er3_600", "name: arm")
    error = refusal(write(content.replace("a_mm: 295", f"a_mm: {text}")))
    assert error.field == "dh.rows[1].a_mm"


@pytest.mark.parametrize("text", ["295.0", "2.95e2", "2.95e+2", "+295", "295."])
def test_numbers_may_be_written_in_the_usual_ways(write, text):
    content = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("name: er3_600", "name: arm")
    assert load_robot(write(content.replace("a_mm: 295", f"a_mm: {text}"))).a[1] == pytest.approx(0.295)


def test_a_robot_can_t_be_a_missing_file(tmp_path):
    error = refusal(tmp_path / "arm.yaml")
    assert error.problem == "there is no such file"


@pytest.mark.parametrize(("key", "value"), [("xyz_mm", [0, 0, 0.12]), ("rpy_deg", [1.5708, 0, 0])])
def test_the_placement_of_a_links_mesh_is_doubted_as_any_other(key, value):
    mesh = {"link": 1, "mesh": "link.stl", "unit": "mm", key: value}
    with pytest.warns(DoubtfulUnit, match=rf"meshes\[0\]\.{key}: "):
        parse(Envelopes, {"source": "x", "grade": "cad", "meshes": [mesh]}, None)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (scale("dh", ("alpha_deg",), np.pi / 180), "dh.rows, zero.rows: .* deg may be radians"),
        (
            scale("limits", ("lower_deg", "upper_deg"), np.pi / 180),
            "limits.rows: .* deg may be radians",
        ),
        (with_tool(xyz_mm=[0, 0, 0.15]), r"tool.xyz_mm: \[0.0, 0.0, 0.15\] mm may be metres"),
        (with_tool(rpy_deg=[3.1416, 1.5708, 0]), r"tool.rpy_deg: .* deg may be radians"),
    ],
)
def test_what_looks_like_a_slip_is_a_warning(write, change, told):
    path = write(change)
    with pytest.warns(InputWarning, match=rf"arm\.yaml: {told}"):
        load_robot(path)


@pytest.mark.parametrize(
    "change",
    [
        set_in("dh", "rows", 0, "alpha_deg", to=-1.5708),
        set_in("zero", "rows", 1, "offset_deg", to=1.5707963),
        with_tool(rpy_deg=[1.5, -2, 0.5]),
        with_tool(xyz_mm=[0, 0, 0.0004]),
    ],
)
def test_degrees_below_two_pi_are_legal(write, change):
    load_robot(write(change))
