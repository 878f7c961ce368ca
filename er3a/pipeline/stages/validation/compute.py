"""Hold a model against its reference sets, and against itself."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pandas as pd

from er3a.files.reference_sets import load_references
from er3a.pipeline.messages.language import N_, keeps_sentences
from er3a.pipeline.results import write_summary, write_table
from er3a.pipeline.stages.validation.checks import Check, checks_of_set, nothing_to_compare
from er3a.pipeline.stages.validation.corrections import identify_from_sets
from er3a.pipeline.stages.validation.diagnoses import diagnose_sets
from er3a.pipeline.stages.validation.findings import SHOWN_DECIMALS, key_figures, set_findings, verdict_of
from er3a.pipeline.stages.validation.geometry_tables import axes_table, key_poses_table, section_table
from er3a.pipeline.stages.validation.self_checks import closed_form, round_trip_checks, table_checks
from er3a.pipeline.stages.validation.subject import model_of
from er3a.pipeline.study import Study
from er3a.references.circle_points import circle_points
from er3a.references.predict import read, state_of
from er3a.references.quantities import MM, ZERO_POSE, Extreme, Quantity
from er3a.references.reach import search
from er3a.references.scalars import reach_name

STAGE = "validation"
WRIST_REACH = Extreme("wrist_centre", "axis_1", "greatest")
FLANGE_REACH = Extreme("flange", "axis_1", "greatest")
ALWAYS_SEARCHED = (
    WRIST_REACH,
    Extreme("wrist_centre", "axis_1", "least"),
    Extreme("wrist_centre", "axis_2", "greatest"),
    Extreme("wrist_centre", "axis_2", "least"),
    FLANGE_REACH,
    Extreme("flange", "axis_1", "least"),
)


@keeps_sentences
def compute(study: Study, name: str, folder: Path) -> None:
    """Write ``summary.json``, and the tables ``checks``, ``axes``, ``key_poses``, ``section``, ``residuals`` and
    ``corrections`` as Parquet.

    The summary's own keys: ``checks`` (see :class:`er3a.pipeline.stages.validation.checks.Check`), ``conflicts``,
    ``sets`` (what was found per reference set), ``diagnosis`` and ``culprits``
    (:mod:`er3a.pipeline.stages.validation.diagnoses`), ``identification``
    (:mod:`er3a.pipeline.stages.validation.corrections`), ``circle_points`` (the carried point, and how round its tracks
    are), ``table`` (convention, and why there is no closed form, if so), ``round_trips`` and
    ``section_origin_mm`` (axis 1 and axis 2 in the base frame, where the workspace drawing has its origin).
    """
    robot = model_of(study, name)
    settings = study.validation
    sets = [load_references(reference) for reference in robot.references]

    wanted = [reference.quantity for references in sets for reference in references.checkable]
    wanted = dict.fromkeys([*ALWAYS_SEARCHED, *(quantity for quantity in wanted if isinstance(quantity, Extreme))])
    extremes = {quantity: search(robot, quantity, settings.reach_starts) for quantity in wanted}
    values = {quantity: value for quantity, (value, _) in extremes.items()}

    circles = circle_points(robot)
    checks, conflicts = table_checks(robot), []
    for references in sets:
        stated = references.checkable
        state = state_of(robot, stated, extremes=values, axes=circles.axes)
        judged, contradictions = checks_of_set(references, read(stated, state))
        checks += judged
        conflicts += contradictions
    checks += _without_reference(values, checks)
    trip_checks, trips = round_trip_checks(robot, settings.round_trips, study.seed)
    checks += trip_checks

    axes = axes_table(circles, sets)
    poses = key_poses_table(robot, sets, extremes)
    diagnosis, culprits, residuals = diagnose_sets(robot, sets)
    identified, corrections = identify_from_sets(robot, sets)
    findings = set_findings(sets, checks, poses, culprits)
    write_table(folder / "checks.parquet", pd.DataFrame([asdict(check) for check in checks]))
    write_table(folder / "axes.parquet", axes)
    write_table(folder / "key_poses.parquet", poses)
    write_table(folder / "section.parquet", section_table(robot, extremes))
    write_table(folder / "residuals.parquet", residuals)
    write_table(folder / "corrections.parquet", corrections)

    reach = {
        N_("Wrist centre reaches from axis 1"): values[WRIST_REACH],
        N_("Flange reaches from axis 1"): values[FLANGE_REACH],
    }
    zero = state_of(robot, ()).at(ZERO_POSE)
    write_summary(
        folder,
        study,
        name,
        STAGE,
        verdict_of(checks, conflicts, findings, culprits),
        key_figures(checks, axes, findings, reach, trips),
        checks=[asdict(check) for check in checks],
        conflicts=[asdict(conflict) for conflict in conflicts],
        sets=findings,
        diagnosis=diagnosis,
        culprits=culprits,
        identification=identified,
        circle_points={
            "offset_mm": circles.offset_mm.tolist(),
            "radius_mm": circles.radius_mm.round(SHOWN_DECIMALS).tolist(),
            "roundness_mm": circles.roundness_mm.round(SHOWN_DECIMALS).tolist(),
        },
        table={"convention": robot.convention, "no_closed_form": closed_form(robot)},
        round_trips=trips,
        section_origin_mm=[float(zero[0, 0, 3] * MM), float(zero[1, 2, 3] * MM)],
    )


def _without_reference(values: dict[Quantity, float], checks: list[Check]) -> list[Check]:
    """Reach that no reference speaks about, as measured."""
    named = {check.name for check in checks}
    return [
        nothing_to_compare(
            reach_name(quantity), "reach", "mm", N_("no reference set gives it"), measured=values[quantity]
        )
        for quantity in ALWAYS_SEARCHED
        if reach_name(quantity) not in named
    ]
