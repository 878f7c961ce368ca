"""Which number of the table is wrong, per reference set."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from er3a.diagnosis.diagnose import Hypothesis, described, residuals, shown
from er3a.diagnosis.ranking import Ranking, rank, usable
from er3a.kinematics.table_batch import COLUMNS
from er3a.pipeline.messages.language import N_, said
from er3a.references.reference import ReferenceSet, vectors_of
from er3a.references.scalars import without_coordinate
from er3a.robots.robot import Robot

MOSTLY = 0.05


def diagnose_sets(robot: Robot, sets: list[ReferenceSet]) -> tuple[list[dict], list[dict], pd.DataFrame]:
    """Diagnose a table against each reference set.

    Returns
    -------
    diagnosis : ranked hypotheses as plain data, set by set
    culprits : per set what follows: ``status`` is ``met`` (nothing to explain), ``named`` (the best hypothesis meets
        all references), ``mostly`` (it leaves less than 5 % of the residual, but more than the references allow),
        ``unexplained`` (no one or two faults will do) or ``no_reference``
    table : residuals before and after the best hypothesis, worst first, for sets with something to explain
    """
    diagnosis, culprits, tables = [], [], []
    for references in sets:
        ranking = rank(robot, references)
        hypotheses = described(ranking, robot) if ranking else []
        diagnosis += [
            {"reference_set": references.name, "rank": place} | _plain(hypothesis)
            for place, hypothesis in enumerate(hypotheses, 1)
        ]
        culprits.append(_culprit(references, ranking, hypotheses))
        if ranking:
            tables.append(_residuals(references.name, ranking))
    empty = _residuals_frame([])
    return diagnosis, culprits, pd.concat(tables, ignore_index=True) if tables else empty


def _plain(hypothesis: Hypothesis) -> dict[str, Any]:
    return {
        "hypothesis": hypothesis.hypothesis,
        "faults": list(hypothesis.faults),
        "kinds": list(hypothesis.kinds),
        "residual_before": hypothesis.residual_before,
        "residual_after": hypothesis.residual_after,
        "unit": hypothesis.unit,
        "explains": hypothesis.explains,
        "indistinguishable_from": list(hypothesis.indistinguishable_from),
        "to_decide": hypothesis.to_decide,
        "score": hypothesis.score,
    }


def _culprit(references: ReferenceSet, ranking: Ranking | None, hypotheses: list[Hypothesis]) -> dict[str, Any]:
    count = len(usable(references))
    best = hypotheses[0] if hypotheses else None
    status = _status(count, ranking, best)
    tried = len(ranking.pool.faults) if ranking else 0
    return {
        "reference_set": references.name,
        "status": status,
        "references": count,
        "hypotheses_tried": tried,
        "text": _text(status, count, tried, best),
        "faults": list(best.faults) if status in ("named", "mostly") else [],
        "repaired": _table_of(best.repaired) if status in ("named", "mostly") else None,
    }


def _status(count: int, ranking: Ranking | None, best: Hypothesis | None) -> str:
    if not count:
        return "no_reference"
    if not ranking:
        return "met"
    if best and best.explains:
        return "named"
    return "mostly" if best and best.residual_after < MOSTLY * best.residual_before else "unexplained"


def _text(status: str, count: int, tried: int, best: Hypothesis | None) -> str:
    if status == "no_reference":
        return N_("There is nothing to rest a diagnosis on.")
    if status == "met":
        return said("Nothing to explain: all {count} references about poses, axes and limits are met.", count=count)
    if status == "named":
        return said("Most likely fault: {hypothesis}.", hypothesis=best.hypothesis)
    if status == "mostly":
        return said(
            "Most likely fault: {hypothesis}, which is still more than the references leave open.",
            hypothesis=best.hypothesis,
        )
    if not best:
        return N_("No fault stands out: what the references are missed by looks like scatter, not like a wrong number.")
    return said(
        "No one or two faults explain the data: the best of {tried} hypotheses still leaves {after} {unit} of {before} "
        "{unit}. This is another arm, or more than two numbers are wrong.",
        tried=tried,
        after=shown(best.residual_after),
        before=shown(best.residual_before),
        unit=best.unit,
    )


def _table_of(robot: Robot) -> dict[str, Any]:
    """The repaired table, for drawing."""
    return {"convention": robot.convention} | {name: getattr(robot, name).tolist() for name in COLUMNS}


def _residuals(set_name: str, ranking: Ranking) -> pd.DataFrame:
    group, _ = vectors_of(ranking.references)
    before, bound, units = residuals(ranking, ranking.before)
    best = ranking.pool.difference[ranking.groups[0][0]] if ranking.groups else ranking.before
    after, _, _ = residuals(ranking, best)
    order = np.argsort(-np.maximum(before, after) / bound, kind="stable")
    records = []
    for i in order:
        parts = [reference for reference, number in zip(ranking.references, group) if number == i]
        name = parts[0].name if len(parts) == 1 else without_coordinate(parts[0].name)
        records.append(
            {
                "reference_set": set_name,
                "source": parts[0].source,
                "group": parts[0].group,
                "name": name,
                "unit": units[i],
                "before": before[i],
                "after": after[i],
                "uncertainty": bound[i],
            }
        )
    return _residuals_frame(records)


def _residuals_frame(records: list[dict]) -> pd.DataFrame:
    types = {"reference_set": str, "source": str, "group": str, "name": str, "unit": str}
    types |= {"before": float, "after": float, "uncertainty": float}
    return pd.DataFrame(records, columns=list(types)).astype(types)
