"""Sentences about calibrations, and their results as lines for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.calibration.calibrate import Calibration
from er3a.calibration.outcomes import (
    Misfit,
    MorePositions,
    NotToldApart,
)
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.say import Plural, joined, say, say_as, sentence, texts, word

LEVELS = {
    "lengths": N_("lengths"),
    "lengths_and_offsets": N_("lengths and joint offsets"),
    "all_entries": N_("all entries"),
}
MUCH_SCATTER = 2.0


TEXTS = texts(
    {
        "moves_nothing": "{entry} has no effect on the measured points",
        "no_positions": "there are no positions of single points to calibrate from",
        "no_correction_fits": (
            "no corrections make the table fit: after {steps} steps the positions are still {rest_mm:.3g} mm off. The "
            "table has a gross fault or belongs to another arm; er3a.diagnose finds single faults"
        ),
        "corrections_found": "The positions indicate corrections of {entries:, }: their 95 % intervals exclude 0.",
        "no_correction_found": Plural(
            "intervals",
            "The positions indicate no correction: the 95 % interval contains 0.",
            "The positions indicate no correction: all {count} 95 % intervals contain 0.",
        ),
        "not_told_apart#parallel": "{entries} can't be identified separately: axes {first} and {second} are parallel",
        "not_told_apart": "{entries} can't be identified separately",
        "more_positions#known": Plural(
            "poses",
            "{coordinates} coordinates at {count} pose determine {determined} of the {determinable} entries "
            "({level}) that positions of these points can determine",
            "{coordinates} coordinates at {count} poses determine {determined} of the {determinable} entries "
            "({level}) that positions of these points can determine",
        ),
        "more_positions#needed": Plural(
            "least", "at least {count} more position is needed", "at least {count} more positions are needed"
        ),
        "more_positions#request": "{known}; {needed}. Spread them over all joints, for example {examples}.",
        "more_positions#for_entries": "{needed} for {entries:, }",
        "misfit": (
            "Correcting {level} does not make this table fit the positions: {rms_after_mm:.3g} mm of "
            "{rms_before_mm:.3g} mm (root mean square) remain. Calibration can't repair it."
        ),
        "list": "{others} and {last}",
    }
)


def level(name: str) -> str:
    """Which entries were estimated, in words."""
    return word("level", LEVELS, name)


@say.register
def _(found: NotToldApart) -> str:
    entries = _listed(found.entries)
    if found.parallel_joints is None:
        return say_as(found, entries=entries)
    first, second = found.parallel_joints
    return say_as(found, "parallel", entries=entries, first=first, second=second)


@say.register
def _(found: MorePositions) -> str:
    known = say_as(found, "known", level=level(found.level))
    needed = say_as(found, "needed")
    if found.entries:
        needed = say_as(found, "for_entries", needed=needed)
    poses = ["(" + ", ".join(as_text(angle, "g") for angle in pose) + ") deg" for pose in found.examples_deg]
    return say_as(found, "request", known=known, needed=needed, examples=_listed(poses))


@say.register
def _(found: Misfit) -> str:
    return say_as(found, level=level(found.level))


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
    return sentence("list", others=joined(words[:-1], ", "), last=words[-1])
