"""Writes EFORT's RPL, as text (.pgm with its .var) and as the controller's XML (.XPL).

Targets are joints, because the meaning of a configuration's number (CFGn) is not known; positions keep the one that
they were read with. Arcs become lines, and tools have to be set on the controller.
"""

from __future__ import annotations

import math
import zlib
from bisect import bisect_right
from xml.sax.saxutils import escape

import numpy as np

from er3a.by_value import frozen
from er3a.numerics.arrays import Reals
from er3a.planning.sequences import Arc
from er3a.programs.instructions import FINE, ArmMotion, Listing, Output, Pause, PoseTarget, Zone, numbers_of
from er3a.programs.rpl.dialect import SPEED, ZONE
from er3a.programs.solving import way_of
from er3a.programs.writing import ARC_DEVIATION, ReadyMotion, WriteOptions, Writer, by_length, fixed, short

DIGITS = 6
MAX_LINES = 10_000  # for an arc
PERCENTS = (1, 2, 5, 10, 15, 20, 25, 30, 40, 50, 60, 70, 75, 80, 90, 100)
SPEEDS_MM_S = (5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000)
ZONES_MM = (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)
MIN_CHORD_ZONE, MAX_CHORD_ZONE = 0.001, 0.2  # m, of the zones between the chords of an arc
USUAL_JOINT, USUAL_LINE = "v50perc", "v100"


@frozen
class RplItem:
    """A statement, for text and XML alike.

    Attributes
    ----------
    kind : name of the XML element
    parts : names and texts of its children
    """

    kind: str
    parts: tuple[tuple[str, str], ...] = ()


class RplWriter(Writer):
    """Writes RPL as text."""

    languages = ("rpl", "xpl")
    longest_name = 31

    def __init__(self, listing: Listing, options: WriteOptions):
        super().__init__(listing, options)
        self.items: list[RplItem] = []

    def files(self, head: list[str]) -> dict[str, str]:
        """The .pgm file, and the .var file, which is empty: no variable is used.

        Returns
        -------
        files : the lines of the head are comments of the .pgm file
        """
        lines = [f"(* {_comment(line)} *)" for line in head]
        indent = ""
        for item in self.items:
            if item.kind == "end":
                indent = ""
            lines.append(indent + _text(item))
            if item.kind == "while":
                indent = "    "
        return {".pgm": "\n".join((*lines, "")), ".var": ""}

    def begin_loop(self) -> None:
        """``WHILE true DO``."""
        self.items.append(RplItem("while"))

    def end_loop(self) -> None:
        """``END_WHILE;``."""
        self.items.append(RplItem("end"))

    def comment(self, text: str) -> None:
        """Add a comment.

        Parameters
        ----------
        text : signs that would end the comment are replaced when the file is made
        """
        self.items.append(RplItem("rem", (("text", text),)))

    def pause(self, pause: Pause) -> None:
        """Write DWELL for a time, or WAIT for a condition.

        Parameters
        ----------
        pause : a wait for the operator becomes a comment
        """
        if pause.seconds is not None:
            self.items.append(RplItem("dwell", (("expr", short(pause.seconds)),)))
        elif pause.condition is not None:
            self.items.append(RplItem("wait", (("condition", pause.condition),)))
        else:
            self.comment("wait for the operator")

    def output(self, output: Output) -> None:
        """Write an output, such as ``io.DOut[8] := true;``.

        Parameters
        ----------
        output : TRUE and FALSE are written in small letters, other values as they are
        """
        value = output.value.lower() if output.value in ("TRUE", "FALSE") else output.value
        self.items.append(RplItem("set", (("dest", output.name), ("expr", value))))

    def verbatim(self, text: str) -> None:
        """Add a statement as it was read.

        Parameters
        ----------
        text : of RPL; blanks and line ends become single spaces
        """
        self.items.append(RplItem("raw", (("text", " ".join(text.split())),)))

    def motion(self, ready: ReadyMotion) -> None:
        """Write MJOINT or MLIN; an arc becomes lines.

        Parameters
        ----------
        ready : targets are joints (rad) unless a pose was read from RPL; one that can't be written is left out
        """
        motion = ready.motion
        if motion.kind == "arc":
            self._arc(ready)
            return
        target = self._target(ready)
        if target is None:
            self.omit(motion)
            return
        form = "mjoint" if motion.kind == "joint" else "mlin"
        self._move(form, target, motion, self._speed(ready), motion.zone)

    def _move(self, form: str, target: str, motion: ArmMotion, speed: str, zone: Zone) -> None:
        parts = [("target", target), ("speed", speed), ("zone", self._zone(zone)), ("tool", self._tool(motion))]
        base = motion.base.name
        if self.own and base not in ("", "wobj0"):
            parts.append(("refsys", base))
        self.items.append(RplItem(form, tuple(parts)))

    def _target(self, ready: ReadyMotion) -> str | None:
        target = ready.motion.target
        if isinstance(target, PoseTarget) and self.own:
            given = dict(target.configuration)
            if {"cfg", "t1", "t2", "t3"} <= given.keys():
                number = given["cfg"]
                word = number if isinstance(number, str) else f"CFG{int(number)}"
                turns = ",".join(str(int(float(given[key]))) for key in ("t1", "t2", "t3"))
                values = ",".join(fixed(value, DIGITS) for value in numbers_of(target.pose, "efort"))
                return f'POINTC({values},"{word}",{turns})'
        return None if ready.joints is None else _joints_text(ready.joints)

    def _arc(self, ready: ReadyMotion) -> None:
        """Lines near the arc, through the joints that the arm's table gives."""
        motion = ready.motion
        joints = None
        if ready.pose is not None and ready.pose_before is not None and ready.via is not None:
            poses = _chords(ready.pose_before, ready.via, ready.pose)
            frames = (motion.tool, motion.base)
            joints = None if poses is None else self.resolver.along(poses, frames, ready.joints_before)
        if joints is None:
            self.omit(motion)
            return
        targets = list(map(_joints_text, joints))
        self.count["arcs"] += 1
        self.count["chords"] += len(targets)
        speed = self._speed(ready)
        longest = (ready.length or 0.0) / len(targets) / 2
        passing = Zone("distance", min(max(longest, MIN_CHORD_ZONE), MAX_CHORD_ZONE))
        last = motion.zone
        if last.kind == "distance" and last.value > passing.value:  # a zone takes half of a line at most
            last = passing
        self._shorten_zone(passing)
        for i, target in enumerate(targets):
            self._move("mlin", target, motion, speed, last if i == len(targets) - 1 else passing)

    def _shorten_zone(self, most: Zone) -> None:
        """Make the zone of the motion before no larger than one."""
        before = self.items[-1] if self.items else None
        found = ZONE.match(dict(before.parts).get("zone", "")) if before is not None else None
        if before is not None and found and float(found[1]) > most.value * 1000:
            parts = tuple((key, self._zone(most) if key == "zone" else text) for key, text in before.parts)
            self.items[-1] = RplItem(before.kind, parts)

    def _speed(self, ready: ReadyMotion) -> str:
        """The name of a speed: the one that was read, or the next slower one."""
        speed = ready.motion.speed
        if speed is not None and self.own and SPEED.match(speed.text):
            return speed.text
        joint = ready.motion.kind == "joint"
        value = self.share(ready) if joint else by_length(ready, "m/s")
        if value is None or speed is None:
            self.count["estimated"] += speed is not None
            return USUAL_JOINT if joint else USUAL_LINE
        self.count["estimated"] += speed.unit == "s"
        if joint:
            return f"v{self._rounded(value * 100, PERCENTS)}perc"
        return f"v{self._rounded(value * 1000, SPEEDS_MM_S)}"

    def _rounded(self, value: float, names: tuple[int, ...]) -> int:
        found = names[max(bisect_right(names, value * (1 + 1e-9)) - 1, 0)]
        self.count["raised" if found > value else "rounded"] += abs(found - value) > 1e-6
        return found

    def _zone(self, zone: Zone) -> str:
        if zone == FINE:
            return "fine"
        if self.own and (ZONE.match(zone.text) or zone.kind == "named"):
            return zone.text
        if zone.kind == "distance" and zone.value >= ZONES_MM[0] / 1000:
            return f"z{self._rounded(zone.value * 1000, ZONES_MM)}"
        self.count["zones"] += 1
        return "fine"

    def _tool(self, motion: ArmMotion) -> str:
        name = motion.tool.name
        if self.own and name:
            return name
        pose = motion.tool.pose
        flange = pose is not None and np.array_equal(pose, np.eye(4))
        if not flange and (name or pose is not None):
            self.name_tool(name or f"the one with its point at ({_point(pose)}) mm of the flange")
        return "tool0"


class XplWriter(RplWriter):
    """Writes RPL as the controller's XML."""

    def files(self, head: list[str]) -> dict[str, str]:
        """The .XPL file, with the routine Main and, where something is repeated for ever, the loop's body.

        Returns
        -------
        files : one text; its FileId is a checksum (CRC-32) of the routines
        """
        main: list[str] = [_element(RplItem("rem", (("text", line),))) for line in head]
        inner: list[str] = []
        into = main
        for item in self.items:
            if item.kind == "while":
                main.append("<while>\n<cond>true</cond>\n<pouref>1</pouref>\n</while>")
                into = inner
            elif item.kind != "end":
                into.append(_element(item))
        body = _body(main)
        nested = f"<Pou>\n<Name>1</Name>\n{_body(inner)}\n</Pou>\n" if into is inner else ""
        pous = f"<Pous>\n<Pou>\n<Name>Main</Name>\n<Type>Program</Type>\n{body}\n{nested}</Pou>\n</Pous>"
        number = f"0x{zlib.crc32(pous.encode()):08x}"
        return {".XPL": SHELL.format(number=number, pous=pous)}


SHELL = """<?xml version="1.0" encoding="utf-8"?>
<Xpl-source>
<HostEnvironment>
<Config>
<FileId>{number}</FileId>
<Target>Robox Motion Control</Target>
<XplType>RoboticProgramLanguage</XplType>
</Config>
</HostEnvironment>
<XplEnvironment>
<Title LcId="1033">
<![CDATA[XPL program]]>
</Title>
<Description LcId="1033">
<![CDATA[XPL program]]>
</Description>
<Version>1.0.0</Version>
<Author>er3a</Author>
{pous}
</XplEnvironment>
</Xpl-source>
"""


def _body(elements: list[str]) -> str:
    return "\n".join(("<Body>", *elements, "</Body>"))


def _element(item: RplItem) -> str:
    """A statement as XML; text of RPL that has no element is kept as a comment."""
    kind, parts = item.kind, item.parts
    if kind == "raw":
        kind, parts = "rem", (("text", f"not translated: {parts[0][1]}"),)
    if kind == "wait":
        parts = (("condition", parts[0][1].replace("NOT ", "!")),)
    inner = "".join(f"<{name}>{escape(text)}</{name}>\n" for name, text in parts)
    return f"<{kind}>\n{inner}</{kind}>"


def _text(item: RplItem) -> str:
    """A statement as text."""
    values = [text for _, text in item.parts]
    match item.kind:
        case "mjoint" | "mlin":
            return f"{item.kind.upper()}({', '.join(values)});"
        case "set":
            return f"{values[0]} := {values[1]};"
        case "wait":
            return f"WAIT({values[0].replace('!', 'NOT ', 1) if values[0].startswith('!') else values[0]});"
        case "dwell":
            return f"DWELL({values[0]});"
        case "rem":
            return f"(* {_comment(values[0])} *)"
        case "while":
            return "WHILE true DO"
        case "end":
            return "END_WHILE;"
    return f"{values[0].rstrip(';')};"


def _chords(start: Reals, via: Reals, end: Reals) -> Reals | None:
    """Ends (n, 4, 4) of lines that stay within ``ARC_DEVIATION`` of an arc; None where the points are on a line."""
    way = way_of(start, via, end)
    if not isinstance(way, Arc):
        return None
    # A chord over an angle w leaves its arc by radius (1 - cos(w / 2)).
    widest = 2 * math.acos(max(1 - ARC_DEVIATION / way.radius, 0.0))
    count = min(max(math.ceil(way.angle / max(widest, 1e-6)), 1), MAX_LINES)
    return way.poses(np.arange(1, count + 1) / count)


def _comment(text: str) -> str:
    return text.replace("*)", "* )").replace("(*", "( *")


def _joints_text(joints: Reals) -> str:
    return f"POINTJ({','.join(fixed(math.degrees(value), DIGITS) for value in joints)})"


def _point(pose: Reals | None) -> str:
    return "" if pose is None else ", ".join(f"{value * 1000:g}" for value in pose[:3, 3])
