"""What is not as it was written is found, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from er3a.errors import ResultError
from er3a.pipeline.results import check_checksum, write_checksum
from er3a.pipeline.run_study import corrupted
from er3a.pipeline.study import load_study
from testing.made_stage import write

ROOT = Path(__file__).resolve().parents[1]
FILES = ("results/er3_600/workspace/summary.json", "reports/index.html",
         "reports/er3_600/inverse.rrd", "reports/er3_600/inverse.html")  # fmt: skip


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A study of which a few files are there."""
    monkeypatch.chdir(ROOT)
    study = load_study("config/small.yaml")
    write((tmp_path / FILES[0]).parent, study)
    for name in FILES[1:]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("whole")
        write_checksum(tmp_path / name)
    return study, tmp_path / "results", tmp_path / "reports"


def test_nothing_is_found_where_all_is_whole(run):
    assert list(corrupted(*run)) == []


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "damage", [lambda content: content[:-1], lambda content: bytes([content[0] ^ 1]) + content[1:]]
)
def test_a_damaged_file_is_found_and_no_other(run, tmp_path, name, damage):
    path = tmp_path / name
    path.write_bytes(damage(path.read_bytes()))
    ((found, fault),) = corrupted(*run)
    assert found == path
    assert fault.file == str(path)
    assert fault.problem.startswith("damaged")


def test_a_view_without_a_checksum_is_found(run, tmp_path):
    (tmp_path / "reports/er3_600/.inverse.rrd.sha256").unlink()
    with pytest.raises(ResultError, match=r"inverse\.rrd: no checksum of it was kept"):
        check_checksum(tmp_path / FILES[2])
    assert [path.name for path, _ in corrupted(*run)] == ["inverse.rrd"]
