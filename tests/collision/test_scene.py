"""Scene files: what they may hold, and every way to get one wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.collision.scene import Box, Cylinder, Plane, Sphere
from er3a.errors import DoubtfulUnit, InputError
from er3a.files.scene_file import load_scene
from er3a.geometry.transforms import translation

SHIPPED = Path(__file__).parents[2] / "data" / "scenes" / "table_and_post.yaml"
BOX = {"name": "table", "size_mm": [500, 800, 40], "xyz_mm": [500, 0, 80]}
CYLINDER = {"name": "post", "radius_mm": 40, "length_mm": 900, "xyz_mm": [200, 420, 450]}
SPHERE = {"name": "lamp", "radius_mm": 60, "xyz_mm": [450, -350, 750]}
PLANE = {"name": "floor", "normal": [0, 0, 2], "offset_mm": -5}


def write(folder: Path, **shapes) -> Path:
    path = folder / "scene.yaml"
    path.write_text(yaml.safe_dump({"kind": "scene", "title": "test", **shapes}), encoding="utf-8")
    return path


def test_shipped_scene_holds_one_of_each():
    scene = load_scene(SHIPPED)
    assert [(type(solid), solid.name) for solid in scene.solids] == [
        (Box, "table"),
        (Cylinder, "post"),
        (Sphere, "lamp"),
        (Plane, "floor"),
    ]
    np.testing.assert_array_equal(scene.solids[0].T, translation(0.5, 0, 0.08))


def test_normal_comes_at_unit_length(tmp_path):
    scene = load_scene(write(tmp_path, planes=[PLANE]))
    (plane,) = scene.solids
    np.testing.assert_array_equal(plane.normal, [0, 0, 1])
    assert plane.offset == -0.0025


BAD = {
    "empty": ({}, None, "the scene is empty"),
    "misspelt": ({"boxs": [BOX]}, "boxs", "Did you mean 'boxes'"),
    "same name twice": ({"boxes": [BOX], "spheres": [SPHERE | {"name": "table"}]}, "spheres[0]", "that of boxes[0]"),
    "no position": ({"boxes": [{"name": "a", "size_mm": [10, 10, 10]}]}, "boxes[0].xyz_mm", "missing"),
    "no thickness": ({"boxes": [BOX | {"size_mm": [500, 800, 0]}]}, "boxes[0].size_mm[2]", "refused"),
    "negative radius": ({"spheres": [SPHERE | {"radius_mm": -60}]}, "spheres[0].radius_mm", "refused"),
    "box in metres": ({"boxes": [BOX | {"size_mm": [0.5, 0.8, 0.04]}]}, "boxes[0].size_mm", "can only be metres"),
    "cylinder in metres": (
        {"cylinders": [CYLINDER | {"radius_mm": 0.04, "length_mm": 0.9}]},
        "cylinders[0]",
        "can only be metres",
    ),
    "sphere in metres": ({"spheres": [SPHERE | {"radius_mm": 0.06}]}, "spheres[0].radius_mm", "can only be metres"),
    "position in metres": ({"boxes": [BOX | {"xyz_mm": [0.5, 0, 0.08]}]}, "boxes[0].xyz_mm", "can only be metres"),
    "NaN": ({"planes": [PLANE | {"offset_mm": float("nan")}]}, "planes[0].offset_mm", "refused"),
    "no direction": ({"planes": [PLANE | {"normal": [0, 0, 0]}]}, "planes[0].normal", "no direction"),
    "two of one name, one carried": (
        {"boxes": [BOX], "carried": {"spheres": [SPHERE | {"name": "table"}]}},
        "carried.spheres[0]",
        "that of boxes[0]",
    ),
    "name of a link": ({"boxes": [BOX | {"name": "link_3"}]}, "boxes[0]", "a part of the arm"),
    "mesh outside the study": (
        {"meshes": [{"name": "jig", "xyz_mm": [500, 0, 0], "mesh": "../jig.stl", "unit": "mm"}]},
        "meshes[0].mesh",
        "outside the study",
    ),
    "allowed pair of what there is not": (
        {"boxes": [BOX], "collision": {"allow": [{"pair": ["link_6", "tabel"], "reason": "x"}]}},
        "collision.allow[0].pair",
        "there is no 'tabel'",
    ),
    "bad name": ({"planes": [PLANE | {"name": "the floor"}]}, "planes[0].name", "refused"),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_file_is_refused_with_file_and_field(case, tmp_path):
    shapes, field, words = BAD[case]
    path = write(tmp_path, **shapes)
    with pytest.raises(InputError) as caught:
        load_scene(path)
    assert caught.value.file == str(path)
    assert caught.value.field == field
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("shapes", "told"),
    [
        ({"planes": [PLANE | {"offset_mm": 0.35}]}, r"planes\[0\]\.offset_mm: 0\.35 mm may be metres"),
        ({"cylinders": [CYLINDER | {"radius_mm": 0.04}]}, r"cylinders\[0\]\.radius_mm: 0\.04 mm may be metres"),
        (
            {"boxes": [BOX | {"size_mm": [2.5, 3, 0.04]}]},
            r"boxes\[0\]\.size_mm: \[2\.5, 3\.0, 0\.04\] mm may be metres",
        ),
        ({"spheres": [SPHERE | {"radius_mm": 1.5}]}, r"spheres\[0\]\.radius_mm: 1\.5 mm may be metres"),
    ],
)
def test_sizes_that_look_like_metres_are_doubted(shapes, told, tmp_path):
    with pytest.warns(DoubtfulUnit, match=told):
        load_scene(write(tmp_path, **shapes))


PIN = {"name": "pin", "xyz_mm": [400, 0, 250], "radius_mm": 3}
TABLE = {"name": "bench", "size_mm": [1000, 800, 40], "xyz_mm": [500, 0, -20]}


@pytest.mark.parametrize(
    ("shapes", "is_doubted"),
    [
        ({"boxes": [TABLE], "spheres": [PIN]}, False),
        ({"boxes": [TABLE, {"name": "nut", "size_mm": [8, 8, 4], "xyz_mm": [400, 0, 2]}]}, False),
        ({"spheres": [PIN]}, True),
        ({"boxes": [TABLE], "spheres": [PIN | {"xyz_mm": [6, 0, 2]}]}, True),  # a place that may be in metres too
        ({"boxes": [TABLE, {"name": "wall", "size_mm": [2.5, 3, 0.04], "xyz_mm": [900, 0, 500]}]}, True),
        ({"boxes": [TABLE | {"size_mm": [2.5, 8, 0.04], "xyz_mm": [6, 0, 0]}], "spheres": [PIN]}, True),
    ],
)
def test_a_small_part_beside_larger_things_is_in_mm(shapes, is_doubted, tmp_path, recwarn):
    load_scene(write(tmp_path, **shapes))
    assert bool([each for each in recwarn if each.category is DoubtfulUnit]) == is_doubted


def test_small_parts_are_carried_and_floors_are_a_millimetre_below(tmp_path, recwarn):
    part = {"name": "screw", "size_mm": [3, 3, 8], "xyz_mm": [0, 0, 20]}
    load_scene(write(tmp_path, planes=[PLANE | {"offset_mm": -1}], carried={"boxes": [part]}))
    assert not [each for each in recwarn if each.category is DoubtfulUnit]
