"""The same cell in all languages that have routines: the same motions, the same findings, the same times.

Each text is written by hand in its language's own units and angle conventions, from one list of joint angles, so that a
reader that is wrong about units, order of turns, frames, speeds or loops can't agree with the others.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from er3a.collision.scene import Scene
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.program_check.check_program import CheckOptions, assumed_limits, check_program
from er3a.programs.instructions import numbers_of
from er3a.programs.languages import read_program, write_program
from er3a.programs.machine import execute
from er3a.programs.writing import WriteOptions

ROBOT = load_robot("er3a_c60")
LANGUAGES = ("krl", "urscript", "rpl", "xpl", "rapid")
HOME = np.radians([0.0, -20.0, 15.0, 0.0, -60.0, 0.0])
TURNED = HOME + np.radians([35.0, 0, 0, 0, 0, 0])
TOOL = np.eye(4)
TOOL[:3, 3] = [0.0, 0.0, 0.1]
BASE = np.eye(4)
BASE[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
BASE[:3, 3] = [0.3, 0.1, 0.05]
ARM = ROBOT.replace(tool=TOOL, base=np.eye(4))
SPEED, TURN_SPEED, PAUSE = 0.2, 2.0, 0.5
FAULTS = ("", "reach", "collision", "limit")


def targets(fault):
    """T_robot_tool (4, 4) of the lines: forth and back, tilted, and to where the fault is."""
    start = forward(ARM, TURNED)
    forth, back = start.copy(), start.copy()
    forth[:3, 3] += [0.02, -0.06, 0.04]
    forth[:3, :3] = start[:3, :3] @ [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]
    if fault == "reach":
        back[:3, 3] += [0.0, 3.0, 0.0]
    if fault == "collision":
        back[2, 3] = 0.01
    return [forth, back]


def last_joints(fault):
    """Where the last joint motion goes, with one joint alone moved."""
    return TURNED + np.radians([200.0 if fault == "limit" else -60.0, 0, 0, 0, 0, 0])


def numbers(values, digits=12):
    return ",".join(f"{each:.{digits}f}" for each in values)


def in_base(pose):
    return np.linalg.inv(BASE) @ pose


def krl(fault):
    def frame(pose):
        return "{" + ",".join(f"{key} {each:.12f}" for key, each in zip("XYZABC", numbers_of(pose, "kuka"))) + "}"

    def axes(q):
        return "{" + ",".join(f"A{i} {each:.12f}" for i, each in enumerate(np.degrees(q), 1)) + "}"

    lines = "\n".join(f"  LIN {frame(in_base(each))}" for each in targets(fault))
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
{lines}
ENDFOR
WAIT SEC {PAUSE}
PTP {axes(last_joints(fault))}
END
""",
    )


def urscript(fault):
    limits = assumed_limits(ARM, CheckOptions())
    rates = f"a={limits.acceleration[0]:.12f}, v={limits.speed[0]:.12f}"

    def pose(T):
        return f"p[{numbers(numbers_of(T, 'ur'))}]"

    lines = "\n".join(f"    movel({pose(each)}, a=2.0, v={SPEED})" for each in targets(fault))
    return (
        ".script",
        f"""def cell():
  set_tcp({pose(TOOL)})
  i = 0
  while (i < 2):
    movej([{numbers(HOME)}], {rates})
    movej([{numbers(TURNED)}], {rates})
{lines}
    i = i + 1
  end
  sleep({PAUSE})
  movej([{numbers(last_joints(fault))}], {rates})
end
""",
    )


def rpl(fault):
    def pose(T):
        return f"POINTC({numbers(numbers_of(T, 'efort'))})"

    def joints(q):
        return f"POINTJ({numbers(np.degrees(q))})"

    lines = "\n".join(f"  MLIN({pose(each)}, v200, fine, gun);" for each in targets(fault))
    return (
        ".pgm",
        f"""i := 0;
WHILE i < 2 DO
  MJOINT({joints(HOME)}, v100perc, fine, gun);
  MJOINT({joints(TURNED)}, v100perc, fine, gun);
{lines}
  i := i + 1;
END_WHILE;
DWELL({PAUSE});
MJOINT({joints(last_joints(fault))}, v100perc, fine, gun);
""",
    )


def rapid(fault):
    axes = "[9E9,9E9,9E9,9E9,9E9,9E9]"

    def pose(T):
        values = numbers_of(T, "abb")
        return f"[{numbers(values[:3])}],[{numbers(values[3:])}]"

    def joints(q):
        return f"[[{numbers(np.degrees(q))}],{axes}]"

    lines = "\n".join(
        f"      MoveL [{pose(in_base(each))},[0,0,0,0],{axes}],slow,fine,gun\\WObj:=plate;" for each in targets(fault)
    )
    return (
        ".mod",
        f"""MODULE cell
  PERS tooldata gun:=[TRUE,[{pose(TOOL)}],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata plate:=[FALSE,TRUE,"",[{pose(BASE)}],[[0,0,0],[1,0,0,0]]];
  CONST speeddata slow:=[{SPEED * 1000},{np.degrees(TURN_SPEED)},5000,1000];
  PROC main()
    ConfL \\Off;
    FOR i FROM 1 TO 2 DO
      MoveAbsJ {joints(HOME)},vmax,fine,gun;
      MoveAbsJ {joints(TURNED)},vmax,fine,gun;
{lines}
    ENDFOR
    WaitTime {PAUSE};
    MoveAbsJ {joints(last_joints(fault))},vmax,fine,gun;
  ENDPROC
ENDMODULE
""",
    )


def xpl(folder, fault):
    """The text as the controller's XML, its loops rolled out."""
    listing = execute(read_program(saved(folder, *rpl(fault))), ARM, frames={"gun": TOOL}).listing()
    return ".xpl", write_program(listing, "xpl", WriteOptions(ARM, start=HOME)).files[".XPL"]


def saved(folder, suffix, text):
    path = folder / f"cell{suffix}"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("data/scenes/table_and_post.yaml")


@pytest.fixture(scope="module")
def checks(tmp_path_factory, scene):
    """The cell's checks by fault and language."""
    folder = tmp_path_factory.mktemp("cell")
    texts = {"krl": krl, "urscript": urscript, "rpl": rpl, "rapid": rapid}
    found = {}
    for fault in FAULTS:
        for language in LANGUAGES:
            text = texts[language](fault) if language in texts else xpl(folder, fault)
            program = read_program(saved(folder, *text))
            assert program.language == language
            options = CheckOptions(start=HOME, scene=scene, frames={"gun": TOOL})
            found[fault, language] = check_program(program, ARM, options)
    return found


@pytest.mark.parametrize("fault", FAULTS)
def test_the_motions_are_the_same(fault, checks):
    for one, other in pairwise(LANGUAGES):
        first, second = checks[fault, one], checks[fault, other]
        ways = [[each.motions[i] for i in each.main if i in each.motions] for each in (first, second)]
        assert len(ways[0]) == 9
        for a, b in zip(*ways, strict=True):
            assert a.kind == b.kind, (one, other)
            for mine, other_end in ((a.start, b.start), (a.end, b.end)):
                assert (mine is None) == (other_end is None), (one, other)
                if mine is not None and other_end is not None:
                    np.testing.assert_allclose(mine, other_end, atol=1e-7, err_msg=f"{one} {other}")


@pytest.mark.parametrize("fault", FAULTS)
def test_the_times_are_the_same(fault, checks):
    for one, other in pairwise(LANGUAGES):
        first, second = checks[fault, one], checks[fault, other]
        assert first.cycle.stopping_s == pytest.approx(second.cycle.stopping_s, abs=1e-6), (one, other)
        for a, b in zip(*([each.motions[i] for i in each.main if i in each.motions] for each in (first, second))):
            if a.way is not None and b.way is not None:
                assert a.way.law.duration == pytest.approx(b.way.law.duration, abs=1e-6), (one, other)
    assert all(checks[fault, each].cycle.stopping_s > 0.5 for each in LANGUAGES)


@pytest.mark.parametrize("fault", FAULTS)
def test_the_findings_are_the_same(fault, checks):
    codes = {
        language: [
            sorted({found.code for found in check.motions[i].findings}) for i in check.main if i in check.motions
        ]
        for language, check in ((each, checks[fault, each]) for each in LANGUAGES)
    }
    for one, other in pairwise(LANGUAGES):
        assert codes[one] == codes[other], (one, other)
    levels = {checks[fault, each].level for each in LANGUAGES}
    wanted = {"reach": "way_out_of_reach", "collision": "motion_collides", "limit": "above_limit"}
    if fault:
        assert levels == {"fail"}
        assert wanted[fault] in {code for each in codes["rapid"] for code in each}
    else:
        assert len(levels) == 1
        assert levels != {"fail"}
