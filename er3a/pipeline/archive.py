"""A finished study packed into one zip with RO-Crate metadata [1]_: results, reports, recordings, inputs and the lock.

References
----------
.. [1] S. Soiland-Reyes et al., "Packaging research artefacts with RO-Crate", Data Science 5(2), 2022.
"""

from __future__ import annotations

from pathlib import Path

from rocrate.model.person import Person
from rocrate.rocrate import ROCrate

from er3a.errors import ResultError
from er3a.files.kept_files import ROOT, write_atomically
from er3a.pipeline.results import OVERALL, THE_CODE, changed_since, check_results
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study
from er3a.version import __version__

WORKFLOW = "Snakefile"
KEPT = (WORKFLOW, "requirements/run.txt", "README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md")
LICENCE = "https://spdx.org/licenses/MIT"
_MEDIA_TYPES = {
    ".html": "text/html",
    ".json": "application/json",
    ".parquet": "application/vnd.apache.parquet",
    ".rrd": "application/vnd.rerun.rrd",
    ".csv": "text/csv",
    ".yaml": "application/yaml",
    ".md": "text/markdown",
    ".xml": "application/xml",
}


def archive(study_file: Path, results: Path, reports: Path, output: Path) -> int:
    """Pack a finished study.

    Returns
    -------
    count : how many files the archive holds, its metadata apart

    Raises
    ------
    ResultError
        a stage has no results, or those of other inputs or settings; or a page or recording is missing
    """
    study = load_study(study_file)
    files = {Path("config") / study_file.name: study_file}
    for name in study.names:
        for stage in study.stages(name):
            folder = results / name / stage
            check_results(folder)
            if changed := [each for each in changed_since(folder, study, name, stage) if each != THE_CODE]:
                raise ResultError(folder, f"computed before these changed: {', '.join(changed)}", "Run the study again")
            files |= {Path("results") / name / stage / file.name: file for file in (results / name / stage).iterdir()}
            files |= {_place(file): file for file in study.inputs(name, stage)}
            if "record" in STAGES[stage].views:
                files[Path("reports") / name / f"{stage}.rrd"] = _there(reports / name / f"{stage}.rrd")
        for page in study.pages(name):
            files[Path("reports") / name / f"{page}.html"] = _there(reports / name / f"{page}.html")
    files |= {Path("reports") / name: _there(reports / name) for name in (*OVERALL, *study.article_pages().values())}
    files |= {Path(name): ROOT / name for name in KEPT if (ROOT / name).is_file()}
    crate = _crate(study.robots)
    for place, file in sorted(files.items()):
        properties: dict[str, object] = {
            "name": place.as_posix(),
            "encodingFormat": _MEDIA_TYPES.get(file.suffix, "text/plain"),
        }
        if place == Path(WORKFLOW):
            properties |= {"@type": ["File", "SoftwareSourceCode"], "version": __version__}
        crate.add_file(str(file), place.as_posix(), properties=properties)
    write_atomically(output, crate.write_zip)
    return len(files)


def _crate(robots) -> ROCrate:
    crate = ROCrate(gen_preview=False)
    crate.name = f"er3a study of {', '.join(robots)}"
    crate.description = (
        "Evidence on kinematic models of industrial robots: results (Parquet and JSON), reports (HTML), Rerun "
        "recordings, the inputs they rest on, and the lock of the software. Start at `reports/index.html`."
    )
    crate.license = LICENCE
    authors = Person(crate, "#er3a-authors", properties={"name": "The er3a authors"})
    crate.add(authors)
    crate.root_dataset["author"] = authors
    crate.add_jsonld({"@id": LICENCE, "@type": "CreativeWork", "name": "MIT License"})
    run = {"@type": "CreateAction", "name": "make run", "instrument": {"@id": WORKFLOW}, "result": {"@id": "./"}}
    crate.add_jsonld({"@id": "#run", **run})
    crate.root_dataset["mentions"] = [{"@id": "#run"}]
    return crate


def _place(file: Path) -> Path:
    """The place of an input in the archive: as the study or the project has it, else below ``inputs``."""
    if file.is_relative_to(ROOT):
        return file.relative_to(ROOT)
    return Path("inputs") / file.name if file.is_absolute() or ".." in file.parts else file


def _there(path: Path) -> Path:
    if not path.is_file():
        raise ResultError(path, "missing", "Run the study, which writes it")
    return path
