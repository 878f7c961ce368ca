"""Writes the teach panel's page: robot, texts and scripts in one file that works offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.distances import CYLINDER, HALF_SPACE, HULL
from er3a.collision.pairs import names_of
from er3a.collision.scene import Scene
from er3a.collision.shapes import shapes_assumed
from er3a.collision.triangles import TriangleTree
from er3a.files.vision_file import load_vision
from er3a.finding import fact
from er3a.kinematics.singularity import (
    TYPES,
    USUAL_NEAR,
    NearSingular,
    characteristic_length,
    conditioning,
    wrist_and_forearm,
)
from er3a.kinematics.solutions import branch_labels
from er3a.kinematics.wrist_partitioned import has_branches, wrist_partition_missing
from er3a.numerics.arrays import Reals
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.pages import Caveat, caveat
from er3a.pipeline.messages.say import say
from er3a.pipeline.messages.scope import body_word
from er3a.pipeline.player.motions import at_rest
from er3a.pipeline.player.player import AXES, LOOKS, SPACE, best_turn, drawing_head, framed, table_data
from er3a.pipeline.results import Provenance, input_records, is_computed, read_foundation
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.trajectory.motion import near_singular
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.conditions import condition_of, program_head
from er3a.pipeline.viewing.drawn import drawn_arm, drawn_scene, drawn_size, floor_of, poses_at
from er3a.pipeline.viewing.page import alternative_table, render, robots_with, run_command
from er3a.pipeline.viewing.palette import JOINTS, TOUCHING
from er3a.pipeline.viewing.still import scene_still
from er3a.programs.writing import ascii_text
from er3a.robots.joint_limits import joint_names, meant
from er3a.robots.robot import Robot

WORDS: dict[str, Any] = {
    "view": N_("The arm"),
    "picture": N_(
        "The arm in three dimensions at the joint angles of the sliders, each joint in its own colour. "
        "Arrow keys turn the view, plus and minus zoom."
    ),
    "views": {"overview": N_("Overview"), "side": N_("Side"), "front": N_("Front"), "top": N_("Top")},
    "looks": N_("Arm drawn as"),
    "look": LOOKS,
    "frames": N_("D-H frames"),
    "row": {
        "standard": N_(
            "Row {row}: turn by θ = {theta} about z, go {d} mm along z and {a} mm along the new x, turn by α = {alpha} "
            "about it."
        ),
        "modified": N_(
            "Row {row}: go {a} mm along x, turn by α = {alpha} about it, turn by θ = {theta} about the new z, go {d} "
            "mm along it."
        ),
    },
    "joints": N_("Joints"),
    "typed": N_("{joint} in degrees"),
    "angle": N_("{degrees} degrees"),
    "way": N_("{degrees} millimetres"),
    "endless_joint": N_("turns without end"),
    "room": N_("{room} to limit"),
    "at_limit": N_("at its limit"),
    "joint_at_limit": N_("{joint} is at its limit."),
    "outside": N_("{joint} stays between {lower} and {upper}."),
    "no_number": N_("{joint} needs a number, in degrees."),
    "no_length": N_("{joint} needs a number, in millimetres."),
    "zero": N_("Zero pose"),
    "flange_off": N_("flange {off} off"),
    "copied": N_("The joints are copied: {text}"),
    "link_copied": N_("The link to this pose is copied."),
    "not_copied": N_("This browser does not let pages copy; copy it from here: {text}"),
    "bad_link": N_("The joints in the link were not used: {reason}"),
    "bad_count": N_("it names {count} numbers where {joints} are needed."),
    "jog": N_("Jog"),
    "jog_frames": {"base": N_("base"), "tool": N_("tool"), "joints": N_("joints")},
    "jog_axes": ["X", "Y", "Z", "RX", "RY", "RZ"],
    "jog_along": N_("Along {axis} of the {frame}."),
    "jog_about": N_("About {axis} of the {frame}: the tool turns or tilts, its point rests."),
    "no_jog_along": N_("The arm does not move: its joints cannot move the tool point along {axis} of the {frame}."),
    "no_jog_about": N_("The arm does not move: its joints cannot turn the tool about {axis} of the {frame}."),
    "jog_step": N_("A step needs a number above 0."),
    "pose_fields": [
        N_("x (mm)"),
        N_("y (mm)"),
        N_("z (mm)"),
        N_("roll (°)"),
        N_("pitch (°)"),
        N_("yaw (°)"),
    ],
    "pose_number": N_("“{field}” needs a number."),
    "not_reached": N_("The arm does not move: {reason}."),
    "not_found": N_(
        "iteration found no joint values within the limits; the nearest are {length} and {angle} away. This "
        "does not prove that none exist"
    ),
    "in_metres": N_("Positions are in mm: did you mean ({place})?"),
    "left_over": N_(
        "The tool is {length} and {angle} away from what was asked, in what the {joints} joints of this arm cannot set."
    ),
    "no_such_motion": N_("The arm does not move: its joints cannot move the tool that way."),
    "points": N_("Way points"),
    "go_to_point": N_("go to point {number}"),
    "remove_point": N_("remove point {number}"),
    "pose": N_("Tool pose"),
    "orientation": N_("Other forms"),
    "orientations": {
        "zyz": N_("Euler angles ZYZ"),
        "quaternion": N_("Quaternion"),
        "matrix": N_("Matrix"),
    },
    "parts": {
        "zyz": [N_("φ about Z"), N_("ϑ about Y"), N_("ψ about Z")],
        "quaternion": ["w", "x", "y", "z"],
    },
    "measures": N_("How near to a singularity?"),
    "length_is": {"wrist": N_("the reach of the wrist centre"), "links": N_("half the length along all links")},
    "manipulability": N_("Manipulability"),
    "smallest": N_("Smallest singular value"),
    "condition": N_("Condition number"),
    "kinds": {"wrist": N_("Wrist"), "elbow": N_("Elbow"), "shoulder": N_("Shoulder")},
    "kinds_are": {
        "wrist": N_("between axes 4 and 6"),
        "elbow": N_("from straight or folded"),
        "shoulder": N_("wrist centre from the plane of axes 1 and 2"),
    },
    "clear": N_("Clear. Inside all limits, not singular."),
    "touch": {"near": N_("Near contact."), "at": N_("Collision.")},
    "near": {
        "wrist": N_("Near the wrist singularity: axes 4 and 6 are {distance} from parallel."),
        "elbow": N_("Near the elbow singularity: the arm is {distance} from straight or folded."),
        "shoulder": N_("Near the shoulder singularity: the wrist centre is {distance} from the plane of axes 1 and 2."),
    },
    "at": {
        "wrist": N_("At the wrist singularity: axes 4 and 6 parallel. Joint moves only."),
        "elbow": N_("At the elbow singularity: arm straight or folded. Joint moves only."),
        "shoulder": N_("Shoulder singularity: wrist centre in plane of axes 1, 2. Joint moves only."),
    },
    "near_unnamed": N_("Near a singularity: the smallest singular value is {value}."),
    "solutions": N_("All IK solutions of this pose"),
    "previous": N_("Previous"),
    "next": N_("Next"),
    "count": N_("{within} of {total} within the limits"),
    "count_colliding": N_("{within} of {total} within the limits, of these {colliding} in collision"),
    "current": N_("the arm is here"),
    "within_at": N_("{joints} at the limit"),
    "leaves": N_("{joint} {excess} over"),
    "separator": N_("; "),
    "above": N_("{joint} at {angle} is {excess} above its limit of {limit}"),
    "below": N_("{joint} at {angle} is {excess} below its limit of {limit}"),
    "turn": N_("{joint} {turn}"),
    "other_turns": N_("Further turns:"),
    "not_moved": N_("The arm does not move: {reasons}."),
    "missing": N_("not there: {reason}"),
    "faults": {
        "too_far": N_("the wrist centre would be {gap} too far from axis 2"),
        "too_near": N_("the wrist centre would be {gap} too near to axis 2"),
        "off_axis": N_("the wrist centre would be {gap} too near to axis 1"),
        "orientation": N_("the wrist would have to tilt {gap} further than it can"),
    },
    "free": {
        "wrist": N_("Axes 4 and 6 are collinear: infinitely many solutions; J4 is kept."),
        "elbow": N_("The wrist centre is on axis 2: infinitely many solutions; J2 is kept."),
        "shoulder": N_("The wrist centre is on axis 1: infinitely many solutions; J1 is kept."),
    },
    "found": N_("solution {number}"),
    "iterated": N_("{count} found by iteration; there may be others"),
    "no_closed_form": N_(
        "The page solves arms with a spherical wrist and parallel axes 2 and 3 in closed form. This arm it solves by "
        "iteration within the joint limits, once the arm is at rest, because {reason}. The inverse page lists all "
        "solutions of its targets where the arm's class has a solver."
    ),
    "endless": N_(
        "The arm has more joints than a pose needs, so there are infinitely many solutions; some that are far "
        "apart are shown."
    ),
    "clearance_is": N_("Clearance {distance}: {pair}."),
    "overlap": N_("Collision: {pair} overlap by {distance}."),
    "overlap_deep": N_("Collision: {pair} overlap by {distance} or more."),
    "assumed": {
        "clearance_is": N_("Clearance {distance} of assumed shapes: {pair}."),
        "overlap": N_("Collision of assumed shapes: {pair} overlap by {distance}."),
        "overlap_deep": N_("Collision of assumed shapes: {pair} overlap by {distance} or more."),
    },
    "collides": N_("collision: {pair}"),
    "nothing_meets": N_("No bodies here can collide."),
}


SIX = 6
_HERE = Path(__file__).parent
NEAR_LIMIT, NEAR_END = np.radians(5.0), 0.005  # rad, m of a prismatic joint
NEAR_TOUCH = 0.03  # m
KINDS = {HULL: "hull", CYLINDER: "cylinder", HALF_SPACE: "half_space"}


def write_teach_page(study: Study, name: str, results: Path, output: Path) -> None:
    """Write the teach panel of a robot of the study to ``output``; the verdict on its table is in ``results``."""
    validated = results / name / "validation"
    known, instead = is_computed(validated), alternative_table(study, name, validated)
    scene = instead or name  # a wrong table is shown where the right one is, as on all pages
    inputs = dict.fromkeys([*study.inputs(name, "teach"), *study.scenes(scene, "trajectory")])
    write_panel(
        study.robot(name),
        output,
        near=near_singular(study.section(TrajectorySettings)),
        scene=study.scene(scene, "trajectory"),
        home=_home(study, name),
        robots=robots_with(study, "teach"),
        robot_pages=study.pages(name),
        first_caveat=caveat(read_foundation(validated) if known else "not_computed"),
        instead=instead,
        right=study.robot(instead) if instead else None,
        head=program_head(validated if known else None),
        condition=condition_of(validated) if known else ("", 0),
        command=run_command(study, f"{name}/teach.html"),
        provenance=Provenance(input_records(inputs), code_digest(), config=study.settings(name, "trajectory")),
    )


def _home(study: Study, name: str) -> Reals | None:
    """Where the arm rests, (n,), rad or m: its home, or else where it waits for its camera; None where no file says."""
    robot, home, task = study.robot(name), study.home(name), study.entry(name).vision
    waiting = load_vision(task).home_deg if home is None and task else ()
    return meant(robot, np.array(waiting)) if len(waiting) == robot.joints else home


def _opened_at(robot: Robot, scene: Scene | None, near: NearSingular, known: list[Reals]) -> Reals:
    """The first joint values (n,) that are clear and regular: those known, then others within the limits."""
    middle, steps = (robot.lower + robot.upper) / 2, np.diag(robot.upper - robot.lower) / 4
    tried = middle + steps
    regular = tried[conditioning(robot, tried).smallest_singular_value.argsort()[::-1]]
    rows = np.clip(
        [*known, *regular, *(middle - steps[:, None] - steps).reshape(-1, robot.joints)], robot.lower, robot.upper
    )
    found: Reals = rows[(Bodies(robot, scene).free(rows, NEAR_TOUCH) & ~near.contains(robot, rows)).argmax()]
    return found


def write_panel(
    robot: Robot,
    output: Path,
    *,
    command: str | None,
    provenance: Provenance,
    near: NearSingular = USUAL_NEAR,
    scene: Scene | None = None,
    home: Reals | None = None,
    robots: Sequence[tuple[str, str, str]] = (),
    robot_pages: Sequence[str] = (),
    first_caveat: Caveat | None = None,
    instead: str | None = None,
    right: Robot | None = None,
    head: Sequence[str] | None = None,
    condition: tuple[str, int] = ("", 0),
) -> None:
    """Write the teach panel of a robot.

    Parameters
    ----------
    near : where the panel warns of a singularity
    home : (n,), rad or m, that the panel opens at; else that of the robot's file, or else joints in the middle of
        their limits, but for one, the farthest from singular first, or for one or two: the first of these that is
        clear and regular
    robots, robot_pages : of the study: arms with a panel (name, title, address), and this arm's other pages
    first_caveat : what to know of its table, if anything; condition : what of it has to be confirmed, and
        how many entries these are
    instead, right : of ``robots`` that of the table to use where evidence contradicts this one; its arm, shown over
        this one
    head : what files that the panel exports say first; None where nothing is known of the table
    """
    own = panel_data(robot, near)
    opened = _opened_at(robot, scene, near, [q for q in (home, robot.home) if q is not None])
    solids = drawn_scene(scene.solids if scene else (), robot)
    others = [arm for arm in (right,) if arm is not None and arm.joints == robot.joints]
    seen = {"scene": solids, "size": own["size"]}
    turned = best_turn(robot, at_rest(robot, "", q=opened), 0.0, seen)
    panel = own | {
        "others": [{"table": table_data(arm), **drawn_arm(arm)} for arm in others],
        "wrong": first_caveat is not None and first_caveat.status == "fail",
        "scene": solids,
        "carried": drawn_scene(scene.carried if scene else (), robot, robot.rows + 1),
        "floor": floor_of(scene),
        "clearance": clearance_data(robot, scene),
        "home": opened.tolist(),
        "turned": turned,
        **framed(seen, (robot, *others), at_rest(robot, "", q=opened, beside=[opened[None]] * len(others)), turned),
        "head": [*map(ascii_text, program_head(None) if head is None else head)],
    }
    render(
        _HERE / "teach.html.j2",
        output,
        robot=robot,
        robots=robots,
        robot_pages=robot_pages,
        joint_names=joint_names(robot),
        joint_colours=JOINTS,
        degrees=float(np.degrees(1.0)),
        words=panel["words"],
        first_caveat=first_caveat,
        instead=instead,
        condition=condition,
        panel=panel,
        drawing_head=drawing_head([*SPACE, *sorted(_HERE.glob("*.js"))]),
        still=scene_still(panel, [poses_at(arm, opened) for arm in (robot, *others)], {}, panel["turned"]).markup(),
        command=command,
        provenance=provenance,
    )


def panel_data(robot: Robot, near: NearSingular) -> dict[str, Any]:
    """What the scripts take of a robot, as plain data; SI units.

    Parameters
    ----------
    near : where the panel warns of a singularity
    """
    missing = wrist_partition_missing(robot) or (None if robot.coupling is None else fact("coupled_joints"))
    thresholds = {kind: near.of(kind) for kind in TYPES}
    labels = [] if missing else [branch_word(label) for label in branch_labels(robot)]
    return {
        "name": robot.name,
        "table": table_data(robot),
        "size": drawn_size(robot),
        **drawn_arm(robot),
        "characteristic_length": characteristic_length(robot),
        "length_is": "links" if wrist_partition_missing(robot) else "wrist",
        "singular_sets": singular_sets(robot),
        "no_closed_form": say(missing) if missing else None,
        "branch_labels": labels,
        "near": {**thresholds, "value": near.smallest, "limit": NEAR_LIMIT, "slide": NEAR_END},
        "programs": robot.joints == robot.rows == SIX and not robot.sliding.any() and robot.coupling is None,
        "joint_names": joint_names(robot),
        "colours": {"joints": JOINTS, "touching": TOUCHING},
        "axes": AXES,
        "words": _translated(WORDS),
    }


def singular_sets(robot: Robot) -> dict[str, Any] | None:
    """What the distances from the three singular sets take of an arm, SI; None for one without these sets."""
    if not has_branches(robot):
        return None
    wrist, to_axis_4 = wrist_and_forearm(robot)
    return {"wrist_in_tool": wrist.tolist(), "to_axis_4": to_axis_4}


def clearance_data(robot: Robot, scene: Scene | None) -> dict[str, Any]:
    """The bodies whose distances the panel watches and their pairs, as ``clearance.js`` takes them; SI units."""
    found = Bodies(robot, scene)
    layout, left_out = found.layout, found.in_error + found.coarse
    shapes = shapes_assumed(robot, 0.0, {})
    return {
        "near": NEAR_TOUCH,
        "unexamined": say(fact("pairs_unexamined", pairs=left_out)) if left_out else None,
        "assumed": say(shapes) if shapes else "",
        "allowed": [
            f"{body_word(row.first)} / {body_word(row.second)}" for row in found.matrix if row.state == "allowed"
        ],
        "bodies": [
            {
                "kind": KINDS[int(layout.kind[b])],
                "link": int(layout.link[b]),
                "points": layout.points[layout.start[b] : layout.start[b + 1]].tolist(),
                "radius": float(layout.radius[b]),
                "disc": float(layout.disc[b]),
                "surface": surface_data(body.tree) if body.tree else None,
            }
            for b, body in enumerate(found.all)
        ],
        "pairs": [
            {
                "bodies": [int(first), int(second)],
                "joined": bool(joined),
                "text": say(pair),
                "names": names_of(pair),
            }
            for first, second, joined, pair in zip(layout.first, layout.second, layout.joined, found.pairs)
        ],
    }


def surface_data(tree: TriangleTree) -> dict[str, Any]:
    """A surface as ``surface.js`` takes it: points (m, to 1 µm), faces, their closed shells (0 for none), probes."""
    points, rows = np.unique(np.round(tree.corner.reshape(-1, 3), 6), axis=0, return_inverse=True)
    keys = np.unique(np.append(tree.shell, 0))
    return {
        "points": points.tolist(),
        "faces": rows.reshape(-1, 3).tolist(),
        "shells": np.where(tree.shell == 0, 0, np.searchsorted(keys, tree.shell) + 1).tolist(),
        "probes": tree.probe.tolist(),
    }


def _translated(words: Any) -> Any:
    """The words, nested as they are, in the page's language."""
    if isinstance(words, dict):
        return {key: _translated(word) for key, word in words.items()}
    return [*map(_translated, words)] if isinstance(words, list) else tr(words)
