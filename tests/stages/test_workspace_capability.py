"""The workspace stage's part about what the tool can do: settings, tables, summary, page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from er3a.pipeline.stages.workspace.capability_numbers import CanDo, can_do

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.files.yaml_file import load
from er3a.pipeline.stages.workspace.capability_texts import capability_context
from er3a.pipeline.stages.workspace.cell_lookup import CellLookup
from er3a.pipeline.study import CapabilitySettings, Study
from er3a.pipeline.viewing.page import Picture
from er3a.robots.robot import Robot

ROOT = Path(__file__).resolve().parents[2]


def settings(**changes) -> CapabilitySettings:
    return CapabilitySettings.model_validate({"directions": 40, "proof_poses": 20_000, **changes})


def skew_wrist() -> Robot:
    robot = load_robot("er3_600")
    a = robot.a.copy()
    a[4] = 0.04
    return robot.replace(a=a)


@pytest.fixture(scope="module")
def done() -> CanDo:
    return can_do(load_robot("er3_600"), settings(), 0.08)


def test_summary_and_tables_belong_together(done):
    can, placed = done.summary["capability"], done.summary["placement"]
    cells, places = done.tables["capability"], done.tables["places"]
    assert can["share"]["best"] == pytest.approx(cells["share"].max())
    assert can["manipulability_m3"] == pytest.approx(cells["manipulability_m3"].max())
    assert can["ways"]["most"] == cells["most_ways"].max() <= 8
    assert 0 <= can["core_m3"]["lower"] <= can["core_m3"]["estimate"] <= can["core_m3"]["upper"]
    assert set(np.round(cells["share"] * 40) % 1) == {0}
    assert placed["fitting"] >= len(places) > 100
    assert placed["fitting_proven"] > 0.5 * placed["fitting"]
    for place in placed["places"]:
        row = places[np.isclose(places[["x_m", "y_m", "z_m"]], place["centre_m"]).all(axis=1)].iloc[0]
        assert row["manipulability_m3"] == pytest.approx(place["manipulability_m3"])
        assert row["proven"] or place["status"] == "sampled"
        assert place["room_deg"] >= 2
        assert place["centre_m"][2] - place["size_m"][2] / 2 >= -1e-9
    centre, size = (np.array([place[key] for place in placed["places"]]) for key in ("centre_m", "size_m"))
    low, high = centre - size / 2, centre + size / 2
    for i in range(len(low)):
        for j in range(i):
            assert ((high[i] <= low[j] + 1e-9) | (high[j] <= low[i] + 1e-9)).any()


def test_the_same_input_gives_the_same_numbers(done):
    again = can_do(load_robot("er3_600"), settings(), 0.08)
    assert again.summary == done.summary
    assert all(again.tables[name].equals(table) for name, table in done.tables.items())


def test_slices_show_the_cells_they_cut(done):
    cells, summary = done.tables["capability"], done.summary
    lookup = CellLookup(summary, cells)
    some = cells.sample(50, random_state=1)
    row = lookup.row(some["rho_m"] + 0.02, np.radians(some["azimuth_deg"] + 1), some["z_m"] - 0.02)
    assert row.tolist() == some.index.tolist()
    outside = lookup.row(np.array([9.0, 0.1, 0.1]), np.zeros(3), np.array([0.0, 9.0, -9.0]))
    assert outside.tolist() == [-1, -1, -1]


def test_an_arm_without_closed_form_is_told_so():
    done = can_do(skew_wrist(), settings(), 0.08)
    for part in ("capability", "placement"):
        assert not done.summary[part]["computed"]
        assert "axes 4, 5 and 6 miss a common point" in done.summary[part]["reason"]
    assert all(len(table) == 0 for table in done.tables.values())
    context = capability_context(skew_wrist(), done.summary, *done.tables.values())
    assert not any(isinstance(value, Picture) for value in context.values())


def test_no_place_is_no_error():
    done = can_do(load_robot("er3_600"), settings(placement={"box_mm": [2000.0, 2000.0, 100.0]}), 0.15)
    assert done.summary["placement"]["places"] == []
    context = capability_context(load_robot("er3_600"), done.summary, *done.tables.values())
    assert context["place_rows"] == []
    assert context["place_picture"] is None


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
