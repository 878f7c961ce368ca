"""``er3a arms``: the catalogue of arms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from er3a.errors import Er3aError
from er3a.pipeline.commands import options


@options.app.command()
def arms(
    word: Annotated[str, typer.Argument(help="a part of a name, maker or model (default: all)")] = "",
    *,
    output: Annotated[Path | None, typer.Option(help="write the one arm that is found to this robot file")] = None,
    as_json: options.AsJson = False,
):
    """List known arms by name, with maker, joints, reach and source. All commands take their names."""
    from er3a.files.arm_catalogue import arms_like, known_arms
    from er3a.files.robot_writer import write_robot
    from er3a.pipeline.messages.known_arms import COLUMNS, arm_record, arm_row, provenance_lines

    known = known_arms()
    found = {word: known[word]} if word in known else arms_like(word)
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
