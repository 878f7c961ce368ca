"""Two results folders side by side: what moved is named, and nothing else."""

from __future__ import annotations

import json

import pandas as pd
import pytest
from typer.testing import CliRunner

from er3a.errors import ResultError
from er3a.pipeline.cli import app
from er3a.pipeline.results import Figure, Verdict, write_checksums, write_summary, write_table
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.diff import changes, write_diff


@pytest.fixture
def folders(tmp_path):
    """Two equal results folders of one stage."""
    study = load_study("config/small.yaml")
    for name in ("old", "new"):
        folder = tmp_path / name / "er3_600" / "workspace"
        figures = [Figure("volume", 1.5, "m³", 0.01), Figure("reach", 700.0, "mm"), Figure("voids", 1, "")]
        write_table(folder / "cells.parquet", pd.DataFrame({"x_m": [0.0, 1.0]}))
        write_summary(folder, study, "er3_600", "workspace", Verdict("pass", "workspace.fine", "All is fine."), figures)
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
    edit(folders[1], lambda summary: summary["figures"][0].update(value=1.5 + moved_by))
    (change,) = changes(*folders)
    assert (change.robot, change.stage, change.what) == ("er3_600", "workspace", "volume")
    assert change.difference == f"{moved_by:.4f} m³"
    assert change.note.startswith(note)


def test_verdict_unit_and_missing_figure_are_named(folders):
    def change(summary):
        summary["verdict"] |= {"status": "fail", "text": "A void."}
        summary["figures"][1] |= {"unit": "m"}
        del summary["figures"][2]

    edit(folders[1], change)
    found = {entry.what: entry for entry in changes(*folders)}
    assert (found["verdict"].old, found["verdict"].new, found["verdict"].note) == ("pass", "fail", "A void.")
    assert found["reach"].difference == "another unit"
    assert (found["voids"].new, found["voids"].difference) == ("–", "gone")


def test_other_bytes_and_a_stage_on_one_side_are_named(folders, tmp_path):
    old, new = folders
    write_table(new / "er3_600/workspace/cells.parquet", pd.DataFrame({"x_m": [0.0, 2.0]}))
    assert [entry.what for entry in changes(old, new)] == ["cells.parquet"]
    (new / "er3_600/workspace").rename(new / "er3_600/inverse")
    assert [(entry.stage, entry.new) for entry in changes(old, new)] == [("inverse", "there"), ("workspace", "–")]
    write_diff(old, new, changes(old, new), tmp_path / "diff.html")
    assert "workspace" in (tmp_path / "diff.html").read_text()


def test_a_folder_without_results_is_one_error(folders, tmp_path):
    with pytest.raises(ResultError, match="holds no results"):
        changes(folders[0], tmp_path / "nothing")
