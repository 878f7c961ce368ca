"""``er3a compare``: do two descriptions describe the same arm?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from er3a.by_value import frozen
from er3a.comparison.mechanism import TOLERANCE_DEG, TOLERANCE_MM, Tolerances
from er3a.errors import DoubtfulUnit, Er3aError
from er3a.finding import plain
from er3a.pipeline.commands.dh_options import Angles, Conventions, Lengths
from er3a.pipeline.commands.options import (
    AsJson,
    Base,
    Columns,
    Tip,
    Xacro,
    app,
    columns_of,
    print_json,
    print_note,
    print_table,
)
from er3a.robots.robot import Robot

if TYPE_CHECKING:
    from er3a.comparison.compare import Comparison
    from er3a.files.robot_library import ReadArm

Read = tuple["ReadArm", Sequence[DoubtfulUnit]]
"""An arm as it was read, and doubts about its units."""

Tolerance = Annotated[
    float, typer.Option(min=1e-9, max=1000, help="lengths, or angles, that differ by at most this are equal")
]
NEAR = 1  # entries of geometry in which a table may differ from a known arm and still be near it
NEAREST_SHOWN = 3  # known arms, if none is near
TOOLS_EQUAL = 1e-9  # m, and of axes
OF_A_TABLE = ("column", "angles", "alpha", "offset", "dh.rows")  # keys of numbers that a comparison looks at
_ARM = "a D-H table in any form (- is standard input), a robot's name or file, a URDF or xacro"


@frozen
class CompareRequest:
    """What a call of ``er3a compare`` asks for: how files are read, tolerances (mm, deg), and what is written."""

    options: dict[str, Any]
    xacro: tuple[str, ...]
    tolerance_mm: float
    tolerance_deg: float
    output: Path | None
    html: Path | None
    as_json: bool

    @property
    def tolerances(self) -> Tolerances:
        """In m and rad."""
        return Tolerances(self.tolerance_mm / 1000, math.radians(self.tolerance_deg))


@app.command()
def compare(
    a: Annotated[str, typer.Argument(metavar="A", help=f"the arm to test: {_ARM}")],
    others: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="B",
            help="the arm to compare with, as A; several: who agrees with whom; none: which known arm is A?",
        ),
    ] = None,
    *,
    convention: Conventions = None,
    length_unit: Lengths = None,
    angle_unit: Angles = None,
    column: Columns = None,
    base: Base = None,
    tip: Tip = None,
    xacro: Xacro = None,
    tolerance_mm: Tolerance = TOLERANCE_MM,
    tolerance_deg: Tolerance = TOLERANCE_DEG,
    output: Annotated[Path | None, typer.Option(help="write A, corrected to equal B, to this file (.yaml)")] = None,
    html: Annotated[Path | None, typer.Option(help="also write a page")] = None,
    as_json: AsJson = False,
):
    """Do A and B describe the same arm? Lists the entries that differ. Without B: which known arm is A?

    Exit code 1 if anything differs.
    """
    if [a, *(others or ())].count("-") > 1:
        raise Er3aError("standard input holds one table; give the others as files")
    if output is not None and output.suffix not in (".yaml", ".yml"):
        raise Er3aError(f"--output is '{output}'; robot files end in .yaml")
    options: dict[str, Any] = {"convention": convention, "length_unit": length_unit, "angle_unit": angle_unit}
    options |= {"base": base, "tip": tip, "as_printed": True, "columns": columns_of(column)}
    asked = CompareRequest(options, tuple(xacro or ()), tolerance_mm, tolerance_deg, output, html, as_json)
    if not others:
        identify(a, asked)
    elif len(others) == 1:
        compare_two(a, others[0], asked)
    else:
        compare_several([a, *others], asked)


def compare_two(
    a: str,
    b: str,
    asked: CompareRequest,
    known: Mapping[str, Any] | None = None,
    read: Read | None = None,
    found: Comparison | None = None,
) -> None:
    """Compare an arm with another, and print what was found.

    Parameters
    ----------
    a, b : as they were named on the command line
    known : what is printed as JSON of a known arm that ``b`` names, too
    read, found : A, if it has been read, and what a comparison with B found, if there was one

    Raises
    ------
    typer.Exit
        with code 1 if anything differs
    """
    from er3a.comparison.compare import compare as compare_arms
    from er3a.files.robot_library import holds_table
    from er3a.robots.robot import to_modified, to_standard

    first, found_before = read or _read(a, asked)
    # Names of columns are those of A, or of B if A is no table.
    of_table = {"columns": (), "joints": first.robot.joints} if holds_table(a) else {}
    second, found_then = _read(b, replace(asked, options=asked.options | of_table))
    arm = first.robot
    if not first.printed and second.printed:
        arm = (to_modified if second.robot.convention == "modified" else to_standard)(arm)
    tolerances = asked.tolerance_mm, asked.tolerance_deg
    if found is None:
        found = compare_arms(arm, second.robot, tolerance_mm=tolerances[0], tolerance_deg=tolerances[1])
    found = _beside(found, first, second)
    doubtful = list({str(each): each for each in (*found_before, *found_then)}.values())
    doubts = [str(each) for each in _unsettled(doubtful, found, Path(a) == Path(b))]
    if found.verdict == "equal" and doubts:
        found = replace(found, verdict="in_doubt")
    notes = _notes((a, first), (b, second))
    for note in notes:
        print_note(note)
    written = _written((a, arm), (b, second.robot), found, asked.output, asked.html, (*tolerances, doubts))
    if asked.as_json:
        record = {key: plain(value) for key, value in vars(found).items() if key not in ("corrected", "alignment")}
        print_json(record | {"notes": notes, "doubtful_units": doubts} | dict(known or {}))
    else:
        _print(found, doubts)
        for file in written:
            print(f"{file}: written")
    if found.verdict != "equal":
        raise typer.Exit(1)


def _read(source: str, asked: CompareRequest) -> Read:
    """An arm, and the numbers of its file whose units are in doubt."""
    from er3a.files.robot_library import read_arm
    from er3a.files.units import noted_doubts

    with noted_doubts() as doubtful:
        arm = read_arm(source, xacro=asked.xacro, **asked.options)
    return arm, doubtful


def identify(source: str, asked: CompareRequest) -> None:
    """Print which known arm a table describes, by what it differs, and which others have the same geometry.

    Parameters
    ----------
    source : as it was named on the command line

    Raises
    ------
    typer.Exit
        with code 1 if anything differs, or no arm is near
    """
    from er3a.comparison.compare import best_of
    from er3a.comparison.nearest import likely, of_equal_geometry
    from er3a.files.arm_catalogue import known_arms
    from er3a.files.robot_library import known_arm
    from er3a.pipeline.messages.known_arms import identified_lines, not_near_lines
    from er3a.robots.robot import to_standard

    read, known = _read(source, asked), known_arms()
    robot = read[0].robot if read[0].printed else to_standard(read[0].robot)
    robots = {name: arm.robot for name, arm in known.items()}
    tolerances = {"tolerance_mm": asked.tolerance_mm, "tolerance_deg": asked.tolerance_deg}
    ranked = best_of(robot, {name: robots[name] for name in likely(robot, robots)}, **tolerances)
    near = ranked and ranked[0][1].different_entries <= NEAR
    if not near or (ranked[0][1].geometry and ranked[0][1].geometry.unexplained_mm):
        notes = _notes((source, read[0]))
        for note in notes:
            print_note(note)
        if asked.as_json:
            nearest = [{"arm": each, "different_entries": found.different_entries} for each, found in ranked]
            print_json({"arm": None, "nearest": nearest, "notes": notes})
        else:
            print("\n".join(not_near_lines([(known[each], found) for each, found in ranked[:NEAREST_SHOWN]])))
        raise typer.Exit(1)
    name, best = ranked[0]
    alike = of_equal_geometry(name, robots, asked.tolerances)
    others = {each for each, found in ranked if found.different_entries == best.different_entries} - {name, *alike}
    groups = [[known[each] for each in names] for names in (alike, sorted(others))]
    if not asked.as_json:
        print("\n".join(identified_lines(known[name], best, *groups)))
    record = {"arm": name, "same_geometry": list(alike), "as_near": sorted(others)}
    # A robot file of this name goes before the catalogue's arm, and may give more.
    compare_two(source, name, asked, record, read, best if known_arm(name) else None)


def compare_several(sources: Sequence[str], asked: CompareRequest) -> None:
    """Print who agrees with whom, layer by layer, and the odd ones out.

    Parameters
    ----------
    sources : three or more, as they were named on the command line

    Raises
    ------
    typer.Exit
        with code 1 if anything differs
    """
    from er3a.comparison.agreement import agreements, compared_in_pairs
    from er3a.pipeline.messages.known_arms import agreement_lines, matrix_rows

    if asked.output or asked.html:
        raise Er3aError("--output and --html are for two arms; give one B")
    if len(set(sources)) < len(sources):
        raise Er3aError("one arm is named twice; name each once")
    arms = {source: _read(source, asked)[0].robot for source in sources}
    pairs = compared_in_pairs(arms, tolerance_mm=asked.tolerance_mm, tolerance_deg=asked.tolerance_deg)
    found = agreements(sources, pairs)
    if asked.as_json:
        verdicts: list[dict[str, Any]] = [{"a": a, "b": b, "verdict": each.verdict} for (a, b), each in pairs.items()]
        print_json({"pairs": verdicts, "layers": [vars(each) for each in found]})
    else:
        print_table(["", *sources], matrix_rows(sources, pairs))
        print("\n".join(agreement_lines(found)))
    if any(each.verdict != "equal" for each in pairs.values()):
        raise typer.Exit(1)


def _written(
    one: tuple[str, Robot],
    other: tuple[str, Robot],
    found: Comparison,
    output: Path | None,
    html: Path | None,
    asked: tuple[float, float, list[str]],
) -> list[Path]:
    """The files that were written: the corrected table, and the page, with tolerances (mm, deg) and doubts."""
    files = []
    if output is not None and found.corrected is not None:
        from er3a.files.robot_writer import write_robot

        write_robot(found.corrected.replace(name=output.stem), output)
        files.append(output)
    if html is not None:
        from er3a.pipeline.viewing.comparison import write_comparison

        write_comparison(one, other, found, html, asked[:2], asked[2])
        files.append(html)
    return files


def _unsettled(doubts: Sequence[DoubtfulUnit], found: Comparison, one_file: bool) -> list[DoubtfulUnit]:
    """Doubts that the comparison leaves: another arm that agrees, and is not in doubt, settles those of a table."""
    of_table = [each for each in doubts if each.key.startswith(OF_A_TABLE)]
    agree = found.geometry is not None and found.geometry.same and not one_file
    settled = agree and len({str(each.file) for each in of_table}) < 2
    return [each for each in doubts if not (settled and each in of_table)]


def _beside(found: Comparison, first: ReadArm, other: ReadArm) -> Comparison:
    """A comparison of two tables, its units named as their headings do, with what both files give beside them."""
    from er3a.comparison.compare import by_headings, given_by_both

    ranges = (each for each in found.not_examined if each in ("limits", "speeds", "limits_on_sums"))
    found = by_headings(found, first.units, other.units)
    return replace(found, not_examined=(*ranges, *given_by_both(first.beside, other.beside)))


def _notes(*arms: tuple[str, ReadArm]) -> list[str]:
    """What was assumed in reading arms, by their names, and that the tools of two differ."""
    import numpy as np

    notes = [f"{source}: {note}" for source, read in arms for note in read.notes]
    (a, first), (b, second) = arms[0], arms[-1]
    if not np.allclose(first.robot.tool, second.robot.tool, rtol=0.0, atol=TOOLS_EQUAL):
        apart = 1000 * float(np.linalg.norm(first.robot.tool[:3, 3] - second.robot.tool[:3, 3]))
        notes.append(f"{a} and {b}: tools are not compared; these differ (their points by {apart:.3g} mm)")
    return notes


def _print(found: Comparison, doubts: list[str]) -> None:
    """Print a comparison, layer by layer."""
    from er3a.pipeline.messages.comparison import doubt_rows, headline, layer_rows

    print(headline(found, doubts))
    for layer, state, detail in (*doubt_rows(doubts), *layer_rows(found)):
        print(f"  {layer:<11} {state:<8} {detail}".rstrip())
