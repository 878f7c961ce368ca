"""The factory calibration of a Universal Robots arm: ``calibration.conf`` of its controller, or the YAML that
``extract_calibration`` of the ROS package ``ur_calibration`` makes from it.

The controller's file holds corrections to the nominal table: ``delta_theta``, ``delta_a``, ``delta_d``,
``delta_alpha``, in rad and m. Axes 2, 3 and 4 are nearly parallel, so the d of these rows may be hundreds of metres and
cancel. The YAML holds the same arm as the poses of its links (``kinematics``, ``shoulder``: x, y, z, roll, pitch, yaw;
...), m and rad, each joint turning about its link's z. Either becomes rows with Hayati's beta.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from er3a.comparison.axis_table import table_from_axes
from er3a.errors import InputError
from er3a.files.robot_library import with_near_rows
from er3a.files.yaml_file import StrictModel, load
from er3a.formats.mesh_file import read_text
from er3a.geometry.transforms import transform
from er3a.numerics.arrays import Reals
from er3a.robots.masses import Masses
from er3a.robots.robot import Robot, Source

MAX_BYTES = 1_000_000
DELTAS = {"offset": "delta_theta", "a": "delta_a", "d": "delta_d", "alpha": "delta_alpha"}
LONGEST_M = 20.0
TABLE = "a", "alpha", "beta", "d", "direction", "offset"
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
REMEDY = "Give a Universal Robots calibration.conf, or the YAML of extract_calibration"


class LinkPose(BaseModel):
    """A link in the frame of the one before, m and rad, with all joints at 0."""

    model_config = ConfigDict(extra="forbid", strict=True)
    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float


class Kinematics(StrictModel):
    """The six links; ``hash`` is the controller's checksum."""

    shoulder: LinkPose
    upper_arm: LinkPose
    forearm: LinkPose
    wrist_1: LinkPose
    wrist_2: LinkPose
    wrist_3: LinkPose
    hash: Annotated[str | None, Field(max_length=200)] = None


LINKS = tuple(Kinematics.model_fields)[:6]


class KinematicsFile(StrictModel):
    """What ``extract_calibration`` writes."""

    kinematics: Kinematics


def load_factory_calibration(path: str | Path, nominal: Robot) -> Robot:
    """Load a robot with its factory calibration.

    Parameters
    ----------
    path : ends in .conf, or in .yaml
    nominal : the published table of the arm; its limits and speeds are kept. Shapes and masses are dropped, because
        they refer to the frames of its rows

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    path = Path(path)
    if nominal.rows != len(LINKS) or nominal.joints != len(LINKS) or nominal.sliding.any():
        raise InputError(path, None, f"{nominal.name} is not an arm with six revolute joints", "Name its nominal table")
    bare = nominal.replace(envelopes=(), hulls=(), pair_rules=(), masses=Masses(), references=())
    found = _of_links(path, bare) if path.suffix in (".yaml", ".yml") else _of_deltas(path, bare)
    longest = float(max(np.abs(found.a).max(), np.abs(found.d).max()))
    if longest > LONGEST_M:
        problem = f"with {nominal.name} it makes an arm with links of {longest:.3g} m"
        raise InputError(path, None, problem, "Name the nominal table of the same arm")
    source = Source(f"Factory calibration {path.name}, beside the nominal table of {nominal.name}", "measured")
    return found.replace(sources={**nominal.sources, "dh": source, "zero": source})


def _of_deltas(path: Path, nominal: Robot) -> Robot:
    text = read_text(path, MAX_BYTES)
    if nominal.convention != "standard":
        raise InputError(path, None, f"{nominal.name}'s table is not standard D-H", "Name the table as published")
    columns = {column: getattr(nominal, column) + _list(path, text, key) for column, key in DELTAS.items()}
    return with_near_rows(nominal.replace(**columns))


def _list(path: Path, text: str, key: str) -> Reals:
    """Six numbers after a key."""
    found = re.search(rf"^\s*{key}\s*=\s*\[([^\]]*)\]", text, re.MULTILINE)
    if found is None:
        raise InputError(path, key, "missing", REMEDY)
    words = [word.strip() for word in found[1].split(",")]
    if len(words) != len(LINKS) or not all(_NUMBER.fullmatch(word) for word in words):
        raise InputError(
            path, key, f"[{found[1].strip()[:80]}] is not {len(LINKS)} numbers", "Write one for each joint"
        )
    values = np.array([float(word) for word in words])
    if not np.isfinite(values).all():
        raise InputError(path, key, "holds a number that is too large", "Check its exponent")
    return values


def _of_links(path: Path, nominal: Robot) -> Robot:
    links = load(KinematicsFile, path).kinematics
    T, directions, points = np.eye(4), [], []
    for name in LINKS:
        pose: LinkPose = getattr(links, name)
        T = T @ transform(np.array([pose.x, pose.y, pose.z]), np.array([pose.roll, pose.pitch, pose.yaw]))
        directions.append(T[:3, 2].copy())
        points.append(T[:3, 3].copy())
    table = table_from_axes(np.array(directions), np.array(points), T)
    columns = {key: getattr(table, key) for key in TABLE}
    return nominal.replace(convention="standard", base=nominal.base @ table.base, flange=table.flange, **columns)
