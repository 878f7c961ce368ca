"""What stages did not examine because of settings, inputs and limits."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from er3a.collision.along import bodies_of
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import PairState, base_contacts
from er3a.collision.pairs import PENETRATION_TOLERANCE, link_label
from er3a.collision.scene import Scene
from er3a.collision.shapes import COVERED, arm_shapes, depths_in, has_bare_tool
from er3a.errors import DoubtfulUnit
from er3a.files.kept_files import shown_path
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.results import NEVER_A_PASS, LeftOut, LeftOutSubject
from er3a.robots.robot import Robot

if TYPE_CHECKING:
    from er3a.files.hand_eye_file import SeenImages
    from er3a.vision.calibration_set import CalibrationSet


def left_out_of_collisions(
    robot: Robot,
    bodies: Bodies,
    scene: Scene | None,
    tolerance_mm: float | None = None,
    arms: Iterable[tuple[str, Robot]] = (),
) -> tuple[LeftOut, ...]:
    """What a check for collisions does not see.

    Parameters
    ----------
    robot : that of the bodies, which may be an equal one that looks otherwise
    tolerance_mm : of overlaps that may go unnoticed between points of a motion; None where only points are checked
    arms : the robot with each tool that programs set, by the tool's name
    """

    def pairs(state: PairState) -> tuple[str, ...]:
        return tuple(f"{row.first}/{row.second}" for row in bodies.matrix if row.state == state)

    arms = tuple(arms)
    carries, tip = bool(scene and scene.carried), "tool" if robot.tool[:3, 3].any() else "flange"
    shapes, rules = arm_shapes(robot), scene.pair_rules if scene else ()
    solids = {solid.name for solid in scene.solids} if scene else set()
    by_scene = {frozenset((each.first, each.second)): f"{each.first}/{each.second}" for each in rules}
    bare = dict.fromkeys(name or tip for name, arm in (("", robot), *arms) if has_bare_tool(arm, scene))
    allowed = [name for name in pairs("allowed") if frozenset(name.split("/")) not in by_scene]
    hidden = {f"{row.first}/{row.second}" for row in bodies.matrix if row.hides}
    contacts = base_contacts(robot, scene)
    found: list[tuple[LeftOutSubject, tuple[str, ...]]] = [
        ("base_inside", tuple(each.solid for each in contacts if each.inside)),
        ("base_contacts", tuple(each.solid for each in contacts if not each.inside)),
        ("uncovered_links", tuple(link_label(link) for link in shapes.uncovered)),
        ("allowed_contacts", (*by_scene.values(), *(name for name in allowed if name in hidden))),
        ("bare_tool", tuple(bare)),
        ("bare_links", tuple(link_label(link) for link in shapes.bare if link not in shapes.uncovered)),
        ("unexamined_pairs", tuple(pair.label for pair in bodies.in_error)),
        ("guessed_pairs", guessed_pairs([bodies, *(bodies_of(arm, scene) for _, arm in arms)])),
        ("allowed_pairs", tuple(name for name in allowed if name not in hidden)),
        ("joined_pairs", pairs("joined")),
    ]
    listed = [LeftOut(subject, names) for subject, names in found if names]
    if shapes.partial:
        shares = tuple(f"{link_label(link)}: {100 * share:.0f} %" for link, share in shapes.partial)
        listed.insert(0, LeftOut("partial_links", shares, 100 * COVERED))
    obstacles = [LeftOut("scene_shapes" if solids else "obstacles")]
    carried = [LeftOut("carried_shapes" if carries else "carried")]
    shallow = [] if tolerance_mm is None else [LeftOut("shallow_overlaps", amount=tolerance_mm)]
    return (*obstacles, *carried, *listed, *shallow)


def guessed_pairs(bodies: Iterable[Bodies]) -> tuple[str, ...]:
    """Pairs of links of which guessed shapes show nothing.

    Parameters
    ----------
    bodies : of an arm, or of it with each of its tools

    Returns
    -------
    pairs : as text, each once
    """
    return tuple(dict.fromkeys(pair.label for each in bodies for pair in each.guessed))


NAMED_DOUBTS = 20


def left_out_of_units(doubts: Sequence[DoubtfulUnit]) -> tuple[LeftOut, ...]:
    """Numbers of input files whose unit is in doubt.

    Parameters
    ----------
    doubts : as they were noted while files were read

    Returns
    -------
    left_out : one entry that names ``NAMED_DOUBTS`` places at most, and how many more there are; none without doubts
    """
    files = [shown_path(Path(each.file)) if each.file else "" for each in doubts]
    places = [": ".join(filter(None, (file, each.key, each.shown))) for file, each in zip(files, doubts)]
    rest = len(places) - NAMED_DOUBTS
    names = (*places[:NAMED_DOUBTS], *([f"+ {rest}"] if rest > 0 else []))
    return (LeftOut("units", names),) if places else ()


def left_out_of_limits(robot: Robot) -> tuple[LeftOut, ...]:
    """That limits of joints are assumed.

    Parameters
    ----------
    robot : whose file grades its limits

    Returns
    -------
    left_out : with what the file says of their source; none for limits of a better grade than inferred
    """
    found = robot.sources.get("limits")
    return (LeftOut("own_limits", (found.source,)),) if found and found.grade == "inferred" else ()


OWN_VALUES = ("dh", "zero", "speeds", "coupling", "base", "flange", "tool")


def left_out_of_values(robot: Robot, replaced: Collection[str]) -> tuple[LeftOut, ...]:
    """Groups of the robot's file, other than limits, that are assumed.

    Parameters
    ----------
    replaced : groups that the study gives values of its own

    Returns
    -------
    left_out : one entry with their names; none if nothing is assumed
    """
    assumed = [group for group in OWN_VALUES if group in robot.sources and robot.sources[group].grade == "inferred"]
    names = tuple(group for group in assumed if group not in replaced)
    return (LeftOut("own_values", names),) if names else ()


def left_out_in_solids(scene: Scene | None, places: Iterable[tuple[str, Reals, float]]) -> tuple[LeftOut, ...]:
    """Places of the tool that are inside a solid of the scene, where no check of the arm looks.

    Parameters
    ----------
    places : name, point (3,) in m in the world frame, and how deep it may be sunk, m

    Returns
    -------
    left_out : one entry with place and solid for each; none in open space
    """
    found = [
        f"{name}: {solid.name}"
        for name, point, sunk in places
        for solid in (scene.solids if scene else ())
        if depths_in(solid, point[None])[0] > max(sunk, PENETRATION_TOLERANCE)
    ]
    return (LeftOut("places_in_solids", tuple(found)),) if found else ()


def left_out_without_tool(robot: Robot) -> tuple[LeftOut, ...]:
    """That the flange's centre was taken for a tool's tip.

    Parameters
    ----------
    robot : with the tool that the study gives it

    Returns
    -------
    left_out : none if the file, or the study, gives a tool
    """
    return () if "tool" in robot.sources or not np.array_equal(robot.tool, np.eye(4)) else (LeftOut("tool"),)


ORIENTATION_OFF_DEG = 0.1  # of what an arm of few joints can't set; poses with two decimals of deg are off by less


def left_out_of_orientations(robot: Robot, asked: Iterable[tuple[str, Reals, Reals]]) -> tuple[LeftOut, ...]:
    """Targets and paths whose poses the joints keep but for how the tool is turned.

    An arm of few joints sets only part of it.

    Parameters
    ----------
    asked : name, the poses (..., 4, 4) asked for, and joints (..., n), rad or m; rows of NaN do not count

    Returns
    -------
    left_out : one entry with the names, and the largest turn in deg; none below ``ORIENTATION_OFF_DEG``
    """
    angles = {name: np.degrees(rotation_angle(forward(robot, q)[..., :3, :3], T[..., :3, :3])) for name, T, q in asked}
    off = {name: float(np.nanmax(each)) for name, each in angles.items() if np.nanmax(each) > ORIENTATION_OFF_DEG}
    return (LeftOut("orientations", tuple(off), amount=max(off.values())),) if off else ()


def left_out_of_rates(speed_known: Flags, acceleration: bool, jerk: bool) -> tuple[LeftOut, ...]:
    """What is not known of the joints' rates.

    Parameters
    ----------
    speed_known : (n,), whether a document gives the joint's speed
    acceleration : whether accelerations are given
    jerk : whether jerk is bounded

    Returns
    -------
    left_out : one entry for each that is missing, speeds with their joints
    """
    assumed = tuple(f"J{joint}" for joint in (np.flatnonzero(~speed_known) + 1).tolist())
    speeds = (LeftOut("own_speeds", assumed),) if assumed else ()
    accelerations = () if acceleration else (LeftOut("own_accelerations"),)
    return (*speeds, *accelerations, *(() if jerk else (LeftOut("jerk"),)))


def missed_of_program(robot: Robot, scene: Scene | None, arms: Iterable[tuple[str, Robot]] = ()) -> tuple[LeftOut, ...]:
    """What is not examined of any motion of a program, so that none passes.

    Parameters
    ----------
    arms : the tools that the program sets, each as the robot with that tool

    Returns
    -------
    left_out : for its row in a study, and for ``er3a check-program``
    """
    found = left_out_of_collisions(robot, bodies_of(robot, scene), scene, arms=arms)
    return (*(each for each in found if each.subject in NEVER_A_PASS), *left_out_of_limits(robot))


def left_out_of_intrinsics(
    samples: CalibrationSet, images: SeenImages | None, simulated: bool, touched: bool
) -> tuple[LeftOutSubject, ...]:
    """What a calibration leaves open of the camera's intrinsics; those of poses given as numbers are known to nobody.

    ``touched``: whether touched points agree with it. They show where a fixed camera is; of a camera on the flange they
    show where the board is, and a wrong focal length may leave that as it is.
    """
    if images is not None:
        return ("given_intrinsics",) if images.views.shared is None else ()
    confirmed = simulated or (samples.setup == "eye_to_hand" and touched)
    return ("pose_intrinsics",) if confirmed else ("open_intrinsics",)
