"""Findings at lines of files as a SARIF log [1]_, which code hosts and editors read.

References
----------
.. [1] Static Analysis Results Interchange Format (SARIF) Version 2.1.0, OASIS Standard, 2020.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from er3a.errors import InputError
from er3a.files.kept_files import from_here
from er3a.program_check.check_program import LocatedFinding
from er3a.program_check.program_check_findings import Level
from er3a.programs.instructions import Place
from er3a.version import __version__

BASE = "%SRCROOT%"
SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
FINGERPRINT = "primaryLocationLineHash"
WORDS: dict[Level, str] = {"fail": "error", "caution": "warning", "note": "note", "pass": "pass"}


class Reported(NamedTuple):
    """A finding with its text, and the text of its line, by which it is known again."""

    found: LocatedFinding
    text: str
    line_text: str = ""


def sarif_log(tool: str, found: Iterable[Reported], notes: Iterable[tuple[Path, str, str]] = ()) -> dict[str, Any]:
    """A log of one run of a tool.

    Parameters
    ----------
    tool : its name
    notes : the tool's own warnings: file, code and text

    Returns
    -------
    log : paths relative to the folder that the command runs in. Fingerprints do not change with line numbers.
    """
    seen: dict[str, int] = {}
    results = [_result(each, seen) for each in found]
    warnings = [
        {
            "level": "warning",
            "descriptor": {"id": code},
            "message": {"text": text},
            "locations": [_location(Place(file))],
        }
        for file, code, text in notes
    ]
    driver = {
        "name": tool,
        "version": __version__,
        "rules": [
            {"id": code, "shortDescription": {"text": code.replace("_", " ")}}
            for code in sorted({each["ruleId"] for each in results})
        ],
    }
    run = {
        "tool": {"driver": driver},
        "originalUriBaseIds": {BASE: {"description": {"text": "The folder that the command was run in."}}},
        "columnKind": "unicodeCodePoints",
        "results": results,
        "invocations": [{"executionSuccessful": True, "toolExecutionNotifications": warnings}],
    }
    return {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def accepted(baseline: Path) -> frozenset[str]:
    """Fingerprints of findings in a SARIF log that were accepted.

    Raises
    ------
    InputError
        for a file that is no SARIF log
    """
    try:
        return frozenset(fingerprints(json.loads(baseline.read_text(encoding="utf-8"))))
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(baseline, None, "is no SARIF log", "Give what --sarif has written") from None


def fingerprints(log: dict[str, Any]) -> list[str]:
    """The fingerprint of each finding in a log, in its order.

    Parameters
    ----------
    log : as :func:`sarif_log` makes it
    """
    return [each["partialFingerprints"][FINGERPRINT] for run in log["runs"] for each in run["results"]]


def shown(file: Path | None) -> str:
    """A path as it is printed.

    Parameters
    ----------
    file : None for a program made in Python

    Returns
    -------
    text : from the folder that the command runs in, where the file is below it; else as it was given
    """
    if file is None:
        return "program"
    near = from_here(file)
    return str(file) if near.startswith("..") else near


def _result(reported: Reported, seen: dict[str, int]) -> dict[str, Any]:
    one, text, line_text = reported
    code, place = one.finding.code, one.place
    parts = (code, _uri_from_here(place.file), place.element, line_text)
    print_of = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
    number = seen[print_of] = seen.get(print_of, 0) + 1
    found: dict[str, Any] = {
        "ruleId": code,
        "level": WORDS[one.level],
        "message": {"text": text},
        "locations": [_location(place)],
        "partialFingerprints": {FINGERPRINT: f"{print_of}:{number}"},
    }
    if one.calls:
        found["relatedLocations"] = [{**_location(call), "message": {"text": "called from here"}} for call in one.calls]
    return found


def _location(place: Place) -> dict[str, Any]:
    artifact = {"uri": _uri_from_here(place.file), "uriBaseId": BASE}
    physical = {"artifactLocation": artifact, "region": {"startLine": max(place.line, 1)}}
    if not place.element:
        return {"physicalLocation": physical}
    logical = [{"fullyQualifiedName": place.element, "kind": "element"}]
    return {"physicalLocation": physical, "logicalLocations": logical}


def _uri_from_here(file: Path | None) -> str:
    """A path from the folder that the command runs in, upwards too where the file lies beside it."""
    return quote(from_here(file or "program").replace(os.sep, "/"))
