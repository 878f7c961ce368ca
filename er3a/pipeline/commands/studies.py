"""Commands for a study: new, check, run, verdicts, view."""

from __future__ import annotations

import json
import shlex
import subprocess
import warnings
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from er3a.errors import Er3aError, InputWarning, ResultError
from er3a.files.kept_files import write_text
from er3a.finding import fact
from er3a.pipeline.commands import options
from er3a.pipeline.commands.dh_options import Angles, Conventions, Lengths
from er3a.pipeline.progress import shown_work
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study

if TYPE_CHECKING:
    from er3a.pipeline.verdicts import StageVerdict


@options.app.command()
def new(
    folder: Annotated[Path, typer.Argument(help="folder to write the study into; existing files are kept")],
    *,
    source: Annotated[
        str,
        typer.Option("--robot", "--urdf", "--dh", help="the arm: a robot's name or file, a URDF or xacro, a D-H table"),
    ],
    convention: Conventions = None,
    length_unit: Lengths = None,
    angle_unit: Angles = None,
    column: options.Columns = None,
    base: options.Base = None,
    tip: options.Tip = None,
    xacro: options.Xacro = None,
    srdf: options.Srdf = None,
):
    """Write a study for an arm: robot file, scene, targets and paths that the arm can do, README."""
    from er3a.pipeline.new_study.arms import arm_of
    from er3a.pipeline.new_study.write import write_study

    form: dict[str, Any] = {"convention": convention, "length_unit": length_unit, "angle_unit": angle_unit}
    form |= {"columns": options.columns_of(column), "base": base, "tip": tip, "xacro": xacro or (), "srdf": srdf}
    with shown_work(f"{folder}: reading the arm") as at:
        arm = arm_of(source, **form)
        compiles = "" if STAGES["trajectory"].compiled.exists() else "; the first time er3a compiles, up to two minutes"
        at(f"{folder}: searching for targets and paths that the arm can do{compiles}")
        files, shortcoming = write_study(arm, folder)
    for note in arm.notes:
        options.print_note(note)
    for file in files:
        print(f"{file}: written")
    print(f"Next: cd {shlex.quote(str(folder))} && er3a run")
    if not arm.references:
        print(f"To hold it against the arm's pendant: er3a confirm {arm.robot.name} --plan")
    if shortcoming:
        typer.secho(f"WARNING: {shortcoming}", fg="red", bold=True, err=True)


WHAT_IT_DOES = "what it does, for which see er3a check-program"


@options.app.command()
def check(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            callback=options.given_files,
            help="robot, study, target, path, scene or reference files (default: the study in this folder)",
        ),
    ] = None,
    xacro: options.Xacro = None,
    base: options.Base = None,
    tip: options.Tip = None,
    sarif: Annotated[Path | None, typer.Option(help="write the rules that URDFs break as SARIF 2.1.0")] = None,
    as_json: options.AsJson = False,
):
    """Check input files: print the kind of each file, or its error; of a URDF also the rules that it breaks.

    Exit code 1 if a unit is in doubt, or a URDF states what can't be meant.
    """
    from er3a.files.units import noted_doubts
    from er3a.pipeline.check import PROGRAM, check_file, rules_broken
    from er3a.pipeline.sarif import WORDS, Reported, sarif_log
    from er3a.program_check.check_program import LocatedFinding
    from er3a.programs.instructions import Place

    found, worst, rules = list[dict[str, object]](), 0, []
    for file in files or [Path()]:
        try:
            with warnings.catch_warnings(record=True) as said, noted_doubts() as doubts:
                warnings.simplefilter("always", InputWarning)
                kind = check_file(file, xacro or (), base, tip)
        except Er3aError as error:
            options.print_error(error)
            parts = {key: getattr(error, key, None) for key in ("field", "problem", "remedy")}
            found.append({"file": str(file), "in_order": False} | parts)
            worst = 2
            continue
        more: dict[str, object] = {"doubtful_units": [str(each) for each in doubts]} if doubts else {}
        more |= {"not_examined": [WHAT_IT_DOES]} if kind == PROGRAM else {}
        broken = rules_broken(file, kind, xacro or ())
        for each in said:
            warnings.showwarning(each.message, each.category, each.filename, each.lineno)
        note = LocatedFinding("note", fact("input_note"), Place(file))
        notes = [(note, str(each.message)) for each in said if each.category is InputWarning]
        rules += [Reported(*each) for each in broken + notes]
        named = [{"code": one.finding.code, "line": one.place.line, "text": text} for one, text in broken + notes]
        more |= {"rules": named} if named else {}
        wrong = bool(doubts) or any(one.level == "fail" for one, _ in broken)
        found.append({"file": str(file), "in_order": not wrong, "kind": kind} | more)
        worst = max(worst, int(wrong))
        if not as_json:
            for one, text in broken:
                print(f"{file}:{one.place.line}: {WORDS[one.level]}: {text} [{one.finding.code}]")
            state = "numbers that can't be meant" if wrong else "in order"
            state = f"{len(doubts)} doubtful unit{'s' if len(doubts) > 1 else ''}" if doubts else state
            only = f"; not examined: {WHAT_IT_DOES}" if kind == PROGRAM else ""
            print(f"{file}: {kind}, {state}{only}")
    if sarif:
        write_text(sarif, json.dumps(sarif_log("er3a check", rules), indent=1, ensure_ascii=False) + "\n")
    if as_json:
        options.print_json(found)
    if worst:
        raise typer.Exit(worst)


@options.app.command(context_settings={"ignore_unknown_options": True})
def run(
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SNAKEMAKE]...", help="stages or files to make, and options of Snakemake"),
    ] = None,
    study: options.StudyFile = options.DEFAULT_STUDY,
    fail_on: Annotated[options.FailOn | None, typer.Option(help="exit code 1 for this verdict or a worse one")] = None,
):
    """Run the study in this folder; finished parts are not run again."""
    from er3a.pipeline.run_study import asked_robots, asked_stages, parsed, run_study
    from er3a.pipeline.verdicts import read_verdicts

    if not run_study(study, options.RESULTS, options.REPORTS, words or []):
        raise typer.Exit(2)
    asked = parsed(words or [])
    if fail_on:
        _end_with_findings(read_verdicts(load_study(study), options.RESULTS), fail_on)
    elif not asked.dryrun:  # what was made, and changed in the meantime
        stages, robots = asked_stages(asked.targets), asked_robots(asked.targets)
        with suppress(ResultError):  # such as after an option that only lists something
            found = read_verdicts(load_study(study), options.RESULTS)
            old = [each for each in found if each.outdated and each.stage in (stages or STAGES)]
            _end_with_findings([each for each in old if each.robot in (robots or [each.robot])], options.FailOn.fail)


@options.app.command()
def verdicts(
    study: options.StudyFile = options.DEFAULT_STUDY,
    fail_on: Annotated[options.FailOn | None, typer.Option(help="exit code 1 for this verdict or a worse one")] = None,
    every: Annotated[bool, typer.Option("--all", help="print all that was found, checked and not checked")] = False,
    as_json: options.AsJson = False,
):
    """Print the verdict of each stage of each robot, and what to confirm before the arm moves."""
    from er3a.pipeline.verdicts import read_verdicts
    from er3a.pipeline.viewing.conditions import condition_of

    found = read_verdicts(load_study(study), options.RESULTS)
    if as_json:
        options.print_json([asdict(verdict) for verdict in found])
    else:
        short = ["The table is contradicted." if each.no_verdict else each.answer for each in found]
        said = [each.text for each in found] if every else short
        rows = ((each.robot, each.stage, each.shown, text) for each, text in zip(found, said))
        options.print_table(("robot", "stage", "verdict", "finding"), rows)
        for each in found:
            open_table = each.stage == "validation" and each.status in ("caution", "no_reference")
            if first := open_table and condition_of(options.RESULTS / each.robot / each.stage)[0]:
                print(f"{each.robot}: {first}")
        if changed := [*dict.fromkeys(name for each in found for name in each.outdated)]:
            options.print_note(f"changed since ({', '.join(changed)}): run the study again")
    if fail_on:
        _end_with_findings(found, fail_on)


def _end_with_findings(found: Sequence[StageVerdict], level: options.FailOn) -> None:
    """Print the verdicts at a level or worse, and end with exit code 1 if there are any."""
    counted = [verdict for verdict in found if verdict.counts(level.value)]
    if skipped := Counter(verdict.shown for verdict in found if verdict.is_skipped):
        named = ", ".join(f"{count} {status}" for status, count in skipped.items())
        options.print_note(f"neither passed nor failed: {named}, of {len(found)} stages")
    if shown := [f"{verdict.robot}, {verdict.stage}" for verdict in found if verdict.is_demonstration]:
        options.print_note(f"demonstrations, which fail as expected and do not count: {'; '.join(shown)}")
    for verdict in counted:
        expected = f"; expected: {verdict.expected}" if verdict.is_otherwise else ""
        options.print_note(f"{verdict.robot}, {verdict.stage} ({verdict.shown}{expected}): {verdict.text}")
    if counted:
        raise typer.Exit(1)


@options.app.command()
def view(
    robot: options.SomeRobot = None,
):
    """Open the recordings in the Rerun viewer, or, without a desktop, serve them to a browser."""
    from er3a.pipeline.results import check_checksum
    from er3a.pipeline.viewing.viewer import has_display, serve, viewer_command, without_statistics

    recordings = sorted(options.REPORTS.glob(f"{robot or '*'}/*.rrd"))
    if not recordings:
        raise Er3aError(f"no recordings below {options.REPORTS / (robot or '')}; run the study first")
    for recording in recordings:
        check_checksum(recording)
    if not has_display():
        serve(recordings)
        return
    with without_statistics() as environment:
        done = subprocess.run(viewer_command(recordings), env=environment, check=False)
    raise typer.Exit(done.returncode)
