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
        "left_out.link_masses": "what links without mass add to the torques; they count as massless",
        "left_out.peak_torques": "peak torques of drives whose limit no document gives",
        "left_out.rated_torques": "RMS and holding torques of drives whose rated torque no document gives",
        "left_out.rotor_inertias": "what rotors add to the torques: their inertias are not known",
        "left_out.friction": "what friction adds to the torques: it is not known",
        "left_out.wrist_limits": "payload, moments and inertias that the wrist allows, where no document gives them",
        "left_out.load": "tool and payload: the study gives no mass for them",
        "left_out.paths_not_run": "paths that may not be run as they are: motors and limits don't count them",
        "left_out.torque_peaks": "torques of paths between the {amount:,.0f} times computed",
        "left_out.program_torques": "torques of programs that are not among the paths",
        "left_out.drive_behaviour": (
            "what changes with speed, heat and wear in motors, gears and brakes, and what elasticity adds"
        ),
        "left_out.real_camera": "what a real camera sees: the samples are simulated",
        "left_out.boardless_images": "images in which no board was found",
        "left_out.left_out_samples": "samples that contradict the others: the calibration does not rest on them",
        "left_out.touched_points": "where the arm really touches what the camera sees: no touched points are given",
        "left_out.detections": "whether detected objects are where the detector says, within the deviations stated",
        "left_out.gripped_parts": "collisions of the objects themselves and of a part in the gripper",
    }
)


def left_out_text(found: LeftOut) -> str:
    """What was not examined, in the language in use."""
    return sentence(f"left_out.{found.subject}", amount=found.amount)
