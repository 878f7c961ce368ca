"""What the command line says of known arms: the list, which of them a table describes, and who agrees with whom."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from er3a.comparison.agreement import Agreement, Pairs
from er3a.comparison.compare import Comparison
from er3a.files.arm_catalogue import KnownArm
from er3a.pipeline.messages.comparison import HEADLINES, LAYERS, STATES, layer_rows
from er3a.pipeline.messages.say import joined, say

COLUMNS = ("name", "maker", "model", "joints", "reach mm", "source")


def arm_record(name: str, arm: KnownArm) -> dict[str, Any]:
    """What is known of an arm, for JSON; its reach is that of the flange from the first axis, in mm."""
    keys = "maker", "model", "source", "licence", "second", "note"
    number = {"joints": arm.robot.joints, "reach_mm": round(1000 * arm.reach)}
    return {"name": name} | number | {key: getattr(arm, key) for key in keys}


def arm_row(name: str, arm: KnownArm) -> list[str]:
    """An arm as a row of a table with ``COLUMNS``."""
    found = arm_record(name, arm) | {"source": arm.source.partition(" at ")[0]}
    return [str(found[key]) for key in ("name", "maker", "model", "joints", "reach_mm", "source")]


def _named(arm: KnownArm) -> str:
    return f"{arm.maker} {arm.model} ({arm.robot.name})"


def identified_lines(
    arm: KnownArm, found: Comparison, alike: Sequence[KnownArm], as_near: Sequence[KnownArm]
) -> list[str]:
    """Which arm a table is of, which others have its geometry, or are as near, and where the arm's numbers are from."""
    same = found.geometry is not None and found.geometry.same
    lines = [f"this is {_named(arm)}" if same else f"nearest, one entry differs: {_named(arm)}"]
    for text, arms in {"of the same geometry": alike, "others that are as near": as_near}.items():
        lines += [f"{text}: {', '.join(map(_named, arms))}"] if arms else []
    return [*lines, *provenance_lines(arm), ""]


def provenance_lines(arm: KnownArm) -> list[str]:
    """Where an arm's numbers are from, what a second source says, and what is known to be wrong in them."""
    lines = [f"its numbers: {arm.source} ({arm.licence})"]
    lines += [f"a second source: {arm.second}"] if arm.second else []
    return [*lines, arm.note] if arm.note else lines


def not_near_lines(nearest: Sequence[tuple[KnownArm, Comparison]]) -> list[str]:
    """That no known arm is near, and which are nearest."""
    if not nearest:
        return ["nothing here is near: no known arm has joints of these kinds"]
    return ["nothing here is near; nearest:", *(f"  {_named(arm)}, {say(found.geometry)}" for arm, found in nearest)]


def matrix_rows(names: Sequence[str], pairs: Pairs) -> list[list[str]]:
    """For each of several arms, the layers in which it differs from each other one."""
    rows = []
    for one in names:
        found = (pairs.get((one, other)) or pairs.get((other, one)) for other in names)
        rows.append([one, *("" if each is None else _differing(each) for each in found)])
    return rows


def _differing(found: Comparison) -> str:
    if found.geometry is None or found.verdict == "equal":
        return HEADLINES[found.verdict].partition(":")[0]
    return ", ".join(name for name, state, _ in layer_rows(found) if state == STATES[False])


def agreement_lines(found: Iterable[Agreement]) -> list[str]:
    """A line for each layer: who agrees with whom, who is the odd one out, and who does not give it."""
    lines = []
    for each in found:
        if each.layer in ("units", "coupling") and len(each.groups) < 2:
            continue
        groups = " ≠ ".join(" = ".join(group) for group in each.groups)
        odd = f"odd one out: {', '.join(each.odd)}" if each.odd else ""
        silent = f"not given: {', '.join(each.silent)}" if each.silent else ""
        lines.append(f"  {LAYERS[each.layer]:<11} {joined([groups, odd, silent])}")
    return lines
