"""From entries of a path file to paths: every kind, and every way to get one wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from er3a.errors import InputError
from er3a.files.path_file import load_paths
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.kinematics.solutions import branch_labels
from er3a.planning.commands import CommandSource, build

HEAD = {"name": "path", "title": "A path", "samples": 20}
DOWN = [180, 0, 0]
START = {"start": {"xyz_mm": [300, 0, 300], "rpy_deg": DOWN}, "duration_s": 2}
LINE = HEAD | START | {"kind": "line", "end": {"xyz_mm": [300, 150, 300], "rpy_deg": DOWN}}
ARC = LINE | {"kind": "arc", "via_mm": [350, 75, 300]}
TO_A = {"kind": "line", "end": {"xyz_mm": [300, 100, 300], "rpy_deg": DOWN}}
TO_B = {"kind": "line", "end": {"xyz_mm": [400, 100, 300], "rpy_deg": DOWN}}
SEQUENCE = HEAD | START | {"kind": "sequence", "segments": [TO_A | {"blend_mm": 20}, TO_B]}
JOINTS = HEAD | {"kind": "joint_sequence", "points_deg": [[0] * 6, [30] * 6, [30, 60, 0, 0, 0, 0]], "duration_s": 3}
TABLE = HEAD | {"kind": "table", "duration_s": 2}


def built(folder: Path, entry: dict, table: str | None = None, ends=None):
    if table is not None:
        (folder / "table.csv").write_text(table)
        entry = entry | {"file": str(folder / "table.csv")}
    file = folder / "paths.yaml"
    before = [JOINTS | {"name": name} for name in ends or {}]
    file.write_text(json.dumps({"kind": "paths", "paths": [*before, entry]}))
    robot = load_robot("er3a_c60")
    command = load_paths(file).paths[-1].command(CommandSource(file, f"paths[{len(before)}]"), robot)
    return build(robot, command, ends or {})


def test_line_and_arc_start_and_end_where_they_say(tmp_path):
    for entry in (LINE, ARC, LINE | {"profile": "trapezoid"}, ARC | {"profile": "trapezoid", "ramp_share": 0.2}):
        path = built(tmp_path, entry).tool
        ends = path.poses(path.progress(np.array([0.0, 2.0]))[0])
        down = np.radians(DOWN)
        np.testing.assert_allclose(ends, [transform([0.3, y, 0.3], down) for y in (0, 0.15)], atol=1e-12)
    assert path.ramp == 0.2


def test_joint_start_is_the_pose_there(tmp_path):
    q = [0, 10, -20, 0, 40, 0]
    entry = {key: value for key, value in SEQUENCE.items() if key != "start"} | {"start_deg": q}
    found = built(tmp_path, entry)
    np.testing.assert_allclose(found.q_start, np.radians(q))
    np.testing.assert_allclose(
        found.tool.poses(np.array(0.0)), forward(load_robot("er3a_c60"), np.radians(q)), atol=1e-12
    )


def test_start_branch_is_named_in_words_or_by_code(tmp_path):
    slots = [
        built(tmp_path, LINE | {"start_branch": name}).start_slot
        for name in ("back, elbow up, flip", "back_elbow_up_flip")
    ]
    assert slots[0] == slots[1] == branch_labels(load_robot("er3a_c60")).index("back_elbow_up_flip")


def test_path_goes_on_where_another_ended(tmp_path):
    q = np.radians([10, 10, -20, 30, 40, 50])
    after = {key: value for key, value in LINE.items() if key != "start"} | {"after": "before"}
    found = built(tmp_path, after, ends={"before": q})
    np.testing.assert_array_equal(found.q_start, q)
    np.testing.assert_allclose(found.tool.poses(np.array(0.0)), forward(load_robot("er3a_c60"), q), atol=1e-12)
    move = HEAD | {"kind": "joint", "after": "before", "end_deg": [0] * 6, "duration_s": 2}
    np.testing.assert_allclose(built(tmp_path, move, ends={"before": q}).joints.joints(np.array(0.0))[0], q)
    with pytest.raises(InputError, match=r"paths\[1\]\.after: the path 'before' does not reach its end"):
        built(tmp_path, after, ends={"before": q * np.nan})
    with pytest.raises(InputError, match=r"paths\[1\]\.after: no earlier path is named 'other'"):
        built(tmp_path, move | {"after": "other"}, ends={"before": q})
    with pytest.raises(InputError, match=r"paths\[1\]: give either start_deg .* or after"):
        built(tmp_path, move | {"start_deg": [0] * 6}, ends={"before": q})


def test_joint_move_takes_its_boundary_rates(tmp_path):
    rates = {
        "start_velocity_deg_s": [10, 0, 0, 0, 0, 0],
        "end_velocity_deg_s": [0, 20, 0, 0, 0, 0],
        "start_acceleration_deg_s2": [0, 0, 5, 0, 0, 0],
        "end_acceleration_deg_s2": [0, 0, 0, -5, 0, 0],
    }
    ends = {"start_deg": [0] * 6, "end_deg": [45, 30, 0, 0, 0, 0]}
    move = built(tmp_path, HEAD | {"kind": "joint", "duration_s": 2} | ends | rates).joints
    q, v, a = (np.degrees(part) for part in move.joints(np.array([0.0, 2.0])))
    np.testing.assert_allclose(q, [ends["start_deg"], ends["end_deg"]], atol=1e-12)
    np.testing.assert_allclose(v, [rates["start_velocity_deg_s"], rates["end_velocity_deg_s"]], atol=1e-12)
    np.testing.assert_allclose(a, [rates["start_acceleration_deg_s2"], rates["end_acceleration_deg_s2"]], atol=1e-11)


def test_table_without_times_is_run_in_its_duration_and_leaves_repeated_points_out(tmp_path):
    rows = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n300,0,300,180,0,0\n300,0,300,180,0,0\n300,100,300,180,0,0\n"
    found = built(tmp_path, TABLE, rows + "400,100,300,180,0,30\n")
    assert found.repeated_rows == (3,)
    assert found.duration == 2
    away = found.tool.poses(np.linspace(0, 1, 20_001))[:, :3, 3] - [0.3, 0.1, 0.3]
    assert np.linalg.norm(away, axis=1).min() == pytest.approx(3 / 8 * 0.05 * np.sin(np.pi / 4), rel=1e-3)
    halted = built(tmp_path, TABLE | {"blend_mm": 0}, rows + "400,100,300,180,0,30\n")
    np.testing.assert_allclose(halted.tool.law.times, [0, 1, 2])


def test_table_with_times_is_where_it_says_when_it_says(tmp_path):
    rows = ["t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz", "0,300,0,300,0,1,0,0", "1,300,100,300,0,1,0,0", "2,300,100,300,0,1,0,0"]
    entry = {key: value for key, value in TABLE.items() if key != "duration_s"}
    path = built(tmp_path, entry | {"blend_mm": 0}, "\n".join([*rows, "3.5,400,100,300,0,1,0,0\n"])).tool
    assert path.duration == 3.5
    at = path.poses(path.progress(np.array([0.0, 1.0, 1.7, 2.0, 3.5]))[0])[:, :3, 3]
    np.testing.assert_allclose(
        at, [[0.3, 0, 0.3], [0.3, 0.1, 0.3], [0.3, 0.1, 0.3], [0.3, 0.1, 0.3], [0.4, 0.1, 0.3]], atol=1e-12
    )


def test_half_turns_of_a_sequence_are_told_and_chosen(tmp_path):
    turned = TO_A | {"end": {"xyz_mm": [300, 100, 300], "rpy_deg": [180, 0, 180]}}
    back = TO_B | {"end": {"xyz_mm": [400, 100, 300], "rpy_deg": [180, 0, 180]}}
    ((segment, axis),) = built(tmp_path, SEQUENCE | {"segments": [turned, back]}).tool.half_turns()
    assert segment == 1
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)
    assert built(tmp_path, SEQUENCE | {"segments": [turned, back]}).turns_open == (1,)
    chosen = SEQUENCE | {"segments": [turned | {"half_turn_axis": [0, 0, -1]}, back]}
    assert built(tmp_path, chosen).turns_open == ()
    np.testing.assert_allclose(built(tmp_path, chosen).tool.half_turns()[0][1], [0, 0, -1], atol=1e-12)


def test_half_turn_of_a_table_is_told_and_chosen(tmp_path):
    rows = (
        "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n300,0,300,180,0,0\n300,100,300,180,0,180\n400,100,300,180,0,180\n"
    )
    np.testing.assert_allclose(built(tmp_path, TABLE, rows).tool.half_turns()[0][1], [0, 0, 1], atol=1e-12)
    assert built(tmp_path, TABLE, rows).turns_open == (1,)
    chosen = built(tmp_path, TABLE | {"half_turn_axis": [0, 0, -1]}, rows)
    np.testing.assert_allclose(chosen.tool.half_turns()[0][1], [0, 0, -1], atol=1e-12)
    assert chosen.turns_open == ()
    with pytest.raises(InputError, match=r"half_turn_axis: on the way to row 3 of .*right angles"):
        built(tmp_path, TABLE | {"half_turn_axis": [1, 0, 0]}, rows)
    with pytest.raises(InputError, match=r"half_turn_axis: nothing in the table turns by 180 deg"):
        built(tmp_path, TABLE | {"half_turn_axis": [1, 0, 0]}, rows.replace("0,180\n", "0,90\n"))


ROWS = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n300,0,300,180,0,0\n300,100,300,180,0,0\n"
BAD = {
    "straight arc": (ARC | {"via_mm": [300, 75, 300]}, None, r"paths\[0\]\.via_mm: .*straight line"),
    "via on the start": (ARC | {"via_mm": [300, 0, 300]}, None, r"paths\[0\]\.via_mm: two of .* are one"),
    "via in metres": (ARC | {"via_mm": [0.35, 0.075, 0.3]}, None, r"paths\[0\]\.via_mm: .*metres"),
    "segment without way": (
        SEQUENCE | {"segments": [TO_A, TO_A, TO_B]},
        None,
        r"paths\[0\]\.segments\[1\]: the segment has no way",
    ),
    "blend too long": (
        SEQUENCE | {"segments": [TO_A | {"blend_mm": 60}, TO_B]},
        None,
        r"paths\[0\]\.segments\[0\]: .*over 60 mm: half of the shorter side is 50 mm",
    ),
    "blend at the end": (
        SEQUENCE | {"segments": [TO_A, TO_B | {"blend_mm": 20}]},
        None,
        r"paths\[0\]\.segments\[1\]\.blend_mm: the last segment has no corner",
    ),
    "unknown segment": (SEQUENCE | {"segments": [TO_A | {"kind": "spline"}]}, None, r"paths\[0\]\.segments\[0\]"),
    "axis without half turn": (
        SEQUENCE | {"segments": [TO_A, TO_B | {"half_turn_axis": [0, 0, 1]}]},
        None,
        r"paths\[0\]\.segments\[1\]\.half_turn_axis: .*the rotation is by 0 deg",
    ),
    "ramp of a quintic": (LINE | {"ramp_share": 0.2}, None, r"paths\[0\]\.ramp_share: a quintic has no ramps"),
    "ramps longer than the way": (LINE | {"profile": "trapezoid", "ramp_share": 0.6}, None, r"paths\[0\]\.ramp_share"),
    "one joint point": (JOINTS | {"points_deg": [[0] * 6]}, None, r"paths\[0\]\.points_deg"),
    "joint point repeated": (
        JOINTS | {"points_deg": [[0] * 6, [30] * 6, [30] * 6]},
        None,
        r"paths\[0\]\.points_deg\[2\]: its way there has no way",
    ),
    "joint blend too long": (JOINTS | {"blend_deg": 20}, None, r"over 20 deg: half of the shorter side is 15 deg"),
    "zero duration": (SEQUENCE | {"duration_s": 0}, None, r"paths\[0\]\.duration_s: 0 is refused"),
    "two durations": (
        TABLE,
        "t_s," + ROWS.replace("\n3", "\n0,3", 1).replace("0\n3", "0\n1,3"),
        r"duration_s: the table's",
    ),
    "no duration": ({k: v for k, v in TABLE.items() if k != "duration_s"}, ROWS, r"paths\[0\]\.duration_s: missing"),
    "blend of the other kind": (TABLE | {"blend_deg": 5}, ROWS, r"paths\[0\]\.blend_deg: the table holds poses"),
    "NaN in the table": (TABLE, ROWS + "nan,0,0,0,0,0\n", r"table.csv: row 4, column x_mm: 'nan'"),
    "unknown branch": (TABLE | {"start_branch": "upside down"}, ROWS, r"paths\[0\]\.start_branch: this robot has no"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_entries_are_refused_by_field(tmp_path, case):
    entry, table, message = BAD[case]
    with pytest.raises(InputError, match=message):
        built(tmp_path, entry, table)
