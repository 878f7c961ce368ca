"""The documents of a reference set: ``documents.csv`` beside its tables."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from pathlib import Path

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv
from er3a.files.robot_file import NAME_PATTERN
from er3a.references.documents import NO_DOCUMENT, Document, Documents
from er3a.references.reference import Row
from er3a.robots.robot import Robot

FILE = "documents.csv"
_WORD = CsvColumn(str)
COLUMNS = {"name": _WORD, "title": _WORD, "publisher": _WORD, "derived_from": CsvColumn(str, optional=True)}


def load_documents(path: str | Path) -> Documents:
    """Read a set's documents; ``derived_from`` holds names, apart by semicolons.

    Raises
    ------
    InputError
        for a name that is none or stands twice, for one that ``derived_from`` does not know, and for documents that
        were made from each other in a circle
    """
    path = Path(path)
    found: dict[str, Document] = {}
    table = read_csv(path, COLUMNS)
    for fields in table:
        name, where = fields["name"], f"row {fields['row']}, column name"
        if not re.match(NAME_PATTERN, name) or name == NO_DOCUMENT:
            remedy = f"Write a short name in small letters, digits and _, other than '{NO_DOCUMENT}'"
            raise InputError(path, where, f"'{name}' is no name of a document", remedy)
        if name in found:
            raise InputError(path, where, f"the document '{name}' is given twice", "Keep one of the two")
        parents = tuple(part.strip() for part in fields["derived_from"].split(";")) if fields["derived_from"] else ()
        found[name] = Document(name, fields["title"], fields["publisher"], parents)
    for fields in table:
        for parent in found[fields["name"]].derived_from:
            if parent not in found:
                where = f"row {fields['row']}, column derived_from"
                raise InputError(path, where, f"the document '{parent}' is not known", _known(found))
    documents = Documents(found)
    if circle := documents.circle():
        chain = " from ".join((*circle, circle[0]))
        problem = f"documents made from each other in a circle: {chain}"
        raise InputError(path, "column derived_from", problem, "Leave out the step that isn't true")
    return documents


def check_origins(path: Path, rows: Iterable[Row], documents: Documents) -> None:
    """Refuse rows whose origin is none of the documents: :class:`InputError` naming the row."""
    for row in rows:
        if row.origin not in documents.by_name:
            problem = f"the document '{row.origin}' is not known"
            raise InputError(path, f"row {row.line}, column origin", problem, _known(documents.by_name))


def check_robot_origins(robot: Robot, documents: Collection[str]) -> None:
    """Refuse a robot whose values name documents that its sets don't declare; without sets it may name any."""
    named = {f"{group}.origin": source.origin for group, source in robot.sources.items() if source.origin}
    named |= {f"the origin of {entry}": name for entry, name in robot.origins.items()}
    for field, name in named.items():
        if documents and name not in documents and name != NO_DOCUMENT:
            raise InputError(f"{robot.name}.yaml", field, f"the document '{name}' is not known", _known(documents))


def _known(names: Iterable[str]) -> str:
    return f"Write one of: {', '.join(names) or 'none yet'}; or declare it in {FILE}"
