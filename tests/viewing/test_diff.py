"""Two results folders side by side: what moved is named, and nothing else."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from er3a.errors import ResultError
from er3a.pipeline.cli import app
from er3a.pipeline.results import Verdict, read_stage, write_checksums
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.diff import changes, write_diff
from testing.made_stage import ROWS, STAGE, SUMMARY, Solid, write


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Two equal results folders of one stage."""
    monkeypatch.setitem(STAGES, "workspace", STAGE)
    study = load_study("config/small.yaml")
    figures = (SUMMARY.figures[0], replace(SUMMARY.figures[1], value=700.0), SUMMARY.figures[2])
    for name in ("old", "new"):
        folder = tmp_path / name / "er3_600" / "workspace"
        write(folder, study, replace(SUMMARY, verdict=Verdict("pass", Solid(None)), figures=figures))
    return tmp_path / "old", tmp_path / "new"


def edit(folder, change):
    path = folder / "er3_600/workspace/summary.json"
    summary = json.loads(path.read_text())
    change(summary)
    path.write_text(json.dumps(summary))
    write_checksums(path.parent)


def test_equal_folders_differ_in_nothing(folders):
    assert changes(*folders) == []
    assert "Nothing differs" in CliRunner().invoke(app, ["diff", *map(str, folders)]).output


@pytest.mark.parametrize(("moved_by", "note"), [(0.012, "within the 95 %"), (0.02, "more than the intervals")])
def test_a_moved_figure_is_weighed_against_its_intervals(folders, moved_by, note):
    edit(folders[1], lambda summary: summary["figures"][0].update(value=1.25 + moved_by))
    (change,) = changes(*folders)
    assert (change.robot, change.stage, change.what) == ("er3_600", "workspace", "Volume of the hull")
    assert change.difference == f"{moved_by:.4f} m³"
    assert change.note.startswith(note)


def test_verdict_unit_and_missing_figure_are_named(folders):
    def change(summary):
        summary["verdict"] |= {"status": "fail", "code": "made.hollow", "params": {"volume_m3": 0.5}}
        summary["figures"][1] |= {"unit": "m"}
        del summary["figures"][2]

    edit(folders[1], change)
    found = {entry.what: entry for entry in changes(*folders)}
    verdict, solved = found["verdict"], found["Targets that are solved"]
    assert (verdict.old, verdict.new, verdict.note) == ("pass", "fail", "A hollow (空洞) of 0.50 m³.")
    assert found["Reach"].difference == "another unit"
    assert (solved.old, solved.new, solved.difference) == ("2 of 3", "–", "gone")


def test_another_finding_of_equal_status_is_named_by_its_text(folders):
    edit(folders[1], lambda summary: summary["verdict"].update(code="made.hollow", params={"volume_m3": 0.5}))
    (change,) = changes(*folders)
    assert (change.what, change.old, change.new) == ("verdict's text", "All is solid.", "A hollow (空洞) of 0.50 m³.")


def test_other_bytes_and_a_stage_on_one_side_are_named(folders, tmp_path):
    old, new = folders
    ROWS.take(np.array([0])).write(new / "er3_600/workspace/rows.parquet")
    write_checksums(new / "er3_600/workspace")
    assert [entry.what for entry in changes(old, new)] == ["rows.parquet"]
    (new / "er3_600/workspace").rename(new / "er3_600/inverse")
    assert [(entry.stage, entry.new) for entry in changes(old, new)] == [("inverse", "present"), ("workspace", "–")]
    write_diff(old, new, changes(old, new), tmp_path / "diff.html")
    assert "workspace" in (tmp_path / "diff.html").read_text()


def test_a_folder_without_results_is_one_error(folders, tmp_path):
    study = tmp_path / "a study"
    (study / "logs").mkdir(parents=True)
    told = {}
    for folder in (study, study / "results", study / "logs"):
        with pytest.raises(ResultError) as error:
            changes(folders[0], folder)
        told[folder.name] = str(error.value)
        assert told[folder.name].startswith(f"{folder}: ")
        assert "Delete" not in told[folder.name]
    assert "holds no results" in told["a study"]
    assert "there is no such folder" in told["results"]
    for name in ("a study", "results"):
        assert f"cd '{study}' && er3a run" in told[name]
    shutil.copytree(folders[0], study / "results")
    with pytest.raises(ResultError, match=r"Give the results folder in it: '.*/a study/results'"):
        changes(folders[0], study)


@pytest.mark.long
def test_a_border_that_moved_is_told_by_how_far(small_study, tmp_path):
    folders = tmp_path / "old", tmp_path / "new"
    for folder in folders:
        shutil.copytree(small_study.folder / "results/er3_600/workspace", folder / "er3_600/workspace")
    assert changes(*folders) == []
    new = folders[1] / "er3_600/workspace"
    border = read_stage(new, STAGES["workspace"]).results.border
    flange = (border.point == "tool_point") & (border.view == "section")
    replace(border, z_m=border.z_m + 0.005 * flange).write(new / "border.parquet")
    write_checksums(new)
    found = {change.what: change for change in changes(*folders)}
    assert list(found) == ["border of the tool point, section", "border.parquet"]
    moved = found["border of the tool point, section"]
    assert 4.9 < float(moved.difference.split(" mm")[0]) <= 5.0
    radius, height = (float(value.replace("−", "-")) for value in re.findall("[−0-9.]+(?= mm)", moved.note))
    up, away = 1000 * border.z_m[flange] - height, 1000 * border.rho_m[flange] - radius
    assert min(np.hypot(away, up).min(), np.hypot(away, up + 5).min()) < 1.0  # on one of the two borders


@pytest.mark.long
def test_an_entry_of_the_table_that_changed_is_told(small_study, tmp_path):
    folders = tmp_path / "old", tmp_path / "new"
    for folder in folders:
        shutil.copytree(small_study.folder / "results/er3_600/validation", folder / "er3_600/validation")
    path = folders[1] / "er3_600/validation/summary.json"
    summary = json.loads(path.read_text())
    (entry,) = [each for each in summary["evidence"]["entries"] if each["entry"] == "lower3"]
    entry["value"] -= 1.5
    path.write_text(json.dumps(summary))
    write_checksums(path.parent)
    (change,) = changes(*folders)
    assert (change.what, change.difference) == ("lower3", "−1.50000 deg")
