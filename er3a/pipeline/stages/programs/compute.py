"""Read, follow and check every program of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from er3a.collision.along import bodies_of, clearance_along
from er3a.collision.shapes import shapes_assumed
from er3a.files.program_file import ProgramEntry, ProgramsFile, load_programs
from er3a.finding import fact, is_one
from er3a.geometry.transforms import inverted
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.pipeline.results import Figure, Status, Verdict
from er3a.pipeline.scope import CHECKS_OF_MOTIONS, Check, Coverage, Open, coverages
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.covered import Covered, assumed_rates, covered_collisions
from er3a.pipeline.stages.expectations import demonstrations, pass_of, unmet_expectations
from er3a.pipeline.stages.programs import model
from er3a.pipeline.stages.trajectory.judgement import safe_stop
from er3a.pipeline.stages.trajectory.motion import MotionTask, limits_of, margin_of, near_singular, task_of
from er3a.pipeline.study import Study
from er3a.program_check.check_program import CheckOptions, LocatedFinding, ProgramCheck, check_program
from er3a.program_check.motion_checks import curve_of
from er3a.program_check.program_check_findings import Level
from er3a.program_check.step_checks import Obstacles
from er3a.programs.instructions import Pause
from er3a.programs.languages import read_program
from er3a.programs.program_names import ProgramOutcome
from er3a.robots.joint_limits import shown, speeds_given
from er3a.robots.robot import Robot

OUTCOMES: dict[Level, ProgramOutcome] = {"pass": "pass", "note": "pass", "caution": "caution", "fail": "fail"}
MAX_POINTS = 20_000  # of a program's motion that are kept


def compute(study: Study, name: str) -> model.ProgramsResults:
    """Read, follow and check every program of a robot.

    Parameters
    ----------
    name : of a robot

    Returns
    -------
    results : with no rows for a robot without programs

    Raises
    ------
    InputError
        naming the file of a program and the line that can't be read, or another file of the study
    """
    robot = study.robot(name)
    file = study.entry(name).programs
    listed = load_programs(file) if file else ProgramsFile(kind="programs")
    scene = study.scene(name, "trajectory")
    limits = limits_of(robot, study.section(TrajectorySettings))
    options = replace(_options(study, name, listed), scene=scene, joint_limits=limits)
    task = task_of(study, name)
    summaries: list[model.ProgramSummary] = []
    lines: list[model.Lines] = []
    instructions: list[model.Instructions] = []
    unknown_starts: list[str] = []
    asked: list[model.ProgramSummary] = []  # those that are given to be run
    arms: list[tuple[str, Robot]] = []
    motions: list[model.ProgramMotion] = []
    for entry in listed.programs:
        check = check_program(read_program(entry.file), robot, replace(options, start=entry.start(robot)))
        check = replace(check, findings=tuple(_ended(check, each, task, options) for each in check.findings))
        motion, starts = _motion(entry.name, check, robot)
        summaries.append(_summary(entry, check, starts))
        if any(is_one(each.finding, "way_not_known") for each in check.findings):
            unknown_starts.append(entry.name)
        if entry.expect in (None, "pass"):
            asked.append(summaries[-1])
            arms += check.arms
        lines.append(_lines(entry.name, check))
        instructions.append(_instructions(entry.name, check))
        motions.append(motion)
    smallest = {
        each.name: None if each.least_clearance_mm is None else each.least_clearance_mm / 1000 for each in asked
    }
    assumed = shapes_assumed(robot, options.assumed_margin, smallest)
    covered = covered_collisions(robot, bodies_of(robot, scene), scene, arms)
    return model.ProgramsResults(
        summary=model.ProgramsSummary(
            verdict=_verdict(summaries, asked).with_assumed_shapes(assumed),
            figures=_figures(asked),
            scene=scene.title if scene else None,
            programs=tuple(summaries),
            checked=_checked(asked, covered),
            assumed=(
                *assumed_rates(speeds_given(robot), not limits.acceleration_assumed),
                *_assumed(summaries, unknown_starts),
                *covered.assumed,
            ),
        ),
        lines=model.Lines.stacked(lines),
        instructions=model.Instructions.stacked(instructions),
        motion=model.ProgramMotion.stacked(motions).of_joints(robot.slides),
    )


def _checked(asked: Sequence[model.ProgramSummary], seen: Covered) -> tuple[Coverage, ...]:
    """What the checks cover of the programs that are given to be run; of each motion all or nothing."""
    lines = tuple(f"{each.name}: {', '.join(map(str, each.not_examined))}" for each in asked if each.not_examined)
    of = sum(each.motions for each in asked)
    done = max(of - sum(len(each.not_examined) for each in asked), 0)
    gaps = (*seen.gaps, *((Open("program_lines", lines),) if lines else ()))
    checks: dict[Check, tuple[int, int]] = dict.fromkeys(CHECKS_OF_MOTIONS, (done, done))
    return coverages({**checks, "program_lines": (done, of), **seen.asked}, gaps)


def _assumed(programs: Sequence[model.ProgramSummary], unknown_starts: Sequence[str]) -> Iterator[Open]:
    """Where the arm stands at first, axes beside its own, and loads."""
    if unknown_starts:
        yield Open("program_starts", tuple(unknown_starts))
    found = [(each.name, at.finding) for each in programs for at in each.findings]
    said = (f"{name}: {load.mass_kg:g} kg" for name, load in found if is_one(load, "load_above_payload"))
    if texts := tuple(dict.fromkeys(said)):
        yield Open("program_load", texts)


def _options(study: Study, name: str, listed: ProgramsFile) -> CheckOptions:
    paths = study.section(TrajectorySettings)
    return CheckOptions(
        frames=listed.transforms(),
        near=near_singular(paths),
        penetration_tolerance=paths.penetration_tolerance_mm / 1000,
        assumed_margin=study.assumed_margin(name),
    )


def _ended(check: ProgramCheck, found: LocatedFinding, task: MotionTask, options: CheckOptions) -> LocatedFinding:
    """What was found; of a collision towards which one line goes once also where and when (s of its motion) the line
    may end: the tool point in the line's base, mm, how clear the arm is up to there, and whether the tool turns on from
    there."""
    motions = [motion for number, motion in check.motions.items() if check.execution.steps[number].place == found.place]
    motion = motions[0] if len(motions) == 1 else None
    if not is_one(found.finding, "motion_collides") or motion is None or motion.path is None or motion.base is None:
        return found
    bodies = Obstacles(task.robot, options.scene, check.motions, task.tolerance, options.assumed_margin).bodies
    task, curve = replace(task, bodies=bodies), curve_of(motion.path)
    times = curve.times
    along = clearance_along(bodies, curve.joints, curve.rate_bounds, times, times[[0, -1]], task.tolerance)
    others = [at for each, at in motion.findings.items() if at is not None and not is_one(each, "motion_collides")]
    last = safe_stop(task, curve, times, along.contacts, others, margin_of(task, options.assumed_margin))
    if last is None:
        return found
    pose = inverted(motion.base) @ forward(motion.arm, curve.joints(np.array([last.kept_to])))[0]
    end = tuple((1000 * pose[:3, 3]).tolist())
    return replace(found, finding=found.finding.but(end_mm=end, end_s=last.kept_to, margin_mm=1000 * last.margin))


def _summary(entry: ProgramEntry, check: ProgramCheck, starts: Mapping[int, float]) -> model.ProgramSummary:
    levels = [OUTCOMES[verdict.level] for verdict in check.verdicts]
    clear = [verdict.least_clearance_mm for verdict in check.verdicts if verdict.least_clearance_mm is not None]
    found = [each for each in check.findings if not is_one(each.finding, "pairs_unexamined")]  # the verdict says it
    return model.ProgramSummary(
        name=entry.name,
        title=entry.title,
        file=entry.file,
        language=check.execution.program.language,
        outcome=OUTCOMES[check.level],
        expect=entry.expect,
        complete=check.execution.complete,
        ways=sum(each.entry == check.execution.program.entry for each in check.execution.endings),
        motions=len(levels),
        passed=levels.count("pass"),
        caution=levels.count("caution"),
        failed=levels.count("fail"),
        cycle=check.cycle,
        least_clearance_mm=min(clear, default=None),
        findings=tuple(model.finding_at(each, starts) for each in found),
        not_examined=tuple(sorted(_not_followed(check))),
    )


def _not_followed(check: ProgramCheck) -> set[int]:
    """Lines of motions that were not followed each time, and of instructions that were not."""
    lines = {each.place.line for each in check.verdicts if not each.followed}
    return lines | {each.place.line for each in check.findings if is_one(each.finding, "not_followed")}


def _lines(name: str, check: ProgramCheck) -> model.Lines:
    text = check.execution.program.lines
    return model.Lines.of(program=name, line=np.arange(1, len(text) + 1), text=text)


def _instructions(name: str, check: ProgramCheck) -> model.Instructions:
    return model.Instructions.of(
        program=name,
        line=[each.line for each in check.verdicts],
        element=[each.place.element for each in check.verdicts],
        kind=[each.kind for each in check.verdicts],
        level=[each.level for each in check.verdicts],
        times=[each.times for each in check.verdicts],
        duration_s=[each.duration_s for each in check.verdicts],
        clearance_mm=[each.least_clearance_mm for each in check.verdicts],
    )


def _motion(name: str, check: ProgramCheck, robot: Robot) -> tuple[model.ProgramMotion, dict[int, float]]:
    """The main way over time, with a stop at each target, and when (s) each of its steps begins; what is not known is
    left out."""
    starts: dict[int, float] = {}
    levels = {each.place: each.level for each in check.verdicts}
    times: list[Reals] = [np.empty(0)]
    angles: list[Reals] = [np.empty((0, robot.joints))]
    points: list[Reals] = [np.empty((0, 3))]
    lines: list[int] = []
    step_levels: list[str] = []
    now = 0.0
    for number in check.main:
        step = check.execution.steps[number]
        motion = check.motions.get(number)
        if isinstance(step.instruction, Pause):
            now += step.instruction.seconds or 0.0
        if motion is None or (motion.path is None and motion.end is None):
            continue
        if motion.path is None:
            assert motion.end is not None
            t, q, arm = np.zeros(1), motion.end[None], motion.arm
        else:
            t, q, arm = motion.path.t, motion.path.q, motion.arm
        if not len(t) or len(lines) + len(t) > MAX_POINTS:
            break
        starts[number] = now
        times.append(now + t)
        angles.append(q)
        points.append(forward(arm, q)[:, :3, 3])
        lines += [check.execution.own_line(step)] * len(t)
        step_levels += [levels[step.place]] * len(t)
        now += motion.path.law.duration if motion.path else 0.0
    kept = model.ProgramMotion.of(
        program=name,
        t_s=np.concatenate(times),
        line=lines,
        level=step_levels,
        q_deg=shown(robot, np.concatenate(angles)),
        xyz_mm=np.concatenate(points) * 1000,
    )
    return kept, starts


def _verdict(programs: list[model.ProgramSummary], asked: list[model.ProgramSummary]) -> Verdict:
    if not programs:
        return Verdict("no_reference", fact("programs.none"))
    if unmet := unmet_expectations(programs, "pass"):
        return Verdict("fail", unmet)
    caution, failed = (tuple(each.name for each in asked if each.outcome == outcome) for outcome in ("caution", "fail"))
    code = "programs.fail" if failed else "programs.caution" if caution else "programs.pass"
    status: Status = "fail" if failed else "caution" if caution else pass_of(asked)
    passed = len(asked) - len(caution) - len(failed)
    missed = tuple(each.name for each in asked if each.not_examined)
    shown = [each for each in programs if each.expect != "pass"]
    found = fact(
        code,
        programs=len(asked),
        passed=passed,
        caution=caution,
        failed=failed,
        demonstrations=demonstrations(shown, "pass"),
        not_examined=missed,
    )
    return Verdict(status, found)


def _figures(asked: list[model.ProgramSummary]) -> tuple[Figure, ...]:
    instructions = sum(each.motions for each in asked)
    clear = [each.least_clearance_mm for each in asked if each.least_clearance_mm is not None]
    return (
        Figure("programs_passed", sum(each.outcome == "pass" for each in asked), "", of=len(asked)),
        Figure("instructions_passed", sum(each.passed for each in asked), "", of=instructions),
        Figure("least_clearance", min(clear, default=None), "mm"),
    )
