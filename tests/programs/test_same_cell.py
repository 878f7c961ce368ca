"""The same cell in all languages that have routines: the same motions, the same findings, the same times.

Each text is written by hand in its language's own units and angle conventions, from one list of joint angles, so that a
reader that is wrong about units, order of turns, frames, speeds or loops can't agree with the others.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.program_check.check_program import CheckOptions, assumed_limits, check_program
from er3a.programs.instructions import numbers_of
from er3a.programs.languages import read_program
from er3a.robots.masses import MassBody

pytestmark = pytest.mark.long

ROBOT = load_robot("er3a_c60")
HOME = np.radians([0.0, -20.0, 15.0, 0.0, -60.0, 0.0])
TURNED = HOME + np.radians([35.0, 0, 0, 0, 0, 0])
TOOL = np.eye(4)
TOOL[:3, 3] = [0.0, 0.0, 0.1]
BASE = np.eye(4)
BASE[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
BASE[:3, 3] = [0.3, 0.1, 0.05]
ARM = ROBOT.replace(tool=TOOL, base=np.eye(4))
SPEED, TURN_SPEED, PAUSE = 0.2, 2.0, 0.5
BEYOND = TURNED + np.radians([200.0, 0, 0, 0, 0, 0])
"""One joint alone turns, to where its limit is passed."""


def lines():
    """T_robot_tool (4, 4) of the lines of the loop, tilted and back; then into the table, and out of reach."""
    start = forward(ARM, TURNED)
    forth, down, away = start.copy(), start.copy(), start.copy()
    forth[:3, 3] += [0.02, -0.06, 0.04]
    forth[:3, :3] = start[:3, :3] @ [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]
    down[:3, 3] += [0.1, 0.07, -0.45]
    away[:3, 3] += [0.5, 0.35, 0.0]
    return [forth, start], down, away


def numbers(values, digits=12):
    return ",".join(f"{each:.{digits}f}" for each in values)


def in_base(pose):
    return np.linalg.inv(BASE) @ pose


def axes(q):
    return "{" + ",".join(f"A{i} {each:.12f}" for i, each in enumerate(np.degrees(q), 1)) + "}"


def frame(T, more=""):
    values = zip("XYZABC", numbers_of(T, "kuka"))
    return "{" + ",".join(f"{key} {each:.12f}" for key, each in values) + more + "}"


def krl():
    loop, down, away = lines()
    inside = "\n".join(f"  LIN {frame(in_base(each))}" for each in loop)
    return (
        ".src",
        f"""DEF cell( )
INT i
BAS(#VEL_PTP,100)
BAS(#ACC_PTP,100)
$TOOL={frame(TOOL)}
$BASE={frame(BASE)}
$VEL.CP={SPEED}
$ACC.CP=2.0
FOR i=1 TO 2
  PTP {axes(HOME)}
  PTP {axes(TURNED)}
{inside}
ENDFOR
WAIT SEC {PAUSE}
LIN {frame(in_base(down))}
PTP {axes(TURNED)}
LIN {frame(in_base(away))}
PTP {axes(TURNED)}
PTP {axes(BEYOND)}
END
""",
    )


LIMITS = assumed_limits(ARM, CheckOptions())
RATES = f"a={LIMITS.acceleration[0]:.12f}, v={LIMITS.speed[0]:.12f}"


def ur_pose(T):
    return f"p[{numbers(numbers_of(T, 'ur'))}]"


def urscript():
    loop, down, away = lines()
    inside = "\n".join(f"    movel({ur_pose(each)}, a=2.0, v={SPEED})" for each in loop)
    return (
        ".script",
        f"""def cell():
  set_tcp({ur_pose(TOOL)})
  i = 0
  while (i < 2):
    movej([{numbers(HOME)}], {RATES})
    movej([{numbers(TURNED)}], {RATES})
{inside}
    i = i + 1
  end
  sleep({PAUSE})
  movel({ur_pose(down)}, a=2.0, v={SPEED})
  movej([{numbers(TURNED)}], {RATES})
  movel({ur_pose(away)}, a=2.0, v={SPEED})
  movej([{numbers(TURNED)}], {RATES})
  movej([{numbers(BEYOND)}], {RATES})
end
""",
    )


def pointc(pose):
    return f"POINTC({numbers(numbers_of(pose, 'efort'))})"


def pointj(q):
    return f"POINTJ({numbers(np.degrees(q))})"


def rpl():
    loop, down, away = lines()
    inside = "\n".join(f"  MLIN({pointc(each)}, v200, fine, gun);" for each in loop)
    return (
        ".pgm",
        f"""i := 0;
WHILE i < 2 DO
  MJOINT({pointj(HOME)}, v100perc, fine, gun);
  MJOINT({pointj(TURNED)}, v100perc, fine, gun);
{inside}
  i := i + 1;
END_WHILE;
DWELL({PAUSE});
MLIN({pointc(down)}, v200, fine, gun);
MJOINT({pointj(TURNED)}, v100perc, fine, gun);
MLIN({pointc(away)}, v200, fine, gun);
MJOINT({pointj(TURNED)}, v100perc, fine, gun);
MJOINT({pointj(BEYOND)}, v100perc, fine, gun);
""",
    )


def xpl():
    def motion(word, target, speed):
        parts = f"<target>{target}</target><speed>{speed}</speed><zone>fine</zone><tool>gun</tool>"
        return f"<{word}>{parts}</{word}>"

    def joint(q):
        return motion("mjoint", pointj(q), "v100perc")

    def line(pose):
        return motion("mlin", pointc(pose), "v200")

    loop, down, away = lines()
    return (
        ".XPL",
        f"""<?xml version="1.0" encoding="utf-8"?>
<Xpl-source><XplEnvironment><Pous><Pou><Name>Main</Name><Type>Program</Type><Body>
<for><var>i</var><from>1</from><to>2</to><pouref>1</pouref></for>
<dwell><expr>{PAUSE}</expr></dwell>
{line(down)}
{joint(TURNED)}
{line(away)}
{joint(TURNED)}
{joint(BEYOND)}
</Body><Pou><Name>1</Name><Body>
{joint(HOME)}
{joint(TURNED)}
{line(loop[0])}
{line(loop[1])}
</Body></Pou></Pou></Pous></XplEnvironment></Xpl-source>
""",
    )


NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def abb_pose(T):
    values = numbers_of(T, "abb")
    return f"[{numbers(values[:3])}],[{numbers(values[3:])}]"


def abb_joint(q):
    return f"MoveAbsJ [[{numbers(np.degrees(q))}],{NO_AXES}],vmax,fine,gun;"


def rapid():
    def line(T):
        return f"MoveL [{abb_pose(in_base(T))},[0,0,0,0],{NO_AXES}],slow,fine,gun\\WObj:=plate;"

    loop, down, away = lines()
    inside = "\n".join(f"      {line(each)}" for each in loop)
    return (
        ".mod",
        f"""MODULE cell
  PERS tooldata gun:=[TRUE,[{abb_pose(TOOL)}],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata plate:=[FALSE,TRUE,"",[{abb_pose(BASE)}],[[0,0,0],[1,0,0,0]]];
  CONST speeddata slow:=[{SPEED * 1000},{np.degrees(TURN_SPEED)},5000,1000];
  PROC main()
    ConfL \\Off;
    FOR i FROM 1 TO 2 DO
      {abb_joint(HOME)}
      {abb_joint(TURNED)}
{inside}
    ENDFOR
    WaitTime {PAUSE};
    {line(down)}
    {abb_joint(TURNED)}
    {line(away)}
    {abb_joint(TURNED)}
    {abb_joint(BEYOND)}
  ENDPROC
ENDMODULE
""",
    )


NEAR = HOME + np.radians([0, 0, 0, 0, 40.0, 0])  # joint 5 at -20 deg; a line turns it to -0.5 deg
STRETCHED = HOME + np.radians([0, 0, 0, 0, 59.5, 0])
CHOSEN = np.radians([20.0, -30.0, 20.0, 30.0, -60.0, 20.0])
"""Joints of a pose that a joint motion goes to by its configuration."""
LOAD = MassBody(50.0, (0.0, 0.01, 0.06))


def stations():
    """T_robot_tool (4, 4): a corner with a zone, a stop, an arc's middle and end, joint 5 near 0, one by its branch."""
    corner, stop, via, end = (forward(ARM, HOME) for _ in range(4))
    for pose, shift in ((corner, (-50, 30, 0)), (stop, (-50, 80, 20)), (via, (-80, 110, 20)), (end, (-110, 80, 20))):
        pose[:3, 3] += np.array(shift) / 1000
    return corner, stop, via, end, forward(ARM, STRETCHED), forward(ARM, CHOSEN)


def second_krl():
    corner, stop, via, end, singular, chosen = map(in_base, stations())
    kg, centre = LOAD.mass, ",".join(f"{key} {each * 1000}" for key, each in zip("XYZ", LOAD.centre))
    return (
        ".src",
        f"""DEF cell( )
BAS(#VEL_PTP,100)
BAS(#ACC_PTP,100)
$TOOL={frame(TOOL)}
$BASE={frame(BASE)}
$VEL.CP={SPEED}
$ACC.CP=2.0
$APO.CDIS=20
PTP {axes(HOME)}
LIN {frame(corner)} C_DIS
LIN {frame(stop)}
PTP {axes(NEAR)}
LIN {frame(singular)}
PTP {axes(HOME)}
LIN {frame(stop)}
CIRC {frame(via)},{frame(end)}
$LOAD={{M {kg},CM {{{centre},A 0,B 0,C 0}},J {{X 0,Y 0,Z 0}}}}
PTP {frame(chosen, ",S 2,T 18")}
END
""",
    )


def second_urscript():
    corner, stop, via, end, singular, chosen = stations()
    return (
        ".script",
        f"""def cell():
  set_tcp({ur_pose(TOOL)})
  movej([{numbers(HOME)}], {RATES})
  movel({ur_pose(corner)}, a=2.0, v={SPEED}, r=0.02)
  movel({ur_pose(stop)}, a=2.0, v={SPEED})
  movej([{numbers(NEAR)}], {RATES})
  movel({ur_pose(singular)}, a=2.0, v={SPEED})
  movej([{numbers(HOME)}], {RATES})
  movel({ur_pose(stop)}, a=2.0, v={SPEED})
  movec({ur_pose(via)}, {ur_pose(end)}, a=2.0, v={SPEED})
  set_payload({LOAD.mass}, [{numbers(LOAD.centre)}])
  movej(get_inverse_kin({ur_pose(chosen)}, qnear=[{numbers(CHOSEN + 0.1)}]), {RATES})
end
""",
    )


def second_rpl():
    corner, stop, _, _, singular, _ = stations()
    return (
        ".pgm",
        f"""MJOINT({pointj(HOME)}, v100perc, fine, gun);
MLIN({pointc(corner)}, v200, z20, gun);
MLIN({pointc(stop)}, v200, fine, gun);
MJOINT({pointj(NEAR)}, v100perc, fine, gun);
MLIN({pointc(singular)}, v200, fine, gun);
""",
    )


def second_rapid():
    corner, stop, via, end, singular, chosen = (f"[{abb_pose(in_base(T))},[0,0,0,1],{NO_AXES}]" for T in stations())
    centre = numbers([(LOAD.centre[0]) * 1000, LOAD.centre[1] * 1000, LOAD.centre[2] * 1000 - 100])
    return (
        ".mod",
        f"""MODULE cell
  PERS tooldata gun:=[TRUE,[{abb_pose(TOOL)}],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
  PERS wobjdata plate:=[FALSE,TRUE,"",[{abb_pose(np.eye(4))}],[{abb_pose(BASE)}]];
  PERS loaddata part:=[{LOAD.mass},[{centre}],[1,0,0,0],0,0,0];
  CONST speeddata slow:=[{SPEED * 1000},{np.degrees(TURN_SPEED)},5000,1000];
  PROC main()
    ConfL \\Off;
    {abb_joint(HOME)}
    MoveL {corner},slow,z20,gun\\WObj:=plate;
    MoveL {stop},slow,fine,gun\\WObj:=plate;
    {abb_joint(NEAR)}
    MoveL {singular},slow,fine,gun\\WObj:=plate;
    {abb_joint(HOME)}
    MoveL {stop},slow,fine,gun\\WObj:=plate;
    MoveC {via},{end},slow,fine,gun\\WObj:=plate;
    GripLoad part;
    MoveJ {chosen},vmax,fine,gun\\WObj:=plate;
  ENDPROC
ENDMODULE
""",
    )


SECOND = {"krl": second_krl, "urscript": second_urscript, "rapid": second_rapid, "rpl": second_rpl}
TEXTS = {"krl": krl, "urscript": urscript, "rpl": rpl, "xpl": xpl, "rapid": rapid}


def saved(folder, suffix, text):
    path = folder / f"cell{suffix}"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def checks(tmp_path_factory):
    """The cell's check in each language."""
    folder = tmp_path_factory.mktemp("cell")
    scene = load_scene("data/scenes/table_and_post.yaml")
    found = {}
    for language, text in TEXTS.items():
        program = read_program(saved(folder, *text()))
        assert program.language == language
        found[language] = check_program(program, ARM, CheckOptions(start=HOME, scene=scene, frames={"gun": TOOL}))
    return found


def carried_out(check):
    """The motions of the program's way, in their order."""
    return [check.motions[i] for i in check.main if i in check.motions]


@pytest.fixture(scope="module")
def seconds(tmp_path_factory):
    """The second cell's check in each language: zone, singular line; where there are such, arc, load, configuration."""
    folder = tmp_path_factory.mktemp("second")
    options = CheckOptions(start=HOME, frames={"gun": TOOL}, measures=False)
    return {name: check_program(read_program(saved(folder, *text())), ARM, options) for name, text in SECOND.items()}


def test_zones_arcs_loads_and_configurations_are_the_same(seconds):
    ends = [carried_out(check)[-1].end for name, check in seconds.items() if name != "rpl"]
    for end in ends:
        np.testing.assert_allclose(end, CHOSEN, atol=1e-7)
    for first, second in pairwise(seconds.values()):
        both = list(zip(carried_out(first), carried_out(second)))  # RPL has no arcs, loads, configurations
        assert len(both) in (5, 9)
        for a, b in both:
            assert (a.motion.kind, a.motion.zone.kind) == (b.motion.kind, b.motion.zone.kind)
            assert a.motion.zone.value == pytest.approx(b.motion.zone.value)
            assert {found.code for found in a.findings} == {found.code for found in b.findings}
            np.testing.assert_allclose(a.end, b.end, atol=1e-7)
            if a.path is not None:
                assert a.path.law.duration == pytest.approx(b.path.law.duration, abs=1e-6)


def test_what_the_second_cell_is_for_is_found(seconds):
    for name, check in seconds.items():
        motions = carried_out(check)
        assert [each.motion.kind for each in motions][:5] == ["joint", "line", "line", "joint", "line"]
        assert motions[1].motion.zone.value == pytest.approx(0.02)
        assert {found.code for found in motions[4].findings} == {"passes_singularity"}
        if name != "rpl":
            assert motions[7].motion.kind == "arc"
            load = motions[8].motion.load
        if name not in ("rpl", "rapid"):  # where what is gripped is not followed
            assert (load.mass, load.centre) == (50.0, pytest.approx(LOAD.centre, abs=1e-12))


def test_the_motions_are_the_same(checks):
    for (one, first), (other, second) in pairwise(checks.items()):
        assert len(carried_out(first)) == 13
        for a, b in zip(carried_out(first), carried_out(second), strict=True):
            assert a.motion.kind == b.motion.kind, (one, other)
            for mine, own in ((a.start, b.start), (a.end, b.end)):
                assert (mine is None) == (own is None), (one, other)
                if mine is not None and own is not None:
                    np.testing.assert_allclose(mine, own, atol=1e-7, err_msg=f"{one} {other}")


def test_the_times_are_the_same(checks):
    for (one, first), (other, second) in pairwise(checks.items()):
        assert first.cycle.stopping_s == pytest.approx(second.cycle.stopping_s, abs=1e-6), (one, other)
        for a, b in zip(carried_out(first), carried_out(second), strict=True):
            assert (a.path is None) == (b.path is None)
            if a.path is not None and b.path is not None:
                assert a.path.law.duration == pytest.approx(b.path.law.duration, abs=1e-6), (one, other)


def test_the_findings_are_the_same(checks):
    codes = {
        language: [sorted({found.code for found in motion.findings}) for motion in carried_out(check)]
        for language, check in checks.items()
    }
    for one, other in pairwise(codes):
        assert codes[one] == codes[other], (one, other)
    assert "motion_collides" in codes["rapid"][8]
    assert "way_out_of_reach" in codes["rapid"][10]
    assert "above_limit" in codes["rapid"][12]
    assert not any("way_out_of_reach" in each or "motion_collides" in each for each in codes["rapid"][:8])
