"""RAPID: what its data, motions, functions and instructions mean, by cases computed by hand from ABB's manual."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.finding import is_one
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import (
    ArmMotion,
    JointTarget,
    Output,
    Pause,
    PoseTarget,
    Rate,
    Unknown,
    UnresolvedTarget,
    Zone,
)
from er3a.programs.languages import execute, files_of, read_program, write_program
from er3a.programs.rapid.data_types import branch_of
from er3a.programs.rapid.reader import MOTIONS
from er3a.programs.solving import solutions_meant
from er3a.programs.writing import WriteOptions

ROBOT = load_robot("er3a_c60")
NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DATA = f"""
  CONST robtarget p:=[[100,200,300],[1,0,0,0],[0,0,0,0],{NONE}];
  CONST robtarget turned:=[[100,200,300],[0.70710678118,0,0,0.70710678118],[0,0,0,0],{NONE}];
  CONST robtarget down:=[[100,200,300],[0,0,1,0],[0,0,0,0],{NONE}];
  CONST robtarget pts{{2}}:=[[[1,2,3],[1,0,0,0],[0,0,0,0],{NONE}],[[4,5,6],[1,0,0,0],[0,0,0,0],{NONE}]];
  CONST pos grid{{2,3}}:=[[[1,0,0],[2,0,0],[3,0,0]],[[4,0,0],[5,0,0],[6,0,0]]];
  VAR robtarget t;
  VAR num n:=3;
  VAR num list{{3}}:=[10,20,30];
  VAR bool flag;
  VAR string text;
  VAR pose frame:=[[10,0,0],[0.70710678118,0,0,0.70710678118]];
  PERS tooldata gripper:=[TRUE,[[0,0,120],[1,0,0,0]],[2,[0,0,60],[1,0,0,0],0,0,0]];
  PERS tooldata fixed:=[FALSE,[[0,0,120],[1,0,0,0]],[2,[0,0,60],[1,0,0,0],0,0,0]];
  PERS wobjdata table:=[FALSE,TRUE,"",[[1000,0,0],[1,0,0,0]],[[0,50,0],[0.70710678118,0,0,0.70710678118]]];
  PERS wobjdata held:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata conveyor:=[FALSE,FALSE,"CNV1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST speeddata slow:=[40,15,200,20];
  CONST zonedata wide:=[FALSE,7,9,9,1,9,1];
  CONST jointtarget home:=[[10,-20,30,-40,50,-60],{NONE}];
"""
HALF = math.sqrt(0.5)


def saved(folder, body, data=DATA, name="job.mod"):
    """The file of a module with a procedure main, and what else is given behind ``MORE``; ``@``: speed, zone, tool."""
    main, _, more = body.replace("@", "v100,fine,tool0").partition("MORE")
    path = folder / name
    text = f"MODULE job\n{data}\n  PROC main()\n{main}\n  ENDPROC\n{more}\nENDMODULE\n"
    path.write_text(text, encoding="utf-8")
    return path


def run(folder, body, data=DATA, **options):
    """A module, run."""
    return execute(read_program(saved(folder, body, data)), **options)


def motions(execution):
    """The motions of all ways."""
    return [step.instruction for step in execution.steps if isinstance(step.instruction, ArmMotion)]


def move(folder, body, **options):
    """The last motion."""
    return motions(run(folder, body, **options))[-1]


POSES = {  # instructions, mm, quaternion (w first)
    "robtarget": ("MoveL p,@;", (100, 200, 300), (1, 0, 0, 0)),
    "quaternion": ("MoveL turned,@;", (100, 200, 300), (HALF, 0, 0, HALF)),
    "aggregate": (f"MoveJ [[1,-2,3.5],[0,1,0,0],[0,0,0,0],{NONE}],@;", (1, -2, 3.5), (0, 1, 0, 0)),
    "offs": ("MoveL Offs(p,10,20,30),@;", (110, 220, 330), (1, 0, 0, 0)),
    "offs_of_the_object": ("MoveL Offs(turned,10,0,0),@;", (110, 200, 300), (HALF, 0, 0, HALF)),
    "reltool": ("MoveL RelTool(turned,10,0,0),@;", (100, 210, 300), (HALF, 0, 0, HALF)),
    "reltool_down": ("MoveL RelTool(down,5,0,50),@;", (95, 200, 250), (0, 0, 1, 0)),
    "reltool_rz": ("MoveL RelTool(p,0,0,0\\Rz:=90),@;", (100, 200, 300), (HALF, 0, 0, HALF)),
    "reltool_order": (
        "MoveL RelTool(p,0,0,0\\Rx:=90\\Rz:=90),@;",
        (100, 200, 300),
        (0.5, 0.5, -0.5, 0.5),
    ),
    "reltool_shift_first": ("MoveL RelTool(p,10,0,0\\Rz:=90),@;", (110, 200, 300), (HALF, 0, 0, HALF)),
    "nested": ("MoveL Offs(RelTool(down,0,0,-40),1,0,0),@;", (101, 200, 340), (0, 0, 1, 0)),
    "element": ("MoveL pts{2},@;", (4, 5, 6), (1, 0, 0, 0)),
    "component": ("t:=p; t.trans.x:=t.trans.x+n; MoveL t,@;", (103, 200, 300), (1, 0, 0, 0)),
    "whole_pos": ("t:=p; t.trans:=[9,8,7]; MoveL t,@;", (9, 8, 7), (1, 0, 0, 0)),
    "whole_pos_and_component": ("t:=p; t.trans:=[9,8,7]; t.trans.z:=6; MoveL t,@;", (9, 8, 6), (1, 0, 0, 0)),
    "orientzyx": ("t:=p; t.rot:=OrientZYX(90,0,0); MoveL t,@;", (100, 200, 300), (HALF, 0, 0, HALF)),
    "orientzyx_order": (
        "t:=p; t.rot:=OrientZYX(90,90,0); MoveL t,@;",
        (100, 200, 300),
        (0.5, -0.5, 0.5, 0.5),
    ),
    "posemult": (
        "frame:=PoseMult(frame,frame); t:=p; t.trans:=frame.trans; t.rot:=frame.rot; MoveL t,@;",
        (10, 10, 0),
        (0, 0, 0, 1),
    ),
    "crobt": (
        "MoveL p,@; t:=CRobT(\\Tool:=tool0\\WObj:=wobj0); MoveL Offs(t,0,0,5),@;",
        (100, 200, 305),
        (1, 0, 0, 0),
    ),
    "crobt_of_another_tool": (
        "MoveL p,@; t:=CRobT(\\Tool:=gripper\\WObj:=wobj0); MoveL t,v100,fine,gripper;",
        (100, 200, 420),
        (1, 0, 0, 0),
    ),
    "cpos_in_an_object": (
        "MoveL p,@; t:=p; t.trans:=CPos(\\Tool:=tool0\\WObj:=table); MoveL t,@\\WObj:=table;",
        (150, 900, 300),
        (1, 0, 0, 0),
    ),
}


@pytest.mark.parametrize("case", POSES)
def test_where_a_target_is(case, tmp_path):
    body, xyz, quaternion = POSES[case]
    found = move(tmp_path, body)
    assert isinstance(found.target, PoseTarget), found.target
    np.testing.assert_allclose(found.target.pose[:3, 3] * 1000, xyz, atol=1e-6)
    wanted = Rotation.from_quat([*quaternion[1:], quaternion[0]]).as_matrix()
    np.testing.assert_allclose(found.target.pose[:3, :3], wanted, atol=1e-9)


VALUES = {  # what stands behind n:=, and the number
    "precedence": ("2+3*4", 14),
    "whole_parts": ("17 DIV 5 + 17 MOD 5", 5),
    "division": ("7/2", 3.5),
    "minus_first": ("-2*3+1", -5),
    "sine": ("Sin(30)", 0.5),
    "atan2": ("ATan2(1,-1)", 135),
    "acos": ("ACos(0.5)", 60),
    "element": ("list{2}", 20),
    "exponent": ("1E1+.5", 10.5),
}


@pytest.mark.parametrize("case", VALUES)
def test_what_an_expression_gives(case, tmp_path):
    expression, wanted = VALUES[case]
    found = move(tmp_path, f"n:={expression}; MoveL Offs(p,n,0,0),@;")
    assert found.target.pose[0, 3] * 1000 - 100 == pytest.approx(wanted, abs=1e-6)


COURSES = {  # instructions, x of the targets in their order, relative to p
    "for": ("FOR i FROM 1 TO 3 DO #i; ENDFOR", [1, 2, 3]),
    "for_down": ("FOR i FROM 3 TO 1 DO #i; ENDFOR", [3, 2, 1]),
    "for_step": ("FOR i FROM 0 TO 10 STEP 5 DO #i; ENDFOR", [0, 5, 10]),
    "while": ("WHILE n>1 DO #n; Decr n; ENDWHILE", [3, 2]),
    "if": ("IF n=3 THEN n:=8; ELSEIF n=4 THEN n:=9; ELSE n:=7; ENDIF #n;", [8]),
    "compact_if": ("IF NOT flag AND n>2 n:=5; IF n=0 n:=6; #n;", [5]),
    "not_binds_least": ("IF NOT n=4 n:=1; #n;", [1]),
    "not_of_a_whole_term": ("IF NOT flag AND n=0 n:=9; #n;", [9]),
    "xor": ("IF (n=3) XOR (n=4) n:=9; #n;", [9]),
    "recursion": ("down_from 3; MORE PROC down_from(num k) IF k=0 RETURN; #k; down_from k-1; ENDPROC", [3, 2, 1]),
    "array_argument": (
        "FOR i FROM 1 TO 3 DO n:=third(list); ENDFOR #n; MORE FUNC num third(num a{*}) RETURN a{3}/10; ENDFUNC",
        [3],
    ),
    "test": ("TEST n CASE 1,2: n:=10; CASE 3: n:=20; DEFAULT: n:=30; ENDTEST #n;", [20]),
    "call": ("go 4; MORE PROC go(num x) #x; ENDPROC", [4]),
    "inout": ("twice n; #n; MORE PROC twice(INOUT num x) x:=2*x; ENDPROC", [6]),
    "by_value": ("twice n; #n; MORE PROC twice(num x) x:=2*x; ENDPROC", [3]),
    "func": ("MoveL above(n),@; MORE FUNC robtarget above(num x) RETURN Offs(p,x+1,0,0); ENDFUNC", [4]),
    "own_counters": (
        "FOR i FROM 1 TO 2 DO inside; #i; ENDFOR MORE PROC inside() FOR i FROM 8 TO 9 DO n:=i; ENDFOR ENDPROC",
        [1, 2],
    ),
    "counters_hide_data": (
        "FOR n FROM n TO n+1 DO FOR n FROM 7 TO 7 DO #n; told; ENDFOR #n; ENDFOR #n; MORE PROC told() #n; ENDPROC",
        [7, 3, 3, 7, 3, 4, 3],
    ),
    "exit": ("MoveL p,@; EXIT; #1;", [0]),
}


@pytest.mark.parametrize("case", COURSES)
def test_the_course_of_a_program(case, tmp_path):
    body, wanted = COURSES[case]
    execution = run(tmp_path, re.sub(r"#(\w+)", r"MoveL Offs(p,\1,0,0),@", body))
    assert [each.kind for each in execution.endings] == ["end"]
    found = [each.target.pose[0, 3] * 1000 - 100 for each in motions(execution)]
    np.testing.assert_allclose(found, wanted, atol=1e-9)


SPEEDS = {  # instructions, speed, turn in deg/s, zone
    "predefined": ("MoveL p,v100,z10,tool0;", Rate(0.1, "m/s"), 500, Zone("distance", 0.01, "z10")),
    "own_data": ("MoveL p,slow,wide,tool0;", Rate(0.04, "m/s"), 15, Zone("distance", 0.007, "wide")),
    "time": ("MoveL p,v100\\T:=2.5,fine,tool0;", Rate(2.5, "s"), None, Zone()),
    "stop_point": ("MoveL p,v100,z50\\Inpos:=inpos50,tool0;", Rate(0.1, "m/s"), 500, Zone()),
    "velset": ("VelSet 50,800; MoveL p,v1000,fine,tool0;", Rate(0.5, "m/s"), 250, Zone()),
    "velset_bounds": ("VelSet 100,80; MoveL p,v1000,fine,tool0;", Rate(0.08, "m/s"), 500, Zone()),
    "joint": ("MoveJ p,v100,z1,tool0;", Rate(0.1, "m/s"), None, Zone("distance", 0.001, "z1")),
    "fastest": ("VelSet 30,5000; MoveAbsJ home,vmax,fine,tool0;", Rate(0.3, "share", "vmax"), None, Zone()),
    "output_besides": ("MoveLDO p,v100,z10,tool0,do1,1;", Rate(0.1, "m/s"), 500, Zone("distance", 0.01, "z10")),
}  # fmt: skip


@pytest.mark.parametrize("case", SPEEDS)
def test_speeds_and_zones(case, tmp_path):
    body, speed, turn, zone = SPEEDS[case]
    found = move(tmp_path, body)
    assert (found.speed.value, found.speed.unit) == (pytest.approx(speed.value), speed.unit)
    assert found.turn_speed == (None if turn is None else pytest.approx(math.radians(turn)))
    assert (found.zone.kind, found.zone.value, found.zone.text) == (zone.kind, pytest.approx(zone.value), zone.text)


def test_a_timed_motion_is_written_without_the_share_of_the_motion_before(tmp_path):
    """What VelSet scales may be timed motions as well."""
    turned = "[[10,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = f"VelSet 10,5000; MoveAbsJ home,vmax,fine,tool0; MoveAbsJ {turned},v100\\T:=2,fine,tool0;"
    text = write_program(run(tmp_path, body, robot=ROBOT).listing(), "rapid", WriteOptions(ROBOT)).files[".mod"]
    settings = re.findall(r"VelSet [\d.]+|\\T:=", text)
    assert settings == ["VelSet 10.0", "VelSet 100", "\\T:="]


RAMPS = {  # instructions, acceleration of a line behind them
    "none": ("", None),
    "share": ("AccSet 50,100;", Rate(0.5, "share")),
    "at_least_20_percent": ("AccSet 10,100;", Rate(0.2, "share")),
    "off_again": ("AccSet 50,100; WorldAccLim\\On:=2; WorldAccLim\\Off;", Rate(0.5, "share")),
}


@pytest.mark.parametrize("case", RAMPS)
def test_accelerations(case, tmp_path):
    body, wanted = RAMPS[case]
    assert move(tmp_path, f"{body} MoveL p,@;").acceleration == wanted


STANDING = {  # what comes before a position is read, and whether the arm stands at p then
    "stop_point": ("MoveL p,@;", True),
    "zone": ("MoveL p,v100,z50,tool0;", False),
    "zone_and_time": ("MoveL p,v100,z50,tool0; WaitTime 1;", False),
    "broken_off": ("MoveL p,@; StopMove;", False),
    "stored_path": ("MoveL p,@; StorePath; RestoPath;", False),
    "another_robot": ('MoveL p,@; t:=CRobT(\\TaskName:="T_ROB2");', None),
}


@pytest.mark.parametrize("case", STANDING)
@pytest.mark.parametrize("read", ["t:=CRobT();", "t:=p; t.trans:=CPos();"])
def test_a_position_is_read_only_where_the_arm_stands(case, read, tmp_path):
    before, stands = STANDING[case]
    found = move(tmp_path, f"{before} {'' if stands is None else read} MoveL t,@;")
    known = isinstance(found.target, PoseTarget) and found.base.pose is not None
    assert known == (stands is True)


def test_frames_of_tools_and_work_objects(tmp_path):
    found = move(tmp_path, "MoveL p,v100,fine,gripper\\WObj:=table;")
    assert (found.tool.name, found.base.name) == ("gripper", "table")
    np.testing.assert_allclose(found.tool.pose[:3, 3], [0, 0, 0.12])
    np.testing.assert_allclose(found.base.pose[:3, 3], [1.0, 0.05, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.base.pose[:3, :3] @ [1, 0, 0], [0, 1, 0], atol=1e-9)
    for body in ("MoveL p,v100,fine,fixed;", "MoveL p,@\\WObj:=held;"):
        assert move(tmp_path, body).target.reason == "external_tool"
    moved = move(tmp_path, "MoveL p,@\\WObj:=conveyor;")
    assert (moved.base.name, moved.base.pose) == ("conveyor", None)
    mapped = move(tmp_path, "MoveL p,v100,fine,tGun;", frames={"TGUN": np.eye(4)})
    assert mapped.tool.pose is not None
    assert move(tmp_path, "MoveL p,v100,fine,tGun;").tool.pose is None
    handed = "go tGun; MORE PROC go(PERS tooldata held) MoveL p,v100,fine,held; ENDPROC"
    assert move(tmp_path, handed).tool.name == "tgun"


def test_joint_targets_and_arcs(tmp_path):
    found = move(tmp_path, "MoveAbsJ home\\NoEOffs,@;")
    assert isinstance(found.target, JointTarget)
    np.testing.assert_allclose(np.degrees(found.target.joints), [10, -20, 30, -40, 50, -60])
    arc = move(tmp_path, "MoveC pts{1},p,v100,z10,tool0;")
    np.testing.assert_allclose(arc.via.pose[:3, 3] * 1000, [1, 2, 3])
    outer = move(tmp_path, "MoveAbsJ [[0,0,0,0,0,0],[150,9E9,9E9,9E9,9E9,0]],@;")
    assert outer.target.external == (("eax_a", 150.0),)


QUARTERS = [  # confdata, joints in deg, whether they have it
    ((0, 0, 0, 0), (10, 0, 0, 20, 30, 40), True),
    ((0, 0, 0, 0), (-10, 0, 0, 20, 30, 40), False),
    ((-1, 0, 0, 0), (-10, 0, 0, 20, 30, 40), True),
    ((1, -2, 3, 0), (100, 0, 0, -91, 30, 280), True),
    ((1, -2, 3, 0), (100, 0, 0, -89, 30, 280), False),
    ((0, 0, 0, 0), (10, 0, 0, 20, -30, 40), False),
    ((0, 0, 0, 1), (10, 0, 0, 20, -30, 40), True),
    ((0, 0, 0, 0), (90, 0, 0, 0, 30, 90), True),
    ((1, -1, 1, 0), (90, 0, 0, 0, 30, 90), True),
]


@pytest.mark.parametrize(("conf", "degrees", "has"), QUARTERS)
def test_quarters_of_confdata(conf, degrees, has):
    branch = branch_of(tuple(map(float, conf)), 6)
    rows = np.radians([degrees])
    assert bool(((rows >= branch.ranges[:, 0]) & (rows <= branch.ranges[:, 1])).all()) == has


@pytest.mark.parametrize(
    ("cfx", "behind_axis_1", "behind_arm"), [(0, False, False), (2, False, True), (5, True, False), (7, True, True)]
)
def test_sides_of_cfx(cfx, behind_axis_1, behind_arm):
    branch = branch_of((0.0, 0.0, 0.0, float(cfx)), 6)
    assert (branch.behind_axis_1, branch.behind_lower_arm) == (behind_axis_1, behind_arm)


def test_of_several_solutions_the_one_with_the_configuration_is_taken(tmp_path):
    q = np.radians([20.0, -30.0, 20.0, 30.0, -60.0, 20.0])
    pose = forward(ROBOT, q)
    rows = inverse(ROBOT, pose, None).q
    rows = rows[((rows >= ROBOT.lower) & (rows <= ROBOT.upper)).all(axis=1)]
    assert len(rows) > 2
    x, y, z = pose[:3, 3] * 1000
    turn = Rotation.from_matrix(pose[:3, :3]).as_quat()[[3, 0, 1, 2]]
    taken = set()
    for row in rows:
        quarters = np.floor(np.degrees(row[[0, 3, 5]]) / 90).astype(int)
        for cfx in range(8):
            conf = (*quarters.tolist(), cfx)
            if not solutions_meant(branch_of(tuple(map(float, conf)), 6), ROBOT, row[None])[0]:
                continue
            text = f"[[{x:.9f},{y:.9f},{z:.9f}],[{','.join(f'{each:.12f}' for each in turn)}],{list(conf)},{NONE}]"
            program = read_program(saved(tmp_path, f"MoveJ {text},@;"))
            check = check_program(program, ROBOT, CheckOptions(start=np.zeros(6)))
            end = check.motions[check.main[0]].end
            met = solutions_meant(branch_of(tuple(map(float, conf)), 6), ROBOT, rows)
            nearest = rows[met][np.abs(rows[met]).max(axis=1).argmin()]
            np.testing.assert_allclose(end, nearest, atol=1e-6)
            assert "configuration_not_met" not in {each.finding.code for each in check.findings}
            taken.add(tuple(np.round(end, 6)))
            break
    assert len(taken) > 2
    impossible = f"[[{x:.9f},{y:.9f},{z:.9f}],[{','.join(f'{each:.12f}' for each in turn)}],[1,1,-2,1],{NONE}]"
    for supervised, word in (("", "MoveJ"), ("ConfJ\\Off;", "MoveJ")):
        program = read_program(saved(tmp_path, f"{supervised} {word} {impossible},@;"))
        codes = {each.finding.code for each in check_program(program, ROBOT, CheckOptions(start=np.zeros(6))).findings}
        assert ("configuration_not_met" in codes) == (not supervised)
        assert bool(motions(execute(program))[-1].target.configuration) == (not supervised)


@pytest.mark.parametrize("seed", range(4))
def test_with_the_wrist_in_line_any_share_of_its_joints_has_the_configuration(seed, tmp_path):
    rng = np.random.default_rng(seed)
    q = np.radians([rng.uniform(-80, 80), -20.0, 15.0, rng.uniform(-170, 170), 0.0, rng.uniform(-170, 170)])
    pose = forward(ROBOT, q)
    turn = ",".join(f"{each:.6g}" for each in Rotation.from_matrix(pose[:3, :3]).as_quat()[[3, 0, 1, 2]])
    xyz = ",".join(f"{each * 1000:.2f}" for each in pose[:3, 3])
    for turned in (0.0, np.pi / 2, np.pi):  # of the first joint a quarter or half a turn off: no solution is there
        quarters = np.floor((q[[0, 3, 5]] + np.array([turned, 0, 0])) / (np.pi / 2)).astype(int).tolist()
        program = read_program(
            saved(tmp_path, f"MoveJ [[{xyz}],[{turn}],[{quarters[0]},{quarters[1]},{quarters[2]},0],{NONE}],@;")
        )
        check = check_program(program, ROBOT, CheckOptions(start=np.zeros(6)))
        codes = {each.finding.code for each in check.findings}
        assert ("configuration_not_met" in codes) == (turned > 0)
        end = check.motions[check.main[0]].end
        assert np.abs(forward(ROBOT, end) - pose).max() < 2e-5
        if not turned:
            assert np.floor(end[[0, 3, 5]] / (np.pi / 2)).astype(int).tolist() == quarters


def test_a_line_that_arrives_in_another_configuration_is_named(tmp_path):
    q = np.radians([10.0, -20.0, 15.0, 5.0, -60.0, 20.0])
    end = forward(ROBOT, q)
    turn = ",".join(f"{each:.12f}" for each in Rotation.from_matrix(end[:3, :3]).as_quat()[[3, 0, 1, 2]])
    xyz = ",".join(f"{each * 1000 + (10 if i == 2 else 0):.9f}" for i, each in enumerate(end[:3, 3]))
    joints = ",".join(f"{each:.9f}" for each in np.degrees(q))
    stated = (("0,0,0,1", "", False), ("-1,0,-1,1", "", False), ("0,0,0,0", "", True), ("0,0,4,1", "", True))
    for conf, setting, named in (*stated, ("-3,0,0,1", "", True), ("-3,0,0,1", "ConfL\\Off;", False)):
        body = f"MoveAbsJ [[{joints}],{NONE}],@; {setting} MoveL [[{xyz}],[{turn}],[{conf}],{NONE}],@;"
        check = check_program(read_program(saved(tmp_path, body)), ROBOT, CheckOptions(start=q))
        assert ("configuration_not_met" in {each.finding.code for each in check.findings}) == named


def test_modules_share_what_is_not_local(tmp_path):
    (tmp_path / "points.sys").write_text(
        f"MODULE points(SYSMODULE)\n PERS robtarget there:=[[5,6,7],[1,0,0,0],[0,0,0,0],{NONE}];\n"
        " LOCAL VAR num n:=50;\n LOCAL PROC helper() n:=n+1; ENDPROC\n"
        " PROC approach(num x)\n  helper;\n  MoveL Offs(there,x,n,0),v100,fine,tool0;\n ENDPROC\nENDMODULE\n"
    )
    (tmp_path / "other.mod").write_text("MODULE other\n PROC main()\n  Stop;\n ENDPROC\nENDMODULE\n")
    path = saved(tmp_path, "n:=1; approach 10; MoveL Offs(there,n,0,0),@; MORE PROC helper() ENDPROC")
    assert [each.name for each in files_of(path)] == ["job.mod", "points.sys"]
    found = motions(execute(read_program(path)))
    np.testing.assert_allclose([each.target.pose[:2, 3] * 1000 for each in found], [[15, 57], [6, 6]])


def test_what_another_module_declares_local_is_not_seen(tmp_path):
    point = "robtarget q:=[[{},6,7],[1,0,0,0],[0,0,0,0]," + NONE + "];\n"
    shared = tmp_path / "points.mod"
    sub = "MODULE sub\n PROC second() MoveL q,v100,fine,tool0; helper; ENDPROC\nENDMODULE\n"
    (tmp_path / "sub.mod").write_text(sub)
    own = f"second; helper; MoveL q,@; MORE LOCAL CONST {point.format(5)} LOCAL PROC helper() n:=n+1; ENDPROC"
    path = saved(tmp_path, own)

    execution = execute(read_program(path))
    hidden, of_main = motions(execution)
    assert of_main.target.pose[0, 3] == pytest.approx(0.005)
    assert isinstance(hidden.target, UnresolvedTarget)
    assert Unknown("helper") in [step.instruction for step in execution.steps]

    shared.write_text(f"MODULE points\n CONST {point.format(8)} PROC helper() n:=n+5; ENDPROC\nENDMODULE\n")
    program = read_program(path)
    found = motions(execute(program))
    np.testing.assert_allclose([each.target.pose[0, 3] for each in found], [0.008, 0.005])

    shared.write_text(f"MODULE points\n LOCAL CONST {point.format(8)} LOCAL PROC helper() n:=n+5; ENDPROC\nENDMODULE\n")
    path = saved(tmp_path, "MoveL q,@;")
    assert isinstance(motions(execute(read_program(path)))[0].target, UnresolvedTarget)


def test_what_an_instruction_reads_has_no_known_value(tmp_path):
    for body in (
        "TPReadNum n,text;",
        "flag:=StrToVal(text,n);",
        "IF StrToVal(text,n) Stop;",
        "ReadRawBytes raw,n;",
        'IVarValue "x:",1,n,x;',
    ):
        assert isinstance(move(tmp_path, f"{body} MoveL Offs(p,n,0,0),@;").target, UnresolvedTarget), body


def test_both_sides_of_a_signal_are_followed(tmp_path):
    execution = run(tmp_path, "IF di1=1 THEN MoveL p,@; ELSE MoveL down,@; ENDIF")
    assert len(motions(execution)) == 2
    waits = run(tmp_path, "WaitDI di1,1; WaitTime 0.5; WaitUntil flag; Stop; SetDO do1,1; MoveL p,@;")
    found = [step.instruction for step in waits.steps]
    assert [each.seconds for each in found if isinstance(each, Pause)] == [None, 0.5, None, None]
    assert [each.value for each in found if isinstance(each, Output)] == ["SetDO do1,1"]


UNKNOWN = {
    "instruction": "ArcL p,v100,seam1,weave1,z10,tool0;",
    "late": "%text%;",
    "function": "n:=Mystery(3);",
    "grammar": "MoveL p v100 fine tool0;",
    "arguments": "MoveL p,v100;",
    "switch_of_a_function": "text:=NumToStr(5,0\\Exp); %text%;",
    "process": "SpotL p,v100,gun1,spot1,tool0;",
    "loaded_module": 'Load "HOME:/more.mod"; %"more"%;',
    "cleared_path": "ClearPath;",
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_what_is_not_understood_is_kept_and_may_move(case, tmp_path):
    execution = run(tmp_path, f"MoveAbsJ home,@; {UNKNOWN[case]} t:=CRobT(); MoveL t,@;", robot=ROBOT)
    kept = [step.instruction for step in execution.steps]
    unknown = any(isinstance(each, Unknown) and each.may_move for each in kept)
    refused = any(isinstance(each, ArmMotion) and isinstance(each.target, UnresolvedTarget) for each in kept[1:-1])
    assert unknown or refused
    assert isinstance(motions(execution)[-1].target, UnresolvedTarget)


def test_the_motions_that_are_read_are_listed():
    text = (Path(__file__).parents[2] / "docs/programs.md").read_text(encoding="utf-8")
    listed = re.search(r"\*\*Motions\*\* that are read: (.*?)\n\n", text, re.DOTALL)[1]
    assert {name.upper() for name in re.findall(r"`(\w+)`", listed)} == MOTIONS


BROKEN = {
    "no_endproc": "MODULE a\nPROC main()\nMoveL p,@;\nENDMODULE\n",
    "no_endif": "MODULE a\nPROC main()\nIF n=1 THEN\nn:=2;\nENDPROC\nENDMODULE\n",
    "no_end_of_text": 'MODULE a\nPROC main()\nTPWrite "hello;\nENDPROC\nENDMODULE\n',
    "bad_for": "MODULE a\nPROC main()\nFOR i 1 TO 3 DO\nENDFOR\nENDPROC\nENDMODULE\n",
}


@pytest.mark.parametrize("case", BROKEN)
def test_blocks_without_an_end_are_one_error_with_its_line(case, tmp_path):
    path = tmp_path / "a.mod"
    path.write_text(BROKEN[case])
    with pytest.raises(InputError) as caught:
        read_program(path)
    assert caught.value.file == str(path)
    assert "line" in str(caught.value)


def test_tools_come_back_with_their_names_and_masses(tmp_path):
    data = DATA.replace(
        "[2,[0,0,60],[1,0,0,0],0,0,0]", "[2.5,[10,0,60],[0.70710678118,0,0,0.70710678118],0.1,0.2,0.3]", 1
    )
    body = "MoveAbsJ home,v200,z10,gripper; MoveL p,slow,fine,gripper\\WObj:=table;"
    execution = run(tmp_path, body, data, robot=ROBOT)
    load = motions(execution)[0].tool.load
    assert (load.mass, load.centre) == (2.5, (0.01, 0.0, 0.06))
    np.testing.assert_allclose(np.diag(load.inertia_matrix), [0.2, 0.1, 0.3], atol=1e-9)
    written = write_program(execution.listing(), "rapid", WriteOptions(ROBOT))
    text = written.files[".mod"]
    assert "PERS tooldata gripper:=[TRUE,[[0.000000,0.000000,120.000000]" in text
    assert "PERS wobjdata table:=[FALSE,TRUE" in text
    assert not any(is_one(each, "written_tool_not_given") for each in written.findings)
    (tmp_path / "again.mod").write_text(text)
    again = execute(read_program(tmp_path / "again.mod"), ROBOT)
    for before, after in zip(motions(execution), motions(again), strict=True):
        np.testing.assert_allclose(after.tool.pose, before.tool.pose, atol=1e-9)
        np.testing.assert_allclose(after.base.pose, before.base.pose, atol=1e-9)
        np.testing.assert_allclose(after.tool.load.inertia_matrix, load.inertia_matrix, atol=1e-8)
        assert after.speed == before.speed
        assert after.turn_speed == before.turn_speed or after.turn_speed == pytest.approx(before.turn_speed)
        assert after.zone.value == before.zone.value
    unknown = run(tmp_path, "MoveAbsJ home,v200,z10,gripper;", DATA.replace("[2,[0", "[0.001,[0"), robot=ROBOT)
    named = write_program(unknown.listing(), "rapid", WriteOptions(ROBOT)).findings
    assert [each.name for each in named if is_one(each, "written_tool_not_given")] == ["the load of gripper"]


@pytest.mark.parametrize("rotation", ["[2,0,0,0]", "[0.5,0,0,0]", "[1,1,0,0]"])
def test_a_quaternion_whose_length_is_not_1_is_no_orientation(rotation, tmp_path):
    path = tmp_path / "m.mod"
    target = f"[[300,0,300],{rotation},[0,0,0,0],{NONE}]"
    path.write_text(f"MODULE m\nPROC main()\nMoveJ {target},v100,fine,tool0;\nENDPROC\nENDMODULE\n", encoding="utf-8")
    (move,) = [
        step.instruction for step in execute(read_program(path)).steps if isinstance(step.instruction, ArmMotion)
    ]
    assert isinstance(move.target, UnresolvedTarget)


def test_an_instruction_that_may_change_an_element_whose_number_is_unknown_makes_the_list_unclear(tmp_path):
    body = f"""
    n:=GInput(gi1);
    GetDataVal "x",list{{n}};
    GetDataVal "x",twin.count{{n}};
    WHILE di1=1 DO
      MoveAbsJ [[list{{1}},0,0,0,30,0],{NONE}],v100,fine,tool0;
    ENDWHILE"""
    (target,) = {each.target for each in motions(run(tmp_path, body))}
    assert isinstance(target, UnresolvedTarget)


def test_a_module_of_data_alone_beside_one_that_begins_again_has_no_motions(tmp_path):
    (tmp_path / "b.mod").write_text("MODULE b\nPERS num k:=1;\nPROC again()\nk:=2;\nExitCycle;\nENDPROC\nENDMODULE\n")
    (tmp_path / "a.mod").write_text("MODULE a\nPERS num m:=k;\nENDMODULE\n")
    found = check_program(read_program(tmp_path / "a.mod"), ROBOT, CheckOptions(measures=False))
    assert "program_nothing_moves" in {each.finding.code for each in found.findings}
