"""Hand-eye calibrations and grasps: the verdict of the vision stage, its page, and lines for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import er3a.pipeline.messages.collision
import er3a.pipeline.messages.diagnosis
import er3a.pipeline.messages.expectations
import er3a.pipeline.messages.planning  # noqa: F401
from er3a.finding import Finding
from er3a.geometry.transforms import quaternion_of, rpy_of
from er3a.pipeline.language import as_text, words
from er3a.pipeline.messages.say import WORDS, say, says, sentence, texts, word
from er3a.vision.hand_eye import HandEye, spread_of

PARTS = words({"move": "move to the approach", "approach": "approach", "retreat": "retreat"})
MENDING = words(
    {
        "half_turn_x": "board detected turned by 180° about its x axis",
        "half_turn_y": "board detected turned by 180° about its y axis",
        "half_turn_z": "board detected turned by 180°",
        "quarter_turn_z": "the board is detected turned by 90° in its plane",
        "mirrored_tilt": "the board's tilt is mirrored, as of a flat board seen from far or head-on",
        "rotation": "no typical detector error explains it",
    }
)
STREAMS = words(
    {
        "flange": "flange",
        "target": "board",
        "board": "board",
        "camera": "camera",
        "both": "flange and board",
    }
)
CONVENTIONS: dict[str, str] = words(
    {
        "inverted": "its poses are inverted",
        "transposed": "its rotations are transposed",
        "real_part_first": "its quaternions have the real part first",
        "real_part_last": "its quaternions have the real part last",
        "turning_axes": "its angles mean R = Rx(roll) Ry(pitch) Rz(yaw)",
        "abc": "its angles mean R = Rz(roll) Ry(pitch) Rx(yaw)",
        "zyz": "its angles mean R = Rz(roll) Ry(pitch) Rz(yaw)",
        "opengl": "its positions are (x, −y, −z)",
        "to_optical": "its positions are (−y, −z, x)",
        "from_optical": "its positions are (z, −x, −y)",
    }
)
POSES = words(
    {
        "eye_in_hand": ("camera on the flange (T_flange_camera)", "board in the base (T_base_board)"),
        "eye_to_hand": ("camera in the base (T_base_camera)", "board on the flange (T_flange_board)"),
    }
)
KEY_FIGURES = words(
    {
        "samples_used": "samples used",
        "position_half_width": "camera's position, largest half-width (95 %)",
        "rotation_half_width": "camera's rotation, largest half-width (95 %)",
        "objects_grasped": "objects that can be grasped",
        "worst_error": "error at the worst grasp (95 %)",
        "least_success": "least probability of success",
    }
)


TEXTS = texts(
    {
        "calibration_impossible": "No hand-eye pose: {why}.",
        "calibration_doubtful": "The calibration can't be used for grasps: {warnings:; }.",
        "touch_contradicts": (
            "Touched points contradict the calibration: {points}, off by up to {largest_mm:.3g} mm (probability "
            "{probability:.1g})."
        ),
        "not_grasped_object": "{name} ({why})",
        "grasp_out_of_reach": "out of reach: {poses} of {poses} grasps",
        "grasp_near_limits": "best of {solutions} solutions: {margin:.1f} from the joint limits; {needed:g} required",
        "grasp_singular": "all solutions singular: singular value {singular_value:.2g} at best; {needed:g} required",
        "no_transfer": "the straight move to the approach collides, and no other was found: {why}",
        "grasp_counts": (
            "{grasped} of {objects} objects can be grasped.[ Only if undocumented shapes are right: {assumed:, "
            "}.][ Probability of success: at least {probability:at_least %}.][ 95 % of errors below {point_mm:.2g} "
            "mm at the worst grasp.][ Not grasped: {missed:, }.][ Calibrated without {left_out:, }.][ Expected to "
            "fail, and did: {demonstrations:, }.]"
        ),
        "grasp_unlikely": "within the gripper's tolerance with probability {probability:.3g}; {needed:.3g} required",
        "line_leaves": "{part:vision.part} exceeds limits or becomes singular {after_mm:.0f} mm from the grasp",
        "line_unproven": "{part:vision.part}: limits, joint speeds and distance from singularities not proven",
        "grasp_collides": (
            "[{part:vision.part}: ]{pair} [overlap by {depth_mm:.0f} mm][come within {clearance_mm:.1f} mm; "
            "{needed_mm:g} mm required]"
        ),
        "far_from_fit": (
            "{sample}: {off_mm:.3g} mm, {off_deg:.2g}° from the other samples' prediction (probability "
            "{probability:.1g})"
        ),
        "ambiguous_tilt": (
            "{sample}: the mirrored tilt fits with only {ratio:.2g} times the error. Take the image from nearer, or "
            "tilt the board by 30°"
        ),
        "boardless_image": "{sample}: left out; {corners} corners of the board found in {image}",
        "no_majority": (
            "flange and board rotate differently in {pairs} of {of} pairs ({median_deg:.3g}° in the median). "
            "Suspects: the robot's table, samples' order, orientations of a stream"
        ),
        "board_scale": (
            "a board {factor:.4g} ± {half_width:.1g} times as large fits: check the size of its squares, the units, "
            "or the focal length"
        ),
        "focal_length": (
            "a focal length {factor:.4g} ± {half_width:.1g} times as long fits. Check the intrinsics' image size, or "
            "estimate them again, and compute the poses with them"
        ),
        "principal_point": (
            "a principal point off along the camera's {axis} by {percent:+.2g} ± {half_width_percent:.1g} % of the "
            "focal length fits. Estimate the intrinsics again, and compute the poses with them"
        ),
        "little_motion": (
            "samples rotate by at most {greatest_turn_deg:.3g}°, axes within {axes_apart_deg:.2g}° of one "
            "direction. Add poses rotated by 30° or more about a second axis"
        ),
        "more_scatter": (
            "residuals are {scatter:.3g} times the stated standard deviations; chance explains {largest:.2f}: table, "
            "repeatability or camera is worse than stated"
        ),
        "moved_between": (
            "{what:vision.stream} moved by {moved_mm:.2g} mm, {moved_deg:.2g}° before {sample}: give one part of "
            "the set alone, or take the samples again"
        ),
        "not_converged": (
            "the fit of {samples} samples does not converge: add samples, and check that both streams belong together"
        ),
        "joint_zero": (
            "zero of J{joint} (or another entry) off by {offset_deg:+.2f} ± {half_width_deg:.1g}°: residuals "
            "{rms_other_mm:.2g}, as given {rms_given_mm:.3g} mm. Set the zero again and repeat the samples"
        ),
        "few_samples": "{samples} poses are too few to find a wrong one: add poses, ten or more",
        "too_few_samples": "{samples} samples; {needed} needed, ten or more advised",
        "all_samples_equal": "{stream:vision.stream}: same pose in all samples; check the record, move the arm between",
        "no_rotation": (
            "the flange rotates by at most {greatest_turn_deg:.2g}°, so the camera's position stays open: rotate "
            "it by 30° or more"
        ),
        "nothing_fits": "no poses of camera and board fit: the streams don't belong together",
        "rotation_mismatch": (
            "{sample}: rotates unlike the other samples, {off_deg:.1f}° in the median; {kind:vision.mending}"
        ),
        "other_convention": (
            "{stream:vision.stream}: {convention:vision.convention}. Residuals then {rms_other_mm:.2g} mm, "
            "{rms_other_deg:.2g}°; as given {rms_given_mm:.3g} mm, {rms_given_deg:.3g}°. Convert the poses, or "
            "take the other setup"
        ),
        "unexplained_residuals": (
            "residuals {rms_mm:.3g} mm, {rms_deg:.2g}°; no common convention explains them. Check samples' order, "
            "board size, tool, base and clocks (widest_s)"
        ),
        "parallel_axes": (
            "all motions rotate about ({axis:, }) within {spread_deg:.2g}°, so the shift along it stays open. Add "
            "poses rotated about another axis by 30° or more"
        ),
    }
)
WORDS.update(
    {
        "vision.part": PARTS,
        "vision.mending": MENDING,
        "vision.stream": STREAMS,
        "vision.convention": CONVENTIONS,
    }
)


@says("grasp_collides", "way_collides")
def _(found: Finding) -> str:
    depth = -found.clearance_mm
    clearance = {"clearance_mm": None} if depth > 0 else {}
    return sentence("grasp_collides", **{**found.params, "depth_mm": depth if clearance else None, **clearance})


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
        f"{np.degrees(found.greatest_turn):.0f}°, about axes up to {np.degrees(found.axes_apart):.0f}° away from "
        "one direction",
        f"camera's standard deviation per axis {1000 * found.deviations[0]:.3g} mm, "
        f"{np.degrees(found.deviations[1]):.3g}° "
        + (
            "(estimated)" if found.samples.camera_covariance is None else f"(stated; scatter {found.scatter:.2f} of it)"
        ),
        f"spread of the board's position {1000 * spread:.3g} mm, {np.degrees(turned):.2g}° (root mean square)",
    ]
    for name, T, half in zip(pose_words(found.samples.setup), (found.X, found.Y), found.half_width.reshape(2, 6)):
        lines.append(f"{name}, with 95 % intervals; rotations are about the parent frame's axes:")
        for axis, value, h in zip("xyz", 1000 * T[:3, 3], 1000 * half[:3]):
            lines.append(f"  {axis:<6}{as_text(value, '>12.3f')} ± {h:.3f} mm")
        for axis, value, h in zip(("roll", "pitch", "yaw"), np.degrees(rpy_of(T)), np.degrees(half[3:])):
            lines.append(f"  {axis:<6}{as_text(value, '>12.4f')}°; about {about[axis]} ± {h:.4f}°")
        lines.append("  quaternion (w, x, y, z) " + " ".join(as_text(part, ".6f") for part in quaternion_of(T)))
    if found.touch:
        far = 1000 * np.linalg.norm(found.touch.difference, axis=1).max()
        lines.append(f"touched points: {far:.2g} mm apart at most, probability {found.touch.probability:.2g}")
        lines += [f"warning: {say(each)}" for each in (found.touch.contradiction,) if each]
    lines += [f"sample {say(each)}" for each in found.suspects]
    lines += [f"warning: {say(each)}" for each in found.warnings]
    return "\n".join(lines)
