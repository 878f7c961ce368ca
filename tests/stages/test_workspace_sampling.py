"""The workspace's sampling loop against forward kinematics, published numbers and other implementations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.sampling.grid import make_grid, tool_bound
from er3a.sampling.random_joints import Draw, philox4x32
from tests.stages.workspace_arms import SEED, tally_of

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
    from scipy import stats  # takes a second to import

    n, draw = 20_000, Draw(SEED, 200_000, 10)
    q = draw.joints(robot, np.full(n, 3), np.arange(n))
    unit = (q - robot.lower) / (robot.upper - robot.lower)
    assert all(stats.kstest(unit[:, k], "uniform").pvalue > 1e-4 for k in range(6))
    assert np.abs(np.corrcoef(unit.T) - np.eye(6)).max() < 0.03
    assert np.array_equal(draw.joints(robot, [3], [777]), q[777:778])
    for other in (Draw(SEED + 2**40, 200_000, 10).joints(robot, [3], [777]), draw.joints(robot, [4], [777])):
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
    """The loop works in single precision, so a sample next to a border may fall to the other side of it."""
    samples, blocks = 9_001, 3
    grid, draw, counts = tally_of(robot, samples, blocks, 20)
    block = np.repeat(np.arange(blocks), draw.sizes)
    number = np.concatenate([np.arange(size) for size in draw.sizes])
    points = forward(robot, draw.joints(robot, block, number))[:, :3, 3]
    assert counts.sum() == samples
    along = (points - grid.axis_point) @ grid.axis
    rho = np.linalg.norm(points - grid.axis_point - along[:, None] * grid.axis, axis=1)
    section_edges = [
        grid.section_origin[i] + np.arange(grid.section_shape[i] + 1) * grid.section_cell for i in range(2)
    ]
    assert np.abs(np.histogram2d(rho, along, section_edges)[0] - counts).sum() <= 8


lengths = st.lists(st.floats(-1, 1), min_size=6, max_size=6)
angles = st.lists(st.floats(-3.2, 3.2), min_size=6, max_size=6)


@pytest.mark.long
@given(a=lengths, d=lengths, alpha=angles, q=angles, tool=st.tuples(lengths, angles), modified=st.booleans())
def test_no_tool_point_leaves_the_section(a, d, alpha, q, tool, modified):
    robot = load_robot("er3_600").replace(
        convention="modified" if modified else "standard",
        a=a,
        d=np.array(d) + 0.01,
        alpha=alpha,
        tool=transform(tool[0][:3], tool[1][:3]),
        base=transform(tool[0][3:], tool[1][3:]),
    )
    grid, point = make_grid(robot, 16), forward(robot, np.array(q))[:3, 3]
    from_axis = np.linalg.norm(np.cross(point - grid.axis_point, grid.axis))
    place = np.array([from_axis, (point - grid.axis_point) @ grid.axis])
    index = (place - grid.section_origin) / grid.section_cell
    assert np.all(index >= 0)
    assert np.all(index < grid.section_shape)
    assert from_axis <= tool_bound(robot).reach * (1 + 1e-9)


def test_the_bound_is_tight_where_the_arm_can_stretch():
    assert tool_bound(load_robot("er3_600")).reach == pytest.approx(0.5928 + 0.0785, abs=5e-5)
    assert tool_bound(load_robot("er3a_c60_article")).reach == pytest.approx(0.65 + 0.65161 + 0.1256, abs=1e-12)
