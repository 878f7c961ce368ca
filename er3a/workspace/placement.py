"""Where a box can be placed so that the tool reaches every point of it along every required direction.

At each point of a lattice, all directions of a cone are tested, branch by branch. A box fits where all lattice points
in it are good, which sliding minima find for all places at once. Between these samples nothing is proven.

Criterion: places where one branch serves the whole box come first. Two measures rank the rest: the smallest
manipulability over the box and the cone, which keeps away from singularities, and the smallest distance from the joint
limits. Each is taken as a ratio to the best of all places, and the smaller ratio counts. A minimum of that distance is
also required: the task narrows the limits.

A supported box has its underside on a :class:`Support`, over which all of it lies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import scipy
import scipy.optimize
from numpy.typing import NDArray

from er3a.by_value import by_identity
from er3a.collision.scene import Box, Cylinder, Plane, Scene
from er3a.kinematics.solutions import slot_labels
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import CombinedLimit, Robot
from er3a.workspace import directions
from er3a.workspace.arcs import FULL_TURN
from er3a.workspace.capability import manipulability_of
from er3a.workspace.cell_frame import cell_frame
from er3a.workspace.orientations import AskedOrientations
from er3a.workspace.tool_inverse import all_solutions, slot_count

NO = -1.0  # below any manipulability: not served
NOTHING = 1e-12  # in place of a best measure of 0, which can't be divided by
_LEVEL = 1e-9  # of a unit vector or m: rounding
MIXED = -1
"""The branch of a box that no single branch serves."""
_POSES = 50_000  # solved at a time, so that their solutions stay within some hundred megabytes

Free = Callable[[Reals], Flags]
"""Which arms (N, n), rad, are free of collisions, (N,)."""


@by_identity
class Support:
    """A level surface of a scene that can support a box.

    Attributes
    ----------
    name : of its solid; height : m
    outline : (k, 2), m, corners of a convex polygon, counter-clockwise; none where it has no end
    """

    name: str
    height: float
    outline: Reals

    def holds(self, points: Reals) -> Flags:
        """Which points lie over the support.

        Parameters
        ----------
        points : (..., 2), m, x and y

        Returns
        -------
        inside : (...) bool, the edge included; all True where it has no end
        """
        inside = np.ones(points.shape[:-1], dtype=bool)
        for start, end in zip(self.outline, np.roll(self.outline, -1, axis=0)):
            along, away = end - start, points - start
            inside &= along[0] * away[..., 1] - along[1] * away[..., 0] >= -1e-9 * np.hypot(*along)
        return inside


def fits_on(support: Support, box: Reals) -> bool:
    """Whether a box fits on a support, as given or turned by 90 deg about z.

    Parameters
    ----------
    box : (3,), m, edges along x, y, z

    Returns
    -------
    fits : by a linear programme for the place of the box's middle
    """
    if not len(support.outline):
        return True
    edges = np.roll(support.outline, -1, axis=0) - support.outline
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1)[:, None]
    bound = np.einsum("ij,ij->i", outward, support.outline)
    for size in (box[:2], box[1::-1]):  # where the middle may be, so that no corner is beyond an edge
        inside = bound - np.abs(outward) @ size / 2 + _LEVEL
        if scipy.optimize.linprog(np.zeros(2), outward, inside, bounds=(None, None)).status == 0:
            return True
    return False


def supports_of(scene: Scene) -> tuple[Support, ...]:
    """The level upper sides of a scene's boxes and upright cylinders, and its level floors.

    Parameters
    ----------
    scene : in the frame that the robot's base is placed in

    Returns
    -------
    supports : the highest first
    """
    found = []
    for solid in scene.solids:
        if isinstance(solid, Plane) and solid.normal[2] > 1 - _LEVEL:
            found.append(Support(solid.name, float(solid.offset), np.empty((0, 2))))
        elif isinstance(solid, Box | Cylinder):
            upright = np.abs(solid.T[2, :3])
            k = int(upright.argmax()) if isinstance(solid, Box) else 2
            if upright[k] > 1 - _LEVEL:
                half = solid.size[k] / 2 if isinstance(solid, Box) else solid.length / 2
                found.append(Support(solid.name, float(solid.T[2, 3] + half), _outline(solid, k)))
    return tuple(sorted(found, key=lambda support: -support.height))


def _outline(solid: Box | Cylinder, upright: int) -> Reals:
    """Corners (k, 2), m, of a solid seen from above, counter-clockwise; ``upright`` is which of its axes is."""
    if isinstance(solid, Cylinder):
        turn = np.linspace(0.0, 2.0 * np.pi, 73)[:-1]
        corners: Reals = solid.T[:2, 3] + solid.radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return corners
    a, b = (solid.size[k] / 2 * solid.T[:2, k] for k in range(3) if k != upright)
    corners = solid.T[:2, 3] + np.array([a + b, b - a, -a - b, a - b])
    return corners if a[0] * b[1] - a[1] * b[0] > 0 else corners[::-1]


@by_identity
class Task:
    """The task, in the frame that the robot's base is placed in.

    Attributes
    ----------
    box : (3,), m, edges along x, y, z
    axis : (3,), unit vector, middle of the tool's directions; half_angle : rad, how far around it they reach
    lowest : m, smallest height of the box's underside; clear : m, smallest distance of its points from axis 1
    margin : rad, how far joints with less than a full turn keep within their limits, and sums of revolute joints
        within theirs; not those that slide
    step : rad, from one direction in the cone to the next
    support : the box's support, at the height of ``lowest``; None where it may be anywhere
    """

    box: Reals
    axis: Reals
    half_angle: float
    lowest: float
    clear: float
    margin: float = 0.0
    step: float = directions.RING
    support: Support | None = None


def limited_joints(robot: Robot) -> Flags:
    """Which joints turn, but less than a full turn.

    Parameters
    ----------
    robot : n joints

    Returns
    -------
    limited : (n,) bool
    """
    return (robot.upper - robot.lower < FULL_TURN) & ~robot.slides & ~robot.continuous


def _limit_margin(robot: Robot, q: Reals) -> Reals:
    """Smallest distance (...,), rad, of joints (..., n) from the limits of those with less than a full turn, and of
    sums of revolute joints."""
    limited = np.flatnonzero(limited_joints(robot))
    inside = np.minimum(q[..., limited] - robot.lower[limited], robot.upper[limited] - q[..., limited])
    margin: Reals = inside.min(axis=-1, initial=np.inf)
    for limit in _turning_sums(robot):
        total = q @ np.array(limit.factors)
        margin = np.minimum(margin, np.minimum(total - limit.lower, limit.upper - total))
    return margin


def _turning_sums(robot: Robot) -> tuple[CombinedLimit, ...]:
    """Limits of sums of which no joint slides."""
    return tuple(limit for limit in robot.combined if not robot.slides[np.flatnonzero(limit.factors)].any())


def narrowed(robot: Robot, margin: float) -> Robot:
    """The robot with its limits drawn in, so that solutions keep a distance from them.

    Parameters
    ----------
    margin : rad, for joints with less than a full turn and for sums of revolute joints

    Returns
    -------
    robot : a copy; a range narrower than two margins becomes its middle
    """
    inward = np.where(limited_joints(robot), np.minimum(margin, (robot.upper - robot.lower) / 2), 0.0)
    turning = _turning_sums(robot)
    combined = tuple(_drawn_in(limit, margin) if limit in turning else limit for limit in robot.combined)
    return robot.replace(lower=robot.lower + inward, upper=robot.upper - inward, combined=combined)


def _drawn_in(limit: CombinedLimit, margin: float) -> CombinedLimit:
    """A limit of a sum, drawn in by an angle, rad, to its middle at most."""
    inward = min(margin, (limit.upper - limit.lower) / 2)
    return CombinedLimit(limit.factors, limit.lower + inward, limit.upper - inward)


@by_identity
class Field:
    """Lattice points and how well each serves the task.

    Attributes
    ----------
    origin : (3,), m; spacing : (3,), m; shape of the arrays : (nx, ny, nz)
    manipulability : (nx, ny, nz, slots), m^3, the smallest over the directions by branch; NO where the branch misses a
        direction, and where slots are no branches
    manipulability_any : (nx, ny, nz), the same by the best branch for each direction
    limit_margin : (nx, ny, nz, slots), rad, smallest distance from the limits of joints with less than a full turn
        and of sums of revolute joints, by branch
    """

    origin: Reals
    spacing: Reals
    manipulability: Reals
    manipulability_any: Reals
    limit_margin: Reals


@by_identity
class Places:
    """Boxes whose lattice points are all good, one row each, the best first.

    Attributes
    ----------
    centre : (n, 3), m; turned : (n,), whether the box is turned by 90 deg about z
    slot : (n,), the branch that serves it all, or MIXED
    manipulability : (n,), m^3, the criterion; limit_margin : (n,), rad (NaN with MIXED)
    """

    centre: Reals
    turned: Flags
    slot: Integers
    manipulability: Reals
    limit_margin: Reals

    def rows(self, chosen: NDArray[Any]) -> Places:
        """Some of the places.

        Parameters
        ----------
        chosen : mask or numbers

        Returns
        -------
        places : in the order chosen
        """
        return Places(*(getattr(self, part.name)[chosen] for part in fields(self)))


def lattice_spacing(box: Reals, coarsest: float) -> Reals:
    """Spacing of a lattice that divides a box's height and its shorter side evenly.

    Parameters
    ----------
    box : (3,), m
    coarsest : m, about the spacing

    Returns
    -------
    spacing : (3,), m, the same along x and y, so that the box can be turned; no less than half of ``coarsest``
    """
    sides = np.array([min(box[:2]), min(box[:2]), box[2]])
    return np.maximum(sides / np.maximum(1, np.round(sides / coarsest)), coarsest / 2)


def survey(robot: Robot, task: Task, asked: AskedOrientations, coarsest: float, free: Free | None = None) -> Field:
    """Find how well each point of a lattice over the arm's reach serves the task.

    Parameters
    ----------
    robot : with the limits that hold, see :func:`narrowed`
    task : in the frame that the robot's base is placed in
    asked : the required orientations
    coarsest : m, about the spacing
    free : which arms count; all, unless given

    Returns
    -------
    field : measures by point and branch
    """
    slots = slot_count(robot)
    start, spacing, shape, points, here = _lattice(robot, task, coarsest)
    manipulability, manipulability_any = np.full((len(points), slots), NO), np.full(len(points), NO)
    limit_margin = np.zeros((len(points), slots))
    rotations = asked.in_cone(points[here], task.axis, task.half_angle, task.step)
    if rotations.shape[-4]:
        manipulability[here], manipulability_any[here], limit_margin[here] = serve(
            robot, points[here], rotations, asked.roll, free
        )
    if not slot_labels(robot):  # slots of a point's neighbours are other arms
        manipulability[:], limit_margin[:] = NO, 0.0
    return Field(
        start,
        spacing,
        manipulability.reshape(*shape, slots),
        manipulability_any.reshape(shape),
        limit_margin.reshape(*shape, slots),
    )


def lattice_size(robot: Robot, task: Task, coarsest: float) -> int:
    """How many points of the lattice :func:`survey` would ask.

    Parameters
    ----------
    task : with box and support
    coarsest : m, about the spacing

    Returns
    -------
    count : points within reach that a box could hold
    """
    return len(_lattice(robot, task, coarsest)[-1])


def _lattice(robot: Robot, task: Task, coarsest: float) -> tuple[Reals, Reals, tuple[int, ...], Reals, Integers]:
    """Lowest corner and spacing (3,), m, shape, points (n, 3) and the numbers of those to ask."""
    frame = cell_frame(robot)
    spacing = lattice_spacing(task.box, coarsest)
    count = np.ceil(frame.ball / spacing).astype(int)
    count[2] += 1
    start = frame.middle - count * spacing
    # Heights count from the lowest place, so that the lowest box lies on lattice points.
    start[2] += (task.lowest - start[2]) % spacing[2]
    if task.support is not None and len(task.support.outline):
        corner = task.support.outline.min(axis=0)
        start[:2] += (corner - start[:2]) % spacing[:2]
    shape = tuple((2 * count + 1).tolist())
    points = start + np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3) * spacing
    asked = np.flatnonzero(
        (frame.distance(points) >= task.clear - 1e-9)
        & (points[:, 2] >= task.lowest - 1e-9)
        & (np.linalg.norm(points - frame.middle, axis=1) <= frame.ball)
        & frame.holds(points)
        & (np.True_ if task.support is None else _over(task, task.support, points))
    )
    return start, spacing, shape, points, asked


def _over(task: Task, support: Support, points: Reals) -> Flags:
    """Which points (n, 3), m, a box on a support can hold."""
    over: Flags = support.holds(points[:, :2]) & (points[:, 2] <= task.lowest + task.box[2] + 1e-9)
    return over


def serve(
    robot: Robot, points: Reals, rotations: Reals, roll: directions.Roll, free: Free | None = None
) -> tuple[Reals, Reals, Reals]:
    """How each branch serves points over all directions.

    Parameters
    ----------
    points : (n, 3), m
    rotations : (k, rolls, 3, 3), or (1 or n, k, rolls, 3, 3) if they differ between points
    roll : whether it is left to the last joint
    free : which arms count; all, unless given

    Returns
    -------
    manipulability, manipulability_any, limit_margin : (n, slots), (n,), (n, slots), as in :class:`Field`
    """
    asked, slots = directions.left_to_roll(robot, roll), slot_count(robot)
    manipulability, manipulability_any = np.full((len(points), slots), np.inf), np.full(len(points), np.inf)
    limit_margin = np.full((len(points), slots), np.inf)
    alive = np.arange(len(points))
    for direction in _by_direction(rotations):
        if not alive.size:
            break
        for part in np.array_split(alive, max(1, len(alive) * direction.shape[1] // _POSES)):
            tried = direction if len(direction) == 1 else direction[part]
            q_all, within = all_solutions(asked, directions.poses(points[part][:, None], tried).reshape(-1, 4, 4))
            value = np.where(within, manipulability_of(robot, q_all, within), NO).reshape(len(part), -1, slots)
            inside = np.full(within.shape, np.inf)
            inside[within] = _limit_margin(asked, q_all[within])
            rolled = _best_roll(
                value, q_all.reshape(*value.shape, -1), free, (manipulability[part] <= NO, manipulability_any[part])
            )[:, None]
            value = np.take_along_axis(value, rolled, axis=1)[:, 0]
            inside = np.take_along_axis(inside.reshape(len(part), -1, slots), rolled, axis=1)[:, 0]
            manipulability[part] = np.minimum(manipulability[part], value)
            manipulability_any[part] = np.minimum(manipulability_any[part], value.max(axis=1))
            limit_margin[part] = np.fmin(limit_margin[part], inside)
        # A point that no branch serves in one direction is lost; it is not asked again.
        alive = np.flatnonzero(manipulability_any > NO)
    return manipulability, manipulability_any, np.where(manipulability > NO, limit_margin, 0.0)


def _by_direction(rotations: Reals) -> Reals:
    """Rotations (k, 1 or n, rolls, 3, 3) of :func:`serve`, one direction after another."""
    return rotations[:, None] if rotations.ndim == 4 else np.moveaxis(rotations, 1, 0)


def _best_roll(value: Reals, q: Reals, free: Free | None, before: tuple[Flags, Reals]) -> Integers:
    """Which roll serves best among those whose arm counts, (n, slots); ``value`` (n, rolls, slots) of others becomes
    NO.

    ``before`` (n, slots), (n,): branches that fail in a direction looked at before, and what some branch has served
    with in all of these. A branch that failed is asked only where it can raise what some branch serves with, else it is
    NO.
    """
    best: Integers = value.argmax(axis=1)
    if free is None:
        return best
    failed, enough = before
    _refuse(value, q, free, best, ~failed)
    offered = np.take_along_axis(value, best[:, None], axis=1)[:, 0]
    served = np.where(failed, NO, offered).max(axis=1)
    late = failed & (offered > served[:, None]) & (served < enough)[:, None]
    value[np.broadcast_to((failed & ~late)[:, None], value.shape)] = NO
    _refuse(value, q, free, best, late)
    return best


def _refuse(value: Reals, q: Reals, free: Free, best: Integers, asked: Flags) -> None:
    """Only the best rolls are asked whether they count, and the next best of those that don't."""
    # Arms of one branch after another: neighbours are alike, which makes asking faster.
    slot, point = np.nonzero((asked & (np.take_along_axis(value, best[:, None], axis=1)[:, 0] > NO)).T)
    while point.size:
        roll = best[point, slot]
        refused = ~free(q[point, roll, slot])
        point, slot, roll = point[refused], slot[refused], roll[refused]
        value[point, roll, slot] = NO
        best[point, slot] = value[point, :, slot].argmax(axis=1)
        left = value[point, best[point, slot], slot] > NO
        point, slot = point[left], slot[left]


def box_points(field: Field, box: Reals, centre: Reals) -> Reals:
    """The lattice points of a box that :func:`fitting_places` has placed.

    Parameters
    ----------
    box : (3,), m
    centre : (3,), m

    Returns
    -------
    points : (n, 3), m
    """
    points = _lattice_points(field, box)
    return centre + (np.indices(tuple(points)).reshape(3, -1).T - (points - 1) / 2) * field.spacing


def serving_arms(robot: Robot, points: Reals, rotations: Reals, roll: directions.Roll, slot: int, free: Free) -> Reals:
    """The arms that serve points along all directions, by one branch or by the best.

    Parameters
    ----------
    points : (n, 3), m
    rotations : as :func:`serve` takes them
    roll : whether it is left to the last joint
    slot : the branch, or ``MIXED`` for the best one in each direction
    free : which arms count; where none does, there is no arm

    Returns
    -------
    q : (m, joints), rad or m
    """
    asked, rows, slots = directions.left_to_roll(robot, roll), np.arange(len(points)), slot_count(robot)
    first = np.zeros((len(points), slots), bool), np.full(len(points), np.inf)
    arms = []
    for direction in _by_direction(rotations):
        q, within = all_solutions(asked, directions.poses(points[:, None], direction).reshape(-1, 4, 4))
        value = np.where(within, manipulability_of(robot, q, within), NO).reshape(len(points), -1, slots)
        q = q.reshape(*value.shape, -1)
        best = _best_roll(value, q, free, first)
        offered = np.take_along_axis(value, best[:, None], axis=1)[:, 0]
        chosen = offered.argmax(axis=1) if slot == MIXED else np.full(len(points), slot)
        arms.append(q[rows, best[rows, chosen], chosen][offered[rows, chosen] > NO])
    return np.concatenate(arms)


def fitting_places(field: Field, box: Reals) -> Places:
    """All boxes on the lattice whose points are good; the box is taken up to one spacing larger.

    Parameters
    ----------
    field : of :func:`survey`
    box : (3,), m

    Returns
    -------
    places : the best first; also those turned by 90 deg, unless the box is square
    """
    found = [_places(field, box, False)]
    if abs(box[0] - box[1]) > 1e-9:
        found.append(_places(field, box[[1, 0, 2]], True))
    places = Places(*(np.concatenate([getattr(part, column.name) for part in found]) for column in fields(Places)))
    merit = (-np.round(_weighed(places), 6), places.slot == MIXED)
    order = np.lexsort((*np.round(places.centre.T, 6), -np.round(places.centre[:, 0], 6), *merit))
    return places.rows(order)


def _weighed(places: Places) -> Reals:
    """The smaller of a place's shares (n,) in the best manipulability and the best distance from limits of all."""
    ratio = places.manipulability / max(places.manipulability.max(initial=0.0), NOTHING)
    margin = np.where(np.isinf(places.limit_margin), np.inf, np.nan_to_num(places.limit_margin))
    best = max(margin[np.isfinite(margin)].max(initial=0.0), NOTHING)
    weighed: Reals = np.minimum(ratio, np.where(places.slot == MIXED, 1.0, margin / best))
    return weighed


def _places(field: Field, box: Reals, turned: bool) -> Places:
    """Places of the box in one turn, by the best single branch, else by the best of all."""
    points = _lattice_points(field, box)
    any_branch = _sliding_min(field.manipulability_any, points)
    where = np.nonzero(any_branch > NO)
    used = np.flatnonzero((field.manipulability > NO).any(axis=(0, 1, 2)))
    slots = field.manipulability.shape[-1]
    by_slot = np.full((len(where[0]), slots), NO)
    limit_margin = np.zeros((len(where[0]), slots))
    for slot in used:
        by_slot[:, slot] = _sliding_min(field.manipulability[..., slot], points)[where]
        limit_margin[:, slot] = _sliding_min(field.limit_margin[..., slot], points)[where]
    slot = np.round(by_slot, 9).argmax(axis=1)
    rows = np.arange(len(slot))
    one = by_slot[rows, slot] > NO
    return Places(
        centre=field.origin + (np.stack(where, axis=1) + (points - 1) / 2) * field.spacing,
        turned=np.full(len(slot), turned),
        slot=np.where(one, slot, MIXED),
        manipulability=np.where(one, by_slot[rows, slot], any_branch[where]),
        limit_margin=np.where(one, limit_margin[rows, slot], np.nan),
    )


def _lattice_points(field: Field, box: Reals) -> Integers:
    """How many lattice points (3,) a box spans along each axis."""
    count: Integers = np.maximum(1, np.ceil(box / field.spacing - 1e-6)).astype(int) + 1
    return count


def _sliding_min(values: Reals, points: Integers) -> Reals:
    """Smallest value over ``points`` (3,) lattice points from each one on; NO where the box leaves the lattice."""
    for axis, size in enumerate(points):
        values = scipy.ndimage.minimum_filter1d(
            values, int(size), axis, mode="constant", cval=NO, origin=-(int(size) // 2)
        )
    return values


@by_identity
class BoxPlacement:
    """Where a box can be placed: the lattice, the places on it, and the rows of the best that don't overlap."""

    field: Field
    places: Places
    chosen: list[int]

    @property
    def best_turns(self) -> Places:
        """The better of both turns at each centre."""
        key = np.round((self.places.centre - self.field.origin) / self.field.spacing * 2).astype(np.int64)
        _, first = np.unique(key, axis=0, return_index=True)
        return self.places.rows(np.sort(first))


def find_places(
    robot: Robot, task: Task, asked: AskedOrientations, grid: float, count: int, free: Free | None = None
) -> BoxPlacement:
    """Survey where the box can be placed, and choose the best places.

    Parameters
    ----------
    robot : with its own limits
    task : in the frame that the robot's base is placed in
    asked : the required orientations
    grid : m, about the lattice's spacing
    count : how many places to choose
    free : which arms count at the lattice's points; all, unless given

    Returns
    -------
    placement : all places, and the chosen ones
    """
    robot = narrowed(robot, task.margin)
    field = survey(robot, task, asked, grid, free)
    places = fitting_places(field, task.box)
    return BoxPlacement(field, places, choose_places(robot, task, places, count))


def choose_places(robot: Robot, task: Task, places: Places, count: int) -> list[int]:
    """Choose the best places that differ: none overlaps one before it, or is one before it turned about axis 1.

    Parameters
    ----------
    places : the best first
    count : how many at most

    Returns
    -------
    rows : numbers of places, the best first
    """
    rows: list[int] = []
    sizes = np.where(places.turned[:, None], task.box[[1, 0, 2]], task.box)
    left = np.ones(len(places.slot), dtype=bool)
    while len(rows) < count and left.any():
        row = int(np.argmax(left))
        rows.append(row)
        apart = np.abs(places.centre - places.centre[row]) >= (sizes + sizes[row]) / 2 - 1e-9
        left &= apart.any(axis=1) & ~_turned_about_axis_1(robot, task, places.centre, row)
    return rows


def _turned_about_axis_1(robot: Robot, task: Task, centre: Reals, row: int) -> Flags:
    """Which places (n, 3) are that of ``row`` but for a turn about axis 1, where the task looks the same after one."""
    frame = cell_frame(robot)
    if frame.bar or abs(task.axis @ frame.R[2]) < 1 - 1e-9:
        return np.zeros(len(centre), dtype=bool)
    local = (centre - frame.origin) @ frame.R.T
    rho = np.hypot(local[:, 0], local[:, 1])
    near = np.abs(rho - rho[row]) < task.box[:2].min() - 1e-9
    same: Flags = near & (np.abs(local[:, 2] - local[row, 2]) < task.box[2] - 1e-9)
    return same
