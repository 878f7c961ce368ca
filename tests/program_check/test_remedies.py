"""Each thing that a check of programs can find says what to do about it, and a program that is mended so passes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.finding import fact, is_one
from er3a.pipeline.messages.programs import ADVISED, NOT_FOLLOWED, REMEDIES, remedy
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.program_check.program_check_findings import NOTES
from er3a.programs.execution import RunLimits
from er3a.programs.languages import read_program
from er3a.robots.robot import CombinedLimit, Envelope
from testing.program_texts import axes

ROBOT = load_robot("er3a_c60")
SCENE = load_scene("data/scenes/table_and_post.yaml")


def codes_of(*folders: str) -> set[str]:
    """The codes of all findings that modules of the library make."""
    files = (file for folder in folders for file in Path("er3a", folder).rglob("*.py"))
    return {
        code
        for file in files
        for code in re.findall(r'"(\w+)"', " ".join(re.findall(r"fact\([^,)]*", file.read_text())))
    }


CODES = codes_of("program_check") - {"bodies_touch"}  # a part of one
"""What a check of a program finds."""


@pytest.mark.parametrize("code", sorted(CODES))
def test_every_caution_and_fail_has_a_remedy(code):
    assert code in NOTES or code in REMEDIES or code in ADVISED


def test_no_remedy_is_for_what_is_never_found():
    assert len(CODES) > 20
    told = {"later_out_of_reach"}  # in place of another, by the page
    assert set(REMEDIES) - told <= codes_of("program_check", "programs", "planning", "robots")


def test_a_zone_may_take_half_of_the_shorter_motion():
    assert remedy(fact("zone_too_large", zone_mm=80.0, motion_mm=20.0)) == "Make the zone 10.0 mm at most."


START = "[0.3, -0.3, -0.2, 0.0, -1.0, 0.0]"


@pytest.mark.parametrize(
    "line",
    [
        "movel(pose_trans(get_forward_kin({start}), p[0, 0, -0.02, 0, 0, 0]), a={a}, v={v})",
        "movej([0.9, -0.3, -0.2, 0.3, -1.0, 0.0], a={a}, v={v})",
    ],
)
def test_a_line_at_the_pace_advised_passes(tmp_path, line):
    def found(a: float, v: float):
        text = f"def a():\n  movej({START}, a=1, v=0.5)\n  {line.format(start=START, a=a, v=v)}\nend\n"
        (tmp_path / "a.script").write_text(text)
        check = check_program(read_program(tmp_path / "a.script"), ROBOT, CheckOptions(start=np.zeros(6)))
        return [at.finding for at in check.findings if is_one(at.finding, "too_fast")]

    told = [re.findall(r"([\d.]+) %", remedy(each)) for each in found(400, 8.0)]
    speed, acc = (min(float(percent) / 100 for percent in each) for each in zip(*told))
    assert not found(400 * acc, 8.0 * speed)


HEAD = "DEF a( )\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP=0.05\n$ACC.CP=0.2\nBAS(#VEL_PTP,10)\n"


def krl(*lines: str, more: str = "") -> str:
    """A program with these lines, at a speed that is given."""
    return HEAD + "".join(f"{line}\n" for line in lines) + f"END\n{more}"


def rapid(*lines: str) -> str:
    """A module whose main has these lines."""
    return "MODULE a\nPROC main()\n" + "".join(f"{line}\n" for line in lines) + "ENDPROC\nENDMODULE\n"


def last(check):
    """Where the arm stands behind the last motion."""
    return list(check.motions.values())[-1].end


def found_of(check, code):
    """The finding of a code."""
    return next(each.finding for each in check.findings if each.finding.code == code)


HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
AT_HOME = "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"
NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DOWN = "A 0,B 0,C 180"
POINT = f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"
FRAMED = f"DEF a( )\n$TOOL=TOOL_DATA[3]\n$BASE=$NULLFRAME\n$VEL.CP=0.05\nLIN {{X 300,Y 50,Z 400,{DOWN}}}\nEND\n"
TURNED = {
    "robot": load_robot("ur5e").replace(envelopes=[Envelope(k, (0.0,) * 3, (0.0,) * 3, 0.005) for k in range(1, 7)]),
    "start": np.radians([-160, -26, 42, 139, 169, -55]),
}
TIED = {"robot": ROBOT.replace(combined=[CombinedLimit((0, 1, 1, 0, 0, 0), *np.radians([-60, 60]))])}
BESIDE = {"start": np.radians([63, -20, -61, -4, -63, -126])}
MENDED = {
    "target_out_of_reach": (krl(f"PTP {{X 3000,Y 0,Z 400,{DOWN}}}"), krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}")),
    "way_out_of_reach": (krl("LIN {X 3000}"), krl("LIN {X 420}")),
    "arrives_otherwise": (
        krl(AT_HOME, "LIN {A1 5,A2 -10,A3 -10,A4 180,A5 70,A6 180}"),
        lambda found: krl(AT_HOME, f"LIN {axes(last(found))}"),
    ),
    "configuration_not_met": (
        krl(f"PTP {{X 400,Y 0,Z 400,{DOWN},S 2,T 1}}"),
        lambda found: krl(f"PTP {axes(last(found))}"),
    ),
    "configuration_guessed": (
        (krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"), {"start": None}),
        krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"),
        (krl(AT_HOME, f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"), {"start": None}),
    ),
    "way_not_known": ((krl("PTP {A1 10,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"), {"start": None}), krl("PTP {A1 10}")),
    "zone_too_large": (
        krl("$APO.CDIS=80", "LIN_REL {Z 40} C_DIS", "LIN_REL {Y 40}"),
        krl("$APO.CDIS=20", "LIN_REL {Z 40} C_DIS", "LIN_REL {Y 40}"),
    ),
    "speed_not_given": (krl("$VEL.CP=$ANIN[1]", POINT), krl(POINT)),
    "frames_from_robot_file": (
        f"DEF a( )\n$VEL.CP=0.05\nBAS(#VEL_PTP,10)\n{AT_HOME}\nLIN_REL {{Z 5}}\nEND\n",
        krl(AT_HOME, "LIN_REL {Z 5}"),
    ),
    "above_limit": (krl("PTP {A1 170}"), krl(f"PTP {{A1 {np.degrees(ROBOT.upper[0]):g}}}")),
    "below_limit": (krl("PTP {A1 -170}"), krl(f"PTP {{A1 {np.degrees(ROBOT.lower[0]):g}}}")),
    "whole_turn": (krl("PTP {A6 -100}", "PTP {A6 200}"), krl("PTP {A6 -100}", "PTP {A6 -160}")),
    "motion_collides.solid": (
        (krl("PTP {A1 100}"), {"scene": SCENE}),
        (krl("PTP {A2 20,A3 -60}", "PTP {A1 100}"), {"scene": SCENE}),
    ),
    "motion_collides.solid_at_target": (
        (krl(POINT, "LIN {Z -50}"), {"scene": SCENE}),
        (krl(POINT, "LIN {Z 300}"), {"scene": SCENE}),
    ),
    "motion_collides.links": (
        (krl("LIN {A1 64,A2 13,A3 -75,A4 27,A5 -60,A6 -166}"), BESIDE),
        (krl("LIN {A1 64,A2 -10}"), BESIDE),
    ),
    "joint_jumps": (
        krl("PTP {A4 -180,A5 70,A6 180}"),
        lambda found: krl(f"PTP {{A4 {found_of(found, 'joint_jumps').near_deg},A5 -70,A6 0}}"),
    ),
    "singular.wrist": (krl("PTP {A5 -20}", "LIN {A1 2,A5 20}"), krl("PTP {A5 -20}", "LIN {A1 2,A5 -30}")),
    "configuration_ends": (
        (krl("LIN_REL {X 194,Y -206,Z -57}"), TURNED),
        (krl("LIN_REL {X 1.2,Y -1.2,Z -0.3}"), TURNED),  # where it ends 4.3 mm behind the start
    ),
    "combination_exceeded": ((krl("PTP {A2 -50,A3 -20}"), TIED), (krl("PTP {A2 -50,A3 -5}"), TIED)),
    "suspect_number": (krl(AT_HOME, "PTP {A1 0,A2 -0.5,A3 -0.6,A4 0.3,A5 -1.2,A6 0.1}"), krl(AT_HOME, "PTP {A1 5}")),
    "not_followed.undefined": (krl("PTP XTHERE"), krl("PTP {A1 10}")),
    "not_followed.position_unknown": ((krl("PTP {A1 10}"), {"start": None}), krl("PTP {A1 10}")),
    "not_followed.instruction": (
        krl("GO_HOME( )", AT_HOME),
        (krl("GO_HOME( )", AT_HOME), {"limits": RunLimits(assumed=("go_home",))}),
    ),
    "not_followed.tool": (FRAMED, (FRAMED, {"frames": {"TOOL_DATA[3]": np.eye(4)}})),
    "not_followed.base": (
        FRAMED.replace("TOOL_DATA[3]", "$NULLFRAME").replace("BASE=$NULLFRAME", "BASE=BASE_DATA[3]"),
        FRAMED.replace("TOOL_DATA[3]", "$NULLFRAME"),
    ),
    "not_followed.half_turn": (
        krl(AT_HOME, "LIN_REL {A 180} #TOOL"),
        krl(AT_HOME, "LIN_REL {A 90} #TOOL", "LIN_REL {A 90} #TOOL"),
        krl(AT_HOME, "PTP_REL {A6 180}"),
    ),
    "not_followed.unreached": (krl(AT_HOME, "RETURN", "PTP {A1 20}"), krl(AT_HOME)),
}


def keys(check) -> set[str]:
    """Codes of findings, and those of the forms of their remedies."""
    found = set()
    for each in check.findings:
        finding = each.finding
        found.add(finding.code)
        if is_one(finding, "motion_collides"):
            there = any(touch.at_target for touch in finding.touches)
            links = is_one(finding.touches[0].pair, "link_pair")
            found.add(f"motion_collides.{'links' if links else 'solid_at_target' if there else 'solid'}")
        elif finding.code == "not_followed":
            found.add(f"not_followed.{finding.reason}")
        elif finding.code == "passes_singularity":
            found.add(f"singular.{finding.type}")
    return found


@pytest.mark.long
@pytest.mark.parametrize("code", MENDED)
def test_a_program_that_is_mended_as_advised_passes(tmp_path, code):
    """Each way to mend it that the remedy names."""

    def checked(program):
        text, given = program if isinstance(program, tuple) else (program, {})
        suffix = {"M": "mod", "D": "src"}[text[0]]
        options = {"start": HOME} | {key: value for key, value in given.items() if key not in ("data", "robot")}
        (tmp_path / f"a.{suffix}").write_text(text)
        (tmp_path / "a.dat").unlink(missing_ok=True)
        if "data" in given:
            (tmp_path / "a.dat").write_text(f"DEFDAT a\nDECL {given['data']}\nENDDAT\n")
        return check_program(read_program(tmp_path / f"a.{suffix}"), given.get("robot", ROBOT), CheckOptions(**options))

    broken, *mended = MENDED[code]
    before = checked(broken)
    assert code in keys(before), keys(before)
    for program in mended:
        after = checked(program(before) if callable(program) else program)
        assert code not in keys(after)
        if "way_not_known" not in keys(after):  # without a start pose the first way is unexamined
            assert after.level in ("pass", "note"), keys(after)


@pytest.mark.parametrize(("name", "near"), [("XTEHRE", ("XTHERE",)), ("XTHERE2", ()), ("XELSEWHERE", ())])
def test_a_name_that_the_program_nearly_gives_is_named(tmp_path, name, near):
    (tmp_path / "a.src").write_text(krl("DECL E6POS XTHERE", "XTHERE={X 500,Y 0,Z 500}", f"PTP {name}"))
    check = check_program(read_program(tmp_path / "a.src"), ROBOT, CheckOptions(start=HOME))
    (found,) = (each.finding for each in check.findings if is_one(each.finding, "not_followed"))
    assert found.near == near


def test_each_reason_why_something_is_not_followed_that_has_a_remedy_is_mended():
    asked = {f"not_followed.{reason}" for reason in NOT_FOLLOWED} - {"not_followed.too_far"}
    assert asked <= MENDED.keys()


@pytest.mark.long
def test_a_loop_that_drifts_is_mended_as_advised(tmp_path):
    """It ends before the passes that are out of reach, or comes back to a set target."""

    def checked(passes, *lines):
        (tmp_path / "a.src").write_text(krl("INT N", f"FOR N=1 TO {passes}", *lines, "LIN_REL {X 60}", "ENDFOR"))
        return check_program(read_program(tmp_path / "a.src"), ROBOT, CheckOptions(start=HOME))

    drifts, *mended = checked(9), checked(1), checked(9, AT_HOME)
    assert "way_out_of_reach" in keys(drifts), keys(drifts)
    assert all("way_out_of_reach" not in keys(each) for each in mended)
