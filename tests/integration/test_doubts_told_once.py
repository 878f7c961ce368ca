"""Numbers of doubtful unit in a study are told once, in one line, however the study is run."""

from __future__ import annotations

import sys

import pytest
import yaml

from testing.small_study import STUDY

pytestmark = pytest.mark.long

ROBOT = "ur5e"  # without references: its validation takes a second


def test_a_doubtful_number_of_the_study_is_one_line_of_a_run(fresh_project):
    """After a run that was cut off, too, whose lock another process takes away; and of Snakemake by itself."""
    run = fresh_project("doubtful")
    file = run.folder / STUDY
    study = yaml.safe_load(file.read_text(encoding="utf-8"))
    body = {"mass_kg": 1.0, "centre_mm": [0, 0, 0.3]}
    files = {key: study["robots"]["er3_600"][key] for key in ("targets", "paths")}
    load = {"source": "x", "grade": "cad", "body": body}
    study["robots"] = {ROBOT: files | {"payload": load, "stages": ["validation", "workspace"]}}
    file.write_text(yaml.safe_dump(study), encoding="utf-8")
    locks = run.folder / ".snakemake/locks"
    locks.mkdir(parents=True)
    (locks / "0.input.lock").touch()
    told = f"robots.{ROBOT}.payload.body.centre_mm: [0.0, 0.0, 0.3] mm may be metres"
    by_er3a = run.make_run("--cores", "2", f"results/{ROBOT}/validation/summary.json").stderr
    assert "left its lock" in by_er3a
    plain = run._run([sys.executable, "-m", "snakemake", "--dry-run", "--configfile", STUDY], True).stderr
    for said in (by_er3a, plain):
        lines = [line for line in said.splitlines() if "may be metres" in line or "DoubtfulUnit" in line]
        assert len(lines) == 1, lines
        assert lines[0].startswith("warning: ")
        assert lines[0].endswith(told)
