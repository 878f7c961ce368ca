"""The application, and its commands by name: a command's module is imported when the command is called.

So ``er3a --help`` and each command start without the numerics of all others. A test holds the lines here to the first
sentences of the commands themselves.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

ROBOT_FILES = "Robot files"

_GROUPS = {
    ("studies", "Studies"): {
        "new": "Write a study for an arm: robot file, scene, targets and paths that the arm can do, README.",
        "check": "Check input files: print the kind of each file, or its error; of a URDF also the "
        "rules that it breaks.",
        "run": "Run the study in this folder; finished parts are not run again.",
        "verdicts": "Print the verdict of each stage of each robot, and what to confirm before the arm moves.",
        "view": "Open the recordings in the Rerun viewer, or, without a desktop, serve them to a browser.",
    },
    ("compare_arms", ROBOT_FILES): {
        "compare": "Do A and B describe the same arm? Lists the entries that differ. Without B: which known arm is A?",
    },
    ("known_arms", ROBOT_FILES): {
        "arms": "List known arms by name, with maker, joints, reach and source. All commands take their names.",
    },
    ("confirm", ROBOT_FILES): {
        "confirm": "Does the model agree with the controller? Compares joint values and poses as "
        "the pendant shows them.",
    },
    ("robot_files", ROBOT_FILES): {
        "import-urdf": "Write a robot file (D-H table, directions, offsets, limits) from a URDF.",
        "export-urdf": "Write a robot as URDF.",
        "import-calibration": "Write a robot file from a factory calibration; huge d values that "
        "cancel become Hayati parameters.",
        "calibrate": "Estimate corrections to a robot's table, base and tool from measured "
        "positions; write the corrected robot file.",
        "predict": "Print where a calibrated arm's tool is at commanded joint values, by the whole "
        "model with all its terms: a CSV with position and roll, pitch and yaw.",
        "hand-eye": "Estimate the pose of a camera, with 95 % intervals; name samples and "
        "conventions that can't be right.",
    },
    ("single_jobs", ROBOT_FILES): {
        "teach": "Write a teach panel as one page: sliders, the arm in 3-D, its pose and all IK solutions.",
    },
    ("programs", "Robot programs"): {
        "check-program": "Check each motion of robot programs. Findings are lines: file:line: level: message \\[code].",
        "program": "Write robot programs from paths.",
    },
    ("single_jobs", "Single jobs, called by the workflow"): {
        "compute": "Compute a stage: tables and summary.json.",
        "views": "Write a robot's recordings (always in English), a picture of each, and pages from results.",
        "index": "Write the index.",
        "article": "Write the page on the article from results; `er3a run --study "
        "config/article.yaml` also computes them.",
    },
}
COMMANDS = {name: (*group, line) for group, lines in _GROUPS.items() for name, line in lines.items()}
"""By name, in the order of ``--help``: the module that registers it, its panel in the help, its first sentence."""


class CommandsByName(TyperGroup):
    """Commands that only have a name and a line of help until one of them is called."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        shown = {name: TyperCommand(name, help=line) for name, (*_, line) in COMMANDS.items()}
        self.commands = {**shown, **self.commands}
        for name, (_, panel, _) in COMMANDS.items():
            vars(self.commands[name]).update(rich_help_panel=panel)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the first word names, its module imported now.

        Parameters
        ----------
        ctx : of the group
        args : words that follow er3a's own options
        """
        if args[0] in COMMANDS:
            import_module(f"er3a.pipeline.commands.{COMMANDS[args[0]][0]}")
            self.commands.update(typer.main.get_group(app).commands)
        return super().resolve_command(ctx, args)


app = typer.Typer(
    name="er3a",
    cls=CommandsByName,
    help="Can this kinematic model of a serial robot be trusted, and what can the robot do?",
    pretty_exceptions_enable=False,
)
