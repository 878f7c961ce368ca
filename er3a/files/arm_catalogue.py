"""The catalogue of arms: geometry, limits and speeds of industrial and research arms, each with its source.

``data/arms/arms.csv`` has a row for each arm, in mm and deg; ``data/arms/sources.csv`` says what its sources are.
``testing/arm_entries.py`` writes the rows.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from functools import cache

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.files.kept_files import ROOT
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.numerics.peaks import box_points, peak
from er3a.robots.robot import Grade, Robot, Source

ARMS, SOURCES = ROOT / "data" / "arms" / "arms.csv", ROOT / "data" / "arms" / "sources.csv"
OF_ROWS = "a_mm", "alpha_deg", "d_mm", "direction", "offset_deg"
OF_JOINTS = "lower", "upper", "speeds"


@frozen
class Publication:
    """A public source: ``title`` as it is cited, and what its numbers are worth (``grade``)."""

    title: str
    grade: Grade


@by_identity
class KnownArm:
    """An arm of the catalogue.

    Attributes
    ----------
    robot : its table, limits and speeds
    maker, model : as the maker writes them
    source, licence : where its numbers are from, and under which licence these were published
    second : a second source, and by what the first one differs; empty without one
    note : what is known to be wrong in a source, or was assumed
    """

    robot: Robot
    maker: str
    model: str
    source: str
    licence: str
    second: str
    note: str

    @property
    def reach(self) -> float:
        """Greatest distance of the flange from the first axis, m, as far as sampling and climbing find it."""
        base, (lower, upper) = self.robot.base, (self.robot.lower, self.robot.upper)

        def across(q: Reals) -> Reals:
            away = (forward(self.robot, q)[:, :3, 3] - base[:3, 3]) @ base[:3, :2]
            return np.asarray(np.linalg.norm(away, axis=1))

        return peak(across, lower, upper, box_points(lower, upper))[1][0]


@cache
def known_arms() -> Mapping[str, KnownArm]:
    """All arms of the catalogue.

    Returns
    -------
    arms : by name, in the order of the file: by maker, then by name
    """
    with SOURCES.open(encoding="utf-8", newline="") as file:
        origins = {row["key"]: Publication(row["title"], row["grade"]) for row in csv.DictReader(file)}  # type: ignore[arg-type]
    with ARMS.open(encoding="utf-8", newline="") as file:
        return {row["name"]: _known_arm(row, origins) for row in csv.DictReader(file)}


def arms_like(word: str) -> dict[str, KnownArm]:
    """Known arms that have a word in their name, or in maker and model: ``kr10r1100`` is in ``kr10_r1100_2``.

    Parameters
    ----------
    word : only its letters and digits count; without any, all arms have it
    """
    arms = known_arms()
    key = _letters(word)
    return {name: arm for name, arm in arms.items() if key in _letters(f"{name} {arm.maker} {arm.model}")}


def _letters(text: str) -> str:
    return re.sub(r"[\W_]", "", text.lower())


def _known_arm(row: Mapping[str, str], origins: Mapping[str, Publication]) -> KnownArm:
    """One row; what ``source`` and ``second`` have before the colon is a key of the sources."""
    source, second = (_cited(row[key], origins) for key in ("source", "second"))
    grade = origins[row["source"].partition(":")[0]].grade
    text = f"{source} ({row['licence']})"
    groups = ["zero", "limits", *(group for group in ("speeds", "base", "flange") if row[group])]
    sources = {group: Source(text, grade) for group in groups}
    remarks = [text, f"second source: {second}" if second else "", row["note"]]
    sources["dh"] = Source("; ".join(filter(None, remarks)), grade)
    names = "maker", "model", "licence", "note"
    return KnownArm(robot_of_row(row, sources), source=source, second=second, **{key: row[key] for key in names})


def _cited(text: str, origins: Mapping[str, Publication]) -> str:
    """A place in a source with the source's title in place of its key."""
    key, _, place = text.partition(":")
    return ", ".join(filter(None, [origins[key].title, place.strip()])) if key else ""


def robot_of_row(row: Mapping[str, str], sources: Mapping[str, Source]) -> Robot:
    """The arm that a row's numbers describe.

    Parameters
    ----------
    row : texts by column; lists of numbers are separated by blanks. ``slides`` has 1 for each row of a prismatic joint,
        whose limits are in mm and speeds in mm/s. A joint without limits has ``-inf`` and ``inf``.
    sources : by group, as :class:`Robot` has them

    Returns
    -------
    robot : m and rad, with a standard table
    """
    a, alpha, d, direction, offset = (_numbers(row[key]) for key in OF_ROWS)
    sliding = _numbers(row["slides"]) > 0 if row["slides"] else np.zeros(len(a), dtype=bool)
    unit = np.where(sliding, 1e-3, np.radians(1.0))
    lower, upper, speed = (_numbers(row[key]) * unit if row[key] else np.empty(0) for key in OF_JOINTS)
    continuous = np.isinf(upper)
    return Robot(
        name=row["name"],
        title=f"{row['maker']} {row['model']}",
        convention="standard",
        a=a / 1000,
        alpha=np.radians(alpha),
        d=d / 1000,
        direction=direction,
        offset=np.radians(offset),
        lower=np.where(continuous, -np.pi, lower),
        upper=np.where(continuous, np.pi, upper),
        speed=speed,
        sliding=sliding,
        continuous=continuous,
        base=_placed(row["base"]),
        flange=_placed(row["flange"]),
        zero_pose="as its source has it",
        sources=sources,
    )


def _numbers(text: str) -> Reals:
    return np.array(text.split(), dtype=float)


def _placed(text: str) -> Reals:
    """A transform (4, 4) from x, y, z in mm and roll, pitch, yaw in deg."""
    values = _numbers(text)
    return transform(values[:3] / 1000, np.radians(values[3:])) if values.size else np.eye(4)
