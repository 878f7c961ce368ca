"""Which number of the table is wrong, per reference set."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from er3a.diagnosis.diagnose import Diagnosis, Hypothesis, diagnosis_of, residuals
from er3a.diagnosis.ranking import Ranking, usable
from er3a.identifiability.statements import made_from_table, title_of
from er3a.pipeline.stages.validation.diagnosis_model import (
    CorrectedTable,
    RankedHypothesis,
    Residuals,
    SetDiagnosis,
)
from er3a.references.reference import ReferenceSet, vectors_of
from er3a.robots.robot import Robot


def diagnose_sets(robot: Robot, sets: list[ReferenceSet]) -> tuple[tuple[SetDiagnosis, ...], Residuals]:
    """Diagnose a table against each reference set."""
    found = [(references.name, diagnosis_of(robot, references)) for references in sets]
    tables = [_residuals(name, diagnosis.ranking) for name, diagnosis in found if diagnosis.ranking]
    records = [_record(robot, references, diagnosis) for references, (_, diagnosis) in zip(sets, found)]
    return tuple(records), Residuals.stacked(tables)


def _record(robot: Robot, references: ReferenceSet, diagnosis: Diagnosis) -> SetDiagnosis:
    documents = dict.fromkeys(reference.document for reference in usable(references))
    own = [name for name in documents if made_from_table(robot, name, references.documents)]
    return SetDiagnosis(
        reference_set=references.name,
        conclusion=diagnosis.conclusion,
        against=tuple(title_of(name, references.documents) for name in documents),
        from_table=tuple(title_of(name, references.documents) for name in own),
        references=diagnosis.references,
        hypotheses_tried=diagnosis.tried,
        hypotheses=tuple(map(_ranked, diagnosis.hypotheses)),
        corrected=table_record(diagnosis.hypotheses[0].corrected) if diagnosis.names_fault else None,
    )


def _ranked(hypothesis: Hypothesis) -> RankedHypothesis:
    return RankedHypothesis(
        faults=hypothesis.faults,
        residual_before=hypothesis.residual_before,
        residual_after=hypothesis.residual_after,
        unit=hypothesis.unit,
        explains=hypothesis.explains,
        half_widths=hypothesis.half_widths,
        indistinguishable_from=hypothesis.indistinguishable_from,
        to_decide=hypothesis.to_decide,
        score=hypothesis.score,
    )


def table_record(robot: Robot) -> CorrectedTable:
    """A robot's table as the results hold it."""
    columns = [field.name for field in fields(CorrectedTable) if field.name != "convention"]
    return CorrectedTable(robot.convention, **{name: tuple(getattr(robot, name).tolist()) for name in columns})


def _residuals(reference_set: str, ranking: Ranking) -> Residuals:
    before, bound, units = residuals(ranking, ranking.before)
    best = ranking.pool.difference[ranking.groups[0][0]] if ranking.groups else ranking.before
    after, _, _ = residuals(ranking, best)
    vectors = [[ranking.references[place] for place in places] for places in vectors_of(ranking.references)]
    return Residuals.of_rows(
        (
            reference_set,
            vectors[i][0].source,
            vectors[i][0].group,
            vectors[i][0].subject if len(vectors[i]) == 1 else vectors[i][0].subject.whole,
            units[i],
            before[i],
            after[i],
            bound[i],
        )
        for i in np.argsort(-np.maximum(before, after) / bound, kind="stable")
    )
