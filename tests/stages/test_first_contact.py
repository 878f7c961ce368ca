"""What touches first is named first, at its own time and depth, and wherever it is said it is the same.

Distances are Coal's, on frames worked out apart, along the path's own formula or the table that the stage stores.
"""

from __future__ import annotations

import json
import re
from itertools import product

import numpy as np
import pytest
import yaml
from scipy.interpolate import CubicHermiteSpline

from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.pipeline.messages.trajectory import path_text
from er3a.pipeline.results import read_results
from er3a.pipeline.stages import run
from er3a.pipeline.stages.collision.model import RESULTS as COLLISION
from er3a.pipeline.stages.trajectory.model import RESULTS
from er3a.pipeline.study import load_study
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.languages import read_program
from testing.motion_cases import contacts_of
from testing.motion_oracle import quintic_law

pytestmark = pytest.mark.long

ROBOT = "er3a_c60"
PLAYED = r'id="player-data">(.*?)</script>'
TOLERANCE_MM = 1.0  # an overlap that the study lets go unnoticed
SCENE = {
    "kind": "scene",
    "units_checked": True,
    "title": "A slab, and small things before, in and behind it",
    "boxes": [{"name": "slab", "size_mm": [120, 300, 300], "xyz_mm": [200, 100, 860]}],
    "spheres": [
        {"name": "before", "radius_mm": 10, "xyz_mm": [195, -35, 860]},
        {"name": "tip", "radius_mm": 2, "xyz_mm": [221, 80, 859]},
        {"name": "bead", "radius_mm": 4, "xyz_mm": [-72, -52, 666]},
        {"name": "late", "radius_mm": 4, "xyz_mm": [-50, -68, 666]},
    ],
}
START, END, DURATION = [-45, 20, 10, 0, 40, 0], [45, 20, 10, 0, 40, 0], 3.0
PATHS = [
    {"name": "swing", "kind": "joint", "start_deg": START, "end_deg": END, "samples": 2},
    {
        "name": "line",
        "kind": "line",
        "start": {"xyz_mm": [300, -200, 740], "rpy_deg": [0, 90, 0]},
        "end": {"xyz_mm": [300, 60, 780], "rpy_deg": [0, 90, 0]},
        "samples": 10,
    },
]


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A study of both paths, and the folder of its files."""
    folder = tmp_path_factory.mktemp("first")
    paths = [path | {"title": "Made", "duration_s": DURATION} for path in PATHS]
    for name, content in (("scene", SCENE), ("paths", {"kind": "paths", "paths": paths})):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    study = load_study("config/small.yaml")
    files = {name: str(folder / f"{name}.yaml") for name in ("scene", "paths")}
    options = {"avoidance": "slow", "programs": ["krl", "urscript"], "write_unsafe": True}
    options["penetration_tolerance_mm"] = TOLERANCE_MM
    study = study.model_copy(
        update={
            "robots": {ROBOT: study.robots[ROBOT].model_copy(update=files)},
            "trajectory": study.trajectory.model_copy(update=options),
        }
    )
    return study, folder


@pytest.fixture(scope="module")
def made(asked):
    """The stage's results on both paths, and the folder of its page and files."""
    study, folder = asked
    run.compute("trajectory", study, ROBOT, folder / "results")
    run.show("report", "trajectory", study, ROBOT, folder / "results", folder / "page.html")
    return read_results(folder / "results", RESULTS).results, folder


def joints_of(results, name: str):
    """Joints (n, 6) in rad at times (n,): by the formula of the move, or through the stage's own table."""
    if name == "swing":
        a, b = np.radians([START, END])
        return lambda t: a + quintic_law(np.asarray(t) / DURATION)[..., None] * (b - a)
    rows = results.checks.take(results.checks.path == name)
    return CubicHermiteSpline(rows.t_s, np.radians(rows.q_deg), np.radians(rows.q_deg_s))


@pytest.mark.parametrize("name", ["swing", "line"])
def test_every_pair_is_named_in_the_order_in_which_it_touches_by_an_outside_oracle(made, name):
    results, folder = made
    (path,) = (each for each in results.summary.paths if each.name == name)
    scene = load_scene(folder / "scene.yaml")
    t = np.linspace(0, DURATION, 601)
    apart = contacts_of(load_robot(ROBOT), scene).from_solids(joints_of(results, name)(t))
    solids = [solid.name for solid in scene.solids]
    for part in path.of("collides"):
        inside = (t >= part.t0_s) & (t <= part.t1_s)
        least = np.where(inside[:, None, None], apart, np.inf)
        expected = {
            (link + 1, solids[k]): (t[np.argmax(least[:, link, k] <= 0)], -1000 * least[:, link, k].min())
            for link, k in product(range(6), range(len(solids)))
            if least[:, link, k].min() < -TOLERANCE_MM / 1000
        }
        found = {(touch.pair.link, touch.pair.solid): touch for touch in part.cause.touches}
        assert expected.keys() <= found.keys()
        starts = [touch.t0_s for touch in part.cause.touches]
        assert starts == sorted(starts)
        assert starts[0] == part.t0_s
        for pair, (start, depth) in expected.items():
            assert start - t[1] - 1e-9 <= found[pair].t0_s <= start + 1e-9, pair
            assert found[pair].depth_mm == pytest.approx(depth, abs=0.1), pair
    outside = np.all([(t < part.t0_s) | (t > part.t1_s) for part in path.of("collides")], axis=0)
    assert apart[outside].min() > -TOLERANCE_MM / 1000
    assert sum(len(part.cause.touches) for part in path.of("collides")) > 1


def test_text_and_player_say_the_same_moment(made):
    results, folder = made
    page = (folder / "page.html").read_text(encoding="utf-8")
    played = {each["name"]: each for each in json.loads(re.search(PLAYED, page)[1])["motions"]}
    for path in results.summary.paths:
        (part,) = path.of("collides")
        at, first = part.t0_s, part.cause.touches[0]
        assert path_text(path).startswith(f"from {at:.4g} s: link {first.pair.link} and")
        (event,) = (each for each in played[path.name]["events"] if each["text"].startswith("collides"))
        assert event["t"] == at


@pytest.mark.parametrize("suffix", ["src", "script"])
def test_the_program_of_a_path_touches_first_what_the_path_does(made, tmp_path, suffix):
    results, folder = made
    rows = results.programs.take(results.programs.path == "line")
    for file, text in zip(rows.file, rows.text):
        (tmp_path / file).write_text(text, encoding="utf-8")
    options = CheckOptions(scene=load_scene(folder / "scene.yaml"))
    found = check_program(read_program(tmp_path / f"line.{suffix}"), load_robot(ROBOT), options)
    (collision,) = (each.finding for each in found.findings if each.finding.code == "motion_collides")
    (part,) = next(each for each in results.summary.paths if each.name == "line").of("collides")
    assert [each.pair for each in collision.touches] == [each.pair for each in part.cause.touches]
    assert collision.touches[0].at_mm == pytest.approx(1000 * part.s0_m, abs=0.1)
    for ours, theirs in zip(collision.touches, part.cause.touches):
        assert ours.depth_mm == pytest.approx(theirs.depth_mm, abs=0.1)


def test_the_collision_stage_names_what_touches_first_on_a_path(made, asked):
    study, folder = asked
    run.compute("collision", study, ROBOT, folder / "collision")
    verdict = read_results(folder / "collision", COLLISION).results.summary.verdict
    colliding = {each.name: each.pair for each in getattr(verdict.finding, "found", verdict.finding).colliding}
    first = {path.name: path.of("collides")[0].cause.touches[0].pair for path in made[0].summary.paths}
    assert colliding == first
