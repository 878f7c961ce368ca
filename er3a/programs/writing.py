"""What all writers share: the order of a file, its head, and what is said where a language has no equal."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from er3a.by_value import ByValue, by_identity, frozen
from er3a.finding import Finding, fact
from er3a.numerics.arrays import Reals
from er3a.programs.instructions import (
    ArmMotion,
    Aside,
    Decision,
    Instruction,
    Listing,
    Load,
    NamedFrame,
    Output,
    Pause,
    Remark,
    UnclearLoad,
    Unknown,
)
from er3a.programs.solving import Resolver, way_of
from er3a.robots.masses import MassBody
from er3a.robots.robot import Robot


@by_identity
class ReadyMotion:
    """A motion with all that is known of its start and end.

    Attributes
    ----------
    number : among the motions of its sequence
    pose, pose_before, via : (4, 4), m, in its base for its tool; None where unknown
    """

    motion: ArmMotion
    resolver: Resolver
    number: int
    pose: Reals | None
    pose_before: Reals | None
    via: Reals | None = None

    @property
    def joints(self) -> Reals | None:
        """Joints (n,) in rad at its end; None where unknown."""
        return self.resolver.joints_after(self.number)

    @property
    def joints_before(self) -> Reals | None:
        """Joints (n,) in rad at its start; None where unknown."""
        return self.resolver.joints_after(self.number - 1)

    @property
    def length(self) -> float | None:
        """Length of the tool point's way, m; for a joint motion of the straight line between its ends."""
        if self.pose is None or self.pose_before is None:
            return None
        way = way_of(self.pose_before, self.via if self.motion.kind == "arc" else None, self.pose)
        return None if way is None else way.length


def with_default_frames(instruction: Instruction, robot: Robot | None) -> Instruction:
    """A motion whose tool or base is not given at all, with the robot's own tool and base.

    Parameters
    ----------
    instruction : any but a motion is returned as it is
    robot : its tool is T_flange_tool; without a robot nothing is filled in

    Returns
    -------
    instruction : the base that is filled in is the robot's own, T_robot_base the identity
    """
    if not isinstance(instruction, ArmMotion) or robot is None:
        return instruction
    tool, base = instruction.tool, instruction.base
    if not tool.name and tool.pose is None:
        tool = NamedFrame("", robot.tool)
    if not base.name and base.pose is None:
        base = NamedFrame("", np.eye(4))
    return replace(instruction, tool=tool, base=base)


HEAD = "er3a: "
AGAIN = UnclearLoad("again")
"""Load at the start of what is done for ever: the one at its end, or the one before."""
RESERVED = frozenset(
    word
    for words in (
        "and anin anout bas bool brake case char circ const continue decl def defdat default deffct delay do else end",
        "enddat endfct endfor endif endloop endswitch endwhile enum exit exor ext extfct false for global goto halt if",
        "import int interrupt is lin loop maximum minimum not or prio ptp public real repeat return sec signal",
        "spl spline struc switch then to trigger true until wait when while",
        "break elif join kill local movec movej movel movep pass run sleep sync thread xor",
    )
    for word in words.split()
)
"""Words of the languages, which can't be names of programs."""

ARC_DEVIATION = 0.0001  # m, of lines that stand for an arc


@frozen
class WrittenProgram(ByValue):
    """A program as files.

    Attributes
    ----------
    files : texts by suffix (``.src``, ``.dat``)
    findings : where the text differs from the request; the file's head says the same
    """

    name: str
    files: Mapping[str, str]
    findings: tuple[Finding, ...]


@frozen
class WriteOptions(ByValue):
    """How a program is written.

    Attributes
    ----------
    robot : the arm; without it poses can't be converted to joint values, nor joint values to poses
    start : (n,), rad or m, joint values before the first motion
    notes : findings to be stated in the head of the program
    head : further lines of the head
    assumed_speed : (n,), rad/s or m/s, for joints of unknown speed
    """

    robot: Robot | None = None
    start: Reals | None = None
    notes: tuple[Finding, ...] = ()
    head: tuple[str, ...] = ()
    assumed_speed: Reals | None = None


class Writer(ABC):
    """Writes a sequence, instruction by instruction: as most languages do, each says what differs.

    Attributes
    ----------
    languages : names of those whose own text (signals, conditions, calls) it writes as it stands
    remark, ends : what a comment begins with, and what ends a line of this language
    loop : the lines around what is done for ever
    wait : for a time in s, for the operator, for a condition
    """

    languages: tuple[str, ...] = ()
    longest_name = 24
    indent = remark = ends = ""
    loop = ("", "")
    wait = ("{}", "", "{}")

    def __init__(self, listing: Listing, options: WriteOptions):
        self.listing, self.options, self.robot = listing, options, options.robot
        self.resolver = Resolver(options.robot, options.start)
        self.name = program_name(listing.name, self.longest_name)
        self.count: Counter[str] = Counter()
        self.assumed: set[str] = set()
        self.tools: list[str] = []
        self.lines: list[str] = []
        self.settings: dict[str, str] = {}
        self.said: list[str] = []
        self.load: Load | None = None
        self.own = listing.language in self.languages

    def write(self) -> WrittenProgram:
        """Write the whole sequence.

        Returns
        -------
        program : texts of the files, and findings on what the language could not hold. The head of the file says these
            too.
        """
        framed = [with_default_frames(each, self.robot) for each in self.listing.instructions]
        ready = [self._ready(each) if isinstance(each, ArmMotion) else each for each in framed]
        for i, instruction in enumerate(ready):
            if i == self.listing.repeats_from:
                self.begin_loop()
                self.load = AGAIN if any(each.load is not None for each in self.listing.motions) else None
            self._add(instruction)
        if self.listing.repeats_from is not None:
            self.end_loop()
        findings = (*self.options.notes, *self._findings())
        lines = [HEAD + line for line in (*self.options.head, *map(head_line, findings))]
        head = list(dict.fromkeys((*self.said, *lines)))
        return WrittenProgram(self.name, self.files(head), findings)

    def _ready(self, motion: ArmMotion) -> ReadyMotion:
        number = len(self.resolver.motions)
        before, pose, via = self.resolver.ready(motion)
        return ReadyMotion(motion, self.resolver, number, pose, before, via)

    @abstractmethod
    def files(self, head: list[str]) -> dict[str, str]:
        """The texts of all files of the program, from the lines written so far.

        Parameters
        ----------
        head : lines for the head, without the signs of a comment

        Returns
        -------
        files : text by suffix, such as ``.src``
        """

    @abstractmethod
    def motion(self, ready: ReadyMotion) -> None:
        """Write a motion, and before it what has to be set for it.

        Parameters
        ----------
        ready : with poses in m and joints in rad, as far as they are known; one that can't be written is left out by
            :meth:`omit`
        """

    @abstractmethod
    def output(self, output: Output) -> None:
        """Write that a signal is set.

        Parameters
        ----------
        output : read from a program in this language
        """

    def line(self, text: str) -> None:
        """Add a line to the program.

        Parameters
        ----------
        text : indented here
        """
        self.lines.append(self.indent + text)

    def set_once(self, key: str, line: str) -> None:
        """Add a line that sets something, unless it is set so already.

        Parameters
        ----------
        key : what it sets
        line : complete but for the indent; the same line with the same key is not repeated, except within a new loop
        """
        if self.settings.get(key) != line:
            self.settings[key] = line
            self.line(line)

    def begin_loop(self) -> None:
        """Begin what is done for ever, to the end of the sequence.

        What was set before does not count within, because the next round begins with what was set last.
        """
        self.line(self.loop[0])
        self.settings.clear()

    def end_loop(self) -> None:
        """The end of what is done for ever."""
        self.line(self.loop[1])

    def comment(self, text: str) -> None:
        """Add a comment of one line.

        Parameters
        ----------
        text : letters other than ASCII's are written as escapes, for controllers read no others
        """
        self.line(f"{self.remark} {ascii_text(text)}")

    def pause(self, pause: Pause) -> None:
        """Write a wait: for a time, for the operator, or for a condition.

        Parameters
        ----------
        pause : seconds, or a condition in this language; neither for the operator
        """
        seconds, operator, condition = self.wait
        if pause.seconds is not None:
            self.line(seconds.format(short(pause.seconds)))
        elif pause.condition is not None:
            self.verbatim(condition.format(pause.condition))
        else:
            self.line(operator)

    def verbatim(self, text: str) -> None:
        """Add text of this language as a line.

        Parameters
        ----------
        text : without what ends a line
        """
        self.line(text + self.ends)

    def set_load(self, load: MassBody | None) -> None:
        """Write what hangs on the flange from here on.

        Parameters
        ----------
        load : kg, m, kg m^2, in the flange's frame; None for what is not known. A language without a word for it names
            the load as one to be set on the controller.
        """
        if load is not None:
            self.name_tool(f"a load of {load.mass:g} kg")

    def omit(self, motion: ArmMotion) -> None:
        """Leave out a motion whose target can't be written; a comment names it, and it is counted for a finding.

        Parameters
        ----------
        motion : with a target that is not known, or that needs the arm's table
        """
        self.count["left out"] += 1
        text = getattr(motion.target, "text", "") or "a target that needs the arm's table"
        self.comment(f"left out: {motion.form or motion.kind} {text}")

    def share(self, ready: ReadyMotion) -> float | None:
        """The speed of a joint motion as a share of the greatest.

        Returns
        -------
        share : at most 1, what is above is counted as cut; None if the program's speed is not known

        Notes
        -----
        Where nobody states a joint's greatest speed, the share is of an assumed one, which becomes a finding.
        """
        share = self._share_asked(ready)
        if share is None:
            return None
        self.count["cut"] += share > 1 + 1e-9
        return min(share, 1.0)

    def _share_asked(self, ready: ReadyMotion) -> float | None:
        speed = ready.motion.speed
        if speed is None or speed.value <= 0:
            return None
        if speed.unit == "share":
            return speed.value
        moved = _moved(ready)
        if speed.unit == "rad/s":
            return speed.value / self._greatest_speed(0 if moved is None else int(np.argmax(moved)))
        seconds = by_length(ready, "s")
        if seconds is None or moved is None or not (seconds > 0 and moved.any()):
            return None
        lead = int(np.argmax(moved / [self._speed_of(j)[0] for j in range(len(moved))]))
        return float(moved[lead] / self._greatest_speed(lead) / seconds)

    def leading_joint_speed(self, ready: ReadyMotion) -> float | None:
        """The speed of a joint motion as that of the joint that moves most.

        Returns
        -------
        speed : rad/s; the mean one if the program gives a time. None if the program gives neither a share, a joint
            speed nor a time, or the motion's ends are needed and not known.
        """
        speed = ready.motion.speed
        if speed is None or speed.value <= 0 or speed.unit not in ("share", "rad/s", "s"):
            return None
        if speed.unit == "rad/s":
            return speed.value
        moved = _moved(ready)
        if speed.unit == "s":
            return None if moved is None else float(moved.max()) / speed.value
        return speed.value * self._greatest_speed(0 if moved is None else int(np.argmax(moved)))

    def _speed_of(self, joint: int) -> tuple[float, str]:
        """A joint's greatest speed, rad/s, and as a text with its unit where it is assumed."""
        robot, given = self.robot, self.options.assumed_speed
        if robot is not None and not np.isnan(robot.speed[joint]):
            return float(robot.speed[joint]), ""
        speed = ASSUMED_JOINT_SPEED if given is None else float(given[joint])
        return speed, f"{math.degrees(speed):g} deg/s"

    def _greatest_speed(self, joint: int) -> float:
        """What decides a motion's speed; counted where it is assumed."""
        speed, assumed = self._speed_of(joint)
        if assumed:
            self.count["of assumed"] += 1
            self.assumed.add(assumed)
        return speed

    def name_tool(self, name: str) -> None:
        """Name a tool, base or load that has to be set on the controller; it becomes a finding, once.

        Parameters
        ----------
        name : by which the program knows it
        """
        if name not in self.tools:
            self.tools.append(name)

    def _add(self, instruction: Instruction | ReadyMotion) -> None:
        match instruction:
            case ReadyMotion():
                self._add_motion(instruction)
            case Remark(text=text):
                self._remark(text)
            case Aside(text=text) | Unknown(text=text):
                self._foreign(text, self.own)
            case Pause(condition=condition):
                if condition is None or self.own:
                    self.pause(instruction)
                else:
                    self._foreign(f"wait for {condition}", False)
            case Output():
                if self.own:
                    self.output(instruction)
                else:
                    self._foreign(f"{instruction.name} = {instruction.value}", False)
            case Decision():
                pass

    def _add_motion(self, ready: ReadyMotion) -> None:
        motion = ready.motion
        if motion.acceleration is not None and motion.acceleration.value <= 0:  # not known
            ready = replace(ready, motion=replace(motion, acceleration=None))
        self.count["external"] += any(getattr(each, "external", ()) for each in (motion.target, motion.via))
        if motion.load != self.load:
            self.load = motion.load
            if isinstance(motion.load, UnclearLoad):
                self.name_tool(f"the load {motion.load.text}")
            else:
                self.set_load(motion.load)
        self.motion(ready)

    def _remark(self, text: str) -> None:
        for line in text.splitlines():
            if line.startswith(HEAD):
                self.said.append(line)
            elif line.strip():
                self.comment(line.strip())

    def _foreign(self, text: str, own: bool) -> None:
        if own:
            self.verbatim(text)
        else:
            self.count["foreign"] += 1
            self.comment(f"not translated: {' '.join(text.split())}")

    def _findings(self) -> tuple[Finding, ...]:
        count = self.count
        found: list[Finding] = []
        if count["arcs"]:
            found.append(
                fact(
                    "written_arcs_split",
                    arcs=count["arcs"],
                    lines=count["chords"],
                    deviation_mm=1000 * ARC_DEVIATION,
                )
            )
        if self.listing.one_sided:
            found.append(fact("written_one_side", branches=self.listing.one_sided))
        found += [fact(code, **{field: count[key]}) for key, (code, field) in COUNTED.items() if count[key]]
        if count["of assumed"]:
            found.append(
                fact("written_speeds_of_assumed", motions=count["of assumed"], assumed=", ".join(sorted(self.assumed)))
            )
        return (*found, *(fact("written_tool_not_given", name=name) for name in self.tools))


COUNTED: dict[str, tuple[str, str]] = {
    "zones": ("written_zones_dropped", "zones"),
    "estimated": ("written_speeds_estimated", "motions"),
    "cut": ("written_speeds_cut", "motions"),
    "raised": ("written_speeds_raised", "motions"),
    "left out": ("written_targets_left_out", "motions"),
    "rounded": ("written_values_rounded", "values"),
    "foreign": ("written_not_translated", "instructions"),
    "external": ("written_external_axes_dropped", "motions"),
}


HEADS = {
    "written_arcs_split": "{arcs} arc(s) as {lines} lines that stay within {deviation_mm:g} mm",
    "written_zones_dropped": "{zones} zone(s) without equal in this language: the arm stops there",
    "written_speeds_estimated": "{motions} duration(s) as speeds: the controller's ramps decide the time",
    "written_speeds_cut": "{motions} speed(s) above 100 %, which was taken",
    "written_speeds_raised": (
        "{motions} speed(s) below the least that has a name, which was taken: FASTER than what was checked"
    ),
    "written_speeds_of_assumed": (
        "{motions} speed(s) with an assumed {assumed} as 100 %, which may be far from the controller's 100 %"
    ),
    "written_half_turns_split": (
        "{lines} line(s) or arc(s) that turn the tool by 180 deg in two halves, to fix the sense"
    ),
    "written_targets_left_out": "{motions} motion(s) left out: their targets are not known",
    "written_tool_not_given": "set this tool or base on the controller: {name}",
    "written_values_rounded": "{values} speed(s) or zone(s) rounded down to the next that has a name",
    "written_unsafe": "NOT SAFE: the path {path} {verdict}; written because it was asked for",
    "written_near_assumed": (
        "NOT SETTLED: the path {path} is clear by {clearance_mm:.1f} mm of assumed shapes only, which may be wrong by "
        "{margin_mm:g} mm"
    ),
    "written_beside_points": (
        "NOT SETTLED: the checked path {path} rounds its corners by up to {missed} beside its points; a controller may "
        "go to the points"
    ),
    "written_one_side": "{branches} branch(es) of which one side alone is written: what the others do is left out",
    "written_external_axes_dropped": "{motions} motion(s) without their external axes",
    "written_not_translated": "{instructions} instruction(s) of the other language as comments",
}
"""What the head of a file says of findings: files are read by controllers, so this is plain ASCII."""


def head_line(finding: Finding) -> str:
    """A finding as a line of a file's head, which a controller reads.

    Parameters
    ----------
    finding : what the language could not hold, or what was assumed

    Returns
    -------
    line : plain ASCII, in English
    """
    return ascii_text(HEADS[finding.code].format(**finding.params))


HEAD_LINE = re.compile(rf"(?m)^(<rem>\n<text>|[ ]*(?:;|#|!|\(\*) ){HEAD}.*?(</text>\n</rem>| \*\)|)$")


def with_head_lines(text: str, lines: Iterable[str]) -> str:
    """The text of a written file with further lines at the beginning of its head.

    Parameters
    ----------
    text : as a writer made it; one without a head is returned as it is
    lines : without the signs of a comment, which are those of the first line of the head
    """
    first = HEAD_LINE.search(text)
    if first is None:
        return text
    before, behind = first.groups()
    more = "".join(f"{before}{HEAD}{ascii_text(line)}{behind}\n" for line in lines)
    return text[: first.start()] + more + text[first.start() :]


def program_name(name: str, longest: int) -> str:
    """A name that every controller takes.

    Parameters
    ----------
    name : any text
    longest : letters that the name may have

    Returns
    -------
    name : ASCII letters, digits and underscores, a letter first, and no word that one of the languages reserves
    """
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "program"
    taken = not plain[0].isalpha() or plain.lower() in RESERVED
    return (f"p{plain}" if taken else plain)[:longest]


def ascii_text(text: str) -> str:
    r"""Text in one line, for controllers that read ASCII only.

    Parameters
    ----------
    text : in any language

    Returns
    -------
    text : other letters as escapes (``\u00e4``), blanks and line ends as single spaces
    """
    return " ".join(text.encode("ascii", "backslashreplace").decode().split())


def fixed(value: float, digits: int) -> str:
    """A number as text with a fixed number of decimals.

    Parameters
    ----------
    digits : after the point

    Returns
    -------
    text : rounded; never ``-0``
    """
    return f"{round(value, digits) + 0.0:.{digits}f}"


def short(value: float, digits: int = 6) -> str:
    """A number as text without needless zeros.

    Parameters
    ----------
    digits : after the point, at most

    Returns
    -------
    text : with at least one digit after the point, such as ``1.0``
    """
    text = fixed(value, digits).rstrip("0")
    return text + "0" if text.endswith(".") else text


def cut(value: float, digits: int = 6) -> str:
    """A number as text, rounded down: a zone of half a motion must not become larger than that.

    Parameters
    ----------
    value : at least 0
    digits : after the point, at most

    Returns
    -------
    text : as of :func:`short`; 1e-12 of the number above a digit is taken for rounding noise
    """
    size: float = 10.0**digits
    return short(math.floor(value * size * (1 + 1e-12)) / size, digits)


def principal_axes(load: MassBody) -> tuple[Reals, Reals]:
    """The principal axes of a load, and its moments about them.

    Parameters
    ----------
    load : inertia about its centre of mass, kg m^2, in the flange's axes

    Returns
    -------
    pose : (4, 4), m, of the axes at the centre of mass, in the flange's frame; right-handed
    moments : (3,), kg m^2, by the eigenvectors of the inertia; as they are given if there are no products of inertia
    """
    # Axes without products of inertia are principal already; ``eigh`` would put them in the order of their moments.
    moments, axes = np.linalg.eigh(load.inertia_matrix)
    if not any(load.inertia[3:]):
        moments, axes = np.array(load.inertia[:3]), np.eye(3)
    pose = np.eye(4)
    # Eigenvectors have no sign, and a frame is right-handed.
    pose[:3, :3] = axes if np.linalg.det(axes) > 0 else -axes
    pose[:3, 3] = load.centre
    return pose, moments


LOAD_DIGITS = 9  # of masses in kg, centres in m, moments in kg m^2
ASSUMED_JOINT_SPEED = math.radians(100)  # rad/s, where nobody states a joint's greatest


def by_length(ready: ReadyMotion, unit: str) -> float | None:
    """A program's speed of the tool, or its time, in one of both units: the other one by the length of the way.

    Parameters
    ----------
    unit : ``m/s`` or ``s``

    Returns
    -------
    rate : None if the program gives neither, or the length is not known; ramps are not counted
    """
    speed = ready.motion.speed
    if speed is None or speed.value <= 0 or speed.unit not in ("m/s", "s"):
        return None
    if speed.unit == unit:
        return speed.value
    length = ready.length
    return length / speed.value if length else None


def _moved(ready: ReadyMotion) -> Reals | None:
    if ready.joints is None or ready.joints_before is None:
        return None
    return np.abs(ready.joints - ready.joints_before)
