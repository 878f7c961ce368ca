"""Values that fill a URDF's fields and are no data: they are named, and left out, so that nothing rests on them.

A field that a format asks for is filled with something where its value is not known: the same effort, friction or
damping for all joints, whatever they carry; 1 kg for each link; half a turn to either side for each joint. Other values
can't be meant as they stand: centres of mass far outside of what the same file draws of the link, as in the base's
coordinates, or all at the links' origins; moments of inertia about these; or efforts with which the arm can't hold its
own links.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from er3a.dynamics.arm_model import arm_model
from er3a.dynamics.plausibility import mass_findings
from er3a.dynamics.torques import worst_holding
from er3a.finding import is_one
from er3a.numerics.arrays import Reals
from er3a.robots.masses import Masses
from er3a.robots.robot import Robot, Source

ROUNDED_RAD = 2e-3  # half a turn written as 3.14
SEVERAL = 3  # joints or links, that no maker's arm has alike
THOUSAND = 1000.0  # N m: of no motors that are known in whole ones; generators of URDFs write them
WITHIN = 1.25  # masses of a file may be off by a fifth, before its efforts are held to contradict them
OUTSIDE_MM = 250.0  # beyond all that is drawn of a link: more than what is glued to it without a shape explains


def without_placeholders(robot: Robot) -> tuple[Robot, tuple[str, ...]]:
    """An imported arm without the values that are no data.

    Parameters
    ----------
    robot : with limits, masses and drives as the file states them, and its shapes and visual meshes

    Returns
    -------
    robot : without these efforts, frictions and masses; limits stay, graded ``inferred``
    notes : what was found, and what is not judged therefore; in words
    """
    notes = []
    stated = ~robot.slides & ~robot.continuous
    half_turns = np.isclose([-robot.lower, robot.upper], math.pi, rtol=0, atol=ROUNDED_RAD)[:, stated]
    if half_turns.shape[1] >= SEVERAL and half_turns.all():
        source = Source("The file gives all joints +-180 deg, which is a placeholder", "inferred")
        robot = robot.replace(sources={**robot.sources, "limits": source})
        notes.append("the limits +-180 deg of all joints are a placeholder: what rests on limits is not settled")
    if why := _no_masses(robot):
        robot = robot.replace(masses=Masses(drives=robot.masses.drives))
        notes.append(f"{why}: the masses can't be right, so no torque is judged")
    drives, why = robot.masses.drives, _no_efforts(robot)
    alike = [kind for kind in ("coulomb", "viscous") if drives and _alike(getattr(drives, kind))]
    if drives and (why or alike):
        rest = replace(drives, **dict.fromkeys([*alike, *(["peak"] if why else [])], np.full(robot.joints, np.nan)))
        known = np.isfinite([rest.peak, rest.coulomb, rest.viscous]).any()
        robot = robot.replace(masses=replace(robot.masses, drives=rest if known else None))
    if why:
        notes.append(f"{why}: a placeholder, so no torque is held against it")
    if alike:
        notes.append("all joints have the same friction or damping: a placeholder, so joints count as without")
    return robot, tuple(notes)


def _no_efforts(robot: Robot) -> str:
    """Why efforts are none; empty if they may be meant."""
    peak = np.empty(0) if robot.masses.drives is None else robot.masses.drives.peak
    if _alike(peak):
        return f"all joints have the effort {np.nanmax(peak):g}"
    round_ = peak[(peak > 0) & (peak % THOUSAND == 0)]
    if len(round_) >= SEVERAL:
        return f"joints have efforts such as {round_[0]:g}"
    if not robot.masses.links or not len(peak):
        return ""
    held = np.abs(worst_holding(arm_model(robot)).values)
    for short in np.flatnonzero(held > WITHIN * peak)[:1]:
        return f"joint {short + 1} has the effort {peak[short]:g}, and the arm's links alone ask {held[short]:.3g}"
    return ""


def _alike(values: Reals) -> bool:
    """Whether the joints of which a value is known have all the same, above 0."""
    known = values[np.isfinite(values)]
    return bool(len(known) >= SEVERAL and np.ptp(known) == 0 and known[0] > 0)


def _no_masses(robot: Robot) -> str:
    """Why masses are none; empty if they may be meant."""
    links = [each for each in robot.masses.links if each.link]  # what the base weighs moves nothing
    masses = [each.body.mass for each in links]
    least = min(masses, default=math.nan)
    # Of links that are fixed to each other, each has it, and they count as one.
    if masses.count(least) >= SEVERAL and not np.mod(np.round(np.divide(masses, least), 6), 1).any():
        return f"all links have the mass {least:g} kg"
    moments = [np.linalg.eigvalsh(each.body.inertia_matrix) for each in links]
    if len(moments) >= SEVERAL and np.allclose(moments, moments[0][0]):
        return f"all links have the moment of inertia {moments[0][0]:g} kg m2 about each axis"
    if len(links) >= SEVERAL and not np.round([each.body.centre[:2] for each in links], 6).any():
        return "the centres of mass of all links are on the axes of their own joints"
    doubts = mass_findings(robot) if links else ()
    far = {each.outside_mm: each.link for each in doubts if is_one(each, "centre_outside")}
    if far and (most := max(far)) > OUTSIDE_MM:
        return f"the centre of mass of link {far[most]} is {most:.0f} mm outside of the link"
    about = [each.link for each in doubts if is_one(each, "about_origin")]
    if len(about) >= SEVERAL:
        return f"{len(about)} links have inertias about their origin, not about their centre of mass"
    return ""
