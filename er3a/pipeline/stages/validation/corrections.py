"""Corrections to the table from the positions that a reference set states."""

from __future__ import annotations

from typing import Any

import pandas as pd

from er3a.calibration.calibrate import Identification, identify
from er3a.errors import IdentificationError
from er3a.pipeline.messages.language import joined, said
from er3a.references.reference import ReferenceSet
from er3a.robots.robot import Robot

MOST_SCATTER = 3.0


def identify_from_sets(robot: Robot, sets: list[ReferenceSet]) -> tuple[list[dict], pd.DataFrame]:
    """Identify the table from each reference set's positions.

    Returns
    -------
    found : per set ``status`` (``identified``; ``misfit``, no corrections make the table meet the positions to three
        times their uncertainty; ``too_few``) and what was found
    table : estimates with standard error and half-width of the 95 % interval, of the sets that are identified
    """
    found, records = [], []
    for references in sets:
        try:
            result = identify(robot, references)
        except IdentificationError as error:
            found.append({"reference_set": references.name, "status": "too_few", "text": str(error)})
            continue
        found.append({"reference_set": references.name} | _plain(result))
        if result.scatter <= MOST_SCATTER:
            records += [
                {
                    "reference_set": references.name,
                    "name": estimate.name,
                    "unit": estimate.unit,
                    "nominal": estimate.nominal,
                    "correction": estimate.correction,
                    "standard_error": estimate.standard_error,
                    "half_width": estimate.half_width,
                }
                for estimate in result.estimates
            ]
    types = {"reference_set": str, "name": str, "unit": str}
    types |= dict.fromkeys(("nominal", "correction", "standard_error", "half_width"), float)
    return found, pd.DataFrame(records, columns=list(types)).astype(types)


def _plain(result: Identification) -> dict[str, Any]:
    fits = result.scatter <= MOST_SCATTER
    beyond = [each.name for each in result.estimates if abs(each.correction) > each.half_width]
    if not fits:
        text = said(
            "No corrections of its {level} make this table meet the positions: {after:.3g} mm of {before:.3g} mm (root "
            "mean square) remain. It is not a matter of calibration.",
            level=result.level,
            after=result.rms_after_mm,
            before=result.rms_before_mm,
        )
    elif beyond:
        text = said(
            "The positions ask for corrections of {entries}, beyond their 95 % intervals.",
            entries=joined(beyond, ", "),
        )
    else:
        text = said(
            "The positions ask for no correction: all {count} intervals (95 %) hold 0.", count=len(result.estimates)
        )
    return {
        "status": "identified" if fits else "misfit",
        "text": text,
        "level": result.level,
        "numbers": result.numbers,
        "poses": result.poses,
        "held": list(result.held),
        "close": [list(pair) for pair in result.close],
        "singular_values": result.singular_values.tolist(),
        "rms_before_mm": result.rms_before_mm,
        "rms_after_mm": result.rms_after_mm,
        "scatter": result.scatter,
        "more": result.more,
    }
