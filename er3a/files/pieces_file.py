"""Files of convex pieces, made from a mesh once, so that studies need neither the mesh nor a mesh library."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from er3a.errors import InputError
from er3a.files.robot_file import Text
from er3a.files.units import Triple
from er3a.files.yaml_file import StrictModel, parse
from er3a.formats.mesh_file import read_text
from er3a.numerics.arrays import Reals

MAX_BYTES = 20_000_000


class PiecesFile(StrictModel):
    """Convex pieces of a mesh, in mm; ``sha256`` is of the pieces, ``source_sha256`` of the mesh's file.

    ``uncovered_mm`` bounds how far the mesh sticks out of the pieces, which are enlarged by it; ``excess_mm`` is how
    far the pieces stick out of the mesh, as measured.
    """

    kind: Literal["pieces"]
    source: Text
    source_sha256: Text
    unit: Literal["m", "mm"]
    triangles: int
    threshold: float
    seed: int
    uncovered_mm: Annotated[float, Field(ge=0)]
    excess_mm: Annotated[float, Field(ge=0)]
    sha256: Text
    pieces_mm: Annotated[list[Annotated[list[Triple], Field(min_length=4)]], Field(min_length=1, max_length=1000)]

    def pieces(self) -> tuple[Reals, ...]:
        """Corners (k, 3), m, of each piece."""
        return tuple(np.array(piece) / 1000 for piece in self.pieces_mm)


def load_pieces(path: str | Path) -> PiecesFile:
    """Read a file of pieces.

    Raises
    ------
    InputError
        if it is missing, not a file of pieces, or changed since it was written
    """
    path = Path(path)
    if path.suffix.lower() != ".json":
        remedy = f"Make one of the mesh: er3a mesh {path.name} --unit mm --output {path.stem}.json"
        raise InputError(path, None, "is not a file of convex pieces", remedy)
    try:
        data = json.loads(read_text(path, MAX_BYTES))
    except (json.JSONDecodeError, RecursionError):
        raise InputError(path, None, "not valid JSON", "Import the mesh again: er3a mesh") from None
    if not isinstance(data, dict):
        raise InputError(path, None, f"the top level is a {type(data).__name__}", "Import the mesh again: er3a mesh")
    content = parse(PiecesFile, data, path)
    if checksum_of(content.pieces_mm) != content.sha256:
        raise InputError(
            path, "sha256", "the pieces were changed after er3a wrote them", "Import the mesh again: er3a mesh"
        )
    return content


def checksum_of(pieces: list[list[list[float]]]) -> str:
    """Checksum of convex pieces, by which a changed file is noticed.

    Parameters
    ----------
    pieces : corners (k, 3) in mm of each piece, as plain lists

    Returns
    -------
    checksum : SHA-256 of their JSON text, in hex
    """
    return hashlib.sha256(json.dumps(pieces).encode()).hexdigest()
