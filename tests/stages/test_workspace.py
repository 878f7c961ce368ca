"""The workspace stage against analytic workspaces, brute force and the closed-form inverse."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from er3a.errors import InputError, ResultError
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.transforms import transform
from er3a.results import read_summary, read_table
from er3a.robots.load import ROBOTS, load_robot
from er3a.robots.robot import Robot
from er3a.stages.workspace import grid as grid_module
from er3a.stages.workspace.compute import compute
from er3a.stages.workspace.extremes import Extremes, fibonacci_sphere
from er3a.stages.workspace.grid import make_grid, tool_bound
from er3a.stages.workspace.hull import cells_inside, convex_hull
from er3a.stages.workspace.random_joints import joint_vectors, philox4x32
from er3a.stages.workspace.reach import reach_figures
from er3a.stages.workspace.record import record
from er3a.stages.workspace.report import report
from er3a.stages.workspace.sample import sample
from er3a.stages.workspace.tally import block_sizes, tally_blocks
from er3a.stages.workspace.verdict import judge
from er3a.stages.workspace.voids import find_voids, shape_of, unseen_cells
from er3a.study import Study

SEED = 20261120


def make_study(files: dict[str, Path] | None = None, **workspace) -> Study:
    entry = {"targets": "targets.yaml", "paths": "paths.yaml"}
    robots = {name: {**entry, "file": str(file)} for name, file in (files or {}).items()} or {"er3_600": entry}
    small = {"samples": 60_001, "blocks": 7, "cells_across": 16, "hull_directions": 200, "cloud_points": 500}
    small |= {"proof_cells": 400, "volume_points": 2000}
    return Study.model_validate(
        {
            "kind": "study",
            "seed": SEED,
            "robots": robots,
            "validation": {"round_trips": 1, "reach_starts": 1},
            "workspace": small | workspace,
            "trajectory": {
                "checks_per_sample": 1,
                "near_wrist_deg": 5.0,
                "near_elbow_deg": 5.0,
                "near_shoulder_mm": 30.0,
            },
        }
    )


def locked_file(folder: Path, locked: dict[int, float]) -> Path:
    """A copy of the ER3-600's file with some joints locked at angles in deg."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    for joint, angle in locked.items():
        content["limits"]["rows"][joint - 1] |= {"lower_deg": angle, "upper_deg": angle}
    content["name"] = "locked"
    path = folder / "locked.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def skew_file(folder: Path) -> Path:
    """A copy of the ER3-600's file whose wrist axes don't meet."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    content["dh"]["rows"][4]["a_mm"] = 40
    content["name"] = "skew"
    path = folder / "skew.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def two_link_arm(lower: list[float], upper: list[float]) -> Robot:
    """Shoulder 0.3 m up, upper arm 0.6 m, forearm 0.4 m, wrist and tool of no length: the tool is the wrist centre."""
    right = np.pi / 2
    return Robot(
        name="two_link",
        title="two links",
        convention="standard",
        a=[0, 0.6, 0, 0, 0, 0],
        alpha=[-right, 0, -right, right, -right, 0],
        d=[0.3, 0, 0, 0.4, 0, 0],
        direction=np.ones(6),
        offset=np.zeros(6),
        lower=np.radians(lower),
        upper=np.radians(upper),
    )


def tally_of(robot: Robot, samples: int, blocks: int, across: int, directions: int = 200):
    grid = make_grid(robot, across)
    return grid, tally_blocks(robot, grid, SEED, range(blocks), block_sizes(samples, blocks), directions)


def extreme_points(robot: Robot, extremes: Extremes) -> np.ndarray:
    return forward(robot, joint_vectors(robot, SEED, extremes.block, extremes.sample))[:, :3, 3]


# --- random numbers ---


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ([0] * 4, [0] * 2, [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
        ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2, [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD]),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            [0xA4093822, 0x299F31D0],
            [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
        ),
    ],
)
def test_philox_gives_the_published_vectors(counter, key, expected):
    """Known answers of Random123 (kat_vectors, philox4x32 with 10 rounds)."""
    assert [int(word) for word in philox4x32(*map(np.uint64, counter + key))] == expected


def test_joints_are_uniform_independent_and_drawn_again_alone(robot):
    n = 20_000
    q = joint_vectors(robot, SEED, np.full(n, 3), np.arange(n))
    unit = (q - robot.lower) / (robot.upper - robot.lower)
    assert all(stats.kstest(unit[:, k], "uniform").pvalue > 1e-4 for k in range(6))
    assert np.abs(np.corrcoef(unit.T) - np.eye(6)).max() < 0.03
    assert np.array_equal(joint_vectors(robot, SEED, np.array([3]), np.array([777])), q[777:778])
    for other in (joint_vectors(robot, SEED + 2**40, [3], [777]), joint_vectors(robot, SEED, [4], [777])):
        assert not np.any(other == q[777])


# --- sampling loop ---


def odd_robots():
    plain = load_robot("er3_600")
    lower, upper = plain.lower.copy(), plain.upper.copy()
    lower[2] = upper[2] = 0.3
    tool, base = transform([0.1, -0.05, 0.4], [0.3, 0.4, 0.5]), transform([1, 2, -0.5], [0.5, -1.0, 2.0])
    return [
        plain.replace(tool=tool, base=base),
        plain.replace(lower=lower, upper=upper, tool=tool),
        plain.replace(convention="modified", base=base),
        plain.replace(lower=plain.lower * 3, upper=plain.upper * 3),
    ]


@pytest.mark.parametrize("robot", odd_robots(), ids=["base and tool", "locked joint", "modified", "many turns"])
def test_the_loop_counts_what_forward_gives(robot):
    samples, blocks = 9_001, 3
    grid, tally = tally_of(robot, samples, blocks, 20)
    sizes = block_sizes(samples, blocks)
    block = np.repeat(np.arange(blocks), sizes)
    number = np.concatenate([np.arange(size) for size in sizes])
    points = forward(robot, joint_vectors(robot, SEED, block, number))[:, :3, 3]
    edges = [grid.origin[i] + np.arange(grid.shape[i] + 1) * grid.cell for i in range(3)]
    assert np.array_equal(np.histogramdd(points, edges)[0], tally.counts)
    assert np.array_equal(np.histogramdd(points[block == 0], edges)[0] > 0, tally.first_block == 0)

    along = (points - grid.axis_point) @ grid.axis
    rho = np.linalg.norm(points - grid.axis_point - along[:, None] * grid.axis, axis=1)
    section_edges = [
        grid.section_origin[i] + np.arange(grid.section_shape[i] + 1) * grid.section_cell for i in range(2)
    ]
    assert np.array_equal(np.histogram2d(rho, along, section_edges)[0], tally.section)

    best = (points @ fibonacci_sphere(200).T).argmax(axis=0)
    assert np.array_equal(tally.extremes.block, block[best])
    assert np.array_equal(tally.extremes.sample, number[best])


lengths = st.lists(st.floats(-1, 1), min_size=6, max_size=6)
angles = st.lists(st.floats(-3.2, 3.2), min_size=6, max_size=6)


@settings(max_examples=40, deadline=None)
@given(a=lengths, d=lengths, alpha=angles, q=angles, tool=st.tuples(lengths, angles), modified=st.booleans())
def test_no_tool_point_leaves_the_grid(a, d, alpha, q, tool, modified):
    robot = load_robot("er3_600").replace(
        convention="modified" if modified else "standard",
        a=a,
        d=np.array(d) + 0.01,
        alpha=alpha,
        tool=transform(tool[0][:3], tool[1][:3]),
        base=transform(tool[0][3:], tool[1][3:]),
    )
    grid, point = make_grid(robot, 16), forward(robot, np.array(q))[:3, 3]
    index = (point - grid.origin) / grid.cell
    assert np.all(index >= 0)
    assert np.all(index < grid.shape)
    assert max(grid.shape) == 16
    from_axis = np.linalg.norm(np.cross(point - grid.axis_point, grid.axis))
    assert from_axis <= tool_bound(robot).reach * (1 + 1e-9)


def test_the_bound_is_tight_where_the_arm_can_stretch():
    assert tool_bound(load_robot("er3_600")).reach == pytest.approx(0.5928 + 0.0785, abs=5e-5)
    assert tool_bound(load_robot("er3a_c60_article")).reach == pytest.approx(0.65 + 0.65161 + 0.1256, abs=1e-12)


def test_a_grid_too_fine_says_how_fine_is_possible(monkeypatch):
    robot = load_robot("er3_600")  # its grid is a cube
    monkeypatch.setattr(grid_module, "memory_budget", lambda: 200**3 * grid_module.BYTES_PER_CELL)
    with pytest.raises(
        InputError, match=r"workspace.cells_across: 1000 cells across need .* GiB.*Write 200 or less"
    ) as error:
        make_grid(robot, 1000)
    possible = int(str(error.value).split("Write ")[1].split()[0])
    assert max(make_grid(robot, possible).shape) == possible


# --- hull ---


def test_hull_agrees_with_scipy(robot):
    grid, tally = tally_of(robot, 20_000, 2, 24)
    points = extreme_points(robot, tally.extremes)
    ours, theirs = convex_hull(points), ConvexHull(points)
    assert ours.volume == pytest.approx(theirs.volume, rel=1e-12)
    assert ours.area == pytest.approx(theirs.area, rel=1e-12)
    assert np.array_equal(points[ours.of], ours.vertices)
    centres = grid.centres(np.argwhere(np.ones(grid.shape, dtype=bool)))
    expected = (centres @ theirs.equations[:, :3].T + theirs.equations[:, 3] <= 0).all(axis=1).reshape(grid.shape)
    assert np.array_equal(cells_inside(ours, grid), expected)


def test_hull_does_not_depend_on_the_order_of_points(random):
    points = random.normal(size=(300, 3))
    one, other = convex_hull(points), convex_hull(points[random.permutation(300)])
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.triangles, other.triangles)
    assert (one.volume, one.area) == (other.volume, other.area)


@pytest.mark.parametrize(
    "points", [np.ones((5, 3)), np.eye(3), np.c_[np.random.default_rng(0).random((50, 2)), np.zeros(50)]]
)
def test_a_flat_hull_has_no_volume(points):
    hull = convex_hull(points)
    assert hull.volume == 0
    assert hull.area == 0
    assert hull.triangles.shape == (0, 3)


# --- voids ---


def voids_of(robot: Robot, samples: int, across: int):
    grid, tally = tally_of(robot, samples, 8, across, 1000)
    hull = convex_hull(extreme_points(robot, tally.extremes))
    return grid, tally, hull, find_voids(tally.counts, cells_inside(hull, grid))


def test_two_link_arm_leaves_the_ball_it_can_not_fold_into():
    """Full turns: the workspace is the ball of radius 1.0 m about the shoulder without that of radius 0.2 m."""
    turn = [-180.0] * 6, [180.0] * 6
    robot = two_link_arm(*turn)
    grid, tally, hull, voids = voids_of(robot, 1_500_000, 40)
    assert hull.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert [void.kind for void in voids.listed] == ["enclosed"]
    (void,) = voids.listed
    assert void.status == "sampled"
    shape = shape_of(void, grid)
    assert shape["centroid_m"] == pytest.approx([0, 0, 0.3], abs=0.01)
    centres = grid.centres(np.argwhere(tally.counts > 0))
    distance = np.linalg.norm(centres - [0, 0, 0.3], axis=1)
    diagonal = grid.cell * np.sqrt(3) / 2
    assert distance.min() > 0.2 - diagonal
    assert distance.max() < 1.0 + diagonal
    wholly_inside = 4 / 3 * np.pi * (0.2 - diagonal) ** 3
    assert wholly_inside < len(void.cells) * grid.cell_volume < 4 / 3 * np.pi * (0.2 + diagonal) ** 3


def test_a_gap_of_joint_1_opens_the_hollow():
    """With half a turn of joint 1 and the elbow one way only, the hollow reaches the outside through the gap."""
    robot = two_link_arm([-60, -90, -60, -180, -180, -180], [60, 0, 60, 180, 180, 180])
    _, _, _, voids = voids_of(robot, 1_000_000, 40)
    assert {void.kind for void in voids.listed} == {"open"}


def test_a_locked_arm_stays_on_its_sphere():
    robot = two_link_arm([-180, -180, 90, 0, 0, 0], [180, 180, 90, 0, 0, 0])
    grid, tally = tally_of(robot, 50_000, 2, 32)
    radius = np.linalg.norm(forward(robot, robot.lower)[:3, 3] - [0, 0, 0.3])
    distance = np.linalg.norm(grid.centres(np.argwhere(tally.counts > 0)) - [0, 0, 0.3], axis=1)
    assert np.abs(distance - radius).max() < grid.cell
    assert convex_hull(extreme_points(robot, tally.extremes)).volume == pytest.approx(
        4 / 3 * np.pi * radius**3, rel=0.05
    )


def test_kinds_of_voids_on_a_made_up_grid():
    inside = np.zeros((20, 20, 20), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    counts = np.where(inside, 50, 0)
    counts[4:7, 4:7, 4:7] = 0
    counts[12:17, 12:17, 12:19] = 0
    counts[9, 9, 9] = 0
    voids = find_voids(counts, inside)
    assert [(void.kind, len(void.cells), void.status) for void in voids.listed] == [
        ("open", 5 * 5 * 7, "sampled"),
        ("enclosed", 27, "sampled"),
    ]
    assert (voids.specks, voids.speck_cells, voids.skin_cells) == (1, 1, 0)


def test_a_thin_cloud_shows_no_voids(random):
    inside = np.ones((20, 20, 20), dtype=bool)
    counts = random.poisson(0.4, size=inside.shape)
    voids = find_voids(counts, inside)
    assert all(void.status == "undersampled" for void in voids.listed)
    assert voids.specks + len(voids.listed) > 0


def test_unseen_cells_are_predicted_or_understated(random):
    even, uneven = random.poisson(1.5, size=20_000), random.poisson(random.gamma(2.0, 1.0, size=20_000))
    assert unseen_cells(even[even > 0]) == pytest.approx((even == 0).sum(), rel=0.1)
    assert 0.5 * (uneven == 0).sum() < unseen_cells(uneven[uneven > 0]) < (uneven == 0).sum()


def void_record(status: str, at_shoulder: bool) -> dict:
    volume, centre = {"lower": 0.002, "upper": 0.003}, [0.1, -0.2, 0.0004]
    return {
        "kind": "enclosed",
        "status": status,
        "volume_m3": volume,
        "centroid_m": centre,
        "holds_shoulder": at_shoulder,
        "cause": "vanishes when joint 3 may exceed +75 deg by 15 deg",
    }


@pytest.mark.parametrize(
    ("voids", "status", "code"),
    [
        ([], "pass", "no_void"),
        ([void_record("proven empty", True)], "pass", "void_at_shoulder"),
        ([void_record("undersampled", True)], "pass", "void_at_shoulder"),
        ([void_record("proven empty", True), void_record("undersampled", False)], "caution", "void_uncertain"),
        ([void_record("undersampled", False), void_record("proven empty", False)], "caution", "void_unexpected"),
    ],
)
def test_an_enclosed_void_away_from_the_shoulder_is_never_passed_over(voids, status, code):
    hull = convex_hull(np.r_[np.eye(3), np.zeros((1, 3))])
    verdict = judge(hull, voids, {"touched": 1000}, 0.0, True)
    assert (verdict.status, verdict.code) == (status, f"workspace.{code}")
    assert code == "no_void" or "2 L" in verdict.text


# --- reach ---


@pytest.mark.parametrize(
    ("name", "reach_mm"), [("er3_600", 592.8 + 78.5), ("er3a_c60", 627.1 + 78.5), ("er3a_c60_article", 1301.61 + 125.6)]
)
def test_reach_meets_the_known_figures(name, reach_mm):
    robot = load_robot(name)
    q = joint_vectors(robot, SEED, np.zeros(3000), np.arange(3000))
    reach = reach_figures(robot, make_grid(robot, 16), q)
    assert 1000 * reach["furthest_from_axis"] == pytest.approx(reach_mm, abs=0.06)
    assert reach["nearest_to_axis"] == pytest.approx(0, abs=1e-6)


# --- the stage ---


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_results_do_not_depend_on_the_parts(tmp_path):
    study = make_study()
    compute(study, "er3_600", tmp_path / "none")
    expected = files_of(tmp_path / "none")
    assert set(expected) == {
        "cells.parquet",
        "section.parquet",
        "curve.parquet",
        "cloud.parquet",
        "hull_vertices.parquet",
        "hull_triangles.parquet",
        "proof.parquet",
        "border.parquet",
        "drawing.parquet",
        "void_vertices.parquet",
        "void_triangles.parquet",
        "capability.parquet",
        "places.parquet",
        "summary.json",
    }
    for parts in (1, 3, 9):
        paths = [tmp_path / f"{parts}-{part}.npz" for part in range(1, parts + 1)]
        for part, path in enumerate(paths, start=1):
            sample(study, "er3_600", part, parts, path)
        compute(study, "er3_600", tmp_path / str(parts), paths[::-1])
        assert files_of(tmp_path / str(parts)) == expected


def test_tables_agree_with_the_summary(tmp_path):
    study = make_study()
    compute(study, "er3_600", tmp_path)
    summary, cells, curve, section, cloud, hull = (
        read_summary(tmp_path),
        *(read_table(tmp_path / f"{name}.parquet") for name in ("cells", "curve", "section", "cloud", "hull_vertices")),
    )
    assert cells["samples"].sum() == section["samples"].sum() == summary["samples"] == 60_001
    for _, rows in curve.groupby("cell_mm"):
        assert rows["touched_m3"].is_monotonic_increasing
        assert rows["samples"].iloc[-1] == 60_001
    finest = curve[curve["cell_mm"] == curve["cell_mm"].min()]
    assert finest["touched_m3"].iloc[-1] == pytest.approx(summary["touched_m3"], rel=1e-12)
    assert len(cloud) == 500
    assert (cloud["manipulability_m3"] >= 0).all()
    q = np.radians(hull[[f"q{k}_deg" for k in range(1, 7)]].to_numpy())
    robot = study.robot("er3_600")
    assert np.abs(forward(robot, q)[:, :3, 3] - hull[["x_m", "y_m", "z_m"]].to_numpy()).max() < 1e-12
    assert 0 < summary["hull"]["volume_m3"] < 1.26


def test_void_centres_have_no_inverse_solution(tmp_path, random):
    """The closed form, over random orientations, is an independent witness of what the samples left out."""
    study = make_study({"er3a_c60_article": ROBOTS / "er3a_c60_article.yaml"}, samples=4_000_000, cells_across=48)
    compute(study, "er3a_c60_article", tmp_path)
    summary, robot = read_summary(tmp_path), study.robot("er3a_c60_article")
    assert summary["verdict"]["code"] == "workspace.void_unexpected"
    assert summary["verdict"]["status"] == "caution"
    (void,) = (void for void in summary["voids"] if void["kind"] == "enclosed" and not void["holds_shoulder"])

    def solvable(position):
        T = np.eye(4)
        T[:3, 3] = position
        for rotation in Rotation.random(150, rng=random).as_matrix():
            T[:3, :3] = rotation
            if inverse(robot, T).within_limits.any():
                return True
        return False

    assert not solvable(void["centroid_m"])
    assert solvable([0.9, 0.1, 0.5])


def test_full_turn_of_joint_1_gives_a_symmetric_cloud():
    grid, tally = tally_of(load_robot("er3a_c60_article"), 500_000, 2, 16)
    assert grid.shape[0] == grid.shape[1]
    turned = np.rot90(tally.counts, axes=(0, 1))
    assert np.abs(turned.sum(axis=2) - tally.counts.sum(axis=2)).sum() < 0.05 * tally.counts.sum()


@pytest.mark.parametrize(
    ("locked", "code"),
    [
        ({1: 0, 2: 0, 3: 0, 4: 0, 5: 0, 6: 90}, "workspace.flat"),
        ({1: 10, 4: 0, 6: 0}, "workspace.flat"),
        ({3: 20}, None),
    ],
)
def test_locked_joints_run_through_all_three_verbs(tmp_path, locked, code):
    study = make_study({"locked": locked_file(tmp_path, locked)}, samples=5000)
    compute(study, "locked", tmp_path / "results")
    summary = read_summary(tmp_path / "results")
    assert code in (None, summary["verdict"]["code"])
    report(study, "locked", tmp_path / "results", tmp_path / "workspace.html")
    record(study, "locked", tmp_path / "results", tmp_path / "workspace.rrd")
    assert summary["verdict"]["text"] in (tmp_path / "workspace.html").read_text(encoding="utf-8")
    assert (tmp_path / "workspace.rrd").stat().st_size > 10_000


def test_too_few_samples_are_called_so(tmp_path):
    """On an arm whose build allows no proof, the samples are all there is."""
    study = make_study({"skew": skew_file(tmp_path)}, samples=10_000, cells_across=64)
    compute(study, "skew", tmp_path)
    summary = read_summary(tmp_path)
    assert summary["verdict"]["code"] == "workspace.undersampled"
    assert summary["volume_m3"]["lower"] == 0
    assert summary["volume_m3"]["upper"] > summary["hull"]["volume_m3"]
    assert "axes 4, 5 and 6 miss a common point" in summary["proof"]["method"]


# --- bad parts ---


@pytest.fixture
def parts(tmp_path):
    study = make_study(samples=700)
    paths = [tmp_path / f"part_{part}.npz" for part in (1, 2)]
    for part, path in enumerate(paths, start=1):
        sample(study, "er3_600", part, 2, path)
    return study, paths


def test_a_damaged_part_is_named(parts, tmp_path):
    study, (first, second) = parts
    whole = second.read_bytes()
    for damaged in (b"", b"no archive", whole[: len(whole) // 2], whole[:200] + b"\xff\x00\xff" + whole[203:]):
        second.write_bytes(damaged)
        with pytest.raises(ResultError, match=r"part_2\.npz: damaged"):
            compute(study, "er3_600", tmp_path / "results", [first, second])
    second.unlink()
    with pytest.raises(ResultError, match=r"part_2\.npz: missing"):
        compute(study, "er3_600", tmp_path / "results", [first, second])
    assert not (tmp_path / "results").exists()


def test_a_part_of_another_run_is_named(parts, tmp_path):
    study, (first, second) = parts
    changed = [
        (study.model_copy(update={"seed": 5}), "seed"),
        (make_study(samples=701), "samples 701, not 700"),
        (make_study({"er3_600": locked_copy(tmp_path)}, samples=700), "another table of the robot"),
    ]
    for other, words in changed:
        sample(other, "er3_600", 2, 2, second)
        with pytest.raises(ResultError, match=rf"part_2\.npz: was sampled with .*{words}"):
            compute(study, "er3_600", tmp_path / "results", [first, second])


def locked_copy(folder: Path) -> Path:
    path = folder / "er3_600.yaml"
    text = locked_file(folder, {3: 20}).read_text(encoding="utf-8")
    path.write_text(text.replace("name: locked", "name: er3_600"), encoding="utf-8")
    return path


def test_blocks_twice_or_missing_are_named(parts, tmp_path):
    study, (first, second) = parts
    with pytest.raises(ResultError, match=r"part_1\.npz: holds block 0, which another part file holds too"):
        compute(study, "er3_600", tmp_path / "results", [first, second, first])
    with pytest.raises(ResultError, match=r"part_1\.npz: .*block 3 is still missing"):
        compute(study, "er3_600", tmp_path / "results", [first])
    with pytest.raises(ResultError, match="block 0 is still missing"):
        compute(study, "er3_600", tmp_path / "results", [])
    with pytest.raises(InputError, match="there is no part 3 of 2"):
        sample(study, "er3_600", 3, 2, second)


def test_summary_is_plain_finite_json(tmp_path):
    compute(make_study(samples=5000), "er3_600", tmp_path)
    text = (tmp_path / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} in summary.json"))
    assert {"volume_m3", "hull", "samples", "voids", "verdict", "figures", "provenance"} <= set(summary)
    assert 4 <= len(summary["figures"]) <= 8
