"""Where the project's own robots, references, schemas and workflow stand: beside the package in a checkout, in it
where a wheel was installed (``tool.hatch.build.targets.wheel.force-include`` in ``pyproject.toml``)."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
_IN_WHEEL = _PACKAGE / "shipped"

INSTALLED = _IN_WHEEL.is_dir()
ROOT = _IN_WHEEL if INSTALLED else _PACKAGE.parent


def own_or_shipped(place: str) -> Path:
    """The file or folder at a place such as ``data/robots/arm.yaml``: the study's own, else the project's.

    The study's folder is the one that er3a is called in, from which all paths of a study count.
    """
    own = Path(place)
    return own if own.exists() else ROOT / place


def given_file(path: Path) -> Path:
    """A file that a person names: their own, else the project's at a place such as ``data/paths/arm.yaml``."""
    shipped = ROOT / path
    return shipped if path.parts[:1] == ("data",) and not path.exists() and shipped.is_file() else path


def names(folder: str, pattern: str) -> list[str]:
    """The stems of what stands in a folder of the study or of the project, sorted."""
    places = (Path(folder), ROOT / folder)
    return sorted({path.stem for place in places for path in place.glob(pattern)})


def view_command(robot: str | None = None) -> str:
    """What a person types to see the recordings, of one robot or of all."""
    if INSTALLED:
        return f"er3a view {robot}" if robot else "er3a view"
    return f"make view ROBOT={robot}" if robot else "make view"
