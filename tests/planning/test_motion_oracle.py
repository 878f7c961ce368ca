"""Verdicts of motions against an oracle that imports nothing of er3a; more of it in the campaign on motions."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.forward import forward
from er3a.pipeline.stages.trajectory import judgement
from er3a.planning.motion_faults import open_stretches
from testing.motion_cases import (
    JOINT_KINDS,
    TOOL_KINDS,
    Tally,
    compare,
    judged,
    limits_of,
    looked_at,
    random_spec,
)
from testing.motion_oracle import Truth

pytestmark = pytest.mark.long

POINTS = 60_001


@pytest.mark.parametrize(("kind", "name"), list(zip([*JOINT_KINDS, *TOOL_KINDS], cycle(["er3_600", "er3a_c60"]))))
def test_nothing_is_missed_or_invented_whatever_the_samples(name, kind, tmp_path):
    robot, random = load_robot(name), np.random.default_rng([7, len(kind)])
    tallies = {2: Tally(), 500: Tally()}
    for _ in range(2):
        spec, written = random_spec(robot, kind, random, tmp_path)
        seen = looked_at(robot, spec, POINTS)
        for samples, tally in tallies.items():
            assert compare(robot, spec, written, samples, tally, seen) == []
    few, many = tallies[2], tallies[500]
    assert (few.safe, few.undecided, few.unreachable) == (many.safe, many.undecided, many.unreachable)


def test_the_comparison_can_fail(tmp_path):
    """A crossing and a stretch that the oracle adds are called missed."""
    robot, random = load_robot("er3_600"), np.random.default_rng(1)
    spec, written = random_spec(robot, "joint moves", random, tmp_path)
    seen = looked_at(robot, spec, POINTS)
    more = Truth(seen.t, [*seen.crossings, (0, 0.123)], [*seen.stretches, (1, 3, 0.1, 0.2)], False)
    wrong = compare(robot, spec, written, 2, Tally(), more)
    assert any("missed wrist" in text for text in wrong)
    assert any("missed order 1 J4" in text for text in wrong)


def test_what_is_open_beside_an_event_is_undecided_where_nobody_finds_the_event(tmp_path, monkeypatch):
    """A line through the aligned wrist, judged by someone who does not see that it is singular."""
    robot = load_robot("er3_600")
    q = np.radians([10.0, -30.0, 20.0, 0.0, 4.0, 15.0])
    turned = np.array([1, 1, 1, 1, -0.5, 1])  # by -1 the event is at a time of the grid, and rounding alone opens a gap
    T = forward(robot, np.stack([q, q * turned]))
    ends = [{"xyz_mm": (pose[:3, 3] * 1000).tolist(), "rpy_deg": np.degrees(rpy_of(pose)).tolist()} for pose in T]
    written = {"kind": "line", "start_deg": np.degrees(q).tolist(), "end": ends[1], "duration_s": 20.0}
    limits = limits_of(robot, {"limits_jerk": False, "known_acceleration": False})
    motion, seen = judged(robot, written, 50, limits)
    assert seen.verdict == "singular"
    assert open_stretches(motion.curve)
    monkeypatch.setattr(judgement, "singular_events", lambda *_: [])
    blind = judged(robot, written, 50, limits)[1]
    assert blind.verdict != "safe"
    assert "undecided" in blind.faults


@pytest.mark.parametrize(
    ("start", "xyz", "rpy", "duration"),
    [
        ([100.139823, -1.162150, 91.643238, 103.039661, -46.790756, -290.638948],
         [-73.957903, 61.658870, 937.969084], [-56.984400, -13.630461, 93.025245], 1.283259),
        ([-40.853948, 24.922158, 42.015753, 8.568680, -54.470744, -74.178321],
         [136.651664, -78.231801, 894.654728], [83.195510, -33.719966, 74.401484], 2.310067),
    ],
)  # fmt: skip
def test_where_a_branch_has_to_be_left_does_not_depend_on_samples(start, xyz, rpy, duration):
    """Lines that only another branch can end: where it is taken, no curve settles, and so samples must not."""
    robot = load_robot("er3a_c60")
    written = {"kind": "line", "start_deg": start, "end": {"xyz_mm": xyz, "rpy_deg": rpy}, "duration_s": duration}
    limits = limits_of(robot, {"limits_jerk": False, "known_acceleration": False})
    found = [judged(robot, written, samples, limits) for samples in (2, 50, 500)]
    jumps = {tuple((jump.t, jump.joint) for jump in motion.followed.jumps) for motion, _ in found}
    assert len(jumps) == 1
    assert jumps != {()}
    assert len({judgement.verdict for _, judgement in found}) == 1
    assert found[0][1].verdict not in ("safe", "undecided")
