"""Ranking solutions by each rule, against the measures computed by hand, and sequences against brute force."""

from __future__ import annotations

import itertools
import warnings

import numpy as np
import pytest

import er3a
from er3a.collision.along import clearance
from er3a.errors import Er3aError
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import SceneFile
from er3a.finding import fact
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.inverse import inverse
from er3a.selection.select import RULES, joint_weights, mixed_cost, select, select_sequence
from testing.arms import DEG, joints_at_random

POSE = np.array([10, 20, 10, 30, 40, -50]) * DEG
WALL = {"kind": "scene", "title": "wall", "planes": [{"name": "wall", "normal": [0, -1, 0], "offset_mm": -10}]}


@pytest.fixture
def arm():
    return load_robot("er3_600")


@pytest.fixture
def solutions(arm):
    return inverse(arm, forward(arm, POSE))


def test_each_rule_orders_by_its_measure(arm, solutions):
    q, q_ref = solutions.q, np.full(6, 0.1)
    moves = q - q_ref
    J = jacobian(arm, q)
    J[:, :3] /= np.hypot(arm.a[2], arm.d[3]) + arm.a[1]
    by_hand = {
        "nearest": np.degrees(np.abs(moves).max(axis=1)),
        "weighted": np.degrees(np.sqrt((joint_weights(arm) ** 2 * moves**2).sum(axis=1))),
        "time": (np.abs(moves) / arm.speed).max(axis=1),
        "manipulability": np.abs(np.linalg.det(J)),
        "limits": np.degrees(np.minimum(q - arm.lower, arm.upper - q).min(axis=1)),
        "clearance": clearance(arm, q, None).distance * 1000,
    }
    assert set(by_hand) == set(RULES)
    for name, expected in by_hand.items():
        ranking = select(arm, solutions, name, q_ref)
        np.testing.assert_allclose(ranking.measured[name], expected, rtol=1e-9)
        ordered = expected[ranking.order] * (1 if RULES[name].best == "least" else -1)
        assert (np.diff(ordered) >= -1e-6).all()
        usable = solutions.within_limits.copy()
        usable[usable] = clearance(arm, solutions.q[usable], None).distance >= 0
        assert sorted(ranking.order) == np.flatnonzero(usable).tolist()
        assert ranking.reason[ranking.chosen].place == 1


def test_mix_stretches_each_rule_over_its_range(arm, solutions):
    ranking = select(arm, solutions, {"time": 1, "limits": 3}, np.zeros(6))
    allowed = solutions.within_limits
    time, limits = ranking.measured["time"], -ranking.measured["limits"]
    stretched = [(each - each[allowed].min()) / np.ptp(each[allowed]) for each in (time, limits)]
    np.testing.assert_allclose(ranking.cost, stretched[0] + 3 * stretched[1])
    assert ranking.chosen == np.flatnonzero(allowed)[ranking.cost[allowed].argmin()]
    assert [measure.rule for measure in ranking.chosen_reason.measures] == ["time", "limits"]
    assert ranking.chosen_reason.measures[0].value.value == time[ranking.chosen]
    assert ranking.chosen_reason.next_best[0].value.value == time[ranking.order[1]]


def test_at_a_singular_pose_a_nearer_solution_of_this_reference_is_named(arm):
    q = np.array([10, 20, 10, 15, 0, 40]) * DEG
    pose, q_ref = forward(arm, q), q + np.array([0, 0, 0, 60, 0, -60]) * DEG
    with pytest.warns(er3a.InputWarning, match=r"a solution .* deg nearer to q_ref is not among these"):
        select(arm, inverse(arm, pose), "nearest", q_ref)
    near = inverse(arm, pose, q_ref)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        chosen = select(arm, near, "nearest", q_ref).chosen
    np.testing.assert_allclose(near.q[chosen], q_ref, atol=1e-9)


def test_colliding_solutions_are_refused_with_their_pair(arm, solutions):
    scene = SceneFile.model_validate(WALL).scene()
    ranking = select(arm, solutions, "nearest", np.zeros(6), scene)
    clear = clearance(arm, solutions.q, scene)
    touching = solutions.within_limits & (clear.distance < 0)
    assert touching.any()
    for row in np.flatnonzero(touching):
        assert row not in ranking.order
        assert ranking.reason[row] == fact("pair_overlaps", pair=clear.pair[row], depth_mm=-clear.distance[row] * 1000)


def test_nothing_left_says_why(arm, solutions):
    everywhere = WALL | {"planes": [{"name": "rock", "normal": [0, 0, 1], "offset_mm": 5000}]}
    ranking = select(arm, solutions, "time", np.zeros(6), SceneFile.model_validate(everywhere).scene())
    assert ranking.chosen is None
    assert ranking.chosen_reason.code == "all_collide"
    assert ranking.chosen_reason.count == solutions.within_limits.sum()
    far = forward(arm, POSE)
    far[:3, 3] += 9
    assert select(arm, inverse(arm, far), "time", np.zeros(6)).chosen_reason.code == "no_solution"


@pytest.mark.parametrize("rule", ["nearest", "weighted", "time"])
def test_sequence_is_the_best_of_all(arm, random, rule):
    q = joints_at_random(arm, random, 3)
    poses = [inverse(arm, T) for T in forward(arm, q)]
    found = select_sequence(arm, poses, np.zeros(6), rule)
    inside = [solution.q[solution.within_limits] for solution in poses]
    weights = {"nearest": np.degrees(np.ones(6)), "weighted": np.degrees(joint_weights(arm)), "time": 1 / arm.speed}[
        rule
    ]

    def cost(path):
        steps = np.abs(np.diff(np.array([np.zeros(6), *path]), axis=0)) * weights
        return (np.linalg.norm(steps, axis=1) if rule == "weighted" else steps.max(axis=1)).sum()

    least = min(cost(path) for path in itertools.product(*(rows[:40] for rows in inside)))
    assert found.cost == pytest.approx(cost(found.q))
    assert found.cost <= least + 1e-9
    assert found.greedy_cost == pytest.approx(cost([p.q[r] for p, r in zip(poses, found.greedy_rows)]))
    assert found.cost <= found.greedy_cost + 1e-9


def test_looking_ahead_beats_greed(arm):
    """The nearest way to the first pose takes joint 6 up to its limit, from where the second one is far."""
    last = np.arange(6) == 5
    arm = arm.replace(lower=np.where(last, -200 * DEG, arm.lower), upper=np.where(last, 200 * DEG, arm.upper))
    start = np.array([0, 0.2, -0.3, 0, 0.9, 10 * DEG])
    q = np.tile(start, (2, 1))
    q[:, 5] = np.array([185, 275]) * DEG
    found = select_sequence(arm, [inverse(arm, T) for T in forward(arm, q)], start, "nearest")
    assert found.greedy_cost == pytest.approx(175 + 180)
    assert found.cost == pytest.approx(180 + 90)


def test_bad_rules_are_refused(arm, solutions):
    zeros = np.zeros(6)
    with pytest.raises(Er3aError, match="there is no rule 'quickest'; known: nearest, weighted, time"):
        select(arm, solutions, "quickest", zeros)
    with pytest.raises(Er3aError, match="the weight of rule 'time' is -1"):
        select(arm, solutions, {"time": -1}, zeros)
    with pytest.raises(Er3aError, match="the weight of rule 'time' is 'high'"):
        select(arm, solutions, {"time": "high"}, zeros)
    with pytest.raises(Er3aError, match="the rule is None; expected a name"):
        select(arm, solutions, None, zeros)
    with pytest.raises(Er3aError, match=r"the scene is a str; expected what er3a\.load_scene returns"):
        select(arm, solutions, "clearance", zeros, "scene.yaml")
    with pytest.raises(Er3aError, match=r"q_ref has shape \(5,\)"):
        select_sequence(arm, [solutions], np.zeros(5))
    with pytest.raises(Er3aError, match="all weights of the mix"):
        select(arm, solutions, {"time": 0.0}, zeros)
    with pytest.raises(Er3aError, match="the mix of rules is empty"):
        select(arm, solutions, {}, zeros)
    with pytest.raises(Er3aError, match="needs joint speeds"):
        select(arm.replace(speed=np.full(6, np.nan)), solutions, "time", zeros)
    with pytest.raises(Er3aError, match="a sequence can't be ranked by 'limits'"):
        select_sequence(arm, [solutions], zeros, "limits")
    with pytest.raises(Er3aError, match="the sequence is empty"):
        select_sequence(arm, [], zeros)
    far = forward(arm, POSE)
    far[:3, 3] += 9
    with pytest.raises(Er3aError, match="pose 1 of the sequence has no solution"):
        select_sequence(arm, [solutions, inverse(arm, far)], zeros)


def test_public_names():
    assert er3a.select.__wrapped__ is select
    assert er3a.select_sequence.__wrapped__ is select_sequence


def test_an_infinite_cost_is_the_worst_of_its_rule_and_no_nan():
    every = np.ones(3, dtype=bool)
    mixed = mixed_cost({"nearest": 1, "limits": 1}, _costs(3, 4, np.inf), every)
    np.testing.assert_array_equal(mixed, [0, 1.5, 2])
    mixed = mixed_cost({"nearest": 0, "limits": 1}, _costs(-np.inf, 4, np.inf), every)
    np.testing.assert_array_equal(mixed, [0, 0.5, 1])
    mixed = mixed_cost({"nearest": 2, "limits": 1}, _costs(-np.inf, 4, 6), every)
    np.testing.assert_array_equal(mixed, [0, 0.5, 3])


def _costs(*nearest):
    return {"nearest": np.array(nearest, float), "limits": np.array([1.0, 2, 3])}
