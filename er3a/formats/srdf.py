"""SRDF out: what MoveIt reads beside a URDF to plan with an arm: its group, and pairs of links not to check [1]_.

References
----------
.. [1] I. Sucan, S. Chitta and others, "Semantic Robot Description Format (SRDF)", ROS documentation.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from er3a.collision.matrix import collision_matrix
from er3a.robots.robot import Robot

REASONS = {"never": "Never", "joined": "Adjacent", "allowed": "User", "overlaps": "Default", "guessed": "Default"}


def export_srdf(robot: Robot) -> str:
    """The arm's SRDF, for the URDF of :func:`er3a.formats.urdf.export_urdf`.

    Pairs of links that are disabled: those that are proven apart in all joint vectors within the limits (Never),
    that a joint joins (Adjacent), that the robot's file allows to touch (User), and whose shapes overlap where no
    arm's can (Default), which is an error of the shapes: a comment names them. What er3a still checks of links
    that a joint joins, away from that joint, SRDF has no words for.
    """
    root = ElementTree.Element("robot", name=robot.name)
    group = ElementTree.SubElement(root, "group", name="arm")
    ElementTree.SubElement(group, "chain", base_link="base", tip_link="tool")
    for row in collision_matrix(robot).rows:
        if row.state not in REASONS:
            continue
        if REASONS[row.state] == "Default":
            root.append(ElementTree.Comment(f" {row.first} and {row.second} are not checked: the shapes are in error "))
        ElementTree.SubElement(root, "disable_collisions", link1=row.first, link2=row.second, reason=REASONS[row.state])
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def pairs_not_checked(robot: Robot) -> tuple[str, ...]:
    """Pairs of links that the SRDF disables because their shapes can't be right."""
    return tuple(
        f"{row.first} and {row.second}" for row in collision_matrix(robot).rows if REASONS.get(row.state) == "Default"
    )
