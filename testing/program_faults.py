"""Faults as people make them, put one at a time into programs that pass with robot, start and scene.

The arm is the ER3A-C60 with its shapes, speeds and payload taken as documented, so that what is certain from the files
is an error. Each fault is a replacement in one text; it counts as named if a finding above a note stands at its line.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.program_check.check_program import CheckOptions, ProgramCheck, check_program
from er3a.programs.languages import read_program
from er3a.robots.masses import WristLoad
from er3a.robots.robot import Robot, Source

ROOT = Path(__file__).resolve().parents[1]
PROGRAMS = ROOT / "data" / "programs"
START = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
RAPID = """MODULE cell
  CONST jointtarget home:=[[0,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget above:=[[25.35,-24.84,-21.5,0,-43.65,25.35],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pick:=[[380,180,180],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget place:=[[380,-180,180],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata grip:=[TRUE,[[0,0,50],[1,0,0,0]],[0.5,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata plate:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PROC main()
    ConfL \\Off;
    ConfJ \\Off;
    MoveAbsJ home,v200,fine,grip;
    FOR i FROM 1 TO 3 DO
      MoveAbsJ above,v200,z10,grip;
      MoveL Offs(pick,0,0,10*i),v200,fine,grip\\WObj:=plate;
      SetDO doGrip,1;
      WaitTime 0.3;
      MoveL Offs(pick,0,0,100),v200,z10,grip\\WObj:=plate;
      MoveJ Offs(place,0,0,100),v200,z10,grip\\WObj:=plate;
      MoveL place,v200,fine,grip\\WObj:=plate;
      SetDO doGrip,0;
      MoveL Offs(place,0,0,100),v200,fine,grip\\WObj:=plate;
      MoveAbsJ home,v200,fine,grip;
    ENDFOR
  ENDPROC
ENDMODULE
"""


@dataclass(frozen=True)
class Fault:
    """A replacement in a sound program's files; ``at``: a part of the line at which it has to be named."""

    what: str
    file: str
    old: str
    new: str
    at: str = ""


@dataclass(frozen=True)
class Found:
    """What became of a fault: the codes at its line, and whether the command ends with an error."""

    fault: Fault
    codes: tuple[str, ...]
    fails: bool


FAULT_TEXT = r"""
pick_place.dat:
a digit too many | X 380.00, Y 180.00 | X 3800.00, Y 180.00 | LIN XPICK
into the table | Y 180.00, Z 220.00 | Y 180.00, Z 22.00 | LIN XPICK
metres for mm | X 380.00, Y -180.00, Z 220.00 | X 0.38, Y -0.18, Z 0.22 | LIN XPLACE
pick_place.src:
a limit passed | PTP {A1 25.35, A2 -24.84 | PTP {A1 250.35, A2 -24.84 | A1 250.35
radians for degrees | {A1 -25.35, A2 -24.84, A3 -21.50, A4 0.00, A5 -43.65, A6 -25.35} |
  {A1 -0.4424, A2 -0.4335, A3 -0.3752, A4 0, A5 -0.7618, A6 -0.4424} | A1 -0.4424
mm/s for m/s | $VEL.CP=0.2 | $VEL.CP=200 | LIN XPICK\n
pick_place.script:
a misspelled variable | movel(pick_p, a | movel(pikc_p, a | movel(pikc_p
pick_place.src:
a tool that is not given | $TOOL=$NULLFRAME | $TOOL=TOOL_DATA[3] | LIN XPICK\n
an index beyond its list | $BASE=$NULLFRAME | DECL FRAME B[2]\n$BASE=B[3] | $BASE=B[3]
a misspelled point | LIN XPLACE | LIN XPLASE | LIN XPLASE
down for up | LIN XPICK:{X 0, Y 0, Z -100 | LIN XPICK:{X 0, Y 0, Z 150 | Z 150
another language's word |    LIN XPLACE |    IF $IN[2] THEN\n   ELSEIF $IN[3] THEN\n   ENDIF\n   LIN XPLACE | ELSEIF
a loop without an end | ENDLOOP\n |  |
an arm that is too small | LIN {Z 320} | LIN {Z 1320} | LIN {Z 1320}
a zone larger than its line | $APO.CDIS=10 | $APO.CDIS=90 | A6 25.35} C_DIS
cell.mod:
a digit too many | pick:=[[380,180 | pick:=[[3800,180 | MoveL Offs(pick,0,0,10*i)
metres for mm | place:=[[380,-180,180] | place:=[[0.38,-0.18,0.22] | MoveL place,
the wrong work object | MoveL place,v200,fine,grip\WObj:=plate | MoveL place,v200,fine,grip\WObj:=fixture |
  MoveL place
the bare flange once | MoveL place,v200,fine,grip | MoveL place,v200,fine,tool0 | MoveL place
v7000 for v700 | MoveL Offs(pick,0,0,100),v200 | MoveL Offs(pick,0,0,100),v7000 | v7000
a zone larger than its line | MoveL Offs(pick,0,0,100),v200,z10 | MoveL Offs(pick,0,0,100),v200,z200 | z200
a load of 12 kg | [0.5,[0,0,50] | [12,[0,0,50] | MoveAbsJ home,v200,fine,grip;\n    FOR
a line to joint angles | MoveAbsJ above, | MoveL above, | MoveL above,
Offs along another axis | MoveJ Offs(place,0,0,100) | MoveJ Offs(place,500,0,0) | place,500
a sign | Offs(pick,0,0,100) | Offs(pick,0,0,-100) | pick,0,0,-100
a quaternion that is none | [380,-180,180],[0,1,0,0] | [380,-180,180],[0,1,0,1] | MoveL place
a counter that runs away | 10*i | 100*i*i | 100*i*i
a joint beyond its limit | above:=[[25.35,-24.84 | above:=[[25.35,-248.4 | MoveAbsJ above
tool and work object exchanged | MoveL place,v200,fine,grip\WObj:=plate | MoveL place,v200,fine,plate\WObj:=grip |
  MoveL place
a missing semicolon | WaitTime 0.3; | WaitTime 0.3 | WaitTime
pick_place.script:
mm for metres | pick_p = p[0.3800, 0.1800, 0.2200 | pick_p = p[380.0, 180.0, 220.0 | movel(pick_p
degrees for radians | above_pick_q = [0.4424, -0.4336, -0.3753, 0.0000, -0.7619, 0.4424] |
  above_pick_q = [25.35, -24.84, -21.50, 0.0, -43.65, 25.35] | movej(above_pick_q
below the table | place_p = p[0.3800, -0.1800, 0.2200 | place_p = p[0.3800, -0.1800, 0.0200 | movel(place_p,
five joints | home_q = [0.0000, -0.1745, | home_q = [-0.1745, | movej(home_q
mm/s for m/s | movel(pick_p, a=1.2, v=0.2) | movel(pick_p, a=1.2, v=200) | v=200
a line for a joint move | movej(above_place_q, a=1.4, v=0.8 |
  movel([2.7,-0.4336,-0.3753,0,-0.7619,-0.4424], a=1.4, v=0.8 | movel([2.7
into the post | above_pick_q = [0.4424, | above_pick_q = [1.1, | movej(above_pick_q
out of reach | pose_trans(pick_p, p[0, 0, -0.1 | pose_trans(pick_p, p[0, 0, -1.1 | -1.1
pick_place.pgm:
a limit passed | POINTJ(25.35, -39.05, -23.40 | POINTJ(25.35, -139.05, -23.40 | -139.05
a missing angle | POINTJ(-25.35, -39.05, -23.40, 0.00, -27.56, -25.35) |
  POINTJ(-25.35, -39.05, -23.40, 0.00, -27.56) | -27.56)
a sign | MLIN(POINTJ(25.35, -39.05 | MLIN(POINTJ(25.35, 39.05 | 25.35, 39.05
a speed without a name | -27.56, 25.35), v200, | -27.56, 25.35), v250x, | v250x
"""
"""Faults by file, one a line, or indented on the next: what it is, the text, what stands in its place, and a part of
the line at which it has to be named; ``\\n`` is the end of a line."""


def faults() -> Iterator[Fault]:
    """The faults."""
    file = ""
    for line in re.sub(r"\n  +", " ", FAULT_TEXT).strip().splitlines():
        if line.endswith(":") and "|" not in line:
            file = line[:-1]
            continue
        what, old, new, at = (part.replace("\\n", "\n") for part in re.split(r" \| ?", f"{line} | | ")[:4])
        yield Fault(what, file, old, new, at.strip("| "))


FAULTS = tuple(faults())


def arm() -> Robot:
    """The ER3A-C60, its capsules, speeds and payload as if documents gave them."""
    robot = load_robot("er3a_c60")
    official = Source("as if a document gave it", "official")
    wrist = WristLoad(3.0)
    return robot.replace(
        speed=np.radians([230.0, 200.0, 250.0, 320.0, 320.0, 420.0]),
        masses=replace(robot.masses, wrist=wrist),
        sources={**robot.sources, "envelopes": official, "speeds": official},
    )


def texts(folder: Path) -> None:
    """The sound programs, in a folder."""
    for name in ("pick_place.src", "pick_place.dat", "pick_place.script", "pick_place.pgm", "pick_place.var"):
        (folder / name).write_text((PROGRAMS / name).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "cell.mod").write_text(RAPID, encoding="utf-8")


def checked(file: Path, robot: Robot) -> ProgramCheck:
    """A program's check, with all that a user has."""
    options = CheckOptions(start=START, scene=load_scene("data/scenes/table_and_post.yaml"))
    return check_program(
        read_program(file), robot, replace(options, frames={"tool0": np.eye(4)} if file.suffix == ".pgm" else {})
    )


def found() -> Iterator[Found]:
    """Each fault, and what the check says of it."""
    robot = arm()
    for fault in FAULTS:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            texts(folder)
            own = folder / fault.file
            text = own.read_text(encoding="utf-8")
            if fault.old not in text:
                raise ValueError(f"{fault.file} has no '{fault.old}'")
            own.write_text(text.replace(fault.old, fault.new, 1), encoding="utf-8")
            program = own.with_suffix(".src") if own.suffix == ".dat" else own
            lines = program.read_text(encoding="utf-8")
            place = lines[: lines.find(fault.at)].count("\n") + 1 if fault.at in lines else 0
            try:
                check = checked(program, robot)
            except InputError as error:
                yield Found(fault, (f"unreadable: {error.problem}",), True)
                continue
            above = [each for each in check.findings if each.level in ("caution", "fail")]
            here = tuple(dict.fromkeys(each.finding.code for each in above if each.place.line == place))
            yield Found(fault, here, check.level == "fail")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        texts(Path(name))
        for sound in ("pick_place.src", "pick_place.script", "pick_place.pgm", "cell.mod"):
            check = checked(Path(name) / sound, arm())
            print(sound, check.level, [(e.finding.code, e.level, e.place.line) for e in check.findings])
    rows = list(found())
    for each in rows:
        print(
            "named" if each.codes else "  -  ",
            "exit 1" if each.fails else "  -   ",
            each.fault.file,
            each.fault.what,
            each.codes,
        )
    print(
        len(rows), "faults", sum(bool(each.codes) for each in rows), "named", sum(each.fails for each in rows), "exit 1"
    )
