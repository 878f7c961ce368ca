"""Collisions of a path with its surroundings and of the arm with itself: what to write of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.along import ClearanceAlong, Contact, clearance_along
from er3a.collision.bodies import Bodies
from er3a.pipeline.messages.language import joined, said
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.trajectory.judgement import WORDS, fault_text, interval_records
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.intervals import Interval

MOST_PAIRS = 3


def measured(bodies: Bodies, motion: Motion, overlap_mm: float) -> ClearanceAlong:
    """Clearance along a motion, shown at its samples; no overlap deeper than ``overlap_mm`` is missed."""
    return clearance_along(bodies, motion.joints, motion.t, motion.samples, overlap_mm / 1000)


def with_collisions(record: dict[str, Any], motion: Motion, along: ClearanceAlong | None) -> dict[str, Any]:
    """A path's entry in ``summary.json`` with what it meets, and a verdict that says so unless it has a graver one.

    ``clearance`` is None where none could be measured.
    """
    if along is None or along.least < 0:
        return record | {"collisions": [], "clearance": None}
    stretches = [Interval(contact.start, contact.end, _cause(contact)) for contact in along.contacts]
    clearance = {
        "least_mm": float(along.distance[along.least] * 1000),
        "t_s": float(along.t[along.least]),
        "between": say(along.pair[along.least]),
        "poses_measured": along.measured,
    }
    record = record | {"collisions": interval_records(motion, stretches), "clearance": clearance}
    if stretches:
        faults = joined(fault_text(part) for part in stretches)
        before = record["verdict"]
        if before == "safe":
            record |= {"verdict": "collides", "text": faults}
        elif WORDS.index(before) > WORDS.index("collides"):
            record |= {"verdict": "collides", "text": joined([faults, record["text"]])}
        else:
            record["text"] = joined([record["text"], faults])
    return record


def clearance_table(name: str, along: ClearanceAlong | None) -> pd.DataFrame:
    """One row per time at which the clearance was measured in full; NaN where the path can't be reached."""
    if along is None:
        return pd.DataFrame({"path": [], "t_s": np.empty(0), "clearance_mm": np.empty(0), "between": []})
    return pd.DataFrame(
        {
            "path": name,
            "t_s": along.t,
            "clearance_mm": along.distance * 1000,
            "between": [pair.label if pair else "" for pair in along.pair],
        }
    )


def _cause(contact: Contact) -> str:
    pairs = joined(map(say, contact.pairs[:MOST_PAIRS]), ", ")
    if len(contact.pairs) > MOST_PAIRS:
        pairs = said("{pairs} and more", pairs=pairs)
    worst = {"pairs": pairs, "depth": contact.depth * 1000, "t": contact.at}
    return said("{pairs} overlap, up to {depth:.1f} mm at t = {t:.4g} s", **worst)
