"""Where an arm is free of collisions: the matrix, joint space, places, targets and paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from er3a.collision import free_space
from er3a.collision.bodies import Bodies
from er3a.collision.matrix import base_contacts
from er3a.collision.pairs import TRIED, Pair, label_of
from er3a.collision.shapes import shapes_assumed
from er3a.files.target_file import load_targets
from er3a.finding import Finding, fact, is_one
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import USUAL_NEAR, conditioning
from er3a.kinematics.solutions import MANY_TARGETS
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import stated
from er3a.pipeline.results import Figure, Verdict
from er3a.pipeline.scope import OF_MOTIONS, Coverage, Open, by_reason, coverages
from er3a.pipeline.stages.collision import model
from er3a.pipeline.stages.collision.entry import CollisionSettings
from er3a.pipeline.stages.covered import Covered, assumed_tool, covered_collisions, gaps_in_solids
from er3a.pipeline.stages.trajectory.judgement import measured
from er3a.pipeline.stages.trajectory.motion import ListedMotion, listed_motions, task_of
from er3a.pipeline.study import Study
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot
from er3a.selection.regular_first import regular_first
from er3a.selection.select import refusals_of


def target_clearances(
    robot: Robot, bodies: Bodies, file: str, others: Bodies | None = None
) -> tuple[model.TargetClearances, list[model.Closest], tuple[Finding, ...]]:
    """Clearance of the solutions of all targets.

    Parameters
    ----------
    bodies : of the robot, and what it must not meet
    file : of the targets
    others : whose distances are measured, those of ``bodies`` unless given, which solutions are chosen by

    Returns
    -------
    rows : one for each solution within the limits, mm; turns are left out of many targets
    closest : where the chosen solution of each target is nearest to anything
    blocked : targets of which none is chosen, because all solutions collide

    Raises
    ------
    InputError
        if the targets can't be read
    """
    tables, closest, blocked = [], [], []
    targets, near = load_targets(file, robot), others or bodies
    for target in targets:
        solutions = inverse(robot, target.T, target.q_ref, self_motion_rows=True)
        if len(targets) > MANY_TARGETS:
            solutions = solutions.without_turns()
        rows = np.flatnonzero(solutions.within_limits)
        if not rows.size:
            continue
        distance, pair = near.min_distance_of_turns(solutions.q[rows])
        tables.append(
            model.TargetClearances.of(
                target=target.name,
                branch=solutions.branch[rows],
                label=solutions.label[rows],
                q_deg=shown(robot, solutions.q[rows]),
                clearance_mm=distance * 1000,
                between=[label_of(near.pairs[k]) if k >= 0 else "" for k in pair],
            )
        )
        choice = regular_first(robot, solutions, target.q_ref, refusals_of(bodies, solutions))
        chosen = choice.chosen
        if is_one(choice.reason, "all_collide"):
            expected = target.expect == "collides"
            blocked.append(
                fact("colliding_target", name=target.name, pair=choice.reason.overlap.pair, expected=expected)
            )
        if chosen is not None:
            at = np.searchsorted(rows, chosen)
            if pair[at] >= 0:
                closest.append(
                    _closest(near, (target.name, "target", None), solutions.q[chosen], distance[at], pair[at])
                )
    return model.TargetClearances.stacked(tables).of_joints(robot.slides), closest, tuple(blocked)


def path_clearances(
    motions: Iterable[ListedMotion], bodies: Bodies, tolerance: float
) -> tuple[model.PathClearances, list[model.Closest], dict[str, Pair]]:
    """Clearance along paths.

    Parameters
    ----------
    motions : those without a motion are passed over
    tolerance : m, overlap that may go unnoticed

    Returns
    -------
    rows : clearance over time of each path, s and mm
    closest : where each path is nearest to anything
    first : the pair of bodies that touches first, by the path's name
    """
    tables, closest, first = [], [], dict[str, Pair]()
    for entry in motions:
        motion = entry.motion
        if motion is None:
            continue
        along = measured(bodies, tolerance, motion)
        q = motion.joints(along.t)
        near = np.full((len(q), 2, 3), np.nan)
        for row in np.flatnonzero(along.number >= 0):
            near[row] = bodies.surface_points(q[row], along.number[row])
        tables.append(
            model.PathClearances.of(
                path=entry.name,
                t_s=along.t,
                q_deg=shown(bodies.robot, q),
                clearance_mm=along.distance * 1000,
                between=[label_of(pair) if pair else "" for pair in along.pair],
                from_mm=near[:, 0] * 1000,
                to_mm=near[:, 1] * 1000,
            )
        )
        if along.contacts:
            first[entry.name] = along.contacts[0].pairs[0]
        at = along.closest
        if at >= 0 and along.number[at] >= 0:
            about = (entry.name, "path", float(along.t[at]))
            closest.append(_closest(bodies, about, q[at], along.distance[at], along.number[at]))
    return model.PathClearances.stacked(tables).of_joints(bodies.robot.slides), closest, first


def _closest(bodies: Bodies, about: tuple, q: Reals, distance: float, pair: int) -> model.Closest:
    first, second = (tuple(point.tolist()) for point in bodies.surface_points(q, int(pair)) * 1000)
    (name, kind, t), q_deg = about, tuple(shown(bodies.robot, q).tolist())
    return model.Closest(name, kind, float(distance * 1000), bodies.pairs[pair], t, q_deg, first, second)


STAGE_NAME = "collision"
CHECKS = 1  # points of a path checked between its samples to begin with; clearance adds what it needs
SAMPLES_STREAM, PLACES_STREAM = 0, 1
FEWEST_ROWS, STEADY_MM, STEADY_JOINTS = 3, 5.0, 3
"""Poses; a steady pair's change of clearance, which is no more than the clearance; joints between the pair."""
HOMES = 64  # free joint vectors among which a home is chosen


def compute(study: Study, name: str) -> model.CollisionResults:
    """Work out where a robot (by its name in the study) is free of collisions.

    Returns
    -------
    results : in joint space, at places, at targets, along paths; :class:`InputError` if a file can't be used
    """
    robot, settings = study.robot(name), study.section(CollisionSettings)
    scene = study.scene(name, STAGE_NAME)
    bodies = Bodies(robot, scene)
    space = free_space.sample_joint_space(bodies, settings.samples, np.random.default_rng([study.seed, SAMPLES_STREAM]))
    random = np.random.default_rng([study.seed, PLACES_STREAM])
    places = free_space.find_places(bodies, space, settings.cells_across, settings.rounds, random)
    targets, at_targets, blocked = target_clearances(robot, bodies, study.entry(name).targets)
    home_from, q_home = _home(bodies, study.home(name), space.q[space.free])
    at_home, depth = _overlap(bodies, q_home)
    if at_home is None:
        solved = _poses(robot, at_targets)
        solved = solved[bodies.free(solved)]
        places.joined[:] = free_space.joined_to_home(bodies, places, q_home, solved, settings.neighbours)
    motions = list(listed_motions(study.entry(name).paths, task_of(study, name), CHECKS))
    tolerance = settings.penetration_tolerance_mm / 1000
    paths, on_paths, first_touch = path_clearances(motions, bodies, tolerance)
    pairs, matrix, places_found = _pair_shares(bodies, space), _matrix(bodies), _places_summary(places)
    mounting = tuple(stated(model.Mounting, contact) for contact in base_contacts(robot, scene))
    wrong = bodies.in_error and fact(
        "collision.shapes_overlap", pairs=bodies.in_error, count=TRIED, free_ratio=space.whole.value
    )
    closest = nearest = (*at_targets, *on_paths)
    if steady := _steady(bodies, closest):
        targets, paths, nearest = _but_steady(bodies, steady, study.entry(name).targets, motions, tolerance)
    assumed = shapes_assumed(robot, study.assumed_margin(name), {one.name: one.clearance_mm / 1000 for one in closest})
    free = _free_space(space, places_found, nearest, blocked, _colliding(motions, on_paths, first_touch)).but(
        shapes_assumed=assumed is not None
    )
    covered = covered_collisions(robot, bodies, scene)
    home = None
    if at_home is not None:
        free = free.but(joined=None)
        home = fact("collision.home_collides", pair=at_home, depth_mm=1000 * depth, **free.params)
    return model.CollisionResults(
        summary=model.CollisionSummary(
            verdict=_verdict(pairs, mounting, wrong or None, free, home).with_assumed_shapes(assumed),
            figures=_figures(space, places_found),
            scene=scene.title if scene else None,
            samples=settings.samples,
            of_itself=_share(space.of_itself),
            of_scene=_share(space.of_scene),
            whole=_share(space.whole),
            home_from=home_from,
            home_deg=None if at_home else tuple(shown(robot, q_home).tolist()),
            proven_m=free_space.DEPTH,
            penetration_tolerance_mm=settings.penetration_tolerance_mm,
            places=places_found,
            mounting=mounting,
            closest=nearest,
            steady=steady,
            checked=_checked(study, name, covered, motions),
            assumed=(*_chosen(motions), *assumed_tool(robot), *covered.assumed),
        ),
        matrix=matrix,
        pairs=pairs,
        places=_place_rows(robot, places),
        targets=targets,
        paths=paths,
    )


def _place_rows(robot: Robot, places: free_space.ClearPlaces) -> model.PlaceRows:
    rows = model.PlaceRows.of(places, middle=places.middles, witness_deg=shown(robot, places.witness))
    return rows.of_joints(robot.slides)


def _poses(robot: Robot, closest: Sequence[model.Closest]) -> Reals:
    """The joint values (k, n), rad or m, at which something is nearest."""
    return meant(robot, np.reshape([each.q_deg for each in closest], (-1, robot.joints)))


def _steady(bodies: Bodies, closest: Sequence[model.Closest]) -> tuple[model.SteadyPair, ...]:
    """The pairs with few joints between them that are as near in all rows, and nearer than the rest in some row."""
    poses = _poses(bodies.robot, closest)
    links = np.array([body.link for body in bodies.all])  # -1 of solids
    pairs = np.arange(len(bodies.pairs))
    far = 1000 * np.array([bodies.counted(bodies.distances(q, pairs)) for q in poses]).reshape(-1, len(pairs))
    met = np.isfinite(far).all(axis=0)
    if len(poses) < FEWEST_ROWS or not met.any():
        return ()
    far, pairs = far[:, met], pairs[met]
    low, spread = far.min(axis=0), np.ptp(far, axis=0)
    joints = np.abs(links[bodies.layout.first] - links[bodies.layout.second])[met]
    steady = (low > 0) & (spread <= np.minimum(STEADY_MM, low)) & (joints <= STEADY_JOINTS)
    if steady.all():
        return ()
    nearer = np.flatnonzero(steady & (low < min(model.NEAR_MM, far[:, ~steady].min(axis=1).max())))
    order = nearer[np.argsort(low[nearer], kind="stable")]
    return tuple(model.SteadyPair(bodies.pairs[pairs[k]], float(low[k]), float(low[k] + spread[k])) for k in order)


def _but_steady(
    bodies: Bodies, steady: Sequence[model.SteadyPair], file: str, motions: Sequence[ListedMotion], tolerance: float
) -> tuple[model.TargetClearances, model.PathClearances, tuple[model.Closest, ...]]:
    """Clearances of targets and paths without some pairs."""
    others = Bodies(bodies.robot, bodies.scene, [each.between for each in steady])
    targets, at_targets, _ = target_clearances(bodies.robot, bodies, file, others)
    paths, on_paths, _ = path_clearances(motions, others, tolerance)
    return targets, paths, (*at_targets, *on_paths)


def _free_space(
    space: free_space.JointSpace,
    places: model.PlacesSummary,
    nearest: Sequence[model.Closest],
    blocked: tuple[Finding, ...],
    colliding: tuple[Finding, ...],
) -> Finding:
    """How much of joint space and of the reached places is free, and what targets and paths come to."""
    at_targets = [each for each in nearest if each.kind == "target"]
    return fact(
        "collision.free_space",
        free_ratio=space.whole.value,
        places=places.reached,
        clear=places.clear,
        joined=places.joined,
        targets=len(at_targets),
        nearest=_nearest_target(at_targets),
        colliding=colliding,
        blocked=blocked,
        demonstrations=tuple(each for each in (*blocked, *colliding) if each.expected),
    )


def _chosen(motions: list[ListedMotion]) -> tuple[Open, ...]:
    """What was chosen for the paths that are given to be run."""
    return by_reason(each for motion in motions if motion.meant_safe for each in motion.assumed)


def _home(bodies: Bodies, given: Reals | None, free: Reals) -> tuple[model.HomeFrom, Reals]:
    """Where places are joined to: the study's home, joints at 0 if that is free of overlap, regular and a twentieth of
    each range away from limits, where an arm is folded up and few moves lead away, or else one of the free joint
    vectors (k, n): of the ``HOMES`` nearest to the middle of the limits the one farthest from singular."""
    robot = bodies.robot
    zero = np.clip(0.0, robot.lower, robot.upper)
    middle = (robot.lower + robot.upper) / 2
    ranges = np.maximum(robot.upper - robot.lower, 1e-9)
    if given is not None:
        return "study", given
    regular = (np.abs(middle) < 0.45 * ranges).all() and not USUAL_NEAR.contains(robot, zero[None])[0]
    if not len(free) or (regular and bodies.free(zero[None])[0]):
        return "zero", zero
    away = np.abs(free - middle) / ranges
    near = free[np.argsort(away.max(axis=1), kind="stable")[:HOMES]]
    return "chosen", near[conditioning(robot, near).smallest_singular_value.argmax()]


def _overlap(bodies: Bodies, q: Reals) -> tuple[Pair | None, float]:
    """What overlaps at joint values (n,) by how much, m; None if nothing does."""
    smallest, nearest = bodies.min_distance(q[None])
    overlap = bodies.pairs[nearest[0]] if smallest[0] < 0 else None
    return overlap, float(-smallest[0])


def _colliding(
    motions: list[ListedMotion], on_paths: list[model.Closest], first_touch: dict[str, Pair]
) -> tuple[Finding, ...]:
    """The paths on which something overlaps, with what touches first, and whether that is expected."""
    meant = {each.name for each in motions if "collides" in each.expected}
    return tuple(
        fact(
            "colliding_path", name=each.name, pair=first_touch.get(each.name, each.between), expected=each.name in meant
        )
        for each in on_paths
        if each.clearance_mm < 0
    )


def _nearest_target(closest: list[model.Closest]) -> Finding | None:
    if not closest:
        return None
    least = min(closest, key=lambda each: each.clearance_mm)
    return fact("nearest_target", name=least.name, clearance_mm=least.clearance_mm, pair=least.between)


def _checked(study: Study, name: str, seen: Covered, motions: list[ListedMotion]) -> tuple[Coverage, ...]:
    """What the checks cover of bodies, and of the paths that are given to be run."""
    targets = load_targets(study.entry(name).targets, study.robot(name))
    asked = ((each.name, each.T[:3, 3], 0.0) for each in targets if each.expect in (None, "reached"))
    own = [motion for motion in motions if motion.meant_safe]
    rest = (each for motion in own for each in motion.gaps)
    gaps = (*seen.gaps, *gaps_in_solids(study.scene(name, STAGE_NAME), asked), *by_reason(rest))
    joints = (study.robot(name).joints,) * 2
    followed = sum(motion.motion is not None for motion in own)
    return coverages({**seen.asked, "limits": joints, **dict.fromkeys(OF_MOTIONS, (followed, followed))}, gaps)


def _matrix(bodies: Bodies) -> model.MatrixRows:
    robot = bodies.robot
    unknown = np.full(robot.joints, np.nan)
    watched = {tuple(label_of(pair).split("/")) for pair, second in zip(bodies.pairs, bodies.second) if second >= 0}
    return model.MatrixRows.of_rows(
        (
            row.first,
            row.second,
            row.state,
            (row.first, row.second) in watched,
            1000 * row.lower_bound,
            1000 * row.left_out,
            row.boxes,
            unknown if row.witness is None else shown(robot, row.witness),
            row.reason,
        )
        for row in bodies.matrix
    ).of_joints(robot.slides)


def _pair_shares(bodies: Bodies, space: free_space.JointSpace) -> model.PairShares:
    """One row for what the results call a pair; it overlaps where any of its bodies do."""
    numbers: dict[Pair, list[int]] = {}
    for number, pair in enumerate(bodies.pairs):
        numbers.setdefault(pair, []).append(number)
    rows = []
    for pair, own in numbers.items():
        share = free_space.Share(space.count(own), len(space.q))
        always = share.count == share.of and any(bodies.always_overlaps(number) for number in own)
        rows.append((pair, bool(bodies.second[own[0]] >= 0), share.value, *share.interval, always))
    return model.PairShares.of_rows(sorted(rows, key=lambda row: (-row[2], label_of(row[0]))))


def _share(share: free_space.Share) -> model.FreeShare:
    return model.FreeShare(share.value, share.interval)


def _places_summary(places: free_space.ClearPlaces) -> model.PlacesSummary:
    cell, clear = places.cell**3, int(places.clear.sum())
    return model.PlacesSummary(
        cell_m=places.cell,
        reached=len(places.clear),
        clear=clear,
        joined=int(places.joined.sum()),
        tries_in_lost=int(places.tries[~places.clear].sum()),
        lost_m3=(len(places.clear) - clear) * cell,
    )


def _verdict(
    pairs: model.PairShares,
    mounting: tuple[model.Mounting, ...],
    wrong: Finding | None,
    found: Finding,
    home: Finding | None,
) -> Verdict:
    if pairs.always.any():
        return Verdict(
            "fail", fact("collision.never_free", pairs=tuple(pairs.between[pairs.always]), assumed=found.shapes_assumed)
        )
    if inside := tuple(contact.solid for contact in mounting if contact.inside):
        return Verdict("fail", fact("collision.base_in_solid", solids=inside))
    if wrong:
        return Verdict("fail", wrong)
    blocked = not all(each.expected for each in found.blocked)
    if not all(each.expected for each in found.colliding) or (blocked and not found.targets):
        return Verdict("fail", home or found)
    return Verdict("caution" if home or not found.joined or blocked else "pass", home or found)


def _figures(space: free_space.JointSpace, places: model.PlacesSummary) -> tuple[Figure, ...]:
    low, high = space.whole.interval
    return (
        Figure("free_of_collisions", 100 * space.whole.value, "%", 50 * (high - low)),
        Figure("clear_places", places.clear, "", of=places.reached),
        Figure("joined_places", places.joined, "", of=places.clear),
        Figure("lost_volume", 1000 * places.lost_m3, "L"),
    )
