"""Checks as rows of the page's tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from er3a.pipeline.messages.evidence import CHECK_KINDS
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import say, sentence, word
from er3a.pipeline.messages.validation import GRADE_NAMES, GROUPS
from er3a.pipeline.stages.validation.check_model import Check, ModelCheck, ReferenceCheck, Unjudged
from er3a.pipeline.viewing.numbers import fixed, number

DECIMALS = {"mm": 2, "deg": 2, "deg/s": 1, "": 0}
COLUMNS = (
    N_("Check"),
    N_("Model>"),
    N_("Reference>"),
    N_("Difference>"),
    N_("Tolerance>"),
    N_("Unit"),
    N_("Source"),
)

Judged = ModelCheck | ReferenceCheck


@dataclass(frozen=True)
class GroupRow:
    """One set and group: counts by status, and the check that comes nearest to failing or fails worst."""

    set: str
    group: str
    status: str
    counts: tuple[int, int, int]
    worst: str
    difference: str


def by_set(checks: Iterable[Judged]) -> dict[str, list[Judged]]:
    """Checks by the set that they come from, as the page names it."""
    found: dict[str, list[Judged]] = {}
    for check in checks:
        found.setdefault(check.reference_set or tr("the model itself"), []).append(check)
    return found


def by_kind(checks: Iterable[Judged]) -> dict[str, list[Judged]]:
    """Checks by their set and what they rest on, as the page names both."""
    found: dict[str, list[Judged]] = {}
    for title, own in by_set(checks).items():
        for check in own:
            kind = check.kind and word("check_kind", CHECK_KINDS, check.kind)
            found.setdefault(tr("{set}, {kind}", set=title, kind=kind) if kind else title, []).append(check)
    return found


def group_rows(checks: Iterable[Judged]) -> list[GroupRow]:
    """A row for each set and group."""
    rows = []
    for title, own in by_set(checks).items():
        for group in dict.fromkeys(check.group for check in own):
            part = [check for check in own if check.group == group]
            counted = Counter(check.status for check in part)
            status = "fail" if counted["fail"] else "conflict" if counted["conflict"] else "pass"
            worst = max(part, key=lambda check: check.tolerances_off)
            rows.append(
                GroupRow(
                    set=title,
                    group=word("group", GROUPS, group),
                    status=status,
                    counts=(counted["pass"], counted["fail"], counted["conflict"]),
                    worst=say(worst.subject),
                    difference=f"{_value(worst.difference, worst)} {worst.unit}".strip(),
                )
            )
    return rows


def check_row(check: Judged) -> list[str]:
    """A check in the columns of ``COLUMNS``."""
    values = [_value(value, check) for value in (check.measured, check.expected, check.difference)]
    if isinstance(check, ReferenceCheck):
        grade = word("grade", GRADE_NAMES, check.grade)
        source = sentence("graded", "{own_source} ({grade})", own_source=check.source, grade=grade)
    else:
        source = tr("the model itself")
    return [say(check.subject), *values, f"{check.tolerance:g}", check.unit, source]


def _value(value: float, check: Check) -> str:
    """A value in its unit's decimals; errors of round trips, which are far smaller, with one digit."""
    if check.group == "round_trips" and 0 < abs(value) < 1e-3:
        return number(value, 1)
    return fixed(value, DECIMALS[check.unit])


def blank_row(check: Unjudged) -> list[str]:
    """What is not judged: its name, the model's value, the set, and why."""
    measured = f"{_value(check.measured, check)} {check.unit}" if check.measured is not None else "–"
    return [say(check.subject), measured, check.reference_set or "–", say(check.note)]
