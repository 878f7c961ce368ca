"""From checks to what a reader wants to know."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from er3a.pipeline.messages.language import N_, joined, said
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.stages.validation.checks import Check, Conflict
from er3a.references.reference import ReferenceSet
from er3a.references.scalars import split_at_pose
from er3a.robots.robot import WEIGHTY_GRADES

TELLING_GROUPS = ("reach", "zero pose", "axes", "envelope", "key poses", "limits", "speeds")
TELLING_SHARE = 0.25
SHOWN_DECIMALS = 9
MODEL_GROUPS = (N_("table sanity"), N_("round trips"))
GRADE_WORDS = {"official": N_("official"), "cad": N_("CAD"), "export": N_("exported")}


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
        text = said(
            "The model fails without any document: {check} {value}.",
            check=first.name,
            value=_value(first.measured, first.unit),
        )
        return Verdict("fail", "validation.model_unsound", text, params | {"check": first.name})
    if failed:
        telling = most_telling(failed)
        other = any(finding["another_arm"] for finding in findings if finding["name"] == telling.reference_set)
        template = (
            N_(
                "This is not the arm that the {grades} data in {own_set} describe: {failed} of {checks} checks fail; "
                "the {quantity} is {measured}, not {expected}."
            )
            if other
            else N_(
                "The model contradicts the {grades} data in {own_set}: {failed} of {checks} checks fail; the "
                "{quantity} is {measured}, not {expected}."
            )
        )
        text = said(
            template,
            grades=_grades(documented),
            own_set=telling.reference_set,
            failed=params["failed"],
            checks=params["checks"],
            quantity=_quoted(telling.name),
            measured=_value(telling.measured, telling.unit),
            expected=_value(telling.expected, telling.unit),
        )
        culprit = named.get(telling.reference_set, "")
        text = joined([text, culprit, claims], " ")
        code = "validation.another_arm" if other else "validation.contradicted"
        return Verdict("fail", code, text, params | {"check": telling.name, "culprit": culprit})
    if not documented:
        text = N_("There is no official, CAD or exported data to hold this model against.")
        return Verdict("no_reference", "validation.no_reference", joined([text, claims], " "), params)
    passed = sum(check.status == "pass" for check in documented)
    template = (
        N_("The model meets all {passed} checks against {grades} data that can be met.")
        if conflicts
        else N_("The model meets all {passed} checks against {grades} data.")
    )
    text = said(template, passed=passed, grades=_grades(documented))
    text = joined([text, _conflicts_sentence(conflicts), claims], " ")
    return Verdict("pass", "validation.confirmed", text, params | {"passed": passed})


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
    figures = [Figure(N_("Checks that count: passed"), counted["pass"], said("of {total}", total=judged))]
    misses = [(f["weighty"]["total"] > 0, f["zero_pose_flange_off_mm"]) for f in findings]
    misses = [miss for miss in misses if miss[1] is not None]
    if misses:
        figures.append(Figure(N_("Zero pose: flange off by"), max(misses)[1], "mm"))
    weighty_axes = axes[axes["grade"].isin(WEIGHTY_GRADES)]
    if len(weighty_axes):
        figures.append(Figure(N_("Joint axes: farthest off"), float(weighty_axes["distance_mm"].max()), "mm"))
        figures.append(Figure(N_("Joint axes: most tilted"), float(weighty_axes["angle_deg"].max()), "deg"))
    labels = [abs(check.difference) for check in checks if check.group == "envelope" and check.difference is not None]
    if labels:
        figures.append(Figure(N_("Workspace drawing: worst label off by"), max(labels), "mm"))
    figures += [Figure(name, value, "mm") for name, value in reach.items()]
    figures = [replace(figure, value=round(figure.value, SHOWN_DECIMALS)) for figure in figures]
    if trips:
        figures.append(Figure(N_("Round trips: worst joint error"), trips["joint_error_deg"], "deg"))
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
        sentence = said(
            "Of the {claims} claims in {own_set}, {failed} don't hold.",
            claims=claims["total"],
            own_set=finding["name"],
            failed=claims["fail"],
        )
        sentences += [sentence, named.get(finding["name"], "")]
    return joined(sentences, " ")


def _conflicts_sentence(conflicts: list[Conflict]) -> str:
    if not conflicts:
        return ""
    first = conflicts[0]
    stated = _chained(N_("{value} or {values}"), [_value(row["expected"], first.unit) for row in first.statements])
    if len(conflicts) == 1:
        return said(
            "The references contradict each other about the {quantity} ({stated}), which is not charged to the model.",
            quantity=first.name,
            stated=stated,
        )
    return said(
        "The references contradict each other about the {quantity} ({stated}) and {more} more, which is not charged to "
        "the model.",
        quantity=first.name,
        stated=stated,
        more=len(conflicts) - 1,
    )


def _quoted(name: str) -> str:
    """A check's name in a sentence: the pose behind what is seen there."""
    pose, seen = split_at_pose(name)
    return said("{seen} ({own_pose})", seen=seen, own_pose=pose) if pose else seen


def _grades(checks: list[Check]) -> str:
    present = [word for grade, word in GRADE_WORDS.items() if any(check.grade == grade for check in checks)]
    return _chained(N_("{value} and {values}"), present)


def _chained(pair: str, words: Sequence[str]) -> str:
    """Words as one text, by a template for a ``{value}`` and the ``{values}`` after it."""
    if len(words) == 1:
        return words[0]
    return said(pair, value=words[0], values=_chained(pair, words[1:]))


def _value(value: float, unit: str) -> str:
    return f"{value:.1f} {unit}".strip() if unit else f"{value:g}"
