"""What a confirmation says: an answer in one line, what is between model and controller, and what to write where."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from er3a.confirmation.confirm import Confirmation, FoundEntry, Placed
from er3a.confirmation.plan import Plan
from er3a.finding import Finding, plain
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import as_text, with_unit
from er3a.pipeline.messages.numbers import number
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

RECORDED = (
    *("verdict", "layers", "renamed", "factor", "joints", "digits_mm", "digits_deg", "noise", "held_out_mm", "alike"),
    *("not_settled", "taken_up", "notes"),
)
OF_A_ROW = "before_mm", "left_mm", "before_deg", "left_deg", "fits"
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

HEADLINES = {
    "agrees": "AGREES: the model is the controller's; at most {off} off",
    "reading": "READING: the model agrees once the file is read otherwise; at most {off} off",
    "frames": "FRAMES: the arm agrees; controller and model have another base or tool; at most {off} off",
    "joints": "JOINTS: the arm agrees once joints are counted as the controller does; at most {off} off",
    "small": "SMALL: the arm is of this type, but not nominal; small corrections leave at most {off}",
    "another": "ANOTHER ARM: entries of the table differ; with these, at most {off} off",
    "open": "OPEN: nothing explains the difference; at least {off} are left",
}
NOTES = {
    "joints_taken_in": "joint values without a unit were taken in",
    "positions_taken_in": "positions without a unit were taken in",
    "blank_rows": "rows without joints or pose, or of another point, left out:",
    "rows_at_rest": "rows at rest, one for each stop:",
    "rows_once": "rows, each pose once:",
}
JOINTS = {
    "joints_in": "joint values are in {unit}; name the columns q1_{unit} ...",
    "turns_other_way": "J{joint} turns the other way at the controller; direction of row {joint} changes its sign",
    "counted_from": "J{joint} of the pendant is counted with J{by}; coupling: rows: {rows}",
    "columns_swapped": "the columns of J{first} and J{second} are swapped",
    "zero_elsewhere": "zero of J{joint} is {deg}° elsewhere; add this to offset_deg of row {joint}",
}
NOTHING = "the model as it is"
ACCURACY = (
    "A controller repeats its own model, so agreement says nothing about the arm's accuracy; that takes a tracker and "
    "er3a calibrate."
)


def lines_of(found: Confirmation, *, nearest: str = "", every: bool = False) -> list[str]:
    """A confirmation as lines of text for a terminal.

    Parameters
    ----------
    nearest : the name of the arm that the corrected table is, if one is
    every : whether each pose is listed
    """
    fits = found.fits
    off = _off(found, float(found.left_mm[fits].max()), float(found.left_deg[fits].max()))
    form = f"; orientations read as {FORMS[found.form]}" if found.oriented else " without orientations"
    lines = [
        f"{len(found.lines)} poses{form}; rounding explains {_off(found, found.digits_mm, found.digits_deg)}",
        HEADLINES[found.verdict].format(off=off),
        *_found_lines(found, nearest),
    ]
    if found.verdict != "agrees":
        before = _off(found, float(found.before_mm.max()), float(found.before_deg.max()))
        lines.append(f"  as it is, the model is up to {before} off")
    if found.noise > 1:
        lines.append(f"  {found.noise:.0f} times what rounding explains is left: did the arm still move?")
    lines += [f"  alike: {', '.join(_alike(each))}" for each in found.alike]
    if found.verdict != "open":
        more = "; er3a confirm ROBOT --plan gives poses that do" if found.not_settled else ""
        lines.append(f"  not settled by these poses: {', '.join(found.not_settled) or 'nothing'}{more}")
    if found.taken_up:
        lines.append(f"  not separated from base and tool: {', '.join(found.taken_up)}")
    if not found.oriented:
        lines.append("  not examined: orientations, and what turns the tool alone")
    lines += _table(found) if every else []
    return [*lines, *(f"{NOTES[note]} {value}" for note, value in found.notes), ACCURACY]


def _off(found: Confirmation, mm: float, deg: float) -> str:
    return f"{number(mm, 3)} mm" + (f" and {number(deg, 3)}°" if found.oriented else "")


def _found_lines(found: Confirmation, nearest: str) -> Iterator[str]:
    """What is between model and controller, and what to write where."""
    parts = list(_parts(found))
    if found.verdict == "open":
        far = np.argsort(-found.left_mm, kind="stable")[:SHOWN_LINES]
        yield f"  nearest: {'; '.join(parts) or NOTHING}"
        yield f"  lines that are farthest off: {_listed(found.lines[far])}"
        return
    if found.renamed:
        form = FORMS[found.form]
        yield f"  orientations are {form}, not what the columns' names say; rename them, or --angles {found.form}"
    if unit := UNITS_BY_FACTOR.get(found.factor):
        yield f"  positions are in {unit}; --units {unit}"
    elif found.factor != 1:
        yield f"  positions are {1 / found.factor:.4g} times as large as the model's; check their unit"
    if not found.fits.all():
        out = ~found.fits
        lines, off = _listed(found.lines[out]), float(found.left_mm[out].max())
        yield f"  lines that do not fit: {lines}; up to {off:.3g} mm off. Check what was typed there"
    yield from (f"  {part}" for part in parts)
    if any(each.entry.column != "offset" for each in found.entries):
        yield (
            f"  the corrected table is that of {nearest}"
            if nearest
            else "  another arm, maybe of the same family: compare names and drawings; --output corrected.yaml"
        )
    if found.small:
        largest = ", ".join(
            with_unit(f"{each.entry.name} {as_text(each.found - each.given, '+.3f')}", each.entry.unit)
            for each in found.small[:SHOWN_ENTRIES]
        )
        yield (
            f"  {len(found.small)} small corrections, as of a factory; the largest: {largest}; --output mine.yaml; UR: "
            "er3a import-calibration; intervals: er3a calibrate"
        )
    if found.held_out_mm is not None:
        yield f"  at poses left out of the fit: {found.held_out_mm:.2g} mm root mean square"


def _parts(found: Confirmation) -> Iterator[str]:
    """Tool, base, joints and entries that are other."""
    if found.tool is not None:
        yield f"tool of the controller: {_place(found.tool, found.oriented)}; or select the flange and read again"
    if found.base is not None:
        yield f"base of the controller: {_place(found.base, True)}; or select base 0 and read again"
    yield from map(_joint, found.joints)
    for each in found.entries:
        given, value = as_text(each.given, ".3f"), as_text(each.found, ".3f")
        width, joint = f"(+-{each.half_width:.2g})", each.entry.joint
        if each.entry.column == "offset":
            yield (
                f"zero of J{joint} is {as_text(each.found - each.given, '+.3f')}° off {width}; offset_deg of row "
                f"{joint}: {given} -> {value}. Zero is defined otherwise, or the joint was mastered wrong: compare its "
                "marks"
            )
        else:
            yield f"{each.entry.name}: {given} -> {with_unit(value, each.entry.unit)} {width}"


def _place(place: Placed, turned: bool) -> str:
    xyz, mm = _for_a_file(place.xyz_mm, 2), f"+-{place.half_width_mm:.2g} mm"
    if not turned:
        return f"{{xyz_mm: {xyz}}} ({mm})"
    return f"{{xyz_mm: {xyz}, rpy_deg: {_for_a_file(place.rpy_deg, 3)}}} ({mm}, {place.half_width_deg:.2g}°)"


def _joint(found: Finding) -> str:
    params = dict(found.params)
    if found.code == "counted_from":
        params["rows"] = (
            f"[{{row: {found.joint}, joints: [{found.by}, {found.joint}], factors: [{found.factor:.0f}, 1]}}]"
        )
    if found.code == "zero_elsewhere":
        params["deg"] = as_text(found.deg, ".0f")
    return JOINTS[found.code].format(**params)


def _alike(found: Finding) -> list[str]:
    """What else explains the poses as well."""
    places, zeros = (f"another {place}" for place in found.places), (f"zero of J{joint}" for joint in found.zeros)
    return [*map(_joint, found.joints), *places, *zeros, *found.entries] or [NOTHING]


def _for_a_file(values: Reals, decimals: int) -> str:
    """Numbers as a study or robot file takes them."""
    return "[" + ", ".join(f"{round(float(value), decimals) + 0.0:.{decimals}f}" for value in values) + "]"


def _listed(lines: Integers) -> str:
    shown = ", ".join(str(line) for line in sorted(lines.tolist())[:SHOWN_LINES])
    return shown + (" ..." if len(lines) > SHOWN_LINES else "")


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
        return {
            "xyz_mm": place.xyz_mm.tolist(),
            "rpy_deg": place.rpy_deg.tolist(),
            "half_width_mm": place.half_width_mm,
            "half_width_deg": place.half_width_deg if np.isfinite(place.half_width_deg) else None,
        }

    def entries(found: Sequence[FoundEntry]) -> list[dict[str, object]]:
        values = ("given", "found", "half_width")
        of = ({"name": each.entry.name, "unit": each.entry.unit} for each in found)
        return [named | {key: float(getattr(each, key)) for key in values} for named, each in zip(of, found)]

    rows = zip(found.lines.tolist(), *(getattr(found, name).tolist() for name in OF_A_ROW))
    return {
        "robot": robot,
        **{name: plain(getattr(found, name)) for name in RECORDED},
        "form": found.form or None,
        "base": placed(found.base),
        "tool": placed(found.tool),
        "entries": entries(found.entries),
        "small": entries(found.small),
        "nearest": nearest or None,
        "rows": [dict(zip(("line", *OF_A_ROW), row)) for row in rows],
    }


PLAN = (
    "{poses} poses: move there slowly, with the flange as tool and the robot's own base. Write down what the pendant "
    "shows. Below each pose is what the model says, X Y Z in mm, A B C in ° (Rz Ry Rx)"
)
PLAN_SAFE = {
    True: "within limits, clear of arm and base, away from singular poses; cell unknown",
    False: "within limits, above the base, away from singular poses; shapes and cell unknown",
}


def on_pendant(T: Reals) -> tuple[float, ...]:
    """X, Y, Z (mm) and A, B, C (deg) of a transform (4, 4), m, as a pendant shows them."""
    return (*(1000 * T[:3, 3]), *np.degrees(rpy_of(T))[::-1])


def plan_lines(found: Plan, robot: Robot) -> list[str]:
    """A plan as a sheet to print and fill in: joint values, and what the pendant should show."""
    names = [f"J{k + 1}" for k in range(robot.joints)]
    pose = ("X", "Y", "Z", "A", "B", "C")
    lines = [PLAN.format(poses=len(found.q)), "  ".join(f"{name:>8}" for name in (*names, *pose))]
    for q, T in zip(shown(robot, found.q), found.T):
        values = [*(f"{value:8.0f}" for value in q), *(f"{value:8.2f}" for value in on_pendant(T))]
        lines += ["  ".join(values), f"the pendant shows: {'  '.join(['________'] * len(pose))}"]
    return [*lines, PLAN_SAFE[bool(found.shapes)]]


def table_to_fill(found: Plan, robot: Robot) -> str:
    """A plan as a table (CSV), whose poses are left blank to be filled in."""
    names = [f"q{k + 1}_{'mm' if slides else 'deg'}" for k, slides in enumerate(robot.slides)]
    rows = [",".join(f"{value:.0f}" for value in q) + ",,,,,," for q in shown(robot, found.q)]
    return "\n".join([",".join([*names, "X", "Y", "Z", "A", "B", "C"]), *rows, ""])
