"""What a confirmation says: an answer in one line, what is between model and controller, and what to write where."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from er3a.confirmation.confirm import Confirmation, FoundEntry, Placed
from er3a.confirmation.plan import Plan
from er3a.finding import Finding, plain
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import as_text
from er3a.pipeline.messages.numbers import number
from er3a.pipeline.messages.say import joined, say, say_as, says, sentence, texts
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

SHOWN_ENTRIES, SHOWN_LINES = 4, 8
FORMS = {
    "abc": "A, B, C: Rz(A) Ry(B) Rx(C)",
    "rpy": "roll, pitch, yaw: Rz(3) Ry(2) Rx(1)",
    "zyz": "Rz(1) Ry(2) Rz(3)",
    "xyz": "Rx(1) Ry(2) Rz(3)",
    "rotation_vector": "rotation vector",
    "matrix": "matrix",
    "transposed": "transposed matrix",
    "quaternion": "quaternion",
    "xyzw": "quaternion, real part last",
    "wxyz": "quaternion, real part first",
}
UNITS_BY_FACTOR = {25.4: "in", 1e3: "m", 1e-3: "mm", 10.0: "cm", 304.8: "ft"}

TEXTS = texts(
    {
        "confirmed#agrees": "AGREES: the model is the controller's; at most {off} off",
        "confirmed#reading": "READING: the model agrees once the file is read otherwise; at most {off} off",
        "confirmed#frames": "FRAMES: the arm agrees; controller and model have another base or tool; at most {off} off",
        "confirmed#joints": "JOINTS: the arm agrees once joints are counted as the controller does; at most {off} off",
        "confirmed#small": "SMALL: the arm is of this type, but not nominal; small corrections leave at most {off}",
        "confirmed#another": "ANOTHER ARM: entries of the table differ; with these, at most {off} off",
        "confirmed#open": "OPEN: nothing explains the difference; at least {off} are left",
        "confirm.off": "{mm} mm and {deg} deg",
        "confirm.off_mm": "{mm} mm",
        "confirm.read": "{poses} poses; orientations read as {form}; rounding explains {off}",
        "confirm.read_positions": "{poses} poses without orientations; rounding explains {off}",
        "confirm.before": "as it is, the model is up to {off} off",
        "confirm.noted#joints_taken_in": "joint values without a unit were taken in {value}",
        "confirm.noted#positions_taken_in": "positions without a unit were taken in {value}",
        "confirm.noted#blank_rows": "rows without joints or pose, or of another point, left out: {value}",
        "confirm.noted#rows_at_rest": "rows at rest, one for each stop: {value}",
        "confirm.noted#rows_once": "rows, each pose once: {value}",
        "confirm.form": "orientations are {form}, not what the columns' names say; rename them, or --angles {key}",
        "confirm.unit": "positions are in {unit}; --units {unit}",
        "confirm.factor": "positions are {factor:.4g} times as large as the model's; check their unit",
        "joints_in": "joint values are in {unit}; name the columns q1_{unit} ...",
        "confirm.rows": "lines that do not fit: {lines}; up to {mm:.3g} mm off. Check what was typed there",
        "confirm.tool": "tool of the controller: {place}; or select the flange and read again",
        "confirm.base": "base of the controller: {place}; or select base 0 and read again",
        "confirm.place": "{{xyz_mm: {xyz}, rpy_deg: {rpy}}} (+-{mm:.2g} mm, {deg:.2g} deg)",
        "confirm.point": "{{xyz_mm: {xyz}}} (+-{mm:.2g} mm)",
        "confirm.zero": (
            "zero of J{joint} is {change:+.3f} deg off (+-{half_width:.2g}); offset_deg of row {joint}: {given:.3f} -> "
            "{value:.3f}. Zero is defined otherwise, or the joint was mastered wrong: compare its marks"
        ),
        "turns_other_way": "J{joint} turns the other way at the controller; direction of row {joint} changes its sign",
        "counted_from": "J{joint} of the pendant is counted with J{by}; coupling: rows: {rows}",
        "columns_swapped": "the columns of J{first} and J{second} are swapped",
        "zero_elsewhere": "zero of J{joint} is {deg:.0f} deg elsewhere; add this to offset_deg of row {joint}",
        "confirm.entry": "{name}: {given:.3f} -> {value:.3f} {unit} (+-{half_width:.2g})",
        "confirm.family": "another arm, maybe of the same family: compare names and drawings; --output corrected.yaml",
        "confirm.nearest": "the corrected table is that of {name}",
        "confirm.small": (
            "{count} small corrections, as of a factory; the largest: {largest:, }; --output mine.yaml; "
            "UR: er3a import-calibration; intervals: er3a calibrate"
        ),
        "confirm.held_out": "at poses left out of the fit: {mm:.2g} mm root mean square",
        "confirm.open": "nearest: {nearest:; }",
        "confirm.nothing": "the model as it is",
        "confirm.worst": "lines that are farthest off: {lines}",
        "confirm.noise": "{times:.0f} times what rounding explains is left: did the arm still move?",
        "explains_too": "alike: {what:, }",
        "confirm.zero_alike": "zero of J{joint}",
        "confirm.place_alike#base": "another base",
        "confirm.place_alike#tool": "another tool",
        "confirm.not_settled": "not settled by these poses: {entries}; er3a confirm ROBOT --plan gives poses that do",
        "confirm.taken_up": "not separated from base and tool: {entries}",
        "confirm.all_settled": "not settled by these poses: nothing",
        "confirm.no_orientations": "not examined: orientations, and what turns the tool alone",
        "confirm.plan": (
            "{poses} poses: move there slowly, with the flange as tool and the robot's own base. Write down what the "
            "pendant shows. Below each pose is what the model says, X Y Z in mm, A B C in deg (Rz Ry Rx)"
        ),
        "confirm.shown": "the pendant shows: {blanks}",
        "confirm.plan_safe#shapes": "within limits, clear of arm and base, away from singular poses; cell unknown",
        "confirm.plan_safe#none": "within limits, above the base, away from singular poses; shapes and cell unknown",
        "confirm.accuracy": (
            "A controller repeats its own model, so agreement says nothing about the arm's accuracy; that takes a "
            "tracker and er3a calibrate."
        ),
    }
)


def lines_of(found: Confirmation, robot: Robot, *, nearest: str = "", every: bool = False) -> list[str]:
    """A confirmation as lines of text for a terminal.

    Parameters
    ----------
    robot : as it is; nearest : the name of the arm that the corrected table is, if one is
    every : whether each pose is listed
    """
    fits = found.fits
    off = _off(found, float(found.left_mm[fits].max()), float(found.left_deg[fits].max()))
    lines = [_read_line(found), sentence(f"confirmed#{found.verdict}", off=off)]
    lines += [f"  {line}" for line in _found_lines(found, nearest)]
    if found.verdict != "agrees":
        before = _off(found, float(found.before_mm.max()), float(found.before_deg.max()))
        lines.append("  " + sentence("confirm.before", off=before))
    if found.noise > 1:
        lines.append("  " + sentence("confirm.noise", times=found.noise))
    lines += [f"  {say(each)}" for each in found.alike]
    lines += [f"  {line}" for line in _open_lines(found)]
    if every:
        lines += _table(found)
    lines += [sentence(f"confirm.noted#{note}", value=value) for note, value in found.notes]
    return [*lines, sentence("confirm.accuracy")]


def _off(found: Confirmation, mm: float, deg: float) -> str:
    parts = {"mm": number(mm, 3), "deg": number(deg, 3)}
    return sentence("confirm.off" if found.oriented else "confirm.off_mm", **parts)


def _read_line(found: Confirmation) -> str:
    off = _off(found, found.digits_mm, found.digits_deg)
    if not found.oriented:
        return sentence("confirm.read_positions", poses=len(found.lines), off=off)
    return sentence("confirm.read", poses=len(found.lines), form=FORMS[found.form], off=off)


def _found_lines(found: Confirmation, nearest: str) -> Iterator[str]:
    """What is between model and controller, and what to write where."""
    if found.verdict == "open":
        far = np.argsort(-found.left_mm, kind="stable")[:SHOWN_LINES]
        yield sentence("confirm.open", nearest=tuple(_parts(found)) or (sentence("confirm.nothing"),))
        yield sentence("confirm.worst", lines=_listed(found.lines[far]))
        return
    if found.renamed:
        yield sentence("confirm.form", form=FORMS[found.form], key=found.form)
    if found.factor != 1:
        unit = UNITS_BY_FACTOR.get(found.factor)
        yield sentence("confirm.unit", unit=unit) if unit else sentence("confirm.factor", factor=1 / found.factor)
    if not found.fits.all():
        out = ~found.fits
        yield sentence("confirm.rows", lines=_listed(found.lines[out]), mm=float(found.left_mm[out].max()))
    yield from _parts(found)
    if any(each.entry.column != "offset" for each in found.entries):
        yield sentence("confirm.nearest", name=nearest) if nearest else sentence("confirm.family")
    if found.small:
        largest = tuple(_change(each) for each in found.small[:SHOWN_ENTRIES])
        yield sentence("confirm.small", count=len(found.small), largest=largest)
    if found.held_out_mm is not None:
        yield sentence("confirm.held_out", mm=found.held_out_mm)


def _parts(found: Confirmation) -> Iterator[str]:
    """Tool, base, joints and entries that are other."""
    for name, place in (("tool", found.tool), ("base", found.base)):
        if place is not None:
            yield sentence(f"confirm.{name}", place=_place(place, turned=found.oriented or name == "base"))
    yield from (say(each) for each in found.joints)
    for each in found.entries:
        values = {"given": each.given, "value": each.found, "half_width": each.half_width}
        if each.entry.column == "offset":
            yield sentence("confirm.zero", joint=each.entry.joint, change=each.found - each.given, **values)
        else:
            yield sentence("confirm.entry", name=each.entry.name, unit=each.entry.unit, **values)


def _place(place: Placed, *, turned: bool) -> str:
    xyz = _for_a_file(place.xyz_mm, 2)
    if not turned:
        return sentence("confirm.point", xyz=xyz, mm=place.half_width_mm)
    rpy = _for_a_file(place.rpy_deg, 3)
    return sentence("confirm.place", xyz=xyz, rpy=rpy, mm=place.half_width_mm, deg=place.half_width_deg)


def _for_a_file(values: Reals, decimals: int) -> str:
    """Numbers as a study or robot file takes them."""
    return "[" + ", ".join(f"{round(float(value), decimals) + 0.0:.{decimals}f}" for value in values) + "]"


def _change(each: FoundEntry) -> str:
    return f"{each.entry.name} {as_text(each.found - each.given, '+.3f')} {each.entry.unit}"


def _listed(lines: Integers) -> str:
    shown = ", ".join(str(line) for line in sorted(lines.tolist())[:SHOWN_LINES])
    return shown + (" ..." if len(lines) > SHOWN_LINES else "")


@says("counted_from")
def _(found: Finding) -> str:
    factors = f"joints: [{found.by}, {found.joint}], factors: [{found.factor:.0f}, 1]"
    return say_as(found, rows=f"[{{row: {found.joint}, {factors}}}]")


@says("explains_too")
def _(found: Finding) -> str:
    what = [say(each) for each in found.joints]
    what += [sentence(f"confirm.place_alike#{place}") for place in found.places]
    what += [*(sentence("confirm.zero_alike", joint=joint) for joint in found.zeros), *found.entries]
    return sentence("explains_too", what=tuple(what or [sentence("confirm.nothing")]))


def _open_lines(found: Confirmation) -> Iterator[str]:
    if found.verdict != "open":
        names = joined(found.not_settled, ", ")
        yield sentence("confirm.not_settled", entries=names) if names else sentence("confirm.all_settled")
    if found.taken_up:
        yield sentence("confirm.taken_up", entries=joined(found.taken_up, ", "))
    if not found.oriented:
        yield sentence("confirm.no_orientations")


def _table(found: Confirmation) -> list[str]:
    """What is left, pose by pose."""
    rows = [f"{'line':>6} {'mm before':>12} {'mm':>10} {'deg':>10}"]
    for line, before, mm, deg, fits in zip(found.lines, found.before_mm, found.left_mm, found.left_deg, found.fits):
        rows.append(f"{line:>6} {before:>12.3f} {mm:>10.4f} {deg:>10.4f}" + ("" if fits else "  does not fit"))
    return rows


def confirmation_record(found: Confirmation, robot: str, nearest: str = "") -> dict[str, object]:
    """A confirmation as plain data, for another program; lengths in mm, angles in deg.

    Parameters
    ----------
    robot : as the command was given it
    """

    def placed(place: Placed | None) -> dict[str, object] | None:
        if place is None:
            return None
        widths = {"half_width_mm": place.half_width_mm, "half_width_deg": _finite(place.half_width_deg)}
        return {"xyz_mm": place.xyz_mm.tolist(), "rpy_deg": place.rpy_deg.tolist(), **widths}

    def entry(each: FoundEntry) -> dict[str, object]:
        values = {"given": each.given, "found": each.found, "half_width": each.half_width}
        return {
            "name": each.entry.name,
            "unit": each.entry.unit,
            **{key: float(value) for key, value in values.items()},
        }

    rows = zip(found.lines, found.before_mm, found.left_mm, found.before_deg, found.left_deg, found.fits)
    keys = ("line", "before_mm", "left_mm", "before_deg", "left_deg", "fits")
    return {
        "robot": robot,
        "verdict": found.verdict,
        "layers": list(found.layers),
        "form": found.form or None,
        "renamed": found.renamed,
        "factor": found.factor,
        "joints": plain(list(found.joints)),
        "base": placed(found.base),
        "tool": placed(found.tool),
        "entries": [entry(each) for each in found.entries],
        "small": [entry(each) for each in found.small],
        "nearest": nearest or None,
        "digits_mm": found.digits_mm,
        "digits_deg": found.digits_deg,
        "noise": found.noise,
        "held_out_mm": found.held_out_mm,
        "alike": plain(list(found.alike)),
        "not_settled": list(found.not_settled),
        "taken_up": list(found.taken_up),
        "notes": [list(note) for note in found.notes],
        "rows": [{key: np.asarray(value).item() for key, value in zip(keys, row)} for row in rows],
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def plan_lines(found: Plan, robot: Robot) -> list[str]:
    """A plan as a sheet to print and fill in: joint values, and what the pendant should show."""
    names = [f"J{k + 1}" for k in range(robot.joints)]
    pose = ("X", "Y", "Z", "A", "B", "C")
    lines = [sentence("confirm.plan", poses=len(found.q)), "  ".join(f"{name:>8}" for name in (*names, *pose))]
    for q, T in zip(shown(robot, found.q), found.T):
        values = [*(f"{value:8.0f}" for value in q), *(f"{value:8.2f}" for value in (*(1000 * T[:3, 3]), *_abc(T)))]
        lines += ["  ".join(values), sentence("confirm.shown", blanks="  ".join(["________"] * len(pose)))]
    return [*lines, sentence("confirm.plan_safe#shapes" if found.shapes else "confirm.plan_safe#none")]


def table_to_fill(found: Plan, robot: Robot) -> str:
    """A plan as a table (CSV), whose poses are left blank to be filled in."""
    names = [f"q{k + 1}_{'mm' if slides else 'deg'}" for k, slides in enumerate(robot.slides)]
    rows = [",".join(f"{value:.0f}" for value in q) + ",,,,,," for q in shown(robot, found.q)]
    return "\n".join([",".join([*names, "X", "Y", "Z", "A", "B", "C"]), *rows, ""])


def _abc(T: Reals) -> Reals:
    return np.degrees(rpy_of(T))[::-1]
