"""Robots from outside the project: the D-H models of Robotics Toolbox, and the URDFs of installed packages.

``rtb-data`` and ``example-robot-data`` are installed for tests; none of their files is copied into the project.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from er3a.errors import InputError
from er3a.formats.urdf import UrdfImport, import_urdf
from er3a.formats.urdf_tree import tree_of
from er3a.robots.robot import Robot

FAR = 10.0  # m or rad: the range that stands in for joints whose source tells none


@dataclass(frozen=True)
class DhModel:
    """A D-H model of Robotics Toolbox as a robot of ours, and the toolbox's own poses for comparison."""

    name: str
    robot: Robot
    poses: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class UrdfFile:
    """A URDF (expanded, where it was xacro), by a short name."""

    name: str
    path: Path


def dh_models() -> Iterator[DhModel | tuple[str, str]]:
    """Every D-H model of Robotics Toolbox; name and reason for those that can't be one of ours."""
    import roboticstoolbox as rtb

    for name in sorted(name for name in dir(rtb.models.DH) if name[0].isupper()):
        try:
            made = getattr(rtb.models.DH, name)()
        except Exception as error:  # what the toolbox itself can't make
            yield name, f"the toolbox can't make it ({type(error).__name__}: {error})"
            continue
        if not hasattr(made, "links") or len(made.links) > 10:
            yield name, f"{len(made.links) if hasattr(made, 'links') else 'no'} joints"
            continue
        yield DhModel(name, robot_of_toolbox(name, made), lambda q, made=made: _toolbox_poses(made, q))


def robot_of_toolbox(name: str, made) -> Robot:
    """A toolbox model as a robot: rows, flips, offsets, limits, base and tool."""
    links, n = made.links, len(made.links)
    sliding = np.array([bool(link.isprismatic) for link in links])
    limits = np.array([_limits(link, slides) for link, slides in zip(links, sliding)])
    theta, d = (np.array([float(getattr(link, key) or 0.0) for link in links]) for key in ("theta", "d"))
    offset = np.array([float(link.offset) for link in links])
    return Robot(
        name=re.sub(r"\W", "_", name.lower()),
        title=name,
        convention="modified" if links[0].mdh else "standard",
        a=np.array([float(link.a) for link in links]),
        alpha=np.array([float(link.alpha) for link in links]),
        d=np.where(sliding, offset, d),
        direction=np.array([-1.0 if link.isflip else 1.0 for link in links]),
        offset=np.where(sliding, theta, offset),
        lower=limits[:, 0],
        upper=limits[:, 1],
        sliding=sliding,
        base=np.asarray(made.base.A, dtype=float),
        tool=np.asarray(made.tool.A, dtype=float),
        speed=np.full(n, np.nan),
    )


def _limits(link, slides: bool) -> tuple[float, float]:
    if link.qlim is None or not np.isfinite(link.qlim).all() or link.qlim[0] >= link.qlim[1]:
        return (0.0, 1.0) if slides else (-np.pi, np.pi)
    return float(link.qlim[0]), float(link.qlim[1])


def _toolbox_poses(made, q: np.ndarray) -> np.ndarray:
    return np.array([made.fkine(row).A for row in q])


def urdf_files(folder: Path, chosen: Callable[[str], bool] = lambda name: True) -> Iterator[UrdfFile | tuple[str, str]]:
    """URDFs of both packages; xacro is expanded into ``folder``. Name and reason for those that can't be.

    Parameters
    ----------
    chosen : whether to take a file, by its name
    """
    shared = Path(str(find_spec("pinocchio").origin)).parents[4] / "share" / "example-robot-data" / "robots"
    for path in sorted(shared.rglob("*.urdf")):
        if chosen(name := str(path.relative_to(shared))):
            yield UrdfFile(name, path)
    data = Path(str(find_spec("rtbdata").origin)).parent
    for path in sorted([*data.rglob("*.urdf"), *data.rglob("*.xacro")]):
        if not chosen(name := str(path.relative_to(data))):
            continue
        if path.suffix == ".xacro":
            if not re.search(r"<robot[^>]*\bname=", path.read_text(encoding="utf-8")):
                continue  # a part that others include
            target = folder / (re.sub(r"\W+", "_", name) + ".urdf")
            try:
                target.write_text(_expanded(path, data), encoding="utf-8")
            except Exception as error:  # what xacro can't expand, because it names packages that are not there
                yield name, f"xacro can't expand it ({' '.join(str(error).split())[:90]})"
                continue
            path = target
        yield UrdfFile(name, path)


def _expanded(path: Path, data: Path) -> str:
    from xacrodoc import XacroDoc

    _make_packages_known(data)
    return XacroDoc.from_file(str(path)).to_urdf_string()


@cache
def _make_packages_known(data: Path) -> None:
    from xacrodoc import packages

    for folder in sorted({found.parent for found in data.rglob("package.xml")} | {*data.glob("xacro/*/*/urdf")}):
        packages.update_package_cache({folder.name if folder.name != "urdf" else folder.parent.name: folder})
    for folder in (*data.glob("xacro/*"), *data.glob("xacro/*/*"), *data.glob("armer_xarm/data/xacro")):
        packages.update_package_cache({folder.name: folder})


def chain_ends(path: Path) -> list[str]:
    """The links of a URDF at which an arm may end, those that ``tip`` can name."""
    tree = tree_of(path, False)
    return [end for root in tree.roots for end in tree.ends(root)]


def chains_of(file: UrdfFile, most: int = 8) -> Iterator[tuple[str, UrdfImport] | tuple[str, InputError]]:
    """Each serial chain of a file with its name: the only one, or one for each end (``most`` of them)."""
    try:
        yield file.name, import_urdf(file.path, snap=True)
        return
    except InputError as error:
        first = error
    try:
        ends = chain_ends(file.path)
    except InputError:
        ends = []
    if len(ends) < 2:
        yield file.name, first
    for end in ends[:most] if len(ends) > 1 else ():
        try:
            yield f"{file.name} to {end}", import_urdf(file.path, tip=end, snap=True)
        except InputError as error:
            yield f"{file.name} to {end}", error
