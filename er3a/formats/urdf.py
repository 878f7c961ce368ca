"""URDF in and out, SRDF out: serial chains of revolute and prismatic joints.

Reference: the ROS URDF specification (joint origin, axis, limit, mimic; rpy is fixed-axis roll-pitch-yaw, the same
matrix as R = Rz(yaw) Ry(pitch) Rx(roll)).

MoveIt reads an SRDF beside the URDF: the arm's planning group, and the pairs of links not to check [1]_.

References
----------
.. [1] I. Sucan, S. Chitta and others, "Semantic Robot Description Format (SRDF)", ROS documentation.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.collision.matrix import collision_matrix
from er3a.collision.meshes import simplified
from er3a.collision.pairs import link_label
from er3a.collision.shapes import arm_shapes
from er3a.comparison.axis_table import table_from_axes
from er3a.errors import Er3aError, InputError
from er3a.formats import urdf_tree
from er3a.formats.mesh_file import link_mesh
from er3a.formats.placeholders import without_placeholders
from er3a.geometry.transforms import rot_z, rpy_of
from er3a.kinematics.chain import constant_links
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.robot import MAX_JOINTS, ConvexPiece, Envelope, LinkMesh, Robot, Source, robot_name

MISFIT_POSES = 1000
NO_RANGE = math.pi
NO_SLIDE_M, MAX_SLID_M = 1.0, 100.0
MANY_TURNS = 4 * math.pi + 0.01
FOLLOWS = 1e-6  # rad or m
DRAWN_TRIANGLES = 4000  # of an arm: what a page paints at each step of a motion
REPEATS = 3e-5  # of its reach, to which an arm comes back: 0.03 mm of 1 m; less is no other arm
MARKER_M = 2e-3  # across; a PR2 has cubes of 1 mm where frames are, a Magician one of 0.1 mm
FASTEST = 100.0  # rad/s or m/s; what URDFs give above stands for a speed that no one knows


@frozen
class UrdfImport(ByValue, Displayed):
    """A robot derived from a URDF.

    Attributes
    ----------
    notes : what was assumed or changed on the way, in words
    misfit_m : largest distance between the table's flange and the URDF's over random joint values, m
    joints : names in the URDF of the joints in q; base, tip : its links at the ends of the chain
    """

    robot: Robot
    notes: tuple[str, ...]
    misfit_m: float
    joints: tuple[str, ...] = ()
    base: str = ""
    tip: str = ""

    def sheet(self) -> Sheet:
        """The robot, how well it fits, and the notes."""
        fits = f"within {shortly(1000 * self.misfit_m)} mm of the URDF"
        return replace(self.robot.sheet(), facts=(fits, *self.robot.sheet().facts, *self.notes))


def import_urdf(
    path: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
    snap: bool = True,
    xacro: Sequence[str] = (),
    srdf: str | Path | None = None,
) -> UrdfImport:
    """Import a URDF: D-H table, directions, offsets, limits and speeds from its axes; shapes, visual meshes and masses.
    Links none of whose collision shapes can be read are checked as they look, and so are those that look larger than
    what can be read.

    The flange is the tip: the link that ``tip`` names, otherwise the end of the fixed joints after the last joint, or
    that joint's own link if they branch. Loads, cameras and tools are mounted there.

    Wrong limits, speeds, shapes and inertias are corrected or left out, with a note that names joint or link and the
    value. Joints in the chain that follow others (mimic) become a coupling; their own limits and speeds hold the joints
    that they follow. Grippers, and linkages that only follow, are left out with a note.

    Parameters
    ----------
    path : a URDF or xacro
    base, tip : links at which the arm begins and ends; None if the file has only one arm
    snap : take angles that the file shows rounded (1.571, 0.785) as the multiples of 45 deg that they stand for; one
        note says how many, and by how much that moves the flange
    xacro : arguments of a xacro file, ``NAME:=VALUE``
    srdf : from which home is taken, see :func:`er3a.formats.urdf_tree.srdf_home`; a note says if it gives none

    Raises
    ------
    InputError
        if the file is not a URDF, has several arms (candidates are named), or no arm of 1 to 10 joints
    """
    with urdf_tree.plain_urdf(Path(path), xacro) as plain:
        found = _imported(plain, base, tip, snap)
    if srdf is None:
        return found
    home = urdf_tree.srdf_home(Path(srdf), found.robot, found.joints)
    lacking = [f"{Path(srdf).name} has no regular state of all joints: home is chosen"] * (home is None)
    return replace(found, robot=found.robot.replace(home=home), notes=(*found.notes, *lacking))


def _imported(path: Path, base: str | None, tip: str | None, snap: bool) -> UrdfImport:
    found = urdf_tree.read_chain(path, base, tip, snap)
    robot, sources, coupling, shift, notes = _robot_of_chain(path, found)
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (MISFIT_POSES, len(sources)))
    values = q @ coupling.T + shift
    misfit = np.linalg.norm((forward(robot, q) - _chain_forward(found.joints, values))[:, :3, 3], axis=1).max()
    root, placed = urdf_tree.urdf_root(path), link_places(found, shift)
    shapes, shaped, lost = link_shapes(path, root, robot, placed, _hanging(found))
    visuals, unseen = link_visuals(path, root, robot, placed, lost)
    unread = {at[1] for name in lost if (at := placed(name, False))}
    larger = arm_shapes(robot.replace(**shapes, visuals=visuals)).uncovered if unread else ()
    have = {shape.link for own in shapes.values() for shape in own} - unread.intersection(dict(larger))
    seen = tuple(each for each in visuals if each.link not in have and not _is_marker(each))
    shapes["meshes"] += seen
    # A link that reaches out of all shapes, and has none, is named by every verdict: the others' are the file's.
    guessed = bool(seen) or not all((at := placed(name, False)) and at[1] in dict(larger) for name in lost)
    lost += tuple(link_label(each.link) for each in seen)
    names = tuple(joint.name for joint in sources)
    moving = [joint.name for joint in found.joints if joint.moves]
    masses, weighed, changed = urdf_tree.masses_from_urdf(root, robot, placed, moving, names)
    robot, empty = without_placeholders(robot.replace(**shapes, visuals=visuals, masses=masses))
    stated = {
        "envelopes": any(shapes.values()),
        "inertia": robot.masses.links,
        "drives": robot.masses.drives,
    }
    but = dict[str, str]()
    if lost:
        but["envelopes"] = f", but for shapes of {', '.join(lost)}, which are left out or as the links look"
    if changed:
        which = f"{len(changed)} links" if len(changed) > 1 else f"link {changed[0]}"
        but["inertia"] = f", but for the inertia of {which}, for which the nearest possible one was taken"
    more = {
        group: Source(
            f"As {path.name} states it{but.get(group, '')}",
            "inferred" if guessed and group == "envelopes" else "export",
        )
        for group, there in stated.items()
        if there
    }
    robot = robot.replace(sources={**robot.sources, **more})
    rounded = _unrounded(urdf_tree.read_chain(path, base, tip, False).joints, found.joints, values) if snap else ()
    of_masses = weighed if robot.masses.links else ()  # nothing was made of masses that are no data
    said = (*empty, *rounded, *found.notes, *notes, *shaped, *unseen, *of_masses)
    return UrdfImport(robot, said, float(misfit), names, found.joints[0].parent, found.joints[-1].child)


UrdfGroup = Literal["envelopes", "inertia", "drives"]


def urdf_table(
    path: str | Path, *, base: str | None = None, tip: str | None = None
) -> tuple[Robot, tuple[str, ...], frozenset[UrdfGroup]]:
    """D-H table, limits and speeds alone of a URDF; no meshes are read.

    Parameters and errors are those of :func:`import_urdf`.

    Returns
    -------
    robot : a standard table, without shapes and masses
    notes : what was assumed or changed on the way, in words
    groups : of which the URDF states anything, too: envelopes if a link has a collision shape, inertia if one has a
        body; drives if a moving joint has friction, damping or an effort
    """
    path = Path(path)
    chain, root = urdf_tree.read_chain(path, base, tip, False), urdf_tree.urdf_root(path)
    robot, *_, notes = _robot_of_chain(path, chain)
    there: dict[UrdfGroup, object] = {
        "envelopes": root.find("link/collision"),
        "inertia": root.find("link/inertial"),
        "drives": urdf_tree.drives_of(root, [joint.name for joint in chain.joints if joint.moves]),
    }
    return robot, (*chain.notes, *notes), frozenset(group for group, found in there.items() if found is not None)


def _robot_of_chain(
    path: Path, found: urdf_tree.UrdfChain
) -> tuple[Robot, list[urdf_tree.UrdfJoint], Reals, Reals, list[str]]:
    """The robot without shapes and masses, its joints, what they move (m, n) and its constant (m,), notes on limits."""
    moving = [joint for joint in found.joints if joint.moves]
    if not 1 <= len(moving) <= MAX_JOINTS:
        ends = f"from {found.joints[0].parent} to {found.joints[-1].child}" if found.joints else "of no joints"
        problem = f"the chain {ends} has {len(moving)} moving joints"
        raise InputError(path, "joint", problem, f"er3a reads 1 to {MAX_JOINTS} in series; name --base and --tip")
    sources, coupling, shift = _coupling(path, found, moving)
    directions, points, T = _axes_at_zero(found.joints, shift)
    sliding = np.array([joint.type == "prismatic" for joint in moving])
    table = table_from_axes(directions, points, T)
    plain = np.array_equal(coupling, np.eye(*coupling.shape))
    limits, said, assumed = _limits(sources)
    speed = np.array([joint.speed for joint in sources])
    unknown = ~((speed > 0) & (speed < FASTEST))
    said += [
        (
            f"has a speed of {speed[k]:g} {'m/s' if sources[k].type == 'prismatic' else 'rad/s'}, which counts as "
            "unknown; a URDF's are in radians and metres",
            sources[k].name,
        )
        for k in np.flatnonzero(unknown & np.isfinite(speed) & (speed != 0))
    ]
    speed[unknown] = math.nan
    held, speed, more = _held_by_followers(moving, coupling, shift, limits, speed)
    continuous = np.array([joint.type == "continuous" for joint in sources]) & (held == limits).all(axis=1)
    groups = ("dh", "zero", "limits", "speeds", "base", "flange", *(() if plain else ("coupling",)))
    stated = dict.fromkeys(groups, Source(f"Derived from the joint axes of {path.name}", "export"))
    if doubtful := [joint.name for joint in found.joints if joint.doubtful]:
        text = f"Derived from the joint axes of {path.name}; places of {', '.join(doubtful)} may be in other units"
        stated |= dict.fromkeys(("dh", "zero", "base", "flange"), Source(text, "inferred"))
    if assumed:
        stated["limits"] = Source(
            f"As {path.name} states them, but for {', '.join(assumed)}: assumed or in doubt", "inferred"
        )
    robot = Robot(
        name=robot_name(path),
        title=path.stem[:200] or sources[0].name,
        convention="standard",
        lower=held[:, 0],
        upper=held[:, 1],
        speed=speed,
        zero_pose="As the URDF has it with all joints at 0.",
        sources=stated,
        sliding=sliding,
        coupling=None if plain else coupling,
        continuous=continuous,
        **vars(table),
    )
    return robot, sources, coupling, shift, [*urdf_tree.by_note(said), *more]


def link_places(found: urdf_tree.UrdfChain, shift: Reals) -> urdf_tree.LinkPlaces:
    """Where links stand that move with the chain, all joints of the robot at 0.

    Parameters
    ----------
    shift : (m,), rad or m, the values of the chain's moving joints at which the robot's joints are 0

    Returns
    -------
    place : of a link's name its frame (4, 4) in that of the chain's base and the number of moving joints before it;
        None for a link that does not move with the chain. What moves by itself on the last link, such as fingers,
        counts as fixed where it is at 0; with ``carried`` all that hangs on a link that moves
    """
    above = {joint.child: joint for joint in found.all.values()}
    name = found.joints[0].parent
    place = {name: (np.eye(4), 0)}
    while (below := above.get(name)) and not below.moves:  # what the base is fixed on
        place[below.parent] = place[name][0] @ np.linalg.inv(below.T_parent_joint), 0
        name = below.parent
    for joint, _, T in _along(found.joints, shift[None]):
        place[joint.child] = T[0], place[joint.parent][1] + joint.moves
    last, led = len(shift), {joint.name for joint in found.joints if joint.moves}
    while more := {each.name for each in above.values() if each.mimic and each.mimic.source in led} - led:
        led |= more

    def placed(name: str, carried: bool) -> tuple[Reals, int] | None:
        behind, kept, led_on = np.eye(4), False, False
        while name not in place and name in above:
            kept, led_on = kept or above[name].moves, led_on or above[name].name in led
            behind, name = above[name].T_parent_joint @ behind, above[name].parent
        if name not in place or (kept and not (place[name][1] if carried else place[name][1] == last and not led_on)):
            return None
        return place[name][0] @ behind, place[name][1]

    return placed


def _hanging(found: urdf_tree.UrdfChain) -> set[str]:
    """The links of the chain, and all that hang on them, such as levers and fingers."""
    links, joints = {found.joints[0].parent}, found.all.values()
    while more := {joint.child for joint in joints if joint.parent in links} - links:
        links |= more
    return links


def link_shapes(
    path: Path, root: ElementTree.Element, robot: Robot, placed: urdf_tree.LinkPlaces, hanging: Collection[str]
) -> tuple[dict[str, Any], tuple[str, ...], tuple[str, ...]]:
    """The collision geometry of a URDF, in the frames of the links of the robot made from it.

    Parameters
    ----------
    path : of the URDF, from which meshes are looked for
    robot : made from the URDF, without shapes
    placed : where the links are with all joints of the robot at 0
    hanging : links on the chain, whose shapes count as lost if they move by themselves

    Returns
    -------
    fields : ``envelopes``, ``hulls`` and ``meshes`` of :class:`Robot`, in m
    notes : what was left out or changed, in words: one for shapes that could not be read, one for links off the chain
    lost : links of which a shape could not be read, or is not moved with the arm
    """
    shapes, unread, astray = list[urdf_tree.Shape](), dict[str, str](), list[str]()
    for name, collisions, place in urdf_tree.in_links(root, robot, placed, "collision"):
        if place is None:
            astray.append(name)
            continue
        made = list[urdf_tree.Shape | urdf_tree.CylinderOfLink]()
        for collision in collisions:
            try:
                made.append(urdf_tree.collision_shape(path, name, collision, place))
            except Er3aError as error:
                unread.setdefault(name, _said(path, error))
        shapes += [each for each in urdf_tree.with_capsules(made) if not _is_marker(each)]
    shapes.sort(key=lambda each: each.link)
    surfaces: dict[int, list[Reals]] = {}
    for shape in shapes:
        if isinstance(shape, LinkMesh):
            surfaces.setdefault(shape.link, []).append(shape.points[shape.faces])
    fields = {
        "envelopes": tuple(shape for shape in shapes if isinstance(shape, Envelope)),
        "hulls": tuple(shape for shape in shapes if isinstance(shape, ConvexPiece)),
        "meshes": tuple(link_mesh(number, np.concatenate(parts)) for number, parts in surfaces.items()),
    }
    left_out = f"shapes of {', '.join(unread)} are left out"
    notes = [f"{left_out} ({why}); such links count as they look, if they are drawn" for why in unread.values()][:1]
    if astray:
        notes.append(f"shapes of {urdf_tree.some(astray)} are left out: they do not move with the arm's chain")
    return fields, tuple(notes), (*unread, *(name for name in astray if name in hanging))


def _is_marker(shape: urdf_tree.Shape) -> bool:
    """Whether a shape is as small as what marks a frame, and is no body."""
    return not isinstance(shape, Envelope) and float(np.ptp(shape.points, axis=0).max()) < MARKER_M


def _said(path: Path, error: Er3aError) -> str:
    """An error about a URDF; without the file's name, as that of expanded xacro is gone by now."""
    if isinstance(error, InputError) and error.file == str(path):
        return f"{error.field}: {error.problem}. {error.remedy}"
    return str(error)


def link_visuals(
    path: Path,
    root: ElementTree.Element,
    robot: Robot,
    placed: urdf_tree.LinkPlaces,
    lost: Collection[str] = (),
) -> tuple[tuple[LinkMesh, ...], tuple[str, ...]]:
    """The visual geometry of a URDF, for pictures, in the frames of the links of the robot made from it.

    Parameters
    ----------
    path : of the URDF, from which meshes are looked for
    placed : where the links are with all joints of the robot at 0
    lost : links of which a note says already that something can't be read

    Returns
    -------
    surfaces : one for each link that has any, m, simplified to ``DRAWN_TRIANGLES`` in all
    notes : one at most, about geometry that could not be read
    """
    parts: dict[int, list[Reals]] = {}
    missing = dict[str, str]()
    for name, visuals, place in urdf_tree.in_links(root, robot, placed, "visual"):
        if place is None:
            continue
        T, number = place
        for visual in visuals:
            try:
                points, faces = urdf_tree.visual_surface(path, name, visual)
            except Er3aError as error:
                if name not in lost:
                    missing.setdefault(name, _said(path, error))
                continue
            parts.setdefault(number, []).append((points @ T[:3, :3].T + T[:3, 3])[faces])
    found = []
    for number, meshes in sorted(parts.items()):
        whole = link_mesh(number, np.concatenate(meshes))
        points, faces = simplified(whole.points, whole.faces, DRAWN_TRIANGLES // len(parts))
        found.append(link_mesh(number, points[faces]))
    unseen = f"pictures show no visual geometry of {urdf_tree.some([*missing])}"
    return tuple(found), tuple(f"{unseen}: {why}" for why in missing.values())[:1]


def _coupling(
    path: Path, found: urdf_tree.UrdfChain, moving: list[urdf_tree.UrdfJoint]
) -> tuple[list[urdf_tree.UrdfJoint], Reals, Reals]:
    """The independent joints behind the chain's, what each of the chain's is made of (m, n), and its constant (m,)."""
    sources: list[urdf_tree.UrdfJoint] = []
    rows = []
    for joint in moving:
        factor, offset, seen = 1.0, 0.0, {joint.name}
        while joint.mimic is not None:
            follows = found.all.get(joint.mimic.source)
            if follows is None or follows.name in seen or not follows.moves:
                problem = f"follows '{joint.mimic.source}', which is not an independent joint"
                raise InputError(path, f"joint {joint.name}", problem, "Correct its <mimic>")
            factor, offset = factor * joint.mimic.multiplier, offset + factor * joint.mimic.offset
            joint = follows
            seen.add(joint.name)
        if joint not in sources:
            sources.append(joint)
        rows.append((sources.index(joint), factor, offset))
    coupling = np.zeros((len(rows), len(sources)))
    for row, (column, factor, _) in zip(coupling, rows):
        row[column] = factor
    return sources, coupling, np.array([offset for _, _, offset in rows])


def _axes_at_zero(joints: Sequence[urdf_tree.UrdfJoint], shift: Reals) -> tuple[Reals, Reals, Reals]:
    """Directions and points (m, 3) of the moving axes and the flange (4, 4) with all independent joints at 0."""
    walk = list(_along(joints, shift[None]))
    moving = [(joint, before[0]) for joint, before, _ in walk if joint.moves]
    directions = np.array([T[:3, :3] @ joint.axis for joint, T in moving])
    return directions, np.array([T[:3, 3] for _, T in moving]), walk[-1][2][0]


def _along(joints: Sequence[urdf_tree.UrdfJoint], values: Reals) -> Iterator[tuple[urdf_tree.UrdfJoint, Reals, Reals]]:
    """Each joint with its frame (N, 4, 4) in the base before and after it moves, for values (N, m) of moving joints."""
    T, moved = np.tile(np.eye(4), (len(values), 1, 1)), 0
    for joint in joints:
        before = T = T @ joint.T_parent_joint
        if joint.moves:
            T, moved = before @ _motion(joint, values[:, moved]), moved + 1
        yield joint, before, T


def _motion(joint: urdf_tree.UrdfJoint, values: Reals) -> Reals:
    """A joint's motions (N, 4, 4) by values (N,), rad or m."""
    T = np.tile(np.eye(4), (len(values), 1, 1))
    if joint.type == "prismatic":
        T[:, :3, 3] = values[:, None] * joint.axis
    else:
        T[:, :3, :3] = scipy.spatial.transform.Rotation.from_rotvec(values[:, None] * joint.axis).as_matrix()
    return T


def _limits(sources: list[urdf_tree.UrdfJoint]) -> tuple[Reals, list[tuple[str, str]], list[str]]:
    """Limits (n, 2), rad or m, notes with their joints, and the joints that the file gives none, none that can be, or
    some that may be in degrees."""
    rows, said, assumed = [], [], []
    for joint in sources:
        lower, upper, turns = joint.lower, joint.upper, joint.type == "revolute"
        widest, shown = max(abs(lower), abs(upper)), f"limits of {lower:g} to {upper:g}"
        if joint.type == "continuous":
            said.append(("is continuous: one turn is sampled", joint.name))
            lower, upper = -math.pi, math.pi
        elif not widest <= (urdf_tree.MAX_TURNED if turns else MAX_SLID_M):
            none = "no limits" if math.isnan(lower) else f"{shown}, which no joint has"
            half, assumed_as = (NO_RANGE, "180 deg") if turns else (NO_SLIDE_M, f"{NO_SLIDE_M * 1000:g} mm")
            said.append((f"has {none}: +-{assumed_as} were assumed", joint.name))
            assumed.append(joint.name)
            lower, upper = -half, half
        elif turns and widest > MANY_TURNS:
            said.append((f"has {shown} rad, more than two turns; a URDF's are in radians", joint.name))
            assumed.append(joint.name)
        rows.append((lower, upper))
    return np.array(rows), said, assumed


def _held_by_followers(
    moving: Sequence[urdf_tree.UrdfJoint], coupling: Reals, shift: Reals, limits: Reals, speed: Reals
) -> tuple[Reals, Reals, list[str]]:
    """Limits (n, 2) and speeds (n,) of joints with which those that follow them keep their own, too, and notes."""
    limits, speed, notes = limits.copy(), speed.copy(), []
    for joint, row, offset in zip(moving, coupling, shift.tolist()):
        leader, factor = int(np.abs(row).argmax()), float(row[np.abs(row).argmax()])
        if joint.mimic is None or factor == 0:
            continue
        before = (*limits[leader].tolist(), float(speed[leader]))
        least, most = np.sort((np.array([joint.lower, joint.upper]) - offset) / factor)
        if joint.type == "revolute" and math.isclose(joint.upper - joint.lower, 2 * NO_RANGE, rel_tol=1e-3):
            least, most = -math.inf, math.inf  # the one turn that files give a joint without stops
        lower, upper = float(np.fmax(before[0], least)), float(np.fmin(before[1], most))
        limits[leader] = (lower, upper) if lower < upper else before[:2]
        if 0 < joint.speed < FASTEST:
            speed[leader] = np.fmin(speed[leader], joint.speed / abs(factor))
        after = (*limits[leader].tolist(), float(speed[leader]))
        if not (lower < upper and np.allclose(before, after, FOLLOWS, FOLLOWS, equal_nan=True)):
            held = f"which is held to {after[0]:g} to {after[1]:g}, and to {after[2]:g} per second"
            notes.append(f"joint {joint.name} follows {joint.mimic.source}, {held}")
    return limits, speed, notes


def export_urdf(robot: Robot, meshes: str | Path | None = None) -> str:
    """The arm as URDF text: joints with limits, speeds, peak torques and friction, links with masses and shapes.

    After the last joint's link come links named ``flange`` and ``tool`` with the robot's frames. Unknown speeds and
    peak torques are written as 0, as URDFs usually do. A URDF has no place for rotors, gear ratios, rated torques,
    limits on sums of joints and the wrist's load limits.

    Parameters
    ----------
    meshes : folder for the convex pieces and visual meshes of the links, one OBJ file each; the URDF refers to them by
        the folder's name, as if the folder were beside it. None leaves them out

    Raises
    ------
    Er3aError
        for an arm with a row that is moved by a sum of joints, which URDF can't express
    """
    links, rows = constant_links(robot.without_tool()), robot.rows
    moved_by = _moved_by(robot)
    root = ElementTree.Element("robot", name=robot.name)
    names = ["base", *(f"link_{k + 1}" for k in range(rows)), "flange", "tool"]
    for name in names:
        ElementTree.SubElement(root, "link", name=name)
    steps = [links[k] @ rot_z(0.0 if robot.sliding[k] else robot.offset[k]) for k in range(rows)]
    for k, T in enumerate([*steps, links[rows], robot.tool]):
        joint = ElementTree.SubElement(root, "joint", name=f"joint_{k + 1}" if k < rows else f"{names[k + 1]}_joint")
        ElementTree.SubElement(joint, "parent", link=names[k])
        ElementTree.SubElement(joint, "child", link=names[k + 1])
        ElementTree.SubElement(joint, "origin", xyz=_words(T[:3, 3]), rpy=_words(rpy_of(T)))
        joint.set("type", "fixed")
        if k < rows:
            _describe(robot, k, moved_by, joint)
    urdf_tree.write_masses(robot, names, root)
    urdf_tree.write_shapes(robot, names, root, None if meshes is None else Path(meshes))
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _moved_by(robot: Robot) -> list[tuple[int, float]]:
    """The joint that moves each row, and how far per unit."""
    if robot.coupling is None:
        return [(k, 1.0) for k in range(robot.rows)]
    found = []
    for k, row in enumerate(robot.coupling):
        joints = np.flatnonzero(row)
        if len(joints) != 1:
            raise Er3aError(f"{robot.name}: row {k + 1} is moved by {len(joints)} joints, which a URDF can't say")
        found.append((int(joints[0]), float(row[joints[0]])))
    if missing := [j for j in range(robot.joints) if (j, 1.0) not in found]:
        raise Er3aError(f"{robot.name}: no row moves by joint {missing[0] + 1} alone, which a URDF needs")
    return found


def _describe(robot: Robot, k: int, moved_by: list[tuple[int, float]], joint: ElementTree.Element) -> None:
    """Type, axis, limits and whom it follows, of one joint."""
    j, factor = moved_by[k]
    endless = bool(robot.continuous[j])
    kind = "prismatic" if robot.sliding[k] else "continuous" if endless else "revolute"
    joint.set("type", kind)
    ElementTree.SubElement(joint, "axis", xyz=f"0 0 {robot.direction[k]:g}")
    speed = 0.0 if math.isnan(robot.speed[j]) else abs(factor) * robot.speed[j]
    lower, upper = sorted((factor * robot.lower[j], factor * robot.upper[j]))
    limits = {} if endless else {"lower": lower, "upper": upper}
    driver = moved_by.index((j, 1.0))
    own = _of_drive(robot, j) if driver == k else {}
    limits |= {"velocity": speed, "effort": own.pop("effort", 0.0)}
    ElementTree.SubElement(joint, "limit", {key: repr(float(value)) for key, value in limits.items()})
    if driver != k:
        ElementTree.SubElement(joint, "mimic", joint=f"joint_{driver + 1}", multiplier=repr(factor), offset="0.0")
    elif own:
        ElementTree.SubElement(joint, "dynamics", {key: repr(value) for key, value in own.items()})


def _of_drive(robot: Robot, j: int) -> dict[str, float]:
    """Peak torque, viscous and Coulomb's friction of a joint (N m and rad, or N and m), as far as they are known."""
    drives = robot.masses.drives
    if drives is None:
        return {}
    values = {"effort": drives.peak[j], "damping": drives.viscous[j], "friction": drives.coulomb[j]}
    return {key: float(value) for key, value in values.items() if not np.isnan(value)}


def _chain_forward(joints: Sequence[urdf_tree.UrdfJoint], values: Reals) -> Reals:
    """The flange (N, 4, 4) by the URDF's own transforms, for values (N, m) of the moving joints in rad or m."""
    return [T for _, _, T in _along(joints, values)][-1]


def _unrounded(
    written: Sequence[urdf_tree.UrdfJoint], taken: Sequence[urdf_tree.UrdfJoint], values: Reals
) -> tuple[str, ...]:
    """A note on angles that were taken as multiples of 45 deg, if it moves the flange; ``values`` (N, m) of the moving
    joints, at which it is compared."""
    before, after = (_chain_forward(each, values)[:, :3, 3] for each in (written, taken))
    moved, reach = (float(np.linalg.norm(each, axis=1).max()) for each in (before - after, before))
    if moved <= REPEATS * reach:
        return ()
    return (f"rounded angles were taken as multiples of 45 deg: that moves the flange by up to {1000 * moved:.2g} mm",)


def _words(values: Reals) -> str:
    return " ".join(repr(float(value)) for value in values)


REASONS = {"never": "Never", "joined": "Adjacent", "allowed": "User", "overlaps": "Default", "coarse": "Default"}


def export_srdf(robot: Robot) -> str:
    """The arm's SRDF, for the URDF of :func:`er3a.formats.urdf.export_urdf`.

    Pairs of links that are disabled: those that are proven apart in all joint vectors within the limits (Never),
    that a joint joins (Adjacent), that the robot's file allows to touch (User), and whose shapes overlap in every
    joint vector (Default), which is an error of the shapes: a comment names them. A comment says on what shapes the
    pairs rest, where no document gives them.
    """
    root = ElementTree.Element("robot", name=robot.name)
    if rests := assumed_pairs(robot):
        root.append(ElementTree.Comment(f" {rests} "))
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


def assumed_pairs(robot: Robot) -> str:
    """That the pairs of an SRDF rest on shapes which no document gives.

    Parameters
    ----------
    robot : whose shapes may come from its file, or be guessed from its table

    Returns
    -------
    note : one sentence; empty where a document gives all shapes
    """
    shapes = arm_shapes(robot)
    if not shapes.assumed:
        return ""
    made = "the robot's file assumes, or gives in part" if shapes.given else "er3a guesses from the table"
    return f"pairs are disabled by shapes that {made}: with other shapes they may meet"


def pairs_not_checked(robot: Robot) -> tuple[str, ...]:
    """Pairs of links that the SRDF disables because their shapes can't be right.

    Returns
    -------
    pairs : as "first and second". Links far from each other overlap at all joint values that were tried, or neighbours
        have guessed shapes that overlap at many of them.
    """
    return tuple(
        f"{row.first} and {row.second}" for row in collision_matrix(robot).rows if REASONS.get(row.state) == "Default"
    )
