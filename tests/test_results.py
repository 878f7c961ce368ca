"""Result files: whole or not at all, equal bytes for equal inputs, damage told."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from er3a.errors import ResultError, WriteError
from er3a.files.robot_library import ROBOTS
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.results import (
    CHECKSUMS,
    FORMAT_VERSION,
    Figure,
    Verdict,
    check_results,
    half_written,
    read_summary,
    read_table,
    sha256,
    write_atomically,
    write_summary,
    write_table,
)
from er3a.pipeline.study import load_study

ROOT = Path(__file__).resolve().parents[1]
VERDICT = Verdict("fail", "workspace.void_enclosed", "Ein Hohlraum – 空洞.", {"volume_m3": 0.25, "cells": 12})
FIGURES = (Figure("hull volume", 1.25, "m³", 0.01), Figure("reach", None, "mm"))
TABLE = pd.DataFrame({"x_m": [0.1, np.nan, -0.0], "count": [1, 2, 3], "name": ["a", "b", None]})


@pytest.fixture
def study(monkeypatch):
    monkeypatch.chdir(ROOT)
    return load_study("config/small.yaml")


def write(folder, study, **more):
    write_summary(folder, study, "er3_600", "workspace", VERDICT, FIGURES, **more)
    return folder / "summary.json"


def leftovers(folder):
    return sorted(path.name for path in folder.iterdir())


def test_shape_of_a_summary(tmp_path, study):
    write(tmp_path, study, voids=[{"volume_m3": 0.25}])
    summary = read_summary(tmp_path)
    shared = ["format_version", "robot", "stage", "verdict", "figures"]
    assert list(summary) == [*shared, "voids", "provenance", "sentences"]
    assert summary["verdict"] == {
        "status": "fail",
        "code": "workspace.void_enclosed",
        "text": "Ein Hohlraum – 空洞.",
        "params": {"volume_m3": 0.25, "cells": 12},
    }
    assert summary["figures"][1] == {"name": "reach", "value": None, "unit": "mm", "uncertainty": None}
    assert summary["provenance"] == {
        "inputs": [
            {
                "path": path,
                "sha256": hashlib.sha256((ROBOTS.parents[1] / path).read_bytes()).hexdigest(),
                "grades": grades,
            }
            for path, grades in (
                (
                    "data/robots/er3_600.yaml",
                    {"official": ["dh", "limits", "speeds"], "inferred": ["zero", "envelopes"]},
                ),
                ("data/manual_refs/er3_600/envelope.csv", {"official": 9}),
            )
        ],
        "config": study.settings("er3_600", "capability") | study.settings("er3_600", "workspace"),
        "seed": study.seed,
        "code": code_digest("er3a.pipeline.stages.workspace.compute"),
    }


def test_equal_inputs_give_equal_bytes(tmp_path, study):
    first = write(tmp_path / "a", study, voids=[1, 2]).read_bytes()
    assert write(tmp_path / "b", study, voids=[1, 2]).read_bytes() == first
    assert str(ROOT).encode() not in first
    assert first.decode().endswith("}\n")
    assert "空洞".encode() in first
    for folder in ("a", "b"):
        write_table(tmp_path / folder / "t.parquet", TABLE)
    assert (tmp_path / "a/t.parquet").read_bytes() == (tmp_path / "b/t.parquet").read_bytes()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["stage key", "figure", "params"])
def test_a_number_that_is_none_is_refused_and_the_old_file_stays(tmp_path, study, bad, where):
    path = write(tmp_path, study)
    before = path.read_bytes()
    verdict = Verdict("pass", "workspace.ok", "Fine.", {"x": bad if where == "params" else 1})
    figures = [Figure("x", bad if where == "figure" else 1, "m")]
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_summary(tmp_path, study, "er3_600", "workspace", verdict, figures, x=bad if where == "stage key" else 1)
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == [CHECKSUMS, "summary.json"]


def test_a_failing_write_leaves_the_old_file_and_no_temporary(tmp_path):
    path = tmp_path / "new" / "file.txt"
    write_atomically(path, lambda file: file.write_text("old"))

    def fail(file):
        file.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(WriteError, match=r"file\.txt: can't be written .No space left on device.\. Make room"):
        write_atomically(path, fail)
    assert path.read_text() == "old"
    assert leftovers(path.parent) == ["file.txt"]


def test_what_a_killed_process_left_is_found(tmp_path):
    killed = (
        "import os, sys; from pathlib import Path; from er3a.pipeline.results import write_atomically\n"
        "for name in ('t.parquet', 'SHA256SUMS', '.page.html.sha256'):\n"
        "    if os.fork() == 0: write_atomically(Path(sys.argv[1]) / 'x' / name, lambda f: (f.touch(), os._exit(9)))\n"
        "    os.wait()"
    )
    subprocess.run([sys.executable, "-c", killed, tmp_path], check=True)
    for name in ("t.parquet", "SHA256SUMS", ".page.html.sha256", ".validation.rrd.sha256"):
        (tmp_path / "x" / name).touch()
    found = [path.name for path in half_written(tmp_path)]
    assert len(found) == 3
    assert not {"t.parquet", "SHA256SUMS", ".page.html.sha256", ".validation.rrd.sha256"} & set(found)


def test_while_writing_the_file_is_not_there_yet(tmp_path):
    path = tmp_path / "file.parquet"
    seen = []
    write_atomically(path, lambda file: (file.write_text("x"), seen.append((path.exists(), file.suffix))))
    assert seen == [(False, ".parquet")]
    assert path.read_text() == "x"


def test_tables_come_back_as_written(tmp_path):
    path = tmp_path / "robot=x" / "t.parquet"
    write_table(path, TABLE)
    table = read_table(path)
    assert list(table) == ["x_m", "count", "name"]
    pd.testing.assert_frame_equal(table, TABLE, check_dtype=False)
    assert np.signbit(table["x_m"][2])


def test_a_column_may_hold_lists(tmp_path):
    path = tmp_path / "t.parquet"
    write_table(path, pd.DataFrame({"arcs_deg": [[0.0, 90.0], []]}))
    assert [arcs.tolist() for arcs in read_table(path)["arcs_deg"]] == [[0.0, 90.0], []]


@pytest.mark.parametrize("keep", [0, 4, 100, -10, -1])
def test_a_truncated_table_is_told(tmp_path, keep):
    path = tmp_path / "t.parquet"
    write_table(path, TABLE)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(ResultError, match=r"t\.parquet: damaged .*run `make run`") as caught:
        read_table(path)
    assert "\n" not in str(caught.value)


def test_a_table_with_a_damaged_page_is_told(tmp_path):
    path = tmp_path / "t.parquet"
    write_table(path, pd.DataFrame({"x": np.random.default_rng(1).random(1000)}))
    content = bytearray(path.read_bytes())
    content[20:2000] = bytes(1980)
    path.write_bytes(bytes(content))
    with pytest.raises(ResultError, match="damaged"):
        read_table(path)


def test_missing_files_are_told(tmp_path):
    with pytest.raises(ResultError, match=r"t\.parquet: missing\. Delete the file and run `make run`"):
        read_table(tmp_path / "t.parquet")
    with pytest.raises(ResultError, match=r"summary\.json: missing"):
        read_summary(tmp_path)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "damaged"),
        (b"{", "damaged"),
        (b"\xff\xfe", "damaged"),
        (b"[]", "format version None, this er3a reads 3"),
        (b'{"format_version": 1}', "format version 1, this er3a reads 3"),
        (b'{"format_version": 3, "robot": "x", "stage": "y"}', "damaged .no 'verdict' in it"),
    ],
)
def test_a_damaged_summary_is_told(tmp_path, content, problem):
    (tmp_path / "summary.json").write_bytes(content)
    with pytest.raises(ResultError, match=problem) as caught:
        read_summary(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_summary_cut_short_is_told(tmp_path, study):
    path = write(tmp_path, study)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(ResultError, match="damaged"):
        read_summary(tmp_path)


@pytest.mark.parametrize("name", ["summary.json", "t.parquet", CHECKSUMS])
@pytest.mark.parametrize("at", [0, 0.3, 0.7, 0.999])
def test_one_flipped_bit_anywhere_is_told(tmp_path, study, name, at):
    write_table(tmp_path / "t.parquet", TABLE)
    write(tmp_path, study)
    check_results(tmp_path)
    content = bytearray((tmp_path / name).read_bytes())
    content[int(at * len(content))] ^= 1
    (tmp_path / name).write_bytes(bytes(content))
    with pytest.raises(ResultError, match=r": (damaged|missing)"):
        check_results(tmp_path)
    with pytest.raises(ResultError, match=r": (damaged|missing)"):
        read_summary(tmp_path), read_table(tmp_path / "t.parquet")


def test_a_table_of_another_run_is_told(tmp_path, study):
    write_table(tmp_path / "t.parquet", TABLE)
    write(tmp_path, study)
    write_table(tmp_path / "t.parquet", TABLE.iloc[:1])
    with pytest.raises(ResultError, match=r"t\.parquet: damaged .not the bytes that SHA256SUMS"):
        read_table(tmp_path / "t.parquet")


def test_results_without_checksums_are_not_read(tmp_path, study):
    write(tmp_path, study).with_name(CHECKSUMS).unlink()
    with pytest.raises(ResultError, match=r"SHA256SUMS: missing"):
        read_summary(tmp_path)


@pytest.mark.parametrize("folder", ["file/stage", "file"])
def test_a_folder_that_cannot_be_made_is_told(tmp_path, folder):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(WriteError, match=r"t\.parquet: can't be written"):
        write_table(tmp_path / folder / "t.parquet", TABLE)


def test_format_version_is_what_is_written(tmp_path, study):
    assert json.loads(write(tmp_path, study).read_text())["format_version"] == FORMAT_VERSION


def test_checksum(tmp_path):
    (tmp_path / "x").write_bytes(b"abc")
    assert sha256(tmp_path / "x") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
