"""What the index shows of a stage: one number, and what is to be known of it in few words."""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.stages.collision.model import CollisionResults
from er3a.pipeline.stages.dynamics.model import DynamicsResults
from er3a.pipeline.stages.inverse.model import InverseResults
from er3a.pipeline.stages.programs.model import ProgramsResults
from er3a.pipeline.stages.programs.page.played import faults as program_faults
from er3a.pipeline.stages.trajectory.model import TrajectoryResults
from er3a.pipeline.stages.trajectory.page.played import faults as path_faults
from er3a.pipeline.stages.validation.model import ValidationResults
from er3a.pipeline.stages.vision.model import VisionResults
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.tray import sound_motions

Glance = tuple[str, str]


@singledispatch
def glance(results: object) -> Glance:
    """A stage's number and a note of at most four words, in the page's language.

    Parameters
    ----------
    results : of a stage that was computed

    Returns
    -------
    value, note : both empty for a stage that says nothing at a glance
    """
    return "", ""


@glance.register
def _(results: ValidationResults) -> Glance:
    summary = results.summary
    counts, evidence = summary.counts.independent, summary.evidence
    value = f"{counts.passed}/{counts.total}" if counts.total else "0"
    if summary.verdict.status == "fail":
        bad = evidence.contradicted if evidence else 0
        failed = f"{counts.total - counts.passed}/{counts.total}"
        return failed, tr("another arm") if summary.is_beyond_correction else tr("{count} wrong", count=bad)
    for conflict in summary.conflicts[:1]:
        stated = [each.expected for each in conflict.statements]
        return value, tr("sources differ by {off}", off=with_unit(fixed(max(stated) - min(stated), 1), conflict.unit))
    left = len(evidence.unconfirmed) if evidence else 0
    return value, tr("{count} entries to confirm", count=left) if left else ""


@glance.register
def _(results: WorkspaceResults) -> Glance:
    summary = results.summary
    far = with_unit(fixed(1000 * summary.reach_m.furthest_from_axis, 0), "mm")
    return far, with_unit(fixed(summary.volume_m3.middle, 2), "m³")


@glance.register
def _(results: CollisionResults) -> Glance:
    params, closest = results.summary.verdict.finding.params, results.summary.closest
    partly = set(results.paths.path[np.isnan(results.paths.q_deg).any(axis=1)].tolist())  # these are clear of nothing
    clear = sum(each.clearance_mm >= 0 and each.name not in partly for each in closest)
    hit = sum(each.clearance_mm < 0 for each in closest) + len(params.get("blocked", ()))
    caught = len(params.get("demonstrations", ()))
    return f"{clear}/{clear + hit - caught}", _caught(caught)


@glance.register
def _(results: InverseResults) -> Glance:
    targets, caught = results.targets, int(results.targets.caught.sum())
    return f"{targets.reached.sum()}/{len(targets) - caught}", _caught(caught)


@glance.register(TrajectoryResults)
@glance.register(ProgramsResults)
def _(results: TrajectoryResults | ProgramsResults) -> Glance:
    if isinstance(results, ProgramsResults):
        count, wrong = len(results.summary.programs), program_faults(results)
    else:
        count, wrong = len(results.summary.paths), path_faults(results)
    caught, shapes = sum(fault.meant for fault in wrong), results.summary.verdict.shapes
    if shapes and shapes.near:
        note = tr("{count} within {far}", count=len(shapes.near), far=with_unit(fixed(shapes.margin_mm, 0), "mm"))
        return f"{len(sound_motions(results))}/{count - caught}", note
    return f"{len(sound_motions(results))}/{count - caught}", _caught(caught)


@glance.register
def _(results: DynamicsResults) -> Glance:
    motors = results.summary.motors
    if not motors:
        return "–", tr("masses unknown")
    worst = max(motors, key=lambda motor: max(motor.peak, motor.holding))
    judged = results.summary.verdict.status != "no_reference"
    note = tr("J{joint}", joint=worst.joint) if judged else tr("J{joint}, not judged", joint=worst.joint)
    return with_unit(number(max(worst.peak, worst.holding), 2), worst.unit), note


@glance.register
def _(results: VisionResults) -> Glance:
    objects = results.summary.objects
    caught = sum(not each.grasp and each.outcome == each.expect for each in objects)
    grasped = sum(bool(each.grasp) for each in objects)
    simulated = results.summary.calibration is not None and results.summary.calibration.simulated
    note = tr("simulated") if simulated else _caught(caught)
    return f"{grasped}/{len(objects) - caught}", tr("not fully checked") if results.summary.verdict.missed else note


def _caught(count: int) -> str:
    return tr("faults caught: {count}", count=count) if count else ""
