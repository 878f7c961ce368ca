"""Two variants through the real pipeline, beside a finished study."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from er3a.pipeline.overview.index import write_index
from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study
from tests.conftest import ROBOTS
from tests.viewing.untranslated import PageTexts, plain_words, texts_from_files, wide_letters

pytestmark = pytest.mark.long  # a study on top of another

SWEEP = "sweeps:\n  a3: {robot: er3a_c60, vary: joints.3.a_mm, values: [50, 70], stages: [workspace]}\n"
VARIANTS = [f"er3a_c60-a3-0{number}" for number in (1, 2)]
JOBS = {f"{name}: {job}" for name in VARIANTS for job in ("compute workspace", "write pages and recordings")}


@pytest.fixture(scope="module")
def swept(small_study, fresh_project):
    """The small study with a sweep, run on top of what was there; and the jobs that were planned for it."""
    run = fresh_project("swept")
    folder = run.folder
    for part in ("results", "reports", "logs", ".snakemake"):
        shutil.copytree(small_study.folder / part, folder / part)
    study = folder / "config/small.yaml"
    study.write_text(study.read_text() + SWEEP)
    planned = run.planned()
    run.make_run("--cores", "2")
    return run, planned


def test_a_new_sweep_runs_its_variants_and_nothing_else(swept):
    run, planned = swept
    assert planned == JOBS | {"write the index"}
    assert run.planned() == set()


def test_a_variant_at_the_base_s_own_value_gives_the_base_s_tables(swept):
    run, _ = swept
    base, own = (run.folder / f"results/{name}/workspace" for name in ("er3a_c60", VARIANTS[1]))
    tables = sorted(path.name for path in base.glob("*.parquet"))
    assert len(tables) >= 10
    for table in tables:
        assert (base / table).read_bytes() == (own / table).read_bytes(), table


def test_results_tell_the_base_s_file_and_the_value(swept):
    run, _ = swept
    stored = [read_stage(run.folder / f"results/{name}/workspace", STAGES["workspace"]) for name in VARIANTS]
    for each, value in zip(stored, (50.0, 70.0)):
        assert each.provenance.config["robot"] == {"varied": {"joints.3.a_mm": value}}
        assert each.provenance.inputs[0].path == "data/robots/er3a_c60.yaml"
    reaches = [
        next(figure.value for figure in each.results.summary.figures if figure.name == "greatest_reach")
        for each in stored
    ]
    assert reaches == sorted(set(reaches)), "a longer arm reaches further"


def test_the_index_compares_the_variants_in_their_section_only(swept):
    run, _ = swept
    index = (run.folder / "reports/index.html").read_text()
    before, section = index.split('<details class="section" id="sweep-a3">')
    assert not any(name in before for name in VARIANTS)
    assert all(f'<a href="{name}/workspace.html">' in section for name in VARIANTS)


def test_a_variant_s_page_links_to_no_page_that_it_lacks(swept):
    run, _ = swept
    page = (run.folder / f"reports/{VARIANTS[0]}/workspace.html").read_text()
    assert set(re.findall(r'<a [^>]*href="(\w+)\.html', page)) == {"workspace"}


def test_another_value_reruns_its_variant_only(swept):
    run, _ = swept
    study = run.folder / "config/small.yaml"
    written = study.read_text()
    study.write_text(written.replace("values: [50, 70]", "values: [50, 75]"))
    try:
        assert run.planned() == {job for job in JOBS if VARIANTS[1] in job} | {"write the index"}
    finally:
        study.write_text(written)


def test_a_sweep_s_section_can_be_translated(swept, tmp_path, monkeypatch):
    run, _ = swept
    monkeypatch.chdir(run.folder)
    with wide_letters() as shown:
        write_index(load_study("config/small.yaml"), Path("results"), tmp_path)
    texts = [*PageTexts((tmp_path / "index.html").read_text(encoding="utf-8")).texts, *shown]
    own = texts_from_files(run.folder / "data") | texts_from_files(run.folder / "config") | {*ROBOTS, *VARIANTS}
    own |= {f"data/robots/{robot}.yaml" for robot in ROBOTS}
    assert plain_words(texts, own) == []
