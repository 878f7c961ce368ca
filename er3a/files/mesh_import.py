"""Makes a file of convex pieces from a mesh, once, so that studies need neither the mesh nor a mesh library."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from er3a.collision.meshes import convex_pieces
from er3a.files.kept_files import sha256, write_atomically
from er3a.files.pieces_file import PiecesFile, checksum_of
from er3a.formats.mesh_file import Unit, read_mesh

DIGITS = 6  # of mm: a nanometre


def import_mesh(source: Path, output: Path, unit: Unit, threshold: float, seed: int) -> PiecesFile:
    """Split a mesh into convex pieces and write them to a file.

    Raises
    ------
    InputError
        for a mesh that can't be used, see :func:`er3a.formats.mesh_file.read_mesh`
    """
    mesh = read_mesh(source, unit)
    found = convex_pieces(mesh.vertices, mesh.faces, threshold, seed)
    rounded = [np.round(piece * 1000, DIGITS).tolist() for piece in found.pieces]
    content = PiecesFile(
        kind="pieces",
        source=source.name,
        source_sha256=sha256(source),
        unit=unit,
        triangles=len(mesh.faces),
        threshold=threshold,
        seed=seed,
        # with what rounding the corners may take away
        uncovered_mm=float(np.ceil(found.uncovered * 1000 * 10**DIGITS) + 2) / 10**DIGITS,
        excess_mm=round(found.excess * 1000, DIGITS),
        sha256=checksum_of(rounded),
        pieces_mm=rounded,
    )
    text = json.dumps(content.model_dump(), indent=1) + "\n"
    write_atomically(output, lambda file: file.write_text(text, encoding="utf-8"))
    return content
