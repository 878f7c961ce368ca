"""Sentences about calibrations, and their results as lines for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.calibration.calibrate import Calibration
from er3a.calibration.outcomes import (
    CorrectionsFound,
    Misfit,
    MorePositions,
    MovesNothing,
    NoCorrectionFits,
    NoCorrectionFound,
    NoPositions,
    NotToldApart,
)
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.say import counted, joined, say, sentence, word

LEVELS = {
    "lengths": N_("lengths"),
    "lengths_and_offsets": N_("lengths and joint offsets"),
    "all_entries": N_("all entries"),
}
MUCH_SCATTER = 2.0


def level(name: str) -> str:
    """Which entries were estimated, in words."""
    return word("level", LEVELS, name)


@say.register
def _(found: MovesNothing) -> str:
    return sentence(found.code, "{entry} has no effect on the measured points", entry=found.entry)


@say.register
def _(found: NotToldApart) -> str:
    entries = _listed(found.entries)
    if found.parallel_joints is None:
        return sentence(found.code, "{entries} can't be identified separately", entries=entries)
    first, second = found.parallel_joints
    return sentence(
        found.code,
        "{entries} can't be identified separately: axes {first} and {second} are parallel",
        entries=entries,
        first=first,
        second=second,
    )


@say.register
def _(found: NoPositions) -> str:
    return sentence(found.code, "there are no positions of single points to calibrate from")


@say.register
def _(found: MorePositions) -> str:
    known = counted(
        found.code,
        "{coordinates} coordinates at {count} pose determine {here} of the {best} entries ({level}) that positions of "
        "these points can determine",
        "{coordinates} coordinates at {count} poses determine {here} of the {best} entries ({level}) that positions of "
        "these points can determine",
        found.poses,
        coordinates=found.coordinates,
        here=found.determined,
        best=found.determinable,
        level=level(found.level),
    )
    needed = counted(
        found.code,
        "at least {count} more position is needed",
        "at least {count} more positions are needed",
        found.least,
    )
    if found.entries:
        needed = sentence(found.code, "{needed} for {entries}", needed=needed, entries=joined(found.entries, ", "))
    poses = ["(" + ", ".join(as_text(angle, "g") for angle in pose) + ") deg" for pose in found.examples_deg]
    return sentence(
        found.code,
        "{known}; {needed}. Spread them over all joints, for example {examples}.",
        known=known,
        needed=needed,
        examples=_listed(poses),
    )


@say.register
def _(found: NoCorrectionFits) -> str:
    return sentence(
        found.code,
        "no corrections make the table fit: after {steps} steps the positions are still {rest:.3g} mm off. The "
        "table has a gross fault or belongs to another arm; er3a.diagnose finds single faults",
        steps=found.steps,
        rest=found.rest_mm,
    )


@say.register
def _(found: Misfit) -> str:
    return sentence(
        found.code,
        "Correcting {level} does not make this table fit the positions: {after:.3g} mm of {before:.3g} mm (root"
        " mean square) remain. Calibration can't repair it.",
        level=level(found.level),
        after=found.rms_after_mm,
        before=found.rms_before_mm,
    )


@say.register
def _(found: CorrectionsFound) -> str:
    return sentence(
        found.code,
        "The positions indicate corrections of {entries}: their 95 % intervals exclude 0.",
        entries=joined(found.entries, ", "),
    )


@say.register
def _(found: NoCorrectionFound) -> str:
    return counted(
        found.code,
        "The positions indicate no correction: the 95 % interval contains 0.",
        "The positions indicate no correction: all {count} 95 % intervals contain 0.",
        found.intervals,
    )


def lines_of(found: Calibration) -> str:
    """A calibration as lines of text for a terminal."""
    lines = [
        f"{found.coordinates} coordinates at {found.poses} poses; estimated: {level(found.level)}",
        f"root mean square difference {found.rms_before_mm:.4g} mm before, {found.rms_after_mm:.4g} mm after; "
        f"scatter {found.scatter:.2f} standard deviations",
        f"{'entry':<9}{'table':>12}{'correction':>14}{'95 % interval':>16}",
    ]
    for each in found.estimates:
        values = as_text(each.nominal, ">12.4f") + as_text(each.correction, ">+14.4f") + f"{each.half_width:>12.4f}"
        lines.append(f"{each.name:<9}{values} {each.unit}")
    lines += [f"not estimated: {say(reason)}" for reason in found.held]
    lines += [
        f"strongly correlated: {pair.first} and {pair.second} ({as_text(pair.correlation, '.2f')})"
        for pair in found.close
    ]
    if found.scatter > MUCH_SCATTER:
        lines.append("warning: the residuals exceed the stated standard deviations, so errors may exceed the intervals")
    if found.more:
        lines.append(f"to estimate more: {say(found.more)}")
    return "\n".join(lines)


def calibration_record(found: Calibration) -> dict[str, object]:
    """A calibration as plain data, for another program; corrections in mm and deg with half their 95 % interval."""
    return {
        "level": found.level,
        "coordinates": found.coordinates,
        "poses": found.poses,
        "rms_before_mm": found.rms_before_mm,
        "rms_after_mm": found.rms_after_mm,
        "scatter": found.scatter,
        "fits": found.fits,
        "entries": [
            {
                "name": each.name,
                "nominal": each.nominal,
                "correction": each.correction,
                "half_width": each.half_width,
                "unit": each.unit,
            }
            for each in found.estimates
        ],
        "held": [say(reason) for reason in found.held],
        "more": say(found.more) if found.more else None,
    }


def _listed(words: Sequence[str]) -> str:
    """Words in a row, with "and" before the last."""
    return sentence("list", "{others} and {last}", others=joined(words[:-1], ", "), last=words[-1])
