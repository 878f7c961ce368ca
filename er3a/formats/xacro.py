"""URDFs that are written as xacro, expanded by xacrodoc (the extra ``xacro``); ROS is not needed."""

from __future__ import annotations

import re
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from er3a.errors import InputError
from er3a.formats.mesh_file import read_text
from er3a.formats.urdf_tree import MOST_BYTES, mesh_of

COMMENT = re.compile("<!--.*?-->", re.DOTALL)
FOLDERS_UP = 4  # in and beside which packages are looked for
EXTRA = "Install it: pip install 'er3a[xacro]'; or expand the file elsewhere: xacro FILE > arm.urdf"


@contextmanager
def plain_urdf(path: Path, arguments: Sequence[str] = ()) -> Iterator[Path]:
    """The file itself if it is a URDF; of xacro the expanded URDF, for as long as the block lasts.

    Packages that the file names are looked for in the four folders above it and beside it, then where ROS has them.

    Parameters
    ----------
    arguments : ``NAME:=VALUE``, as ``<xacro:arg name="NAME"/>`` asks for them

    Raises
    ------
    InputError
        for arguments of another form or to a file that is no xacro, without xacrodoc, or for what it can't expand; it
        names ``path`` for what the expanded file is refused for, too
    """
    if "<xacro:" not in COMMENT.sub("", read_text(path, MOST_BYTES)):
        if arguments:
            raise InputError(path, "--xacro", "the file holds no xacro macros", "Leave the arguments out")
        yield path
        return
    values = dict(_argument(path, each) for each in arguments)
    expanded = _expanded(path, values)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{path.name.removesuffix('.xacro').removesuffix('.urdf')}.urdf")
        file.write_text(expanded, encoding="utf-8")
        try:
            yield file
        except InputError as error:
            if error.file != str(file):
                raise
            raise InputError(path, error.field, error.problem, error.remedy) from None


def _argument(path: Path, text: str) -> tuple[str, str]:
    name, given, value = text.partition(":=")
    if not name or not given:
        raise InputError(path, "--xacro", f"'{text}' is no argument of xacro", "Write NAME:=VALUE")
    return name, value


def _expanded(path: Path, values: dict[str, str]) -> str:
    """The URDF's text, its meshes named by where they are; those not found keep their names."""
    try:
        from xacrodoc import XacroDoc, packages
    except ImportError:
        raise InputError(path, None, "is xacro, which xacrodoc expands", EXTRA) from None
    packages.reset()
    packages.update_package_cache(_packages_near(path))
    try:
        text = XacroDoc.from_file(path, subargs=values, resolve_packages=False).to_urdf_string()
        root = ElementTree.fromstring(text)
    except Exception as error:  # whatever a macro makes its expander stumble over
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        remedy = "Give what it asks for: --xacro NAME:=VALUE; keep its packages in folders beside it"
        raise InputError(path, None, f"can't be expanded ({reason})", remedy) from None
    for mesh in root.iter("mesh"):
        if (file := mesh_of(path, mesh.get("filename", ""))) is not None:
            mesh.set("filename", f"file://{file.resolve()}")
    return ElementTree.tostring(root, encoding="unicode")


def _packages_near(path: Path) -> dict[str, Path]:
    """Packages by name: folders above the file, nearest last, and beside those; ``package.xml`` renames one."""
    found: dict[str, Path] = {}
    for above in reversed(path.resolve().parents[:FOLDERS_UP]):
        found |= {folder.name: folder for folder in (*sorted(above.glob("*/")), above)}
        for manifest in (*sorted(above.glob("*/package.xml")), above / "package.xml"):
            if manifest.is_file():
                found[_package_name(manifest)] = manifest.parent
    return found


def _package_name(manifest: Path) -> str:
    try:
        name = ElementTree.parse(manifest).findtext("name")
    except ElementTree.ParseError:
        name = None
    return (name or manifest.parent.name).strip()
