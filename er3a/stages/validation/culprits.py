"""Which number of the table is wrong, per reference set."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from er3a.diagnosis.diagnose import Hypothesis, described, residuals, shown
from er3a.diagnosis.ranking import Ranking, rank, usable
from er3a.kinematics.table_batch import COLUMNS
from er3a.references.reference import ReferenceSet, vectors_of
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
        return "There is nothing to rest a diagnosis on."
    if status == "met":
        return f"Nothing to explain: all {count} references about poses, axes and limits are met."
    if status == "named":
        return f"Most likely fault: {best.hypothesis}."
    if status == "mostly":
        return f"Most likely fault: {best.hypothesis}, which is still more than the references leave open."
    if not best:
        return "No fault stands out: what the references are missed by looks like scatter, not like a wrong number."
    return (
        f"No one or two faults explain the data: the best of {tried} hypotheses still leaves "
        f"{shown(best.residual_after)} {best.unit} of {shown(best.residual_before)} {best.unit}. "
        "This is another arm, or more than two numbers are wrong."
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
        name = parts[0].name if len(parts) == 1 else parts[0].name.rsplit(" ", 1)[0]
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
