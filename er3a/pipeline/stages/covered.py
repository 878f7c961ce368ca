"""What checks that several stages make do not cover, and what they rest on without a document."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

import numpy as np

from er3a.by_value import frozen
from er3a.collision.along import bodies_of
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import base_contacts
from er3a.collision.pairs import PENETRATION_TOLERANCE, label_of, link_label
from er3a.collision.scene import Scene
from er3a.collision.shapes import COVERED, arm_shapes, depths_in, has_bare_tool, outward
from er3a.errors import DoubtfulUnit
from er3a.files.kept_files import shown_path
from er3a.geometry.transforms import rotation_angle
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.scope import Check, Coverage, Open
from er3a.robots.robot import Robot


@frozen
class Covered:
    """What a check for collisions sees.

    Attributes
    ----------
    asked : of its checks how many bodies of the arm are covered, and of how many
    gaps : why not all
    assumed : what it takes as given
    """

    asked: dict[Check, tuple[int, int]]
    gaps: tuple[Open, ...]
    assumed: tuple[Open, ...]


def covered_collisions(
    robot: Robot, bodies: Bodies, scene: Scene | None, arms: Iterable[tuple[str, Robot]] = ()
) -> Covered:
    """What a check for collisions covers.

    Parameters
    ----------
    robot : that of the bodies, which may be an equal one that looks otherwise
    arms : the robot with each tool that programs set, by the tool's name

    Returns
    -------
    covered : links, the base and the tool count as one body each
    """
    arms = tuple(arms)
    tip = "tool" if robot.tool[:3, 3].any() else "flange"
    shapes, rules = arm_shapes(robot), scene.pair_rules if scene else ()
    by_scene = {frozenset((each.first, each.second)): f"{each.first}/{each.second}" for each in rules}
    bare = dict.fromkeys(name or tip for name, arm in (("", robot), *arms) if has_bare_tool(arm, scene))
    hidden = ((row.first, row.second) for row in bodies.matrix if row.hides)
    allowed = ("/".join(names) for names in hidden if frozenset(names) not in by_scene)
    contacts = base_contacts(robot, scene)
    with_tools = [bodies, *(bodies_of(arm, scene) for _, arm in arms)]
    coarse = tuple(dict.fromkeys(label_of(each) for arm in with_tools for each in arm.coarse))
    shares = tuple(f"{link_label(link)}: {100 * share:.0f} %" for link, share in shapes.partial)
    uncovered = tuple(
        link_label(link) + (f": {1000 * by:.0f} mm" if np.isfinite(by) else "") for link, by in shapes.uncovered
    )
    gaps = (
        Open("uncovered_links", uncovered),
        Open("partial_links", shares, 100 * COVERED if shares else None),
        Open("bare_tool", tuple(bare)),
        Open("allowed_contacts", (*by_scene.values(), *allowed)),
        Open("wrong_shapes", tuple(label_of(pair) for pair in bodies.in_error)),
        Open("coarse_shapes", coarse if shapes.given else ()),
        Open("base_inside", tuple(each.solid for each in contacts if each.inside)),
    )
    assumed = (
        Open("base_contacts", tuple(each.solid for each in contacts if not each.inside)),
        Open("guessed_pairs", () if shapes.given else coarse),
    )
    count = robot.rows + 2
    open_links = {link_label(link) for link, _ in (*shapes.uncovered, *shapes.partial)}
    of_itself = count - len(open_links | set(bare))
    no_scene = () if scene and scene.solids else (Open("no_scene"),)
    return Covered(
        {"self_collision": (of_itself, count), "scene_collision": (0 if no_scene else of_itself, count)},
        (*(each for each in gaps if each.names), *no_scene),
        (*(each for each in assumed if each.names), *(() if scene and scene.carried else (Open("carried"),))),
    )


NAMED_DOUBTS = 20


def covered_units(files: int, doubts: Sequence[DoubtfulUnit]) -> Coverage:
    """Of how many input files all numbers have the unit that their keys say.

    Parameters
    ----------
    files : that were read
    doubts : as they were noted while files were read

    Returns
    -------
    checked : its gap names ``NAMED_DOUBTS`` places at most, and how many more there are
    """
    named = [shown_path(Path(each.file)) if each.file else "" for each in doubts]
    places = [": ".join(filter(None, (file, each.key, each.shown))) for file, each in zip(named, doubts)]
    rest = len(places) - NAMED_DOUBTS
    names = (*places[:NAMED_DOUBTS], *[f"+ {rest}"] * (rest > 0))
    files = max(files, len(set(named)))
    return Coverage("units", files - len(set(named)), files, (Open("units", names),) if places else ())


def assumed_limits(robot: Robot) -> tuple[Open, ...]:
    """That limits of joints are assumed.

    Parameters
    ----------
    robot : whose file grades its limits

    Returns
    -------
    gaps : with what the file says of their source; none for limits of a better grade than inferred
    """
    found = robot.sources.get("limits")
    return (Open("limits_assumed", (found.source,)),) if found and found.grade == "inferred" else ()


OWN_VALUES = ("dh", "zero", "speeds", "coupling", "base", "flange", "tool")


def assumed_values(robot: Robot, replaced: Collection[str]) -> tuple[Open, ...]:
    """Groups of the robot's file, other than limits, that are assumed.

    Parameters
    ----------
    replaced : groups that the study gives values of its own

    Returns
    -------
    assumed : one entry with their names; none if nothing is assumed
    """
    own = {group: robot.sources[group].grade for group in OWN_VALUES if group in robot.sources}
    names = tuple(group for group, grade in own.items() if grade == "inferred" and group not in replaced)
    return (Open("own_values", names),) if names else ()


def gaps_in_solids(scene: Scene | None, places: Iterable[tuple[str, Reals, float]]) -> tuple[Open, ...]:
    """Places of the tool that are inside a solid of the scene, where no check of the arm looks.

    Parameters
    ----------
    places : name, point (3,) in m in the world frame, and how deep it may be sunk, m

    Returns
    -------
    gaps : one entry with place and solid for each; none in open space
    """
    found = [
        f"{name}: {solid.name}"
        for name, point, sunk in places
        for solid in (scene.solids if scene else ())
        if depths_in(solid, point[None])[0] > max(sunk, PENETRATION_TOLERANCE)
    ]
    return (Open("inside_solid", tuple(found)),) if found else ()


def assumed_tool(robot: Robot) -> tuple[Open, ...]:
    """That the flange's centre was taken for a tool's tip, and where it is not the end of the last link.

    Parameters
    ----------
    robot : with the tool that the study gives it

    Returns
    -------
    assumed : none if the file, or the study, gives a tool
    """
    if "tool" in robot.sources or not np.array_equal(robot.tool, np.eye(4)):
        return ()
    beyond = outward(robot)[1]
    return (Open("tool"), *([Open("beyond_flange", (), 1000 * beyond)] if beyond else []))


ORIENTATION_OFF_DEG = 0.1  # of what an arm of few joints can't set; poses with two decimals of deg are off by less


def gaps_of_orientations(robot: Robot, asked: Iterable[tuple[str, Reals, Reals]]) -> tuple[Open, ...]:
    """Targets and paths whose poses the joints keep but for how the tool is turned.

    An arm of few joints sets only part of it.

    Parameters
    ----------
    asked : name, the poses (..., 4, 4) asked for, and joints (..., n), rad or m; rows of NaN do not count

    Returns
    -------
    gaps : one entry with the names, and the largest turn in deg; none below ``ORIENTATION_OFF_DEG``
    """
    angles = {name: np.degrees(rotation_angle(forward(robot, q)[..., :3, :3], T[..., :3, :3])) for name, T, q in asked}
    off = {name: float(np.nanmax(each)) for name, each in angles.items() if np.nanmax(each) > ORIENTATION_OFF_DEG}
    return (Open("tool_turned", tuple(off), max(off.values())),) if off else ()


def assumed_rates(speed_known: Flags, acceleration: bool) -> tuple[Open, ...]:
    """What is assumed of the joints' rates.

    Parameters
    ----------
    speed_known : (n,), whether a document gives the joint's speed
    acceleration : whether accelerations are given

    Returns
    -------
    assumed : speeds with their joints
    """
    joints = tuple(f"J{joint}" for joint in (np.flatnonzero(~speed_known) + 1).tolist())
    speeds = (Open("own_speeds", joints),) if joints else ()
    return (*speeds, *(() if acceleration else (Open("own_accelerations"),)))


def gaps_of_program(robot: Robot, scene: Scene | None) -> tuple[Open, ...]:
    """What is not covered of any motion of a program, so that none passes.

    Parameters
    ----------
    robot : that is to run it
    scene : around it; None: not given

    Returns
    -------
    gaps : for its row in a study, and for ``er3a check-program``
    """
    return (*covered_collisions(robot, bodies_of(robot, scene), scene).gaps, *assumed_limits(robot))
