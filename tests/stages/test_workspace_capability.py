"""The workspace stage's part about what the tool can do: settings, tables, summary, page."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Box, Plane, Scene
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.files.yaml_file import load
from er3a.finding import is_one
from er3a.geometry.transforms import transform, translation
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.chain import constant_links
from er3a.kinematics.solutions import branch_labels
from er3a.pipeline.messages.workspace import reached_text
from er3a.pipeline.stages.workspace.compute import _assumed
from er3a.pipeline.stages.workspace.entry import CapabilitySettings
from er3a.pipeline.stages.workspace.model import CellLookup
from er3a.pipeline.stages.workspace.page.capability_section import capability_context
from er3a.pipeline.stages.workspace.page.tray import placing, trays
from er3a.pipeline.stages.workspace.tool_capability import ToolCapability, tool_capability
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import Picture
from er3a.robots.robot import ConvexPiece, Robot
from er3a.workspace.directions import cone_directions, poses, roll_of, tool_rotations
from er3a.workspace.placement import narrowed
from er3a.workspace.proven import prove_robot
from testing.arms import palletiser, scara

ROOT = Path(__file__).resolve().parents[2]


def settings(**changes) -> CapabilitySettings:
    return CapabilitySettings.model_validate({"directions": 40, **changes})


@pytest.fixture(scope="module")
def done() -> ToolCapability:
    return tool_capability(load_robot("er3_600"), settings(), 0.08)


def context_of(robot: Robot, found: ToolCapability) -> dict:
    """What the page takes, of results that hold nothing else."""
    verdict = SimpleNamespace(shapes=None)
    summary = SimpleNamespace(capability=found.capability, placement=found.placement, verdict=verdict, assumed=())
    results = SimpleNamespace(summary=summary, capability=found.cells, places=found.places)
    placed = placing({"workspace": SimpleNamespace(results=results)}, robot, {}, {})
    return capability_context(robot, results, placing=placed)


@pytest.mark.long
def test_lines_of_a_tray_are_the_tray_in_a_scene_file(done, tmp_path):
    (tray, *_) = trays(SimpleNamespace(summary=SimpleNamespace(placement=done.placement)))
    (tmp_path / "scene.yaml").write_text(f"kind: scene\ntitle: Tray\n{tray.lines}\n", encoding="utf-8")
    for read, meant in zip(load_scene(tmp_path / "scene.yaml").solids, tray.parts, strict=True):
        assert read.name == meant.name
        np.testing.assert_allclose(read.T, meant.T, atol=1e-6)
        np.testing.assert_allclose(read.size, meant.size, atol=1e-6)


@pytest.mark.long
def test_summary_and_tables_belong_together(done):
    overall, placed = done.capability.overall, done.placement
    cells, places = done.cells, done.places
    assert overall.best_reachability == pytest.approx(cells.reachability.max())
    assert overall.best_manipulability_m3 == pytest.approx(cells.manipulability_m3.max())
    assert overall.most_solutions == cells.most_solutions.max() <= 8
    assert set(np.round(cells.reachability * 40) % 1) == {0}
    assert placed.fitting >= len(places) > 100
    for place in placed.places:
        row = np.flatnonzero(np.isclose(places.centre_m, place.centre_m).all(axis=1))[0]
        assert places.manipulability_m3[row] == pytest.approx(place.manipulability_m3)
        assert place.limit_margin_deg >= 2
        assert place.centre_m[2] - place.size_m[2] / 2 >= -1e-9
    centre = np.array([place.centre_m for place in placed.places])
    size = np.array([place.size_m for place in placed.places])
    low, high = centre - size / 2, centre + size / 2
    for i in range(len(low)):
        for j in range(i):
            assert ((high[i] <= low[j] + 1e-9) | (high[j] <= low[i] + 1e-9)).any()


@pytest.mark.long
def test_the_clearance_of_a_place_is_that_of_the_nearest_arm_on_its_lattice(done):
    robot, placed = load_robot("er3_600"), done.placement
    task = placed.task
    tight, spacing = narrowed(robot, np.radians(task.limit_margin_deg)), np.array(placed.spacing_m)
    rotations = tool_rotations(
        cone_directions(np.array(task.tool_direction), np.radians(task.cone_deg)), roll_of(robot, 1)
    )
    one = [place for place in placed.places if place.branch is not None]
    assert one
    for place in one:
        count = np.ceil(np.array(place.size_m) / spacing - 1e-6).astype(int) + 1
        points = (
            place.centre_m
            + (np.stack(np.meshgrid(*map(np.arange, count)), axis=-1).reshape(-1, 3) - (count - 1) / 2) * spacing
        )
        found = inverse_batch(tight, poses(points[:, None], rotations[:, 0]).reshape(-1, 4, 4))
        q = found.q[:, branch_labels(robot).index(place.branch)]
        least = Bodies(robot, None).min_distance(q)[0]
        assert 1000 * least.min() == pytest.approx(place.clearance_mm, abs=1e-6)
        room = np.degrees(np.minimum(q - robot.lower, robot.upper - q))
        turns_fully = np.degrees(robot.upper - robot.lower) >= 360
        assert np.where(turns_fully, np.inf, room).min() == pytest.approx(place.limit_margin_deg, abs=1e-6)


@pytest.mark.long
def test_the_same_input_gives_the_same_numbers(done):
    again = tool_capability(load_robot("er3_600"), settings(), 0.08)
    assert (again.capability, again.placement) == (done.capability, done.placement)
    assert again.cells == done.cells
    assert again.places == done.places


@pytest.mark.long
def test_slices_show_the_cells_they_cut(done):
    lookup, cells = CellLookup(done.capability, done.cells), done.cells
    some = np.random.default_rng(1).choice(len(cells), 50, replace=False)
    row = lookup.row(cells.rho_m[some] + 0.02, np.radians(cells.azimuth_deg[some] + 1), cells.z_m[some] - 0.02)
    assert row.tolist() == some.tolist()
    outside = lookup.row(np.array([9.0, 0.1, 0.1]), np.zeros(3), np.array([0.0, 9.0, -9.0]))
    assert outside.tolist() == [-1, -1, -1]


def test_an_arm_without_a_known_inverse_is_told_so():
    coupling = np.array(palletiser().coupling)
    coupling[3, 2] = -0.5  # a turn of joint 3 is half a turn of a row
    robot = palletiser().replace(coupling=coupling)
    done = tool_capability(robot, settings(), 0.08)
    assert is_one(done.capability.lacks, "inverse_unknown")
    assert done.placement is None
    assert len(done.cells) == len(done.places) == 0
    context = context_of(robot, done)
    assert "no method here finds all inverse solutions" in context["missing"]
    assert not any(isinstance(value, Picture) for value in context.values())


@pytest.mark.long
def test_a_tool_that_points_elsewhere_is_told_so():
    robot = scara()
    found = tool_capability(robot, settings(placement={"tool_direction": [1, 0, 0]}), 0.15)
    assert is_one(found.placement, "workspace.tool_points_elsewhere")
    context = context_of(robot, found)
    assert context["nowhere"].startswith("Nowhere: the arm can't tilt its tool")


@pytest.mark.long
def test_cells_whose_middles_all_lie_out_of_reach_are_no_error():
    robot = load_robot("er3_600")
    done = tool_capability(robot, settings(), 3.0, proven=prove_robot(robot, 200, 1))
    assert done.capability.cell_m == 3.0
    assert len(done.cells) == 0


@pytest.mark.long
def test_no_place_is_no_error():
    done = tool_capability(load_robot("er3_600"), settings(placement={"box_mm": [2000.0, 2000.0, 100.0]}), 0.15)
    assert done.placement.places == ()
    context = context_of(load_robot("er3_600"), done)
    assert context["tray_rows"] == []
    assert not list(_assumed(done))


def test_of_a_flange_within_its_link_the_tray_is_asked_at_the_links_end():
    robot = load_robot("er3_600")
    beyond = constant_links(robot)[-1][2, 3] + 0.05
    corners = tuple((x, y, z) for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (beyond - 0.06, beyond))
    robot = robot.replace(envelopes=(), meshes=(), hulls=(ConvexPiece(6, corners, 0.0),))
    asked = settings(placement={"box_mm": [100.0, 100.0, 20.0], "cone_deg": 5}, directions=40)
    found = tool_capability(robot, asked, 0.1).placement
    held = tool_capability(robot.replace(tool=translation(0, 0, 0.05)), asked, 0.1).placement
    assert found.beyond_m == pytest.approx(0.05)
    assert found.places == held.places != ()
    assert "50 mm beyond" in reached_text(found)


def test_a_box_lower_than_the_layers_of_places_stands_whole_or_is_told_why_not():
    """On a grid so coarse that its height is less than half a layer."""
    table = Box("table", transform(np.array([0.4, 0.0, 0.05]), np.zeros(3)), np.array([0.4, 0.4, 0.1]))
    asked = settings(placement={"box_mm": [100.0, 100.0, 20.0], "cone_deg": 5}, directions=40)
    (stand,) = tool_capability(load_robot("er3_600"), asked, 0.1, Scene("cell", (table,))).placement.stands
    assert stand.why_none in (None, "in_the_way", "out_of_reach")


@pytest.mark.long
def test_a_box_stands_on_a_surface_where_the_arm_leaves_it_room_or_is_told_why_not():
    def block(name: str, size: list[float], x: float, top: float) -> Box:
        return Box(name, transform(np.array([x, 0.0, top - size[2] / 2]), np.zeros(3)), np.array(size))

    robot, floor = load_robot("er3_600"), Plane("floor", np.array([0.0, 0.0, 1.0]), -0.3)
    table, peg = block("table", [0.3, 0.3, 0.1], 0.4, 0.1), block("peg", [0.09, 0.09, 0.2], -0.4, 0.25)
    scene = Scene("cell", (table, peg, block("far", [0.4, 0.4, 0.1], 2.0, 0.1), floor))
    asked = settings(placement={"box_mm": [100.0, 100.0, 120.0], "cone_deg": 5})
    done = tool_capability(robot, asked, 0.04, scene)
    placed = done.placement
    stands = {stand.name: stand for stand in placed.stands}
    assert {name: stand.why_none for name, stand in stands.items()} == {
        "table": None,
        "peg": "too_small",
        "far": "out_of_reach",
        "floor": None,  # lower than what is asked
    }
    stand = placed.stand
    assert stand == stands["table"]
    assert placed.best == stand.place
    # At the table itself the flange's round end would be in it.
    assert 0 < stand.served_from_m < 0.12
    centre, size = np.array(stand.place.centre_m), np.array(stand.place.size_m)
    assert centre[2] - size[2] / 2 == pytest.approx(0.1)
    assert (np.abs(centre[:2] - [0.4, 0.0]) + size[:2] / 2 <= 0.15 + 1e-9).all()
    points = centre + (np.array(list(np.ndindex(3, 3, 3))) / 2 - 0.5) * size
    points = points[points[:, 2] > 0.1 + stand.served_from_m - 1e-9]
    down = tool_rotations(cone_directions(np.array([0.0, 0.0, -1.0]), 0.0), roll_of(robot, 1))[0, 0]
    found = inverse_batch(narrowed(robot, np.radians(2)), poses(points, down))
    free = Bodies(robot, scene).free(found.q.reshape(-1, 6)).reshape(found.within_limits.shape)
    assert (free & found.within_limits).any(axis=1).all()
    assert stands["floor"].above is not None
    context = context_of(robot, done)
    assert len(context["stands"]) == 3  # the floor is lower than what was asked


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"box_mm": [0.2, 0.15, 0.05]}, r"capability.placement.box_mm.*can only be metres.*Multiply by 1000"),
        ({"box_mm": [200, 150]}, r"capability.placement.box_mm"),
        ({"box_mm": [200, 150, 0]}, r"capability.placement.box_mm\[2\]"),
        ({"tool_direction": [0, 0, 0]}, r"capability.placement.tool_direction.*no direction"),
        ({"cone_deg": 200}, r"capability.placement.cone_deg"),
        ({"cone": 30}, r"unknown key 'cone'"),
    ],
)
def test_bad_settings_are_named(change, told, tmp_path):
    content = yaml.safe_load((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
    content["capability"]["placement"] |= change
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(InputError, match=told) as error:
        load(Study, path)
    assert "study.yaml" in str(error.value)


def test_the_shipped_studies_name_every_setting():
    for name in ("config.yaml", "small.yaml"):
        content = yaml.safe_load((ROOT / "config" / name).read_text(encoding="utf-8"))["capability"]
        assert set(content) == set(CapabilitySettings.model_fields)
        assert set(content["placement"]) == set(type(CapabilitySettings().placement).model_fields)
