"""Subjects of references, for tests: findings by the names of :mod:`er3a.references.subjects`."""

from __future__ import annotations

from er3a.finding import Finding, fact


def axis_direction(joint: int, signed: bool) -> Finding:
    return fact("axis_direction", joint=joint, signed=signed)


def axis_position(joint: int, coordinate: str | None) -> Finding:
    return fact("axis_position", joint=joint, coordinate=coordinate)


def point_at_pose(pose: str, point: str, coordinate: str | None) -> Finding:
    return fact("point_at_pose", pose=pose, point=point, coordinate=coordinate)


def pose_excess(pose: str) -> Finding:
    return fact("pose_excess", pose=pose)


def segment_inclination(segment: str) -> Finding:
    return fact("segment_inclination", segment=segment)


def drawing_corner(q2_deg: float, q3_deg: float, coordinate: str) -> Finding:
    return fact("drawing_corner", q2_deg=q2_deg, q3_deg=q3_deg, coordinate=coordinate)


def reach(extreme: str, point: str, axis: int) -> Finding:
    return fact("reach", extreme=extreme, point=point, axis=axis)


def joint_limit(joint: int, side: str) -> Finding:
    return fact("joint_limit", joint=joint, side=side)


def joint_speed(joint: int) -> Finding:
    return fact("joint_speed", joint=joint)
