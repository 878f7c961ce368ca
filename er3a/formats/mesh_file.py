"""Triangle meshes from STL, OBJ, DAE and GLB files, read by trimesh."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from er3a.errors import InputError
from er3a.numerics.arrays import Integers, Reals

Unit = Literal["m", "mm"]
UNITS: tuple[Unit, ...] = get_args(Unit)
FORMATS = (".stl", ".obj", ".dae", ".glb")
MOST_TRIANGLES = 1_000_000
MOST_BYTES = 200_000_000
SMALLEST, LARGEST = 2e-3, 100.0  # m, of a mesh in all


@dataclass(frozen=True, eq=False)
class ClosedMesh:
    """A closed surface: vertices (V, 3), m, and faces (F, 3), outwards by the right-hand rule."""

    vertices: Reals
    faces: Integers


def read_mesh(path: str | Path, unit: Unit, scale: Reals | None = None) -> ClosedMesh:
    """Read a closed mesh whose lengths are in a unit, each axis times ``scale`` (3,).

    Raises
    ------
    InputError
        for a file that is no such mesh, is too large, is not closed, or can only be in the other unit
    """
    path = Path(path)
    loaded = _loaded(path)
    loaded.merge_vertices()
    if not loaded.is_watertight:
        edges = np.unique(loaded.edges_sorted, axis=0, return_counts=True)[1]
        problem = f"is not closed: {int((edges != 2).sum())} edges don't have two triangles"
        raise InputError(path, None, problem, "Close its holes, for example in a mesh editor")
    if scale is not None:
        loaded.vertices = loaded.vertices * scale
    loaded.fix_normals()
    vertices = np.asarray(loaded.vertices, float) * (1.0 if unit == "m" else 1e-3)
    _check_size(path, float(np.ptp(vertices, axis=0).max()), unit)
    return ClosedMesh(vertices, np.asarray(loaded.faces, np.int64))


def read_vertices(path: Path) -> Reals:
    """Corners (V, 3) of a mesh that need not be closed, in the unit of its file; :class:`InputError` as above."""
    return np.asarray(_loaded(path).vertices, float)


def _loaded(path: Path) -> Any:
    """A mesh as trimesh reads it."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(path, None, f"'{path.suffix}' is no format of meshes", f"Save it as {', '.join(FORMATS)}")
    if not path.is_file():
        raise InputError(path, None, "there is no such file", "Check the path")
    _refuse_large(path)
    if path.suffix.lower() == ".dae" and find_spec("collada") is None:
        raise InputError(path, None, "can't be read without pycollada", "Install it: pip install 'er3a[meshes]'")
    import trimesh  # takes a while

    try:
        loaded = trimesh.load(path, force="mesh", process=True)
    except Exception as error:  # whatever a damaged file makes a reader stumble over
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(path, None, f"can't be read as a mesh ({reason})", "Save the mesh again") from None
    if not isinstance(loaded, trimesh.Trimesh) or not len(loaded.faces):
        raise InputError(path, None, "holds no triangles", "Save the surface as triangles")
    if len(loaded.faces) > MOST_TRIANGLES:
        raise _too_many(path, len(loaded.faces))
    if not np.isfinite(loaded.vertices).all():
        raise InputError(path, None, "has corners that are no numbers", "Save the mesh again")
    return loaded


def _refuse_large(path: Path) -> None:
    """A file that is too large to be opened at all; a binary STL says how many triangles it has."""
    size = path.stat().st_size
    if path.suffix.lower() == ".stl" and size >= 84:
        with path.open("rb") as file:
            count = struct.unpack("<I", file.read(84)[80:])[0]
        if size == 84 + 50 * count and count > MOST_TRIANGLES:
            raise _too_many(path, count)
    if size > MOST_BYTES:
        raise InputError(path, None, f"larger than {MOST_BYTES // 1_000_000} MB", "Simplify the mesh")


def _too_many(path: Path, count: int) -> InputError:
    remedy = "Simplify it: links are known to millimetres"
    return InputError(path, None, f"has {count} triangles; at most {MOST_TRIANGLES} are read", remedy)


def _check_size(path: Path, size: float, unit: Unit) -> None:
    if size < SMALLEST:
        problem = f"its longest side is {size * 1000:.3g} mm, which can only be metres"
        raise InputError(path, None, problem, "Import it with --unit m")
    if size > LARGEST:
        other = "mm" if unit == "m" else "a smaller unit"
        raise InputError(path, None, f"its longest side is {size:.4g} m, which can only be {other}", "Check --unit")
