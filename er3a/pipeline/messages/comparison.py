"""What a comparison of two arms says: a headline, and a line for each layer."""

from __future__ import annotations

from collections.abc import Iterable

from er3a.comparison.compare import (
    Comparison,
    Difference,
    GeometryLayer,
    PlacementLayer,
    RangeDifference,
    RangeLayer,
    Uncompared,
)
from er3a.comparison.slips import Cause
from er3a.pipeline.language import tr, with_unit, words
from er3a.pipeline.messages.pages import GROUP_NAMES
from er3a.pipeline.messages.say import joined, say, word

LAYERS = words(
    {
        "units": "units",
        "geometry": "geometry",
        "zero": "zero",
        "directions": "directions",
        "base": "base",
        "flange": "flange",
        "coupling": "coupling",
        "limits": "limits",
        "speeds": "speeds",
    }
)
HEADLINES = words(
    {
        "equal": "equal: the same arm, usable as printed",
        "in_doubt": "equal numbers, in units that are in doubt",
        "same_arm": "same arm, defined otherwise",
        "other_arm": "another arm",
        "other_joint_count": "another number of joints",
    }
)
CAUSES = words(
    {
        "a_and_d_swapped": "a and d are swapped",
        "other_convention": "the table is of the other D-H convention: a and alpha stand a row off",
        "all_alphas_negated": "every alpha has the other sign",
        "one_alpha_negated": "it has the other sign",
        "one_length_negated": "it has the other sign",
        "offsets_negated": "every offset has the other sign",
        "unit": "the lengths are in another unit",
        "angle_unit": "the angles are in another unit",
        "scale": "all lengths are scaled",
        "rows_shifted": "values stand a row too high or too low",
        "rows_exchanged": "two rows are exchanged",
    }
)
BESIDE = words({"pair_rules": "rules for pairs of links", "limits_on_sums": "limits on sums of joints"})
STATES = words({True: "agrees", False: "differs", None: "not given"})


def headline(found: Comparison, doubts: Iterable[str] = ()) -> str:
    """The verdict in one sentence, units first.

    Parameters
    ----------
    found : the comparison; units that it found to differ stand before its verdict
    doubts : about units of what was read, which stand before all else: what follows rests on these units
    """
    causes = (*(found.units.causes if found.units else ()), *found.causes)
    text = joined([*doubts, *map(say, causes), word("comparison", HEADLINES, found.verdict)])
    if found.as_printed_mm is None or found.aligned_mm is None:
        a, b = found.joints
        return tr("{verdict}: {a} and {b}", verdict=text, a=a, b=b) if found.verdict == "other_joint_count" else text
    off = tr(
        "{verdict} (flange off by {printed:.1f} mm and {turned:.2f}° at the worst found; aligned by "
        "{aligned:.4g} mm and {aligned_deg:.3g}°)",
        verdict=text,
        printed=found.as_printed_mm,
        turned=found.as_printed_deg,
        aligned=round(found.aligned_mm, 3),
        aligned_deg=round(found.aligned_deg or 0.0, 3),
    )
    missing = joined([_uncompared(each) for each in found.not_examined], ", ") if found.verdict == "equal" else ""
    return tr("{verdict}; not compared: {layers}", verdict=off, layers=missing) if missing else off


def layer_rows(found: Comparison) -> list[tuple[str, str, str]]:
    """Of each layer its name, whether it agrees, and how it differs."""
    rows = []
    for name, shown in LAYERS.items():
        layer = getattr(found, name)
        if layer is None or (name in ("units", "coupling") and layer.same):
            continue
        rows.append((tr(shown), tr(STATES[layer.same]), _detail(name, found)))
    beside = [each for each in found.not_examined if each not in LAYERS]
    return [*rows, *((_uncompared(each), tr("not compared"), "") for each in beside)]


def _uncompared(name: Uncompared) -> str:
    return tr(LAYERS.get(name) or BESIDE.get(name) or GROUP_NAMES[name])


def doubt_rows(doubts: Iterable[str]) -> list[tuple[str, str, str]]:
    """The same of numbers whose unit is in doubt."""
    return [(tr("units"), tr("in doubt"), each) for each in doubts]


def _detail(name: str, found: Comparison) -> str:
    layer = getattr(found, name)
    if name == "geometry":
        return say(layer)
    if name == "zero" and not layer.same:
        moved = [(k, value) for k, value in enumerate(layer.offsets_deg, 1) if abs(value) > 1e-3]
        return ", ".join(f"J{k} {with_unit(f'{value:+.6g}', 'deg')}" for k, value in moved)
    if name == "directions" and not layer.same:
        return tr("{joints} turn the other way", joints=", ".join(f"J{k}" for k in layer.reversed))
    if name == "limits" and layer.same is False:
        return tr("{limits} (by the first's zeros and directions)", limits=say(layer))
    if name == "units":
        return joined([say(each) for each in layer.causes])
    if name == "coupling":
        return tr("rows {rows}", rows=", ".join(map(str, layer.rows)))
    return "" if layer.same is not False else say(layer)


@say.register
def _(found: GeometryLayer) -> str:
    if found.same:
        return tr(
            "{count} of {count} invariants, worst {mm:.2g} mm, {deg:.2g}°",
            count=found.invariants,
            mm=found.worst_mm,
            deg=found.worst_deg,
        )
    return joined([say(each) for each in found.differences], ", ")


@say.register
def _(found: Difference) -> str:
    if isinstance(found.a, str) or isinstance(found.b, str):
        return f"{found.entry} {found.a} → {found.b}"
    shown = with_unit(f"{found.entry} {found.a:.6g} → {found.b:.6g}", found.unit)
    if not found.alike:
        return shown
    return tr("{shown} (or {others}: a sum alone is known)", shown=shown, others=", ".join(found.alike))


@say.register
def _(found: Cause) -> str:
    text = word("comparison", CAUSES, found.code)
    amount = "" if found.amount is None else f" ({found.unit} {found.amount:.6g})".replace("( ", "(")
    shown = joined(
        [", ".join(found.entries), *([tr("or {entries}", entries=", ".join(found.alike))] if found.alike else [])], " "
    )
    where = f"{shown}: " if shown else ""
    sides = {"a": tr("in the first table"), "b": tr("in the second table"), None: tr("in one of the tables")}
    return f"{where}{text}{amount}, {sides[found.side]}"


@say.register
def _(found: PlacementLayer) -> str:
    x, y, z = (value + 0.0 if abs(value) > 5e-4 else 0.0 for value in found.shift_mm)
    parts = []
    if max(abs(x), abs(y), abs(z)) > 0:
        parts.append(tr("shifted by ({x:.6g}, {y:.6g}, {z:.6g}) mm", x=x, y=y, z=z))
    if found.turn.deg > 1e-3:
        axis = _axis(found.turn.axis)
        parts.append(tr("turned {deg:.6g}° about {axis}", deg=found.turn.deg, axis=axis))
    moved = joined(parts, ", ")
    if not found.entries:
        return moved
    return tr("{entries} ({moved})", entries=joined(map(say, found.entries), ", "), moved=moved)


def _axis(axis: tuple[float, float, float]) -> str:
    for name, value in zip("xyz", axis):
        if abs(value) > 1 - 1e-6:
            return name if value > 0 else f"-{name}"
    return "({:.4g}, {:.4g}, {:.4g})".format(*axis)


@say.register
def _(found: RangeLayer) -> str:
    return joined([say(each) for each in found.differences], ", ")


@say.register
def _(found: RangeDifference) -> str:
    a, b = (tr("none") if value is None else f"{value:.6g}" for value in (found.a, found.b))
    return with_unit(f"J{found.joint} {found.entry} {a} → {b}", found.unit)
