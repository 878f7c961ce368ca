"""Hand-eye calibrations and grasps: the verdict of the vision stage, its page, and lines for a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import er3a.pipeline.messages.collision
import er3a.pipeline.messages.diagnosis
import er3a.pipeline.messages.planning  # noqa: F401
from er3a.finding import Finding
from er3a.geometry.transforms import quaternion_of, rpy_of
from er3a.pipeline.language import N_, as_text
from er3a.pipeline.messages.expectations import demonstrated
from er3a.pipeline.messages.say import Plural, by, joined, listed, say, say_as, says, sentence, texts, word
from er3a.vision.hand_eye import HandEye, spread_of
from er3a.vision.vision_findings import Convention, Suspect

PARTS = {"move": N_("move to the approach"), "approach": N_("approach"), "retreat": N_("retreat")}
MENDING = {
    "half_turn_x": N_("the board is detected turned by 180 deg about its x axis"),
    "half_turn_y": N_("the board is detected turned by 180 deg about its y axis"),
    "half_turn_z": N_("the board is detected turned by 180 deg in its plane"),
    "quarter_turn_z": N_("the board is detected turned by 90 deg in its plane"),
    "mirrored_tilt": N_("the board's tilt is mirrored, as of a flat board seen from far or head-on"),
    "rotation": N_("no typical detector error explains it"),
}
STREAMS = {"flange": N_("flange"), "target": N_("board"), "both": N_("flange and board")}
CONVENTIONS: dict[Convention, str] = {
    "inverted": N_("its poses are inverted"),
    "transposed": N_("its rotations are transposed"),
    "real_part_first": N_("its quaternions have the real part first"),
    "real_part_last": N_("its quaternions have the real part last"),
    "turning_axes": N_("its angles mean R = Rx(roll) Ry(pitch) Rz(yaw)"),
    "abc": N_("its angles mean R = Rz(roll) Ry(pitch) Rx(yaw)"),
    "zyz": N_("its angles mean R = Rz(roll) Ry(pitch) Rz(yaw)"),
    "opengl": N_("its positions are (x, −y, −z)"),
    "to_optical": N_("its positions are (−y, −z, x)"),
    "from_optical": N_("its positions are (z, −x, −y)"),
}
POSES = {
    "eye_in_hand": (N_("camera on the flange (T_flange_camera)"), N_("board in the base (T_base_board)")),
    "eye_to_hand": (N_("camera in the base (T_base_camera)"), N_("board on the flange (T_flange_board)")),
}
KEY_FIGURES = {
    "samples_used": N_("samples used"),
    "position_half_width": N_("camera's position, largest half-width (95 %)"),
    "rotation_half_width": N_("camera's rotation, largest half-width (95 %)"),
    "objects_grasped": N_("objects that can be grasped"),
    "worst_error": N_("error at the worst grasp (95 %)"),
    "least_success": N_("least probability of success"),
}


TEXTS = texts(
    {
        "calibration_impossible": "The samples determine no hand-eye pose: {why}.",
        "calibration_doubtful": "The calibration can't be used, so no grasp rests on it: {warnings:; }.",
        "touch_contradicts": Plural(
            "points",
            "{count} touched point contradicts the calibration: it is {largest_mm:.3g} mm off (probability "
            "{probability:.1g}).",
            "{count} touched points contradict the calibration: they are up to {largest_mm:.3g} mm off "
            "(probability {probability:.1g}).",
        ),
        "not_grasped_object": "not {name} ({why})",
        "grasp_out_of_reach": Plural(
            "poses", "its only grasp is out of reach", "all {count} poses of its grasps are out of reach"
        ),
        "grasp_near_limits": Plural(
            "solutions",
            "the only solution is {margin_deg:.1f} deg from the joint limits; {needed_deg:g} deg are required",
            "the best of {count} solutions is {margin_deg:.1f} deg from the joint limits; {needed_deg:g} deg are "
            "required",
        ),
        "grasp_near_ends": Plural(
            "solutions",
            "the only solution is {margin_deg:.1f} deg (mm of a prismatic joint) from the joint limits; {needed_deg:g} "
            "are required",
            "the best of {count} solutions is {margin_deg:.1f} deg (mm of a prismatic joint) from the joint limits; "
            "{needed_deg:g} are required",
        ),
        "grasp_singular": (
            "all solutions within the limits are singular: the least singular value is {singular_value:.2g} at best, "
            "and {needed:g} is required"
        ),
        "no_transfer": "the straight move to the approach collides, and there is no other: {why}",
        "grasp_counts#grasped": Plural(
            "count", "{grasped} of {count} object can be grasped", "{grasped} of {count} objects can be grasped"
        ),
        "grasp_counts#assumed": Plural(
            "count",
            "{count} more only if shapes that no document gives are right ({assumed:, })",
            "{count} more only if shapes that no document gives are right ({assumed:, })",
        ),
        "grasp_counts#error": "at the worst grasp 95 % of errors stay below {point_mm:.2g} mm",
        "grasp_counts#success": "the probability of success is at least {percent:g} %",
        "grasp_counts#simulated": "The camera's samples are simulated.",
        "grasp_counts#left_out": "calibrated without {left_out:, }",
        "grasp_unlikely": (
            "the gripper's tolerance is kept with a probability of {p:.3g} % at best, and {level:.3g} % is required"
        ),
        "grasp_collides#apart": (
            "at the grasp {pair} are at most {clearance_mm:.1f} mm apart; {needed_mm:g} mm are required"
        ),
        "grasp_collides#overlap": "at the grasp {pair} overlap by at least {depth:.1f} mm",
        "line_leaves": "the straight {part} exceeds limits or becomes singular {after_mm:.0f} mm from the grasp",
        "line_unproven": (
            "along the straight {part} the bounds can't decide whether limits, joint speeds and distances from "
            "singularities are kept"
        ),
        "way_collides#apart": "on the {part} {pair} are {clearance_mm:.1f} mm apart; {needed_mm:g} mm are required",
        "way_collides#overlap": "on the {part} {pair} overlap by {depth:.1f} mm",
        "far_from_fit": (
            "{sample}: {off_mm:.3g} mm and {off_deg:.2g} deg from what the other samples predict (probability "
            "{probability:.1g})"
        ),
        "ambiguous_tilt": (
            "{sample}: the flat board is seen almost head-on, or too small: the mirrored tilt fits with only "
            "{ratio:.2g} times the error. Take the image from nearer, or tilt the board by 30 deg"
        ),
        "boardless_image": "{sample}: {corners} corners of the board are found in {image}; the sample is left out",
        "no_majority": (
            "flange and board rotate by different angles in {pairs} of {of} pairs of samples ({median_deg:.3g} deg in "
            "the median): the robot's table, the order of the samples, or the orientations of one stream are wrong"
        ),
        "board_scale": (
            "the samples fit a board {factor:.4g} ± {half_width:.1g} times as large: check the stated size of its "
            "squares, the units, or the camera's focal length"
        ),
        "focal_length": (
            "the samples fit with distances along the camera's axis {factor:.4g} ± {half_width:.1g} times as large, as "
            "if the focal length, by which the board's poses were computed, had to be as many times as long: estimate "
            "the camera's intrinsics again, check that they are of this image size, and compute the poses with them"
        ),
        "principal_point": (
            "the samples fit with the board {percent:+.2g} ± {half_width_percent:.1g} % of its distance farther along "
            "the camera's {axis}, as if the principal point, with which the board's poses were computed, were off by "
            "that share of the focal length: estimate the camera's intrinsics again, and compute the poses with them"
        ),
        "little_motion": (
            "the samples rotate by at most {greatest_turn_deg:.3g} deg, about axes within {axes_apart_deg:.2g} deg of "
            "one direction: add poses rotated by 30 deg or more about a second axis"
        ),
        "more_scatter": (
            "the residuals are {scatter:.3g} times the stated standard deviations, where chance explains at most "
            "{largest:.2f}: the arm's table, its repeatability or the camera is worse than stated"
        ),
        "moved_between": by(
            "what",
            camera="from {sample} on the camera stands {moved_mm:.2g} mm and {moved_deg:.2g} deg elsewhere: give one "
            "of the two parts of the set alone, or take the samples again",
            board="from {sample} on the board stands {moved_mm:.2g} mm and {moved_deg:.2g} deg elsewhere: give one of "
            "the two parts of the set alone, or take the samples again",
        ),
        "not_converged": (
            "the fit of the {samples} samples does not converge, so neither the poses nor their intervals hold: add "
            "samples, and check that both streams belong together"
        ),
        "joint_zero": (
            "the zero of J{joint}, or another entry of the arm's table, is wrong: with the joint {offset_deg:+.2f} ± "
            "{half_width_deg:.1g} deg from its recorded angle the residuals are {rms_other_mm:.2g} mm, as given "
            "{rms_given_mm:.3g} mm. Set the joint's zero again and repeat the samples"
        ),
        "few_samples": (
            "samples at only {samples} poses: a wrong one can't be found among so few, and the intervals rest on "
            "little; add poses, ten or more are advised"
        ),
        "too_few_samples": "{samples} samples; {needed} are needed, and ten or more advised",
        "all_samples_equal": by(
            "stream",
            target="the board is seen in the same pose in all samples: check what was recorded",
            flange="the flange has the same pose in all samples: move the arm between them",
        ),
        "no_rotation": (
            "the flange rotates by at most {greatest_turn_deg:.2g} deg, so the camera's position is undetermined: "
            "rotate it by 30 deg or more"
        ),
        "nothing_fits": "no poses of camera and board fit the samples: the two streams don't belong together",
        "rotation_mismatch": (
            "{sample}: flange and board rotate by different angles relative to the other samples, {off_deg:.1f} deg "
            "in the median; {kind}"
        ),
        "other_convention": (
            "the samples fit if {stream} differs: {convention}. Residuals are then {rms_other_mm:.2g} mm and "
            "{rms_other_deg:.2g} deg, as given {rms_given_mm:.3g} mm and {rms_given_deg:.3g} deg. Convert the poses, "
            "or take the other setup"
        ),
        "unexplained_residuals": (
            "the residuals are {rms_mm:.3g} mm and {rms_deg:.2g} deg, and no common convention explains them: check "
            "the order of the samples, the board's size, tool and base of the poses, and clocks (widest_s)"
        ),
        "parallel_axes": (
            "all motions rotate about one direction ({x:.2f}, {y:.2f}, {z:.2f}) within {spread_deg:.2g} deg, so the "
            "translation along it is undetermined: add poses rotated about another axis by 30 deg or more"
        ),
    }
)


@says("grasp_counts")
def _(found: Finding) -> str:
    grasped = say_as(found, "grasped", count=found.objects)
    percent = None if found.probability is None else math.floor(1000 * found.probability) / 10
    success = "" if percent is None else say_as(found, "success", percent=percent)
    error = say_as(found, "error") if found.point_mm is not None else ""
    assumed = say_as(found, "assumed", count=len(found.assumed)) if found.assumed else ""
    left = say_as(found, "left_out") if found.left_out else ""
    sentences = [
        grasped if found.objects else "",
        assumed,
        success,
        error,
        *listed(found.missed),
        left,
        demonstrated(found.demonstrations, found.objects),
    ]
    simulated = say_as(found, "simulated") if found.simulated else ""
    return joined([sentence("finding", finding=joined(sentences)), simulated], " ")


@says("grasp_unlikely")
def _(found: Finding) -> str:
    return say_as(found, p=100 * found.probability, level=100 * found.needed)


@says("grasp_collides")
def _(found: Finding) -> str:
    if found.clearance_mm < 0:
        return say_as(found, "overlap", depth=-found.clearance_mm)
    return say_as(found, "apart")


@says("line_leaves", "line_unproven")
def _(found: Finding) -> str:
    return say_as(found, part=word("vision.part", PARTS, found.part))


@says("way_collides")
def _(found: Finding) -> str:
    if found.clearance_mm < 0:
        return say_as(found, "overlap", part=word("vision.part", PARTS, found.part), depth=-found.clearance_mm)
    return say_as(found, "apart", part=word("vision.part", PARTS, found.part))


@says("rotation_mismatch")
def _(found: Finding) -> str:
    return say_as(found, kind=word("vision.mending", MENDING, found.kind))


@says("other_convention")
def _(found: Finding) -> str:
    stream = word("vision.stream", STREAMS, found.stream)
    return say_as(found, stream=stream, convention=word("vision.convention", CONVENTIONS, found.convention))


@says("parallel_axes")
def _(found: Finding) -> str:
    return say_as(found, x=found.axis[0], y=found.axis[1], z=found.axis[2])


def pose_words(setup: str) -> tuple[str, str]:
    """What the two unknown poses of a setup are, in words."""
    first, second = POSES[setup]
    return word("vision.pose", {"pose": first}, "pose"), word("vision.pose", {"pose": second}, "pose")


def hand_eye_lines(found: HandEye, boardless: Sequence[Finding] = ()) -> str:
    """A calibration as lines of text for a terminal; ``boardless``: images that it leaves out."""
    spread, turned = spread_of(found)
    about = {"roll": "x", "pitch": "y", "yaw": "z"}
    lines = [
        f"{int(found.used.sum())} of {len(found.samples) + len(boardless)} samples used; rotated by up to "
        f"{np.degrees(found.greatest_turn):.0f} deg, about axes up to {np.degrees(found.axes_apart):.0f} deg away from "
        "one direction",
        f"camera's standard deviation per axis {1000 * found.deviations[0]:.3g} mm, "
        f"{np.degrees(found.deviations[1]):.3g} deg "
        + (
            "(estimated)" if found.samples.camera_covariance is None else f"(stated; scatter {found.scatter:.2f} of it)"
        ),
        f"spread of the board's position {1000 * spread:.3g} mm, {np.degrees(turned):.2g} deg (root mean square)",
    ]
    for name, T, half in zip(pose_words(found.samples.setup), (found.X, found.Y), found.half_width.reshape(2, 6)):
        lines.append(f"{name}, with 95 % intervals; rotations are about the parent frame's axes:")
        for axis, value, h in zip("xyz", 1000 * T[:3, 3], 1000 * half[:3]):
            lines.append(f"  {axis:<6}{as_text(value, '>12.3f')} ± {h:.3f} mm")
        for axis, value, h in zip(("roll", "pitch", "yaw"), np.degrees(rpy_of(T)), np.degrees(half[3:])):
            lines.append(f"  {axis:<6}{as_text(value, '>12.4f')} deg; about {about[axis]} ± {h:.4f} deg")
        lines.append("  quaternion (w, x, y, z) " + " ".join(as_text(part, ".6f") for part in quaternion_of(T)))
    if found.touch:
        far = 1000 * np.linalg.norm(found.touch.difference, axis=1).max()
        lines.append(f"touched points: {far:.2g} mm apart at most, probability {found.touch.probability:.2g}")
        lines += [f"warning: {say(each)}" for each in (found.touch.contradiction,) if each]
    lines += [f"sample {say(each)}" for each in found.suspects]
    if found.without_suspects is not None:
        mm, deg = 1000 * found.without_suspects[0], np.degrees(found.without_suspects[1])
        lines.append(f"if included, they would move the camera by {mm:.3g} mm and {deg:.2g} deg")
    lines += [f"warning: {say(each)}" for each in found.warnings]
    return "\n".join(lines)


def hand_eye_record(
    found: HandEye,
    boardless: Sequence[Finding] = (),
    open_tilts: Sequence[Finding] = (),
) -> dict[str, object]:
    """A calibration as plain data, for another program; half widths of 95 % intervals in mm and deg.

    ``boardless``: images that it leaves out; ``open_tilts``: those that leave open which way the board is tilted.
    """

    def named(findings: Sequence[Suspect | Finding]) -> list[dict[str, str]]:
        return [{"code": each.code, "sample": each.sample, "text": say(each)} for each in findings]

    def pose(T: np.ndarray, half: np.ndarray) -> dict[str, object]:
        return {
            "matrix": T.tolist(),
            "xyz_mm": (1000 * T[:3, 3]).tolist(),
            "quaternion_wxyz": quaternion_of(T).tolist(),
            "half_width_mm": (1000 * half[:3]).tolist(),
            "half_width_deg": np.degrees(half[3:]).tolist(),
        }

    return {
        "setup": found.samples.setup,
        "samples": len(found.samples) + len(boardless),
        "used": [name for name, used in zip(found.samples.names, found.used) if used],
        "hand_eye": pose(found.X, found.half_width[:6]),
        "board": pose(found.Y, found.half_width[6:]),
        "scatter": found.scatter,
        "camera_mm": float(1000 * found.deviations[0]),
        "camera_deg": float(np.degrees(found.deviations[1])),
        "suspects": named(found.suspects),
        "left_out": named(boardless),
        "open_tilts": named(open_tilts),
        "warnings": [{"code": each.code, "text": say(each)} for each in found.warnings],
        "touch_probability": found.touch.probability if found.touch else None,
        "touch_contradicts": found.touch is not None and found.touch.contradiction is not None,
    }
