"""What all writers share: the order of a file, its head, and what is said where a language has no equal."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from er3a.by_value import ByValue
from er3a.numerics.arrays import Reals
from er3a.programs.instructions import (
    ArmMotion,
    Aside,
    Decision,
    Disabled,
    Instruction,
    Listing,
    Output,
    Pause,
    Remark,
    Unknown,
)
from er3a.programs.program_findings import (
    ArcsSplit,
    HalfTurnsSplit,
    NotTranslated,
    SpeedsCut,
    SpeedsEstimated,
    SplinesAsLines,
    TargetsLeftOut,
    ToolNotGiven,
    ValuesRounded,
    WriteFinding,
    WrittenUnsafe,
    ZonesDropped,
)
from er3a.programs.resolving import ReadyMotion, Resolver, with_default_frames
from er3a.robots.robot import Robot

HEAD = "er3a: "
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


@dataclass(frozen=True, eq=False)
class WrittenProgram(ByValue):
    """A program as files.

    Attributes
    ----------
    files : texts by suffix (``.src``, ``.dat``)
    findings : where the text differs from what was asked for; the file's head says the same
    """

    name: str
    files: Mapping[str, str]
    findings: tuple[WriteFinding, ...]


@dataclass(frozen=True, eq=False)
class WriteOptions(ByValue):
    """How a program is written.

    Attributes
    ----------
    robot : the arm; without it joints can't be told from poses, nor poses from joints
    start : (n,), rad, where the arm is before the first motion
    notes : findings of those who made the sequence, to be said in the head
    head : further lines of the head
    """

    robot: Robot | None = None
    start: Reals | None = None
    arc_deviation: float = ARC_DEVIATION
    notes: tuple[WriteFinding, ...] = ()
    head: tuple[str, ...] = ()


class Writer(ABC):
    """Writes a sequence, instruction by instruction."""

    language = ""
    longest_name = 24

    def __init__(self, listing: Listing, options: WriteOptions):
        self.listing, self.options, self.robot = listing, options, options.robot
        self.resolver = Resolver(options.robot, options.start)
        self.name = program_name(listing.name, self.longest_name)
        self.count: Counter[str] = Counter()
        self.tools: list[str] = []
        self.lines: list[str] = []
        self.said: list[str] = []
        self.own = listing.language == self.language or (listing.language, self.language) in SISTERS

    def write(self) -> WrittenProgram:
        """The files."""
        instructions = [with_default_frames(each, self.robot) for each in self.listing.instructions]
        ready = [self.resolver.ready(each) if isinstance(each, ArmMotion) else each for each in instructions]
        for i, instruction in enumerate(ready):
            if i == self.listing.repeats_from:
                self.begin_loop()
            self._add(instruction)
        if self.listing.repeats_from is not None:
            self.end_loop()
        findings = (*self.options.notes, *self._findings())
        lines = [HEAD + line for line in (*self.options.head, *map(head_line, findings))]
        head = list(dict.fromkeys((*self.said, *lines)))
        return WrittenProgram(self.name, self.files(head), findings)

    @abstractmethod
    def files(self, head: list[str]) -> dict[str, str]:
        """The files' texts by suffix."""

    @abstractmethod
    def motion(self, ready: ReadyMotion) -> None:
        """A motion."""

    @abstractmethod
    def begin_loop(self) -> None:
        """What follows is done for ever."""

    @abstractmethod
    def end_loop(self) -> None:
        """The end of what is done for ever."""

    @abstractmethod
    def comment(self, text: str) -> None:
        """A comment of one line."""

    @abstractmethod
    def pause(self, pause: Pause) -> None:
        """A wait for a time, for the operator, or for a condition in this language."""

    @abstractmethod
    def output(self, output: Output) -> None:
        """A signal in this language."""

    @abstractmethod
    def verbatim(self, text: str) -> None:
        """Text of this language."""

    def left_out(self, motion: ArmMotion) -> None:
        """A motion whose target can't be written."""
        self.count["left out"] += 1
        text = getattr(motion.target, "text", "") or "a target that needs the arm's table"
        self.comment(f"left out: {motion.form or motion.kind} {text}")

    def name_tool(self, name: str) -> None:
        """A tool that is known by its name alone."""
        if name not in self.tools:
            self.tools.append(name)

    def _add(self, instruction: Instruction | ReadyMotion) -> None:
        match instruction:
            case ReadyMotion():
                self.motion(instruction)
            case Remark(text=text):
                self._remark(text)
            case Disabled(text=text):
                self.comment(f"disabled: {text}")
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

    def _findings(self) -> tuple[WriteFinding, ...]:
        count = self.count
        found: list[WriteFinding] = []
        if count["arcs"]:
            found.append(ArcsSplit(count["arcs"], count["chords"], self.options.arc_deviation))
        found += [make(count[key]) for key, make in COUNTED.items() if count[key]]
        return (*found, *map(ToolNotGiven, self.tools))


COUNTED = {
    "zones": ZonesDropped,
    "splines": SplinesAsLines,
    "estimated": SpeedsEstimated,
    "cut": SpeedsCut,
    "left out": TargetsLeftOut,
    "rounded": ValuesRounded,
    "foreign": NotTranslated,
}
SISTERS = {("rpl", "xpl"), ("xpl", "rpl")}


def head_line(finding: WriteFinding) -> str:
    """A finding as a line of a file's head; these files are read by controllers, so it is plain ASCII."""
    match finding:
        case ArcsSplit(arcs=arcs, lines=lines, deviation_m=deviation):
            return f"{arcs} arc(s) as {lines} lines that stay within {deviation * 1000:g} mm"
        case ZonesDropped(zones=count):
            return f"{count} zone(s) without equal in this language: the arm stops there"
        case SplinesAsLines(points=count):
            return f"{count} point(s) of splines as straight lines"
        case SpeedsEstimated(motions=count):
            return f"{count} duration(s) as speeds: the controller's ramps decide the time"
        case SpeedsCut(motions=count):
            return f"{count} speed(s) above the joints' greatest, which was taken"
        case HalfTurnsSplit(lines=count):
            return f"{count} line(s) that turn the tool by 180 deg in two halves, to fix the sense"
        case TargetsLeftOut(motions=count):
            return f"{count} motion(s) left out: their targets are not known"
        case ToolNotGiven(name=name):
            return f"set this tool or base on the controller: {ascii_text(name)}"
        case ValuesRounded(values=count):
            return f"{count} speed(s) or zone(s) rounded down to the next that has a name"
        case WrittenUnsafe(path=path, verdict=verdict):
            return f"NOT SAFE: the path {ascii_text(path)} {ascii_text(verdict)}; written because it was asked for"
        case NotTranslated(instructions=count):
            return f"{count} instruction(s) of the other language as comments"


def program_name(name: str, longest: int) -> str:
    """A name that every controller takes: letters, digits and underscores, a letter first."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "program"
    taken = not plain[0].isalpha() or plain.lower() in RESERVED
    return (f"p{plain}" if taken else plain)[:longest]


def ascii_text(text: str) -> str:
    """Text without other letters than ASCII's, and in one line."""
    return " ".join(text.encode("ascii", "backslashreplace").decode().split())


def fixed(value: float, digits: int) -> str:
    """A number with so many digits behind the point, never -0."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def short(value: float, digits: int = 6) -> str:
    """A number with up to so many digits behind the point, at least one."""
    text = fixed(value, digits).rstrip("0")
    return text + "0" if text.endswith(".") else text
