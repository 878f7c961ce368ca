"""The results of a stage as a typed model, and their files: ``summary.json``, Parquet tables, checksums.

A stage's ``model.py`` declares a summary and its results::

    @dataclass(frozen=True)
    class ReachSummary(Summary):
        farthest_mm: float

    @dataclass(frozen=True)
    class ReachResults(Results):
        summary: ReachSummary
        points: Points  # a Table, written as points.parquet

``compute`` returns the results; views use what :func:`read_results` returns. The summary's verdict is a finding with a
status; in the file it is ``{status, code, params}``. Its sentence is made when it is shown.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, TypeVar, dataclass_transform, get_type_hints

from pydantic import ValidationError

from er3a.by_value import ByValue, frozen
from er3a.errors import ResultError
from er3a.files.annotations import grades_in
from er3a.files.kept_files import read_bytes, sha256, shown_path, write_atomically, write_text
from er3a.finding import Finding, fact, opened_once, plain
from er3a.pipeline.code_digest import numbers_digest
from er3a.pipeline.language import N_
from er3a.pipeline.scope import Check, Coverage, Open
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.study import STAGES, Study
from er3a.pipeline.tables import adapter, table_types

FORMAT_VERSION = 16
"""Of results as they are stored. Rises, at the latest before a release, if a field or column of an earlier release
goes, or gets another name, unit or meaning. What is only added does not raise it: changed code computes results again.
"""
BESIDE = ("shapes", "missed", "lowered")
"""What a verdict can have beside its finding."""
THE_SETTINGS = N_("the study's settings")
THE_CODE = N_("er3a itself")
SUMMARY = "summary.json"
CHECKSUMS = "SHA256SUMS"

Status = Literal["pass", "caution", "fail", "no_reference", "not_computed"]
Foundation = Literal[Status, "unsettled"]  # a caution about a table of which independent documents settle no entry


@frozen
class Verdict:
    """A stage's answer: pass, caution (usable, with something to know), fail, or no_reference, and what it found.

    ``shapes``: on what assumed shapes of the arm it rests. ``missed``: the checks that do not cover all that was asked.
    ``lowered``: whether it would pass but for these.
    """

    status: Status
    finding: Finding
    shapes: Finding | None = None
    missed: tuple[Coverage, ...] = ()
    lowered: bool = False

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What it found, what was not checked (``not_checked``: no verdict passes with it), and what was assumed."""
        named = tuple(each for each in self.missed if each.gaps)
        missed = (fact("not_checked", checks=named),) if named and self.status == "caution" else ()
        return (self.finding, *missed, *((self.shapes,) if self.shapes else ()))

    def covering_less(self, missed: tuple[Coverage, ...]) -> Verdict:
        """The verdict where checks do not cover all that was asked.

        Parameters
        ----------
        missed : these checks

        Returns
        -------
        verdict : a caution in place of a pass, if there are any
        """
        if missed and self.status == "pass":
            return replace(self, status="caution", missed=missed, lowered=True)
        return replace(self, missed=missed)

    def with_assumed_shapes(self, shapes: Finding | None) -> Verdict:
        """The verdict where shapes of the arm are assumed.

        Parameters
        ----------
        shapes : with what comes too near to them; None where a document gives them

        Returns
        -------
        verdict : a caution in place of a pass, if anything comes too near
        """
        near = shapes and shapes.near and self.status == "pass"
        return replace(self, status="caution" if near else self.status, shapes=shapes)


@frozen
class Figure:
    """A key figure.

    Attributes
    ----------
    name : code of what it is; value : None where it can't be had
    uncertainty : half-width of its 95 % interval in the same unit, None where it has none
    of : the whole that a count is part of
    """

    name: str
    value: float | int | None
    unit: str
    uncertainty: float | None = None
    of: int | None = None


@dataclass_transform(frozen_default=True)
@frozen
class Summary:
    """What all summaries begin with; a stage's own, a frozen dataclass like this one, says what its verdict can be.

    Attributes
    ----------
    needs : checks that the stage's question needs; one that is not made is not covered
    checked : what each check covers; a verdict passes only if all of them are complete
    assumed : what these rest on without a document
    """

    needs: ClassVar[tuple[Check, ...]] = ()

    verdict: Verdict
    figures: tuple[Figure, ...]
    checked: tuple[Coverage, ...] = field(default=(), kw_only=True)
    assumed: tuple[Open, ...] = field(default=(), kw_only=True)

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    def __post_init__(self) -> None:
        made = {each.check for each in self.checked}
        absent = (Coverage(check, 0, 1, (Open("not_run"),)) for check in self.needs if check not in made)
        missed = tuple(each for each in (*self.checked, *absent) if not each.complete)
        object.__setattr__(self, "verdict", self.verdict.covering_less(missed))


ResultsT = TypeVar("ResultsT", bound="Results")


@dataclass_transform(frozen_default=True, eq_default=False)
@frozen
class Results(ByValue):
    """A stage's results: a subclass, a frozen dataclass like this one, says which summary, and adds tables."""

    summary: Summary

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False)(cls)


@frozen
class Input:
    """An input file: path from the project's root, checksum, and the grades that stand in it."""

    path: str
    sha256: str
    grades: Mapping[str, list[str] | int]


@frozen
class Provenance:
    """What numbers rest on; pages over several stages have no settings of their own."""

    inputs: tuple[Input, ...]
    code: str
    config: dict[str, Any] | None = None
    seed: int | None = None


@frozen
class Stored(ByValue, Generic[ResultsT]):
    """Results as they were read, and where they come from.

    Attributes
    ----------
    table : what validation found of the table that they rest on; None where that is not known, or they rest on none
    folder : that they were read from
    """

    robot: str
    stage: str
    provenance: Provenance
    results: ResultsT
    table: Foundation | None = None
    folder: Path | None = None

    @property
    def withheld(self) -> bool:
        """Whether it says nothing of the robot: see :func:`withheld`."""
        return withheld(self.results.summary.verdict.status, self.table)

    @property
    def validated(self) -> Path | None:
        """Where validation's results of the robot are, if there are any."""
        folder = self.folder.parent / "validation" if self.folder else None
        return folder if folder and is_computed(folder) else None


class AbsentResults(Results):
    """In place of the results of a stage that was not computed; its verdict is a finding that says why."""


def write_results(
    folder: Path, study: Study, robot: str, stage: Stage, results: Results, read: tuple[Input, ...] | None = None
) -> None:
    """Write a stage's tables, summary and checksums into a folder; tables without rows if it was not computed.

    Parameters
    ----------
    read : the inputs as they were before it was computed, as one may be edited meanwhile; by default as they are

    Raises
    ------
    WriteError
        if the disk is full or permission is missing
    """
    kind = AbsentResults if isinstance(results, AbsentResults) else type(results)
    for name, table in table_types(stage.module("model").RESULTS).items():
        rows = table.empty() if kind is AbsentResults else getattr(results, name)
        write_atomically(folder / f"{name}.parquet", rows.write)
    summary = results.summary
    own = opened_once(summary) | {"verdict": _verdict_record(summary.verdict)}
    origin = Provenance(
        inputs=input_records(study.inputs(robot, stage.name)) if read is None else read,
        config=study.computed_from(robot, stage.name),
        seed=study.seed,
        code=numbers_digest(),
    )
    content = {"format_version": FORMAT_VERSION, "robot": robot, "stage": stage.name, **own, "provenance": origin}

    def write(file: Path) -> None:  # bit by bit: of thousands of targets a text would be large
        with file.open("w", encoding="utf-8", newline="\n") as out:
            json.dump(content, out, indent=1, ensure_ascii=False, allow_nan=False, default=opened_once)
            out.write("\n")

    write_atomically(folder / SUMMARY, write)
    # Last, so that a folder that was left half-written is not taken for whole.
    write_checksums(folder)


def read_stage(folder: Path, stage: Stage) -> Stored[Any]:
    """Read a stage's results, or :class:`AbsentResults` if it was not computed.

    Raises
    ------
    ResultError
        naming the file that is missing, damaged or of another format version
    """
    record = _record(folder)
    table = table_below(folder, stage)
    if (summary := _absent(record)) is not None:
        absent = AbsentResults(summary)
        origin = adapter(Provenance).validate_python(record["provenance"])
        return Stored(record["robot"], stage.name, origin, absent, table, folder)
    return replace(read_results(folder, stage.module("model").RESULTS, record), table=table, folder=folder)


def table_below(folder: Path, stage: Stage) -> Foundation | None:
    """What validation found of the table that a stage rests on; None where it rests on none or that is not known.

    Parameters
    ----------
    folder : of the stage's results
    """
    below = folder.parent / "validation"
    return read_foundation(below) if stage.rests_on and is_computed(below) else None


def is_computed(folder: Path) -> bool:
    """Whether a folder holds a stage's results.

    Parameters
    ----------
    folder : such as ``results/er3_600/inverse``

    Returns
    -------
    computed : True also for the result that the stage could not be computed
    """
    return (folder / SUMMARY).is_file()


def read_results(folder: Path, kind: type[ResultsT], record: dict[str, Any] | None = None) -> Stored[ResultsT]:
    """Read the results of a stage that was computed.

    Parameters
    ----------
    record : the summary as plain data, if it is read already; it is emptied, as with thousands of targets it is large

    Raises
    ------
    ResultError
        naming the file that is missing, damaged or of another format version
    """
    record = record or _record(folder)
    sums, of = checksums(folder), (record["robot"], record["stage"])
    summary, provenance = _parsed(folder / SUMMARY, record, kind)
    record.clear()
    tables = {}
    for name, table in table_types(kind).items():
        file = folder / f"{name}.parquet"
        content = read_bytes(file)
        _compare(file, content, sums)
        try:
            tables[name] = table.read(content)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ResultError(file, f"damaged ({' '.join(str(error).split())})") from None
    return Stored(*of, provenance, kind(summary=summary, **tables))


def _record(folder: Path) -> dict[str, Any]:
    """A summary file as plain data, whole and of the present format."""
    path = folder / SUMMARY
    content = read_bytes(path)
    try:
        stored = json.loads(content)
    except ValueError as error:
        raise ResultError(path, f"damaged ({error})") from None
    version = stored.get("format_version") if isinstance(stored, dict) else None
    if version != FORMAT_VERSION:
        raise ResultError(path, f"format version {version}, this er3a reads {FORMAT_VERSION}")
    for key in ("robot", "stage", "verdict", "figures", "provenance"):
        if key not in stored:
            raise ResultError(path, f"damaged (no '{key}' in it)")
    if not isinstance(stored["verdict"], dict) or "status" not in stored["verdict"]:
        raise ResultError(path, "damaged (verdict without status)")
    _compare(path, content, checksums(folder))
    return stored


def _absent(record: dict[str, Any]) -> Summary | None:
    """The summary of a stage that could not be computed; None of one that was."""
    verdict = record["verdict"]
    if verdict["status"] != "not_computed":
        return None
    return Summary(Verdict("not_computed", Finding(**_stored_finding(verdict))), ())


def read_status(folder: Path) -> Status:
    """The status of a stage's verdict, without its tables.

    Parameters
    ----------
    folder : of the stage's results

    Raises
    ------
    ResultError
        as :func:`read_stage`
    """
    return _record(folder)["verdict"]["status"]


def read_foundation(folder: Path) -> Foundation:
    """What the validation stage's verdict is for the stages that rest on it.

    Parameters
    ----------
    folder : of the validation stage's results

    Returns
    -------
    foundation : its status; ``unsettled`` for a caution about a table of which documents settle no part at all

    Raises
    ------
    ResultError
        as :func:`read_stage`
    """
    verdict = _record(folder)["verdict"]
    parts = [part["params"] for part in verdict.get("params", {}).get("parts", ())]
    unsettled = parts and not any(part["settled"] or part["up_to_signs"] for part in parts)
    return "unsettled" if verdict["status"] == "caution" and unsettled else verdict["status"]


def withheld(status: str, foundation: str | None) -> bool:
    """Whether a stage says nothing of a robot, because evidence contradicts the table that it rests on.

    Whatever it computed is of another arm, so it neither passes nor fails: the one place where this is decided.

    Parameters
    ----------
    status : of the stage's verdict; one that was not computed says why
    foundation : what validation found of the table; None where that is not known
    """
    return foundation == "fail" and status not in ("not_computed", "not_examined")


def read_scope(folder: Path, stage: Stage) -> Summary:
    """A stage's verdict, what it checked and what it assumed, without its tables.

    Parameters
    ----------
    folder : of the stage's results

    Returns
    -------
    summary : with the verdict ``not_computed`` and the reason, if the stage could not be computed

    Raises
    ------
    ResultError
        as :func:`read_stage`
    """
    record = _record(folder)
    return _absent(record) or _parsed(folder / SUMMARY, record, stage.module("model").RESULTS)[0]


def check_results(folder: Path) -> None:
    """Check that a stage's results are whole, unchanged and of this version.

    Raises
    ------
    ResultError
        naming the first file that is not
    """
    _record(folder)
    sums = checksums(folder)
    for name in sums:
        _compare(folder / name, read_bytes(folder / name), sums)


def write_checksums(folder: Path) -> None:
    """Write the checksums of a stage's files, in the form that ``sha256sum --check`` reads.

    Parameters
    ----------
    folder : whose files are listed by name; hidden ones are left out
    """
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name[0] != ".")
    sums = "".join(f"{sha256(path)}  {path.name}\n" for path in files if path.name != CHECKSUMS)
    write_text(folder / CHECKSUMS, sums)


def checksums(folder: Path) -> dict[str, str]:
    """The checksums that a stage wrote.

    Parameters
    ----------
    folder : of the stage's results

    Returns
    -------
    checksums : SHA-256 in hex, by file name

    Raises
    ------
    ResultError
        if the list is missing or damaged
    """
    path = folder / CHECKSUMS
    try:
        lines = read_bytes(path).decode("ascii").removesuffix("\n").split("\n")
        return {name: checksum for checksum, name in (line.split("  ") for line in lines)}
    except ValueError:
        raise ResultError(path, "damaged (no list of checksums)") from None


def _compare(path: Path, content: bytes, sums: dict[str, str]) -> None:
    if sums.get(path.name) != hashlib.sha256(content).hexdigest():
        raise ResultError(path, f"damaged (not the bytes that {CHECKSUMS} beside it tells of)")


def input_records(files: Iterable[Path]) -> tuple[Input, ...]:
    """What provenance says of input files.

    Parameters
    ----------
    files : that exist

    Returns
    -------
    records : path from the project's root, checksum, and the grades of the values in the file
    """
    return tuple(Input(shown_path(file), sha256(file), grades_in(file)) for file in files)


def changed_since(folder: Path, study: Study, robot: str, stage: str) -> tuple[str, ...]:
    """What a stage's results rest on that is otherwise now.

    Parameters
    ----------
    folder : of the stage's results
    study : as it is now

    Returns
    -------
    names : paths of files with another content, ``THE_SETTINGS`` and ``THE_CODE``; none if the results are up to date

    Raises
    ------
    ResultError
        as :func:`read_stage`
    """
    stored = _record(folder)["provenance"]
    then = {each["path"]: each["sha256"] for each in stored["inputs"]}
    now = {shown_path(file): sha256(file) for file in study.inputs(robot, stage) if file.is_file()}
    changed = [path for path in sorted(then.keys() | now.keys()) if then.get(path) != now.get(path)]
    settings = json.loads(json.dumps(plain(study.computed_from(robot, stage))))
    if settings != stored["config"]:
        changed.append(THE_SETTINGS)
    if numbers_digest() != stored["code"]:
        changed.append(THE_CODE)
    return tuple(changed)


def is_current(folder: Path, study: Study, robot: str, stage: str) -> bool:
    """Whether a stage's results are there, whole, and what they would be if they were computed again.

    Parameters
    ----------
    folder : of the stage's results
    study : as it is now

    Returns
    -------
    current : False also where there are none
    """
    try:
        check_results(folder)
        return not changed_since(folder, study, robot, stage)
    except ResultError:
        return False


def result_records(results: Path, robots: Iterable[str]) -> tuple[Input, ...]:
    """What provenance says of the results of robots that a page shows.

    Parameters
    ----------
    results : the folder of all results
    robots : names of those shown

    Returns
    -------
    records : the list of checksums of each stage that is there, and the checksum of that list
    """
    files = [results / robot / stage / CHECKSUMS for robot in robots for stage in STAGES]
    return tuple(Input(file.as_posix(), sha256(file), {}) for file in files if file.is_file())


def _verdict_record(verdict: Verdict) -> dict[str, Any]:
    more = {key: value for key in BESIDE if (value := getattr(verdict, key))}
    return {"status": verdict.status, **opened_once(verdict.finding), **more}


def _stored_finding(verdict: Mapping[str, Any]) -> dict[str, Any]:
    return {key: verdict[key] for key in ("code", "params", "basis") if key in verdict}


def _parsed(path: Path, stored: dict[str, Any], kind: type[Results]) -> tuple[Any, Provenance]:
    own = {key: value for key, value in stored.items() if key not in ("format_version", "robot", "stage", "provenance")}
    verdict = own["verdict"]
    of_stage: Any = get_type_hints(kind)["summary"]
    more = {key: verdict[key] for key in BESIDE if key in verdict}
    own["verdict"] = {"status": verdict["status"], "finding": _stored_finding(verdict), **more}
    try:
        return adapter(of_stage).validate_python(own), adapter(Provenance).validate_python(stored.get("provenance"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ResultError(path, f"damaged ({where}: {first['msg']})") from None
    except (KeyError, TypeError) as error:
        raise ResultError(path, f"damaged (verdict without {error})") from None


JUNIT = "junit.xml"
OVERALL = ("index.html", JUNIT)


def write_checksum(path: Path) -> None:
    """Write the checksum of a finished page or recording into a hidden file in its folder.

    Parameters
    ----------
    path : of the page or recording
    """
    checksum = sha256(path)
    write_text(checksum_file(path), checksum)


def check_checksum(path: Path) -> None:
    """Check that a page or recording is as it was written.

    Parameters
    ----------
    path : of the page or recording

    Raises
    ------
    ResultError
        if it was changed, or no checksum of it was kept
    """
    try:
        kept = checksum_file(path).read_bytes()
    except OSError:
        raise ResultError(path, "no checksum of it was kept") from None
    if kept != sha256(path).encode("ascii"):
        raise ResultError(path, "damaged (its checksum does not agree)")


def checksum_file(path: Path) -> Path:
    """Where a page's or recording's checksum is kept.

    Parameters
    ----------
    path : of the page or recording

    Returns
    -------
    path : a hidden file in the same folder
    """
    return path.with_name(f".{path.name}.sha256")
