"""The catalogue of arms on the command line: ``er3a arms``, ``er3a compare`` with one arm, and with three or more."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from er3a.errors import Er3aError
from er3a.pipeline.commands import options
from er3a.pipeline.commands.compare_arms import Asked, compare_two

NEAR = 1  # entries of geometry in which a table may differ from a known arm and still be near it
RANKED = 3  # arms named if none is near


@options.app.command(rich_help_panel=options.ROBOT_FILES)
def arms(
    word: Annotated[str, typer.Argument(help="a part of a name, maker or model (default: all)")] = "",
    *,
    output: Annotated[Path | None, typer.Option(help="write the one arm that is found to this robot file")] = None,
    as_json: options.AsJson = False,
):
    """List known arms by name, with maker, joints, reach and source. All commands take their names."""
    from er3a.files.arm_catalogue import known_arms
    from er3a.files.robot_writer import write_robot
    from er3a.pipeline.messages.known_arms import COLUMNS, arm_record, arm_row, provenance_lines

    known = known_arms()
    found = {
        name: arm
        for name, arm in known.items()
        if name == word or (word not in known and word.lower() in f"{name} {arm.maker} {arm.model}".lower())
    }
    if not found:
        raise Er3aError(f"no known arm has '{word}' in its name, maker or model; er3a arms lists all")
    if output:
        if len(found) > 1:
            raise Er3aError(f"--output writes one arm; '{word}' is in {len(found)}: {', '.join(found)}")
        write_robot(next(iter(found.values())).robot.replace(name=output.stem), output)
    if as_json:
        options.print_json([arm_record(name, arm) for name, arm in found.items()])
    else:
        options.print_table(COLUMNS, [arm_row(name, arm) for name, arm in found.items()])
        if len(found) == 1:
            print("\n".join(provenance_lines(*found.values())))


def identify(source: str, asked: Asked) -> None:
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
    from er3a.files.arm_file import read_arm
    from er3a.files.units import noted_doubts
    from er3a.pipeline.messages.known_arms import identified_lines, not_near_lines

    with noted_doubts():
        robot = read_arm(source, xacro=asked.xacro, **asked.options).robot
    known = known_arms()
    robots = {name: arm.robot for name, arm in known.items()}
    tolerances = {"tolerance_mm": asked.tolerance_mm, "tolerance_deg": asked.tolerance_deg}
    ranked = best_of(robot, {name: robots[name] for name in likely(robot, robots)}, **tolerances)
    name, best = ranked[0]
    if best.different_entries > NEAR or (best.geometry and best.geometry.unexplained_mm):
        if asked.as_json:
            nearest = [{"arm": each, "different_entries": found.different_entries} for each, found in ranked]
            options.print_json({"arm": None, "nearest": nearest})
        else:
            print("\n".join(not_near_lines([(known[each], found) for each, found in ranked[:RANKED]])))
        raise typer.Exit(1)
    alike = of_equal_geometry(name, robots, asked.tolerances)
    if not asked.as_json:
        print("\n".join(identified_lines(known[name], best, [known[each] for each in alike])))
    compare_two(source, name, asked, {"arm": name, "same_geometry": list(alike)})


def compare_several(sources: Sequence[str], asked: Asked) -> None:
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
    from er3a.files.arm_file import read_arm
    from er3a.pipeline.messages.known_arms import agreement_lines, matrix_rows

    if asked.output or asked.html:
        raise Er3aError("--output and --html are for two arms; give one B")
    if len(set(sources)) < len(sources):
        raise Er3aError("one arm is named twice; name each once")
    arms = {source: read_arm(source, xacro=asked.xacro, **asked.options).robot for source in sources}
    pairs = compared_in_pairs(arms, tolerance_mm=asked.tolerance_mm, tolerance_deg=asked.tolerance_deg)
    found = agreements(sources, pairs)
    if asked.as_json:
        verdicts: list[dict[str, Any]] = [{"a": a, "b": b, "verdict": each.verdict} for (a, b), each in pairs.items()]
        options.print_json({"pairs": verdicts, "layers": [vars(each) for each in found]})
    else:
        options.print_table(["", *sources], matrix_rows(sources, pairs))
        print("\n".join(agreement_lines(found)))
    if any(each.verdict != "equal" for each in pairs.values()):
        raise typer.Exit(1)
