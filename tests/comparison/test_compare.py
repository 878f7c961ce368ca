"""Whether two tables are of one arm, against arms that are made here from D-H matrices alone."""

from __future__ import annotations

import numpy as np
import pytest

import er3a
from er3a.comparison.compare import best_of

KINDS = ("generic", "industrial", "parallel", "coincident", "nearly_parallel", "slides", "scara")


def rot(axis: int, angle: float) -> np.ndarray:
    T = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i] = np.sin(angle)
    T[i, j] = -T[j, i]
    return T


def shift(x: float, y: float, z: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def flange_of(robot: er3a.Robot, q: np.ndarray) -> np.ndarray:
    """Standard D-H, as any textbook has it; of er3a only the numbers."""
    T = robot.base
    for k in range(robot.rows):
        x = robot.direction[k] * q[k]
        theta, d = (robot.offset[k], robot.d[k] + x) if robot.sliding[k] else (robot.offset[k] + x, robot.d[k])
        T = T @ rot(2, theta) @ shift(0, 0, d) @ shift(robot.a[k], 0, 0) @ rot(0, robot.alpha[k])
    return T @ robot.flange


def table(rng: np.random.Generator, kind: str) -> dict[str, np.ndarray]:
    n = 4 if kind == "scara" else int(rng.integers(4, 9))
    a, d = rng.choice([0, 0, 0.1, 0.25, 0.42], (2, n)) * rng.uniform(0.9, 1.1, (2, n))
    alpha = np.radians(rng.choice([90.0, -90.0, 0.0, 180.0], n))
    sliding = np.zeros(n, dtype=bool)
    k = int(rng.integers(0, n - 1))
    if kind == "generic":
        a, d, alpha = rng.uniform(-0.5, 0.5, n), rng.uniform(-0.5, 0.5, n), rng.uniform(-3, 3, n)
    if kind == "industrial":
        a, d = (np.resize(own, n) for own in ([0.15, 0.6, 0.13, 0.0, 0.0], [0.4, 0.0, 0.0, 0.64, 0.0, 0.1]))
        alpha = np.radians(np.resize([-90.0, 0.0, -90.0, 90.0, -90.0, 0.0], n))
    if kind == "parallel":
        alpha[:3], a[:3] = np.radians(rng.choice([0.0, 180.0], 3)), rng.uniform(0.1, 0.5, 3)
    if kind == "coincident":
        a[k], alpha[k] = 0.0, rng.choice([0.0, np.pi])
    if kind == "nearly_parallel":
        alpha[k] = np.radians(10 ** rng.uniform(-6, 0.4))
    if kind == "slides":
        sliding = rng.random(n) < 0.3
    if kind == "scara":
        a, d, alpha = np.array([0.25, 0.25, 0, 0]), np.array([0.2, 0, 0, 0.05]), np.array([0, np.pi, 0, 0])
        sliding = np.arange(4) == 2
    offset = np.where(sliding, np.radians(rng.choice([0.0, 90.0, 180.0, 30.0], n)), rng.uniform(-3, 3, n))
    return {
        "a": a,
        "d": d,
        "alpha": alpha,
        "offset": offset,
        "direction": rng.choice([1.0, -1.0], n),
        "sliding": sliding,
    }


def robot(values: dict[str, np.ndarray], **placed: np.ndarray) -> er3a.Robot:
    sliding = values["sliding"]
    ends = {"lower": np.where(sliding, 0.0, -2.5), "upper": np.where(sliding, 0.5, 2.5)}
    return er3a.Robot(name="arm", title="arm", convention="standard", **ends, **values, **placed)


def pose(rng: np.random.Generator) -> np.ndarray:
    turns = [rot(axis, rng.uniform(-3, 3)) for axis in (2, 1, 0)]
    return shift(*rng.uniform(-0.5, 0.5, 3)) @ turns[0] @ turns[1] @ turns[2]


def defined_elsewhere(rng: np.random.Generator, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The same arm with other zeros, directions, ends, and other feet of normals between parallel axes."""
    n, own = len(values["a"]), {key: value.copy() for key, value in values.items()}
    own["offset"] = np.where(own["sliding"], own["offset"], rng.uniform(-3, 3, n))
    own["direction"] = rng.choice([1.0, -1.0], n)
    own["d"] = np.where(own["sliding"], own["d"] + rng.uniform(-0.2, 0.2, n), own["d"])
    own["d"][[0, -1]], own["a"][-1], own["alpha"][-1] = rng.uniform(-0.3, 0.3, 2), 0.05, rng.uniform(-3, 3)
    for k in np.flatnonzero(np.abs(np.sin(own["alpha"][:-1])) < 1e-12):
        moved = rng.uniform(-0.2, 0.2)
        own["d"][k] += moved
        own["d"][k + 1] -= moved * np.cos(own["alpha"][k])
    return own


@pytest.mark.parametrize("kind", KINDS)
def test_no_right_table_is_accused(kind):
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(12):
        values = table(rng, kind)
        printed = robot(values)
        assert er3a.compare(printed, printed).verdict == "equal"
        other = robot(defined_elsewhere(rng, values), base=pose(rng), flange=pose(rng))
        found = er3a.compare(printed, other)
        assert (found.verdict, found.geometry.differences) == ("same_arm", ())
        assert found.aligned_mm < 0.5
        q = rng.uniform(printed.lower, printed.upper, (20, printed.joints))
        gaps = [np.linalg.norm((flange_of(printed, row) - flange_of(other, row))[:3, 3]) for row in q]
        assert found.as_printed_mm > 1000 * max(gaps) * 0.5
        mended = er3a.compare(found.corrected, other)
        assert mended.verdict == "equal"
        far = max(np.linalg.norm((flange_of(found.corrected, row) - flange_of(other, row))[:3, 3]) for row in q)
        assert 1000 * far == pytest.approx(0, abs=4.0)  # angles that agree to 0.1 deg stay as printed


@pytest.mark.parametrize("kind", ["generic", "industrial", "parallel"])
@pytest.mark.parametrize("moved", [False, True])
def test_wrong_entries_are_named(kind, moved):
    rng = np.random.default_rng(5)
    for _ in range(4):
        values = table(rng, kind)
        printed = robot(values)
        n, wrong = printed.joints, {key: value.copy() for key, value in values.items()}
        block = 3 if kind == "parallel" else 0  # d in front of it belongs to the base
        names = [("a", k) for k in range(n - 1)] + [("alpha", k) for k in range(n - 1) if k > block]
        chosen = [names[i] for i in rng.permutation(len(names))[: rng.integers(1, 5)]]
        for column, k in chosen:
            wrong[column][k] += np.radians(rng.choice([0.2, 2, 37])) if column == "alpha" else rng.choice([6e-4, 0.05])
        other = robot(wrong)
        if moved:
            other = robot(defined_elsewhere(rng, wrong), base=pose(rng), flange=pose(rng))
        found = er3a.compare(printed, other)
        assert found.verdict == "other_arm"
        assert {each.entry for each in found.geometry.differences} == {f"{column}{k + 1}" for column, k in chosen}
        assert er3a.compare(found.corrected, other).geometry.same


def article() -> er3a.Robot:
    return er3a.load_robot("er3a_c60_article")


def test_the_articles_table_is_another_arm():
    found = er3a.compare(article(), er3a.load_robot("er3a_c60"))
    assert found.verdict == "other_arm"
    assert [each.entry for each in found.geometry.differences] == ["a1", "a2", "a3", "d4"]
    assert er3a.compare(found.corrected, er3a.load_robot("er3a_c60")).verdict == "equal"


@pytest.mark.parametrize(
    ("slip", "cause"),
    [
        (lambda arm: arm.replace(a=arm.d, d=arm.a), "a_and_d_swapped"),
        (lambda arm: arm.replace(convention="modified"), "other_convention"),
        (lambda arm: arm.replace(a=arm.a / 25.4, d=arm.d / 25.4), "unit"),
        (lambda arm: arm.replace(a=arm.a * 1.3, d=arm.d * 1.3), "scale"),
        (lambda arm: arm.replace(d=np.roll(arm.d, 1)), "rows_shifted"),
    ],
)
def test_slips_are_named(slip, cause):
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    found = er3a.compare(slip(right), right)
    assert found.verdict == "other_arm"
    assert [(each.code, each.side) for each in found.geometry.causes] == [(cause, "a")]


def test_all_alphas_negated_of_an_arm_that_is_its_own_mirror_image_is_a_matter_of_directions():
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    found = er3a.compare(right.replace(alpha=-right.alpha), right)
    assert found.verdict == "same_arm"
    assert not found.directions.same


def test_couplings_and_counts_and_kinds():
    right = er3a.load_robot("er3_600")
    coupling = np.eye(6)
    coupling[2, 1] = 1.0
    coupled = er3a.compare(right, right.replace(coupling=coupling))
    assert (coupled.verdict, coupled.coupling.rows, coupled.geometry.same) == ("same_arm", (3,), True)
    assert er3a.compare(right, er3a.load_robot("lbr_iiwa_14")).verdict == "other_joint_count"
    slides = er3a.compare(right, right.replace(sliding=np.arange(6) == 2))
    assert (slides.verdict, slides.geometry.differences[0].entry) == ("other_arm", "type3")


def test_the_arm_that_fits_best_comes_first():
    right = er3a.load_robot("er3_600")
    others = {f"{mm}": right.replace(a=right.a + np.array([0, mm / 1000, 0, 0, 0, 0])) for mm in (300, 20, 0, -50)}
    assert [name for name, _ in best_of(right, others)] == ["0", "20", "-50", "300"]
