"""The weight and the lever that the page of torques draws at a joint that holds them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.pipeline.stages.dynamics.model import HoldingTorque, LinkEntry
from er3a.pipeline.stages.dynamics.page.played import held
from er3a.pipeline.viewing.drawn import poses_at

ROBOT = load_robot("er3a_c60")
LINKS = [LinkEntry(2, 5.0, (120.0, -4.0, 10.0), False), LinkEntry(4, 1.5, (0.0, 3.0, 220.0), False)]
Q_DEG = (30.0, -60.0, 20.0, 40.0, -30.0, 10.0)
STEP = 1e-6


def drawn(joint, links=LINKS, **load):
    """The marks of a joint that holds the links in the pose Q_DEG."""
    summary = SimpleNamespace(
        masses=SimpleNamespace(**({"links": links, "load_kg": None} | load)),
        holding=[HoldingTorque(joint, 1.0, 0.1, "N m", Q_DEG, (1.0,) * 6)],
    )
    return held(ROBOT, SimpleNamespace(summary=summary))[0].marks


def moment_kg_m(joint):
    """The static moment about a joint, by how the height of all masses changes as it turns; kg m."""

    def height(turn):
        q = np.radians(Q_DEG)
        q[joint - 1] += turn
        poses = poses_at(ROBOT, q)
        moved = [each for each in LINKS if each.link >= joint]
        return sum(each.mass_kg * (poses[each.link] @ [*(np.array(each.centre_mm) / 1000), 1.0])[2] for each in moved)

    return abs(height(STEP) - height(-STEP)) / (2 * STEP)


@pytest.mark.parametrize("joint", [2, 3])
def test_weight_times_lever_is_the_moment_that_the_joint_holds(joint):
    lever, weight, *others = drawn(joint)
    hung = [each.mass_kg for each in LINKS if each.link >= joint]
    kg = sum(hung)
    own = np.average([mark.start for mark in others[-len(hung) :]], axis=0, weights=hung)
    assert weight.start == pytest.approx(own, abs=1e-9)  # of the links' own weights
    far = np.linalg.norm(np.subtract(lever.end, lever.start))
    assert kg * far == pytest.approx(moment_kg_m(joint), rel=1e-6)
    assert lever.start[2] == pytest.approx(lever.end[2], abs=1e-12)
    poses = poses_at(ROBOT, np.radians(Q_DEG))
    parts = [
        each.mass_kg * (poses[each.link] @ [*(np.array(each.centre_mm) / 1000), 1])[2]
        for each in LINKS
        if each.link >= joint
    ]
    assert weight.start[2] == pytest.approx(sum(parts) / kg, abs=1e-9)
    assert (lever.text, weight.text) == (f"{1000 * far:.0f} mm", f"{kg:.2f} kg")


def test_nothing_is_drawn_of_a_joint_that_is_not_level_or_of_masses_that_are_not_known():
    assert not drawn(5)
    assert not drawn(2, [replace(each, mass_kg=None) for each in LINKS])
    assert not drawn(2, load_kg=1.0)
