"""Result files: whole or not at all, equal bytes for equal inputs, damage told."""

from __future__ import annotations

import errno
import hashlib
import itertools
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from er3a.errors import ResultError, WriteError
from er3a.files.kept_files import half_written, sha256, write_atomically
from er3a.files.robot_library import ROBOTS
from er3a.finding import fact
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.pipeline.code_digest import numbers_digest
from er3a.pipeline.results import (
    CHECKSUMS,
    FORMAT_VERSION,
    AbsentResults,
    Figure,
    Summary,
    Verdict,
    check_results,
    read_results,
    read_stage,
    write_results,
)
from er3a.pipeline.study import load_study
from er3a.pipeline.tables import Table, Texts, column, lists
from testing.made_stage import ROWS, STAGE, SUMMARY, MadeResults, Rows, write

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def study(monkeypatch):
    monkeypatch.chdir(ROOT)
    return load_study("config/small.yaml")


def leftovers(folder):
    return sorted(path.name for path in folder.iterdir())


def test_shape_of_a_summary(tmp_path, study):
    summary = json.loads(write(tmp_path, study).read_text())
    shared = ["format_version", "robot", "stage", "verdict", "figures", "checked", "assumed"]
    assert list(summary) == [*shared, "reach_m", "provenance"]
    assert summary["format_version"] == FORMAT_VERSION
    assert summary["verdict"] == {
        "status": "fail",
        "code": "made.hollow",
        "params": {"volume_m3": 0.25},
    }
    assert summary["figures"][1] == {"name": "reach", "value": None, "unit": "mm", "uncertainty": None, "of": None}
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
                    {"official": ["dh", "limits", "speeds", "wrist_load", "weight"], "inferred": ["zero", "envelopes"]},
                ),
                ("data/scenes/table_and_post.yaml", {}),
            )
        ],
        "code": numbers_digest(),
        "config": study.computed_from("er3_600", "workspace"),
        "seed": study.seed,
    }


def test_results_come_back_as_written(tmp_path, study):
    write(
        tmp_path,
        study,
        replace(SUMMARY, verdict=Verdict("pass", fact("made.solid", apart_from=fact("made.hollow", volume_m3=1.5)))),
    )
    stored = read_results(tmp_path, MadeResults)
    assert (stored.robot, stored.stage, stored.results.summary.verdict.status) == ("er3_600", "workspace", "pass")
    assert stored.results.summary.verdict.finding == fact("made.solid", apart_from=fact("made.hollow", volume_m3=1.5))
    assert stored.results.summary.figures == SUMMARY.figures
    assert stored.results.rows == ROWS
    assert np.signbit(stored.results.rows.x_m[2])
    assert stored.results.rows.q_deg.shape == (3, 6)
    names = ["x_m", "count", "label", *(f"q{joint}_deg" for joint in range(1, 7)), "x_mm", "y_mm", "z_mm"]
    assert list(pd.read_parquet(tmp_path / "rows.parquet")) == names


def test_a_stage_that_was_not_computed_has_a_reason_and_empty_tables(tmp_path, study):
    absent = AbsentResults(Summary(Verdict("not_computed", fact("stage.not_computed", reason="no wrist")), ()))
    write_results(tmp_path, study, "er3_600", STAGE, absent)
    stored = read_stage(tmp_path, STAGE)
    assert isinstance(stored.results, AbsentResults)
    assert stored.results.summary.verdict == Verdict("not_computed", fact("stage.not_computed", reason="no wrist"))
    assert pd.read_parquet(tmp_path / "rows.parquet").empty
    check_results(tmp_path)


def test_a_column_of_another_length_or_shape_is_refused():
    with pytest.raises(ValueError, match="different lengths"):
        Rows(x_m=[1.0], count=[1, 2], label=["a"], q_deg=np.zeros((1, 6)), point_mm=np.zeros((1, 3)))
    with pytest.raises(ValueError, match="q_deg has shape"):
        Rows(x_m=[1.0], count=[1], label=["a"], q_deg=[0.0], point_mm=np.zeros((1, 3)))


class EveryKind(Table):
    """A column of each type of values."""

    text: Texts = column("a text, or none")
    flag: Flags = column("a flag")
    count: Integers = column("a number")
    t_s: Reals = column("a time")
    small: NDArray[np.int32] = column("a short number")
    ends_deg: Texts = lists("angles")


MANY = EveryKind(
    text=["α", None, "", "end"] * 5,
    flag=[True, False, False] * 6 + [True, True],
    count=range(20),
    t_s=np.where(np.arange(20) == 3, np.nan, np.linspace(0, 1, 20))[::-1],
    small=np.arange(40)[::2],
    ends_deg=[np.arange(k % 3, dtype=float) for k in range(20)],
)


@pytest.mark.parametrize("table", [MANY, EveryKind.empty()])
def test_a_file_is_as_arrow_itself_writes_its_columns(table, tmp_path):
    """:meth:`Table.write` hands over memory; Arrow's own conversion is the judge."""
    table.write(tmp_path / "own.parquet")
    found = pq.read_table(tmp_path / "own.parquet")
    values = {name: list(getattr(table, name)) for name in table.columns()}
    wanted = pa.table({name: pa.array(values[name], found.schema.field(name).type) for name in values})
    for name in wanted.column_names:
        theirs = wanted[name].to_pylist()
        assert found[name].to_pylist() == (pytest.approx(theirs, nan_ok=True) if name == "t_s" else theirs)
        assert found[name].null_count == wanted[name].null_count
    found.validate(full=True)


@pytest.mark.long
def test_writing_a_table_loads_no_pandas(tmp_path):
    code = "import sys; from testing.made_stage import ROWS; from pathlib import Path; ROWS.write(Path(sys.argv[1])); "
    code += "assert 'pandas' not in sys.modules"
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "rows.parquet")], check=True, cwd=ROOT)


def test_equal_inputs_give_equal_bytes(tmp_path, study):
    first = write(tmp_path / "a", study).read_bytes()
    assert write(tmp_path / "b", study).read_bytes() == first
    assert str(ROOT).encode() not in first
    assert first.decode().endswith("}\n")
    assert "m³".encode() in first
    assert (tmp_path / "a/rows.parquet").read_bytes() == (tmp_path / "b/rows.parquet").read_bytes()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["own key", "figure", "params"])
def test_a_number_that_is_none_is_refused_and_the_old_file_stays(tmp_path, study, bad, where):
    path = write(tmp_path, study)
    before = path.read_bytes()
    summary = {
        "own key": replace(SUMMARY, reach_m=(bad,)),
        "figure": replace(SUMMARY, figures=(Figure("x", bad, "m"),)),
        "params": replace(SUMMARY, verdict=Verdict("fail", fact("made.hollow", volume_m3=bad))),
    }[where]
    with pytest.raises(ValueError, match="not JSON compliant"):
        write(tmp_path, study, summary)
    assert path.read_bytes() == before
    assert leftovers(tmp_path) == [CHECKSUMS, "rows.parquet", "summary.json"]


def test_a_failing_write_leaves_the_old_file_and_no_temporary(tmp_path):
    path = tmp_path / "new" / "file.txt"
    write_atomically(path, lambda file: file.write_text("old"))

    def fail(file):
        file.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(WriteError, match=r"file\.txt: can't be written .No space left on device.\. Free disk"):
        write_atomically(path, fail)
    assert path.read_text() == "old"
    assert leftovers(path.parent) == ["file.txt"]


def test_what_a_killed_process_left_is_found(tmp_path):
    killed = (
        "import os, sys; from pathlib import Path; from er3a.files.kept_files import write_atomically\n"
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


@pytest.mark.parametrize(
    ("name", "keep"),
    [
        *itertools.product(["rows.parquet", "summary.json"], [0, 4, 100, -10, -1]),
        *itertools.product([CHECKSUMS], [0, 4, 100, -10]),  # the newline at its end alone is not missed
    ],
)
def test_a_file_cut_short_is_told(tmp_path, study, name, keep):
    write(tmp_path, study)
    path = tmp_path / name
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(ResultError, match=r"(damaged|missing).*run the study again") as caught:
        read_results(tmp_path, MadeResults)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["rows.parquet", "summary.json", CHECKSUMS])
def test_missing_files_are_told(tmp_path, study, name):
    write(tmp_path, study)
    (tmp_path / name).unlink()
    with pytest.raises(ResultError, match=rf"{name}: missing\. Run the study, which writes it"):
        read_results(tmp_path, MadeResults)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "damaged"),
        (b"{", "damaged"),
        (b"\xff\xfe", "damaged"),
        (b"[]", f"format version None, this er3a reads {FORMAT_VERSION}"),
        (b'{"format_version": 3}', f"format version 3, this er3a reads {FORMAT_VERSION}"),
        (f'{{"format_version": {FORMAT_VERSION}, "robot": "x", "stage": "y"}}'.encode(), "damaged .no 'verdict' in it"),
    ],
)
def test_a_damaged_summary_is_told(tmp_path, content, problem):
    (tmp_path / "summary.json").write_bytes(content)
    with pytest.raises(ResultError, match=problem) as caught:
        check_results(tmp_path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["summary.json", "rows.parquet", CHECKSUMS])
@pytest.mark.parametrize("at", [0, 0.3, 0.7, 0.999])
def test_one_flipped_bit_anywhere_is_told(tmp_path, study, name, at):
    write(tmp_path, study)
    check_results(tmp_path)
    content = bytearray((tmp_path / name).read_bytes())
    content[int(at * len(content))] ^= 1
    (tmp_path / name).write_bytes(bytes(content))
    for read in (check_results, lambda folder: read_results(folder, MadeResults)):
        with pytest.raises(ResultError, match=r": (damaged|missing)"):
            read(tmp_path)


def test_a_table_of_another_run_is_told(tmp_path, study):
    write(tmp_path, study)
    ROWS.take(np.array([0])).write(tmp_path / "rows.parquet")
    with pytest.raises(ResultError, match=r"rows\.parquet: damaged .not the bytes that SHA256SUMS"):
        read_results(tmp_path, MadeResults)


@pytest.mark.parametrize("folder", ["file/stage", "file"])
def test_a_folder_that_cannot_be_made_is_told(tmp_path, study, folder):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(WriteError, match=r"rows\.parquet: can't be written"):
        write(tmp_path / folder, study)


def test_checksum(tmp_path):
    (tmp_path / "x").write_bytes(b"abc")
    assert sha256(tmp_path / "x") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
