"""Triangle meshes from STL, OBJ, PLY, DAE and GLB files, read by trimesh."""

from __future__ import annotations

import hashlib
import struct
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import numpy as np

from er3a.errors import InputError, given_bytes
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import LinkMesh

Unit = Literal["m", "mm"]
FORMATS = (".stl", ".obj", ".ply", ".dae", ".glb")
MAX_TRIANGLES = 1_000_000
MAX_MESH_BYTES = 200_000_000
SMALLEST, LARGEST = 2e-3, 100.0  # m, of a mesh in all
LARGEST_OF_LINK = 20.0  # m


def read_mesh(path: Path, unit: Unit) -> tuple[Reals, Integers]:
    """Vertices (V, 3), m, and faces (F, 3) of a mesh whose lengths are in a unit.

    Raises
    ------
    InputError
        for a file that is not a mesh, is too large, or can only be in the other unit
    """
    vertices, faces, _ = _surface(_loaded(path), 1.0 if unit == "m" else 1e-3)
    _check_size(path, float(np.ptp(vertices, axis=0).max()), unit)
    return vertices, faces


def read_link_mesh(path: Path, scale: Reals) -> tuple[Reals, Integers, bool]:
    """Vertices (V, 3), m, and faces (F, 3) of a mesh of a URDF's link, each axis times ``scale`` (3,), and whether it
    is closed.

    Lengths of the file are in metres, those of a DAE in the unit that it states, as RViz and Gazebo take them.

    Raises
    ------
    InputError
        for a file that is not a mesh, is too large, or has a size that no link has
    """
    loaded = _loaded(path)
    return _surface(loaded, _link_scale(path, loaded, scale))


STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])


def link_mesh(link: int, corners: Reals) -> LinkMesh:
    """A link's surface from triangles, to the digits that :func:`stl_of` keeps.

    Parameters
    ----------
    link : its number, 0 for the base
    corners : (F, 3, 3), m, of each triangle, in the frame that moves with the link's joint

    Returns
    -------
    mesh : with corners that are equal to single precision in mm joined to one
    """
    # As an STL holds them, so that what is read back is equal to what was written.
    rounded = (1000 * np.asarray(corners).reshape(-1, 3)).astype(np.float32).astype(float) / 1000
    points, same = np.unique(rounded, axis=0, return_inverse=True)
    return LinkMesh(link, points, same.reshape(-1, 3).astype(np.int64))


def stl_of(mesh: LinkMesh) -> bytes:
    """A surface as a binary STL file.

    Parameters
    ----------
    mesh : corners in m

    Returns
    -------
    content : 80 bytes of zeros, the number of triangles, then the triangles in mm; normals are 0, so readers compute
        them
    """
    triangles = np.zeros(len(mesh.faces), STL_TRIANGLE)
    triangles["corners"] = 1000 * mesh.points[mesh.faces]
    return bytes(80) + struct.pack("<I", len(triangles)) + triangles.tobytes()


def read_stl(path: Path, link: int, checksum: str) -> LinkMesh:
    """A surface that :func:`stl_of` wrote.

    Raises
    ------
    InputError
        if it is missing, or changed since it was written
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(path, None, f"can't be read ({error.strerror})", "Copy it beside the robot file") from None
    if len(content) < 84 or hashlib.sha256(content).hexdigest() != checksum:
        raise InputError(path, None, "was changed after er3a wrote it", "Import the URDF again: er3a import-urdf")
    return link_mesh(link, np.frombuffer(content, STL_TRIANGLE, offset=84)["corners"].astype(float) / 1000)


def _surface(loaded: Any, scale: Reals | float) -> tuple[Reals, Integers, bool]:
    """Vertices (V, 3) times ``scale``, faces (F, 3), and whether it is closed: then outwards, where they have sides."""
    loaded.merge_vertices()
    loaded.vertices = loaded.vertices * scale
    closed = bool(loaded.is_watertight)
    if closed and loaded.is_winding_consistent:
        loaded.fix_normals()
    return np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64), closed


def _link_scale(path: Path, loaded: Any, scale: Reals) -> Reals:
    """Metres (3,) for a length of 1 in the file of a link's mesh."""
    if path.suffix.lower() == ".dae" and loaded.units is not None:
        import trimesh  # takes a while

        scale = scale * trimesh.units.unit_conversion(loaded.units, "meters")
    longest = float((np.ptp(loaded.vertices, axis=0) * np.abs(scale)).max())
    if longest > LARGEST_OF_LINK:
        problem = f"its longest side is {longest:.4g} m, which no link is; its lengths can only be in a smaller unit"
        raise InputError(path, None, problem, 'For mm write scale="0.001 0.001 0.001" in its <mesh>')
    return scale


def _loaded(path: Path) -> Any:
    """A mesh as trimesh reads it."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(path, None, f"'{path.suffix}' is not a mesh format", f"Save it as {', '.join(FORMATS)}")
    if not path.is_file():
        raise InputError(path, None, "there is no such file", "Check the path")
    if path.stat().st_size > MAX_MESH_BYTES:
        raise InputError(path, None, f"larger than {MAX_MESH_BYTES // 1_000_000} MB", "Simplify the mesh")
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
    if (count := len(loaded.faces)) > MAX_TRIANGLES:
        remedy = "Simplify it: links are known to millimetres"
        raise InputError(path, None, f"has {count} triangles; at most {MAX_TRIANGLES} are read", remedy)
    if not np.isfinite(loaded.vertices).all():
        raise InputError(path, None, "has corners that are not numbers", "Save the mesh again")
    return loaded


def _check_size(path: Path, size: float, unit: Unit) -> None:
    if size < SMALLEST:
        problem = f"its longest side is {size * 1000:.3g} mm, which can only be metres"
        raise InputError(path, None, problem, "Write unit: m")
    if size > LARGEST:
        other = "mm" if unit == "m" else "a smaller unit"
        raise InputError(path, None, f"its longest side is {size:.4g} m, which can only be {other}", "Check its unit")


MAX_BYTES = 1_000_000
TOO_LARGE = "Write long lists of targets or points as CSV tables"


def read_text(path: Path, most: int = MAX_BYTES, too_large: str = TOO_LARGE) -> str:
    """Read a text file that a user gave.

    Parameters
    ----------
    most : bytes that the file may have at most
    too_large : the remedy that the error names for a larger one

    Returns
    -------
    text : without the byte order mark, if it has one; Windows' ends of lines are ``\\n``

    Raises
    ------
    InputError
        if it is missing, not a plain file, unreadable, too large, or not UTF-8 (with the number of the byte)
    """
    return text_of(path, given_bytes(path, most, too_large), "utf-8-sig")


def text_of(path: Path, raw: bytes, encoding: str = "", errors: str = "strict") -> str:
    """The text that a file's bytes are.

    Parameters
    ----------
    encoding : by default UTF-8, or UTF-16 where a byte order mark says so, as spreadsheets write it
    errors : ``replace`` puts the sign U+FFFD for what is in another encoding, such as comments

    Returns
    -------
    text : without the byte order mark, if it has one; Windows' ends of lines are ``\\n``

    Raises
    ------
    InputError
        if they are in another encoding (with the number of the byte)
    """
    try:
        text = raw.decode(encoding or ("utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"), errors)
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "not UTF-8 text", "Save the file as UTF-8") from None
    return text.replace("\r\n", "\n")
