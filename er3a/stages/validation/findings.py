"""From checks to what a reader wants to know."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pandas as pd

from er3a.references.reference import ReferenceSet
from er3a.results import Figure, Verdict
from er3a.robots.robot import WEIGHTY_GRADES
from er3a.stages.validation.checks import Check, Conflict

TELLING_GROUPS = ("reach", "zero pose", "axes", "envelope", "key poses", "limits", "speeds")
TELLING_SHARE = 0.25
SHOWN_DECIMALS = 9
MODEL_GROUPS = ("table sanity", "round trips")


def weighs(check: Check) -> bool:
    """Whether the verdict rests on a check: a trustworthy document, or the model itself."""
    return check.grade in WEIGHTY_GRADES or check.group in MODEL_GROUPS


def set_findings(
    sets: list[ReferenceSet], checks: list[Check], poses: pd.DataFrame, culprits: list[dict]
) -> list[dict]:
    """Per reference set: its counts, whether it describes another arm (most of the checks that count fail, and
    no one or two faults explain that), and how far the flange is off in the zero pose."""
    explained = {culprit["reference_set"]: culprit["status"] for culprit in culprits}
    findings = []
    for references in sets:
        own = [check for check in checks if check.reference_set == references.name]
        weighty = _counts(check for check in own if weighs(check))
        findings.append(
            {
                "name": references.name,
                "grades": sorted({reference.grade for reference in references.references}),
                "weighty": weighty,
                "another_arm": weighty["fail"] > weighty["total"] / 2 and explained[references.name] == "unexplained",
                "claims": _counts(check for check in own if not weighs(check) and check.grade),
                "zero_pose_flange_off_mm": _zero_pose_miss(poses, references.name),
            }
        )
    return findings


def verdict_of(checks: list[Check], conflicts: list[Conflict], findings: list[dict], culprits: list[dict]) -> Verdict:
    """The stage's answer."""
    resting = [check for check in checks if weighs(check) and check.status != "no_reference"]
    failed = [check for check in resting if check.status == "fail"]
    documented = [check for check in resting if check.group not in MODEL_GROUPS]
    params = {
        "checks": len(documented),
        "failed": sum(check.group not in MODEL_GROUPS for check in failed),
        "conflicts": len(conflicts),
        "sets": [finding["name"] for finding in findings],
    }
    named = {culprit["reference_set"]: culprit["text"] for culprit in culprits if culprit["faults"]}
    claims = _claims_sentence(findings, named)
    own_faults = [check for check in failed if check.group in MODEL_GROUPS]
    if own_faults:
        first = own_faults[0]
        text = f"The model fails without any document: {first.name} {_value(first.measured, first.unit)}."
        return Verdict("fail", "validation.model_unsound", text, params | {"check": first.name})
    if failed:
        telling = most_telling(failed)
        described = f"the {_grades(documented)} data in {telling.reference_set}"
        other = any(finding["another_arm"] for finding in findings if finding["name"] == telling.reference_set)
        lead = f"This is not the arm that {described} describe" if other else f"The model contradicts {described}"
        text = (
            f"{lead}: {params['failed']} of {params['checks']} checks fail; the {_quoted(telling.name)} is "
            f"{_value(telling.measured, telling.unit)}, not {_value(telling.expected, telling.unit)}."
        )
        culprit = named.get(telling.reference_set, "")
        text += f" {culprit}{claims}" if culprit else claims
        code = "validation.another_arm" if other else "validation.contradicted"
        return Verdict("fail", code, text, params | {"check": telling.name, "culprit": culprit})
    if not documented:
        text = f"There is no official, CAD or exported data to hold this model against.{claims}"
        return Verdict("no_reference", "validation.no_reference", text, params)
    passed = sum(check.status == "pass" for check in documented)
    can = " that can be met" if conflicts else ""
    text = f"The model meets all {passed} checks against {_grades(documented)} data{can}."
    if conflicts:
        first = conflicts[0]
        stated = " or ".join(_value(row["expected"], first.unit) for row in first.statements)
        text += f" The references contradict each other about the {first.name} ({stated})"
        text += f" and {len(conflicts) - 1} more" if len(conflicts) > 1 else ""
        text += ", which is not charged to the model."
    return Verdict("pass", "validation.confirmed", text + claims, params | {"passed": passed})


def most_telling(failed: list[Check]) -> Check:
    """The failed check to quote: of those not far behind the largest difference in mm, the first of the group that
    tells most."""
    lengths = [check for check in failed if check.unit == "mm"]
    least = TELLING_SHARE * max((abs(check.difference) for check in lengths), default=0.0)
    large = [check for check in lengths if abs(check.difference) >= least]
    return min(large or failed, key=lambda check: TELLING_GROUPS.index(check.group))


def key_figures(
    checks: list[Check], axes: pd.DataFrame, findings: list[dict], reach: dict[str, float], trips: dict | None
) -> list[Figure]:
    """The stage's key figures."""
    counted = Counter(check.status for check in checks if weighs(check))
    judged = counted["pass"] + counted["fail"]
    figures = [Figure("Checks that count: passed", counted["pass"], f"of {judged}")]
    misses = [(f["weighty"]["total"] > 0, f["zero_pose_flange_off_mm"]) for f in findings]
    misses = [miss for miss in misses if miss[1] is not None]
    if misses:
        figures.append(Figure("Zero pose: flange off by", max(misses)[1], "mm"))
    weighty_axes = axes[axes["grade"].isin(WEIGHTY_GRADES)]
    if len(weighty_axes):
        figures.append(Figure("Joint axes: farthest off", float(weighty_axes["distance_mm"].max()), "mm"))
        figures.append(Figure("Joint axes: most tilted", float(weighty_axes["angle_deg"].max()), "deg"))
    labels = [abs(check.difference) for check in checks if check.group == "envelope" and check.difference is not None]
    if labels:
        figures.append(Figure("Workspace drawing: worst label off by", max(labels), "mm"))
    figures += [Figure(name, value, "mm") for name, value in reach.items()]
    figures = [replace(figure, value=round(figure.value, SHOWN_DECIMALS)) for figure in figures]
    if trips:
        figures.append(Figure("Round trips: worst joint error", trips["joint_error_deg"], "deg"))
    return figures


def _counts(checks) -> dict[str, int]:
    counted = Counter(check.status for check in checks)
    total = sum(counted.values()) - counted["no_reference"]
    return {"total": total} | {status: counted[status] for status in ("pass", "fail", "conflict", "no_reference")}


def _zero_pose_miss(poses: pd.DataFrame, set_name: str) -> float | None:
    rows = poses[(poses["reference_set"] == set_name) & (poses["group"] == "zero pose") & (poses["point"] == "flange")]
    return float(rows["deviation_mm"].max()) if len(rows) else None


def _claims_sentence(findings: list[dict], named: dict[str, str]) -> str:
    sentences = []
    for finding in findings:
        claims = finding["claims"]
        if finding["weighty"]["total"] or not claims["total"]:
            continue
        sentence = f" Of the {claims['total']} claims in {finding['name']}, {claims['fail']} don't hold"
        sentences.append(f"{sentence}. {named[finding['name']]}" if finding["name"] in named else f"{sentence}.")
    return "".join(sentences)


def _quoted(name: str) -> str:
    """A check's name in a sentence: the pose behind what is seen there."""
    pose, _, seen = name.rpartition(": ")
    return f"{seen} ({pose})" if pose else name


def _grades(checks: list[Check]) -> str:
    words = {"official": "official", "cad": "CAD", "export": "exported"}
    present = [word for grade, word in words.items() if any(check.grade == grade for check in checks)]
    return " and ".join(present)


def _value(value: float, unit: str) -> str:
    return f"{value:.1f} {unit}".strip() if unit else f"{value:g}"
