"""Plausibility of masses: implausible values in the data of links, entry by entry.

Values that no body can have are refused when a file is read (:func:`er3a.robots.masses.no_body`). Here are values that
are possible but unlikely for this link. Shapes are the links' meshes or capsules; if they are guessed from the table,
only errors by orders of magnitude count.
"""

from __future__ import annotations

import numpy as np

from er3a.dynamics.arm_model import WATER, LinkShape, drives_of, link_shapes
from er3a.finding import Finding, fact, is_one
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import size_of
from er3a.robots.masses import MassBody, about, no_body, six_moments
from er3a.robots.robot import Robot

LIGHTEST, HEAVIEST = 100.0, 12_000.0
"""kg/m^3 of a link's shape: thin shells, and more than solid steel."""
BEYOND_SHAPE = 0.03
"""m by which a centre may be outside the hull of the shape, which leaves out housings."""
GUESSED = 10.0
"""How much wider bounds are of a guessed shape; a centre may then be outside by the arm's size."""
WIDEST_RATIO, NARROWEST_RATIO = 3.0, 0.1
"""Radius of gyration against that of the filled capsules."""
WEIGHT_RATIO = 0.15  # of the stated weight, by which the sum of the links may differ
LIGHT = 0.01  # of the arm's mass: of less than that, as a flange, a moment of inertia changes no torque
PARALLEL_RATIO = 2.0  # of the inertia that the shape would have: more is too much


def mass_findings(robot: Robot) -> tuple[Finding, ...]:
    """Implausible values among a robot's masses, link by link, then their sum.

    Parameters
    ----------
    robot : bodies of links in SI, shapes, rotors and the weight that the manufacturer states

    Returns
    -------
    findings : at most a few for each link; empty if nothing is implausible
    """
    shapes = link_shapes(robot)
    drives, total = drives_of(robot), sum(each.body.mass for each in robot.masses.links)
    found: list[Finding] = []
    for link in range(1, robot.rows + 1):  # the base loads no joint
        body = robot.masses.body(link)
        if body is None or not has_mass(body):
            rotor = robot.coupling is None and drives.armature[link - 1] > 0
            # A massless link with mass beyond it is no singular joint: what it carries has inertia about its axis.
            carries = any(has_mass(robot.masses.body(k)) for k in range(link + 1, robot.rows + 1))
            found.append(fact("missing_link", link=link, singular=not rotor and not carries))
        elif problem := no_body(body):
            found.append(fact("impossible_inertia", link=link, why=problem))
        elif body.mass == 0:
            found.append(fact("inertia_without_mass", link=link))
        elif not any(body.inertia):
            found += [fact("point_mass", link=link)] if body.mass > LIGHT * total else []
        elif link in shapes:
            found += _against_shape(link, body, shapes[link], size_of(robot))
    return (*found, *_against_weight(robot, total, any(is_one(each, "missing_link") for each in found)))


def has_mass(body: MassBody | None) -> bool:
    """Whether a body adds anything to torques.

    Parameters
    ----------
    body : of a link, or None

    Returns
    -------
    adds : it has a mass above 0 kg or an inertia
    """
    return body is not None and (body.mass > 0 or any(body.inertia))


def _against_shape(link: int, body: MassBody, shape: LinkShape, size: float) -> list[Finding]:
    """What density, centre and inertia of a body say against the link's shape; ``size`` of the arm, m."""
    water, slack = shape.water, GUESSED if shape.guessed else 1.0
    found: list[Finding] = []
    density = WATER * body.mass / water.mass
    if not LIGHTEST / slack <= density <= HEAVIEST * slack:
        found.append(fact("unlikely_density", link=link, mass_kg=body.mass, density_kg_m3=density))
    centre = np.array(body.centre)
    outside = shape.outside(centre)
    if outside > (size if shape.guessed else BEYOND_SHAPE):
        found.append(fact("centre_outside", link=link, outside_mm=1000 * outside))
    own, expected = _gyration(body.inertia_matrix, body.mass), _gyration(water.inertia_matrix, water.mass)
    less = body.inertia_matrix - body.mass * about(centre)
    at_centre = MassBody(body.mass, body.centre, six_moments(less))
    expected_trace = float(np.trace(water.inertia_matrix)) * body.mass / water.mass
    given, rest = float(np.trace(body.inertia_matrix)), float(np.trace(less))
    if (
        not shape.guessed
        and given > PARALLEL_RATIO * expected_trace
        and no_body(at_centre) is None
        and rest < PARALLEL_RATIO * expected_trace
    ):
        found.append(
            fact(
                "about_origin",
                link=link,
                given_kg_m2=given / 2,
                about_centre_kg_m2=rest / 2,
                shape_kg_m2=expected_trace / 2,
            )
        )
    elif not NARROWEST_RATIO / slack <= own / expected <= WIDEST_RATIO * slack:
        found.append(fact("unlikely_inertia", link=link, gyration_mm=1000 * own, shape_mm=1000 * expected))
    return found


def _against_weight(robot: Robot, total: float, incomplete: bool) -> list[Finding]:
    """Whether the sum of the links' masses contradicts the stated weight."""
    weight = robot.masses.weight
    if not (np.isfinite(weight) and robot.masses.links):
        return []
    complete = not incomplete and robot.masses.body(0) is not None
    off = total > weight * (1 + WEIGHT_RATIO) or (complete and total < weight * (1 - WEIGHT_RATIO))
    return [fact("sum_off_weight", sum_kg=total, weight_kg=weight, complete=complete)] if off else []


def _gyration(tensor: Reals, mass: float) -> float:
    """Mean radius of gyration, m: half the trace is the second moment of the mass about the centre."""
    return float(np.sqrt(np.trace(tensor) / 2 / mass))
