"""Checksums of views, in a hidden file beside each, and the search for files that are not as they were written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from er3a.errors import ResultError
from er3a.files.kept_files import read_checked, sha256, write_atomically
from er3a.pipeline.results import check_results
from er3a.pipeline.study import Study

OVERALL = ("index.html", "compare.html", "junit.xml")


def write_checksum(path: Path) -> None:
    """Write the checksum of a finished view beside it."""
    checksum = sha256(path)
    write_atomically(_checksum_file(path), lambda file: file.write_text(checksum, encoding="ascii"))


def check_checksum(path: Path) -> None:
    """Raise :class:`ResultError` if a view is not as it was written."""
    try:
        kept = _checksum_file(path).read_bytes()
    except OSError:
        raise ResultError(path, "no checksum of it was kept") from None
    if kept != sha256(path).encode("ascii"):
        raise ResultError(path, "damaged (its checksum does not agree)")


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


def _checksum_file(path: Path) -> Path:
    return path.with_name(f".{path.name}.sha256")
