"""The real pipeline on the small study: what it leaves, what it repeats, what an edit reruns."""

from __future__ import annotations

import hashlib
import html
import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from filelock import FileLock
from typer.testing import CliRunner

from er3a.errors import ResultError
from er3a.pipeline.cli import app
from er3a.pipeline.commands import options
from er3a.pipeline.results import FORMAT_VERSION, check_results, checksum_file, write_checksums
from er3a.pipeline.study import load_study
from er3a.pipeline.verdicts import read_verdicts
from testing.small_study import STUDY, stages_of
from tests.conftest import ALL_THERE

pytestmark = pytest.mark.long


@contextmanager
def edited(path: Path, old: str, new: str, newer: bool = True) -> Iterator[None]:
    """Change a file for a while, which may stay as old as it was; content and times are put back."""
    text, times = path.read_text(), path.stat()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    if not newer:
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    try:
        yield
    finally:
        path.write_text(text)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


OF_MODEL = ("validation", "workspace")


def computing(robot: str, stages: Iterable[str]) -> set[str]:
    """The jobs that compute stages of a robot: two stages share one, the others another."""
    jobs = [[each for each in stages if (each in OF_MODEL) is shared] for shared in (True, False)]
    return {f"{robot}: compute {', '.join(job)}" for job in jobs if job}


def views(robot: str) -> str:
    return f"{robot}: write pages and recordings"


def test_every_stage_leaves_results_a_page_and_a_recording(small_study):
    for robot in small_study.robots:
        for stage in stages_of(robot):
            summary = json.loads((small_study.folder / "results" / robot / stage / "summary.json").read_text())
            assert summary["format_version"] == FORMAT_VERSION
            assert (summary["robot"], summary["stage"]) == (robot, stage)
            assert summary["verdict"]["status"] in ("pass", "caution", "fail", "no_reference")
            assert set(summary["verdict"]) <= {"status", "code", "params", "missed", "shapes", "lowered"}
            for figure in summary["figures"]:
                assert {"name", "value", "unit", "uncertainty", "of"} == set(figure)
            assert summary["provenance"]["inputs"][0]["path"] == f"data/robots/{robot}.yaml"
            for suffix in ("html", "rrd"):
                assert (small_study.folder / "reports" / robot / f"{stage}.{suffix}").stat().st_size > 1000
        assert (small_study.folder / "reports" / robot / "teach.html").stat().st_size > 1000
    assert (small_study.folder / "reports/index.html").is_file()


def test_snakemake_s_report_holds_every_page(small_study, tmp_path):
    small_study.snakemake("--report", str(tmp_path / "report.zip"))
    with zipfile.ZipFile(tmp_path / "report.zip") as packed:
        held = sorted(packed.read(name) for name in packed.namelist() if "/data/raw/" in name)
    assert held == sorted(page.read_bytes() for page in (small_study.folder / "reports").rglob("*.html"))


def test_a_page_s_foot_names_inputs_with_grades_and_the_command_that_makes_it_again(small_study):
    page = small_study.folder / "reports/er3_600/validation.html"
    foot = html.unescape(page.read_text(encoding="utf-8").partition('class="provenance"')[2])
    reach = small_study.folder / "data/manual_refs/er3_600/reach.csv"
    assert hashlib.sha256(reach.read_bytes()).hexdigest() in foot
    assert "official (D-H table, limits, joint speeds, wrist load, weight), inferred (zeros and directions" in foot
    command = re.search(r"<code>make run STUDY=config/small.yaml ARGS=(\S+)</code>", foot)
    assert command[1] == "reports/er3_600/validation.html"


def test_a_stage_that_is_asked_for_by_name_computes_no_other(small_study):
    with edited(small_study.folder / "config/small.yaml", "seed: 20261120", "seed: 20261121"):
        planned = small_study.make_run("--dry-run", "--nocolor", "inverse").stdout
    jobs = set(re.findall(r"^Job \d+: (.+)$", planned, flags=re.MULTILINE))
    computed = {job.partition(": ")[2] for job in jobs if ": compute" in job}
    assert computed == {"compute inverse", "compute validation"}
    assert {views("er3_600"), "write the index"} <= jobs


def test_edits_of_views_compute_nothing_and_that_of_a_budget_its_stage_s_job_only(small_study):
    package = small_study.folder / "er3a/pipeline"
    all_views = {*map(views, small_study.robots), "write the index"}
    edits = [
        (package / "stages/inverse/page/report.html.j2", "{% block content %}", "{% block content %}<!-- -->"),
        (small_study.folder / "config/small.yaml", "\ntrajectory:", "\nreport: {language: zh}\ntrajectory:"),
    ]
    for edit in edits:
        with edited(*edit):
            assert small_study.planned() == all_views, edit[0]
    with edited(package / "messages/locale/zh/LC_MESSAGES/er3a.po", "所有机器人", "全部机器人"):
        assert small_study.planned() == set(), "words of a language that no page speaks"
    with edited(small_study.folder / "config/small.yaml", "samples: 200000", "samples: 200008"):
        jobs = [computing(robot, OF_MODEL) for robot in small_study.robots]
        assert small_study.planned() == all_views.union(*jobs)


def test_edits_of_code_a_table_and_references_compute_again_what_rests_on_them(small_study):
    data = small_study.folder / "data"
    with (
        edited(data / "robots/er3_600.yaml", "d_mm: 367.5", "d_mm: 367.6", newer=False),  # as from a backup
        edited(data / "manual_refs/er3a_c60/axes.csv", "cad", "export", newer=False),
    ):
        planned = small_study.planned()
    assert computing("er3_600", stages_of("er3_600")) <= planned
    computed = {job for job in planned if "compute" in job and not job.startswith("er3_600")}
    assert computed == computing("er3a_c60", OF_MODEL) | computing("er3a_c60_article", OF_MODEL)
    with edited(small_study.folder / "er3a/kinematics/neighbours.py", '"""', '"""Edited. '):
        planned = small_study.planned()
    assert {job for job in planned if "compute" in job} == {
        job for robot in small_study.robots for job in computing(robot, stages_of(robot))
    }


def test_verdicts_say_what_has_changed_since(small_study, monkeypatch):
    monkeypatch.chdir(small_study.folder)

    def outdated() -> dict[tuple[str, str], tuple[str, ...]]:
        found = read_verdicts(load_study("config/small.yaml"), Path("results"))
        changed = {(each.robot, each.stage): each for each in found if each.outdated}
        assert all(each.counts("fail") and "run the study again" in each.text for each in changed.values())
        return {place: each.outdated for place, each in changed.items()}

    assert outdated() == {}
    with edited(Path("data/manual_refs/er3a_c60/axes.csv"), "cad", "export", newer=False):
        assert outdated()["er3a_c60", "validation"] == ("data/manual_refs/er3a_c60/axes.csv",)
        assert {stage for _, stage in outdated()} == {"validation"}
    with edited(Path("config/small.yaml"), "seed: 20261120", "seed: 20261121"):
        assert set(outdated().values()) == {("the study's settings",)}


def test_the_first_table_can_be_read_while_the_rest_of_a_first_run_is_computed(small_study, tmp_path):
    run = replace(small_study, folder=shutil.copytree(small_study.folder, tmp_path / "project"))
    page = run.folder / "reports/er3a_c60/validation.html"
    whole = _but_for_commit(page)
    for made in ("results/er3a_c60/validation/summary.json", "reports/index.html", "reports/er3a_c60/validation.html"):
        (run.folder / made).unlink()
    planned = run.snakemake("--dry-run", "--printshellcmds").stdout
    (words,) = re.findall(r"er3a compute (.+ --show validation) 2>", planned)
    environment = run.environment() | {"ER3A_STUDY": STUDY}
    command = [sys.executable, "-m", "er3a", "compute", *words.split()]
    told = subprocess.run(command, cwd=run.folder, env=environment, capture_output=True, text=True, check=True).stdout
    assert told == "reports/er3a_c60/validation.html can be read while the rest is computed\n"
    assert _but_for_commit(page) == whole


def _but_for_commit(page: Path) -> str:
    """A page without its commit, which a copy of the project has none of."""
    return re.sub(r"<dt>commit</dt><dd>.*?</dd>", "", page.read_text(encoding="utf-8"))


def test_what_is_missing_damaged_or_of_an_older_version_is_made_again(small_study, tmp_path, monkeypatch):
    run = replace(small_study, folder=shutil.copytree(small_study.folder, tmp_path / "project"))
    results, reports = run.folder / "results", run.folder / "reports"
    before = {path: path.read_bytes() for path in results.rglob("*") if path.is_file()}
    old = results / "er3_600/collision/summary.json"
    old.write_text(old.read_text().replace(f'"format_version": {FORMAT_VERSION}', '"format_version": 1', 1))
    next(old.parent.glob("*.parquet")).unlink()
    write_checksums(old.parent)
    damaged = [results / "er3_600/inverse/solutions.parquet", reports / "er3_600/workspace.html"]
    for path in damaged:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 4
        path.write_bytes(bytes(content))
    untouched = (results / "er3_600/trajectory/summary.json").stat().st_ino  # another file replaces one that is written
    half = reports / "er3_600/validation.rrd"
    half.write_bytes(half.read_bytes()[: half.stat().st_size // 2])

    monkeypatch.setattr(options, "REPORTS", reports)
    told = CliRunner().invoke(app, ["view", "er3_600"])
    assert str(told.exception).startswith(f"{half}: damaged")
    with pytest.raises(ResultError, match=r"er3_600/inverse/solutions\.parquet: damaged"):
        check_results(results / "er3_600/inverse")
    with pytest.raises(ResultError, match=f"format version 1, this er3a reads {FORMAT_VERSION}"):
        check_results(old.parent)

    done = run.make_run("--cores", "2", "--nocolor")
    for path in (old, *damaged, half):
        (line,) = (
            line for line in done.stderr.splitlines() if line.startswith(f"note: {path.relative_to(run.folder)}: ")
        )
        assert line.endswith("; it is made again")
    log = max((run.folder / ".snakemake/log").glob("*.snakemake.log")).read_text(encoding="utf-8")
    jobs = set(re.findall(r"^Job \d+: (.+)$", log, flags=re.MULTILINE)) - {ALL_THERE}
    again = {job for job in computing("er3_600", stages_of("er3_600")) if "inverse" in job}
    assert jobs == again | {views("er3_600"), "write the index"}
    kept = results / "er3_600/trajectory/summary.json"
    assert kept.stat().st_ino == untouched, "stages of the job whose results are whole are left alone"
    assert {path: path.read_bytes() for path in results.rglob("*") if path.is_file()} == before
    for path in (reports / "er3_600").glob("*.rrd"):  # made again, of the same data
        words = ("rrd", "compare", "--unordered", small_study.folder / path.relative_to(run.folder), path)
        compared = subprocess.run([Path(sys.executable).with_name("rerun"), *words], capture_output=True, check=False)
        assert compared.returncode == 0, f"{path}: {compared.stderr[-500:]}"
    assert run.planned() == set()


def test_bad_input_is_one_error_before_anything_runs(small_study, call):
    """Continuous integration reads it in place of the verdicts of the run before, and each page says so."""
    report = small_study.folder / "reports/junit.xml"
    pages = {page: (page.read_bytes(), page.stat().st_mtime_ns) for page in report.parent.rglob("*.html")}
    before = {path: path.read_bytes() for path in (report, checksum_file(report))}
    with edited(small_study.folder / "data/manual_refs/er3_600/axes.csv", "x_mm", "x_cm"):
        done = call("run", "--study", STUDY, folder=small_study.folder)
    try:
        (error,) = ElementTree.parse(report).iter("error")
        assert "axes.csv" in error.get("message", "")
        report.unlink()  # as the next run does
        assert "write the index" in small_study.planned()
        assert {page: (page.read_bytes(), page.stat().st_mtime_ns) for page in pages} == pages
    finally:
        for path, content in before.items():
            path.write_bytes(content)
    assert done.returncode == 2
    assert "axes.csv" in done.stderr
    assert "column x_cm" in done.stderr
    assert done.stderr.count("\n") == 1


def test_two_runs_at_once_are_refused(small_study, call):
    with FileLock(small_study.folder / ".snakemake/er3a.lock"):
        done = call("run", "--study", STUDY, folder=small_study.folder)
    assert done.returncode == 2
    assert done.stderr == "error: another run is active in this folder; wait for its end, or stop it\n"


def test_a_dry_run_changes_nothing(small_study, call):
    damaged = small_study.folder / "results/er3_600/validation/checks.parquet"
    before, parts = damaged.read_bytes(), ("results", "reports", "logs")
    damaged.write_bytes(before + b"x")
    try:
        there = {path: path.stat().st_mtime_ns for part in parts for path in (small_study.folder / part).rglob("*")}
        done = call("run", "--study", STUDY, "--", "-nc1", folder=small_study.folder)
        assert "note: results/er3_600/validation/checks.parquet: damaged" in done.stderr
        again = {path: path.stat().st_mtime_ns for part in parts for path in (small_study.folder / part).rglob("*")}
        assert again == there
    finally:
        damaged.write_bytes(before)
