"""What a measurement that er3a proposes would show on an arm."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from er3a.finding import Finding, fact, is_one
from er3a.references.predict import predict
from er3a.references.quantities import Limit, Quantity, Speed
from er3a.references.reference import Reference
from er3a.references.seen import COARSE_DEG, Seen, SeenMotion, TableEntry
from er3a.references.subjects import Subject
from er3a.robots.robot import Robot

MEASURED = "measured"


def measured(proposal: Finding, arm: Robot, origin: str = MEASURED) -> Reference:
    """What the proposed measurement shows on an arm, as a reference."""
    subject, quantity, group = _about(proposal)
    expected = float(predict(arm, [_plain(quantity, subject, group)])[0])
    width = COARSE_DEG
    if is_one(proposal, "look_at_motion"):
        if expected > 90.0 and isinstance(quantity, SeenMotion):
            quantity = replace(quantity, seen=opposite(proposal.seen))
            subject = subject.but(seen=quantity.seen)
        expected = 0.0
    elif is_one(proposal, "measure_length"):
        width = proposal.half_width_mm
    elif is_one(proposal, "time_joint"):
        width = proposal.half_width_deg_s
    else:
        width = proposal.half_width_deg
    return Reference(subject, group, quantity, expected, width, origin, "measured", origin)


def opposite(seen: Seen) -> Seen:
    """The outcome if the joint turns the other way."""
    turned = {"up": "down", "left": "right", "forward": "back"}
    turned |= {other: one for one, other in turned.items()}
    stem, _, last = seen.rpartition("_")
    return cast(Seen, f"{stem}_{turned[last]}" if stem else turned[last])


def _about(proposal: Finding) -> tuple[Subject, Quantity, str]:
    joint = proposal.joint
    if is_one(proposal, "look_at_motion"):
        motion = SeenMotion(proposal.pose_deg, joint, proposal.point, proposal.seen)
        return fact("motion_of_joint", joint=joint, point=proposal.point, seen=proposal.seen), motion, "key_poses"
    if is_one(proposal, "read_limit"):
        return fact("joint_limit", joint=joint, side=proposal.side), Limit(joint, proposal.side), "limits"
    if is_one(proposal, "time_joint"):
        return fact("joint_speed", joint=joint), Speed(joint), "speeds"
    return fact("entry_of_table", column=proposal.column, joint=joint), TableEntry(proposal.column, joint), "axes"


def _plain(quantity: Quantity, subject: Subject, group: str) -> Reference:
    return Reference(subject, group, quantity, 0.0, 1.0, MEASURED, "measured")
