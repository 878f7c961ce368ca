"""The search for files of a study that are not as they were written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from er3a.errors import ResultError
from er3a.files.kept_files import read_checked
from er3a.pipeline.checksums import OVERALL, check_checksum
from er3a.pipeline.results import check_results
from er3a.pipeline.study import Study


def corrupted(study: Study, results: Path, reports: Path) -> Iterator[tuple[Path, ResultError]]:
    """Files that are there and not as they were written, or of another format version, each with what is wrong.

    These are results, blocks that a run which was cut off has sampled, pages, recordings and previews. Of a stage's
    results it is the summary that is named, without which the stage counts as not done.
    """
    checks: list[tuple[Path, Callable[[Path], object]]] = [(reports / page, check_checksum) for page in OVERALL]
    for robot in study.names:
        checks += [(reports / robot / f"{page}.html", check_checksum) for page in study.pages(robot)]
        for stage in study.stages(robot):
            checks.append((results / robot / stage / "summary.json", lambda path: check_results(path.parent)))
            checks += [(reports / robot / f"{stage}.{kind}", check_checksum) for kind in ("rrd", "webp")]
        checks += [(part, read_checked) for part in sorted((results / robot).glob("*/parts/*.npz"))]
    for path, check in checks:
        if path.is_file():
            try:
                check(path)
            except ResultError as error:
                yield path, error
