"""What a stage did not examine, in words."""

from __future__ import annotations

from er3a.pipeline.messages.say import sentence, texts
from er3a.pipeline.results import LeftOut

TEXTS = texts(
    {
        "left_out.obstacles": "obstacles: no scene is given, and the arm was checked against itself only",
        "left_out.bare_links": "what links hit to which no shape is given",
        "left_out.unexamined_pairs": "collisions of pairs whose shapes can't be right",
        "left_out.allowed_pairs": "collisions of pairs that the robot's or scene's file allows",
        "left_out.joined_pairs": "collisions of links near the joint between them",
        "left_out.shallow_overlaps": "overlaps of less than {amount:g} mm between the points measured",
        "left_out.own_speeds": "speeds that the joints can really do: no document gives them, and others are assumed",
        "left_out.jerk": "jerk: nothing bounds it",
        "left_out.torques": "torques, payload and what the arm bends (torques have a page of their own)",
        "left_out.paths": "paths that were not followed to their end",
        "left_out.path_stretches": "stretches that the bounds between the poses solved leave open",
        "left_out.strategies": "avoidance strategies that the study does not ask for",
        "left_out.program_lines": "lines of programs that were not examined, or not each time",
        "left_out.program_starts": "motions from where the arm is not known to stand",
        "left_out.outer_axes": "axes beside the arm's, which are taken to be at rest",
        "left_out.controller_ramps": "the controller's own ramps and blends, which decide times and corners",
        "left_out.joint_vectors": "joint vectors other than {amount:,.0f} random ones: shares are estimates",
        "left_out.lost_cells": "whether {amount:,.0f} cells in which no clear arm was found are really blocked",
    }
)


def left_out_text(found: LeftOut) -> str:
    """What was not examined, in the language in use."""
    return sentence(f"left_out.{found.subject}", amount=found.amount)
