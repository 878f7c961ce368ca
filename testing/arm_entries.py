"""Entries of the catalogue of arms, from the URDFs that they come from.

``python -m testing.arm_entries FOLDER`` fills in the numbers of ``data/arms/arms.csv`` where there are none, with
``--again`` all. FOLDER holds checked-out public repositories, named OWNER+NAME; they stay outside this repository. A
row's ``source`` is a key of ``data/arms/sources.csv``, a colon and the URDF's path; ``ends`` are the links between
which the arm lies. To add an arm, write a row with its columns up to ``ends``. Each entry is held against Pinocchio's
forward kinematics of the same URDF.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pinocchio

from er3a.comparison.compare import Comparison, compare
from er3a.files.arm_catalogue import ARMS, SOURCES, robot_of_row
from er3a.formats.urdf import urdf_table
from er3a.formats.urdf_tree import plain_urdf, read_chain
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.comparison import layer_rows
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

COLUMNS = ("name", "maker", "model", "source", "licence", "second", "note", "ends", "a_mm", "alpha_deg", "d_mm")
COLUMNS += ("direction", "offset_deg", "lower", "upper", "speeds", "base", "flange", "slides")
RIGHT = math.pi / 2
NEAR_RIGHT = 2e-3  # rad; files print right angles as 1.57 and 1.571
POSES, WORST_M = 100, 2e-5
NUMBER = r"[-+]?[0-9.]+(?:e[-+]?[0-9]+)?"
ROTATION = re.compile(rf'(\brpy\s*=\s*["\'])\s*({NUMBER}\s+{NUMBER}\s+{NUMBER})\s*(["\'])', re.IGNORECASE)


class Unfit(Exception):
    """An arm that a row can't hold, or that Pinocchio sees elsewhere."""


def with_right_angles(text: str) -> tuple[str, bool]:
    """A URDF whose angles next to a multiple of a right one are that, and whether any was visibly off (1e-4 rad)."""
    off = []

    def settled(match: re.Match[str]) -> str:
        values = []
        for value in map(float, match[2].split()):
            right = round(value / RIGHT) * RIGHT
            near = abs(value - right) < NEAR_RIGHT
            off.append(near and abs(value - right) > 1e-4)
            values.append(right if near else value)
        return match[1] + " ".join(map(repr, values)) + match[3]

    return ROTATION.sub(settled, text), any(off)


@contextmanager
def plain(file: Path, arguments: list[str]) -> Iterator[tuple[Path, bool]]:
    """A plain URDF with right angles, and whether any was off."""
    with chdir(file.parent), plain_urdf(file, arguments) as path, TemporaryDirectory() as folder:
        text, off = with_right_angles(path.read_text(encoding="utf-8"))
        own = Path(folder, "arm.urdf")
        own.write_text(text.replace('effort="-1"', 'effort="0"'), encoding="utf-8")  # unknown; Pinocchio rejects -1
        yield own, off


def listed(values: np.ndarray, digits: int) -> str:
    """Numbers as a row has them."""
    return " ".join(f"{round(float(value), digits) + 0.0:.10g}" for value in values)


def placed(T: np.ndarray) -> str:
    """A transform as a row has it; nothing for the identity."""
    if np.abs(T - np.eye(4)).max() < 1e-7:
        return ""
    return f"{listed(1000 * T[:3, 3], 4)} {listed(np.degrees(rpy_of(T)), 6)}"


def columns_of(robot: Robot) -> dict[str, str]:
    """A robot's numbers by column."""
    if robot.coupling is not None or robot.beta.any():
        raise Unfit("coupled joints or Hayati's beta")
    speed = shown(robot, robot.speed)
    return {
        "a_mm": listed(1000 * robot.a, 4),
        "alpha_deg": listed(np.degrees(robot.alpha), 6),
        "d_mm": listed(1000 * robot.d, 4),
        "direction": listed(robot.direction, 0),
        "offset_deg": listed(np.degrees(robot.offset), 6),
        "lower": listed(np.where(robot.continuous, -np.inf, shown(robot, robot.lower)), 2),
        "upper": listed(np.where(robot.continuous, np.inf, shown(robot, robot.upper)), 2),
        "speeds": listed(speed, 1) if np.isfinite(speed).any() else "",
        "base": placed(robot.base),
        "flange": placed(robot.flange),
        "slides": listed(robot.sliding, 0) if robot.sliding.any() else "",
    }


def misfit(urdf: Path, robot: Robot, base: str, tip: str) -> float:
    """Largest distance, m, between an entry's flange and Pinocchio's at random joint values."""
    names = [joint.name for joint in read_chain(urdf, base, tip, False).joints if joint.independent]
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data = model.createData()
    moving = [model.joints[model.getJointId(name)] for name in names]
    ends = [model.getFrameId(link, pinocchio.FrameType.BODY) for link in (base, tip)]
    random, worst = np.random.default_rng(0), 0.0
    for q in random.uniform(-math.pi, math.pi, (POSES, len(names))):
        values = pinocchio.neutral(model)
        for value, joint in zip(q, moving):
            values[joint.idx_q : joint.idx_q + joint.nq] = (
                value if joint.nq == 1 else (math.cos(value), math.sin(value))
            )
        pinocchio.framesForwardKinematics(model, data, values)
        there = (data.oMf[ends[0]].inverse() * data.oMf[ends[1]]).homogeneous
        worst = max(worst, float(np.linalg.norm((forward(robot, q[None])[0] - there)[:3, 3])))
    return worst


def read(folder: Path, repositories: dict[str, str], source: str, ends: str) -> tuple[dict[str, str], bool]:
    """The columns of one source, held against Pinocchio, and whether its right angles were printed roughly."""
    key, _, place = source.partition(":")
    path, *arguments = place.split()
    base, tip = ends.split() or (None, None)
    with plain(folder / repositories[key].replace("/", "+") / path, arguments) as (urdf, off):
        robot, _, _ = urdf_table(urdf, base=base, tip=tip)
        found = columns_of(robot)
        chain = read_chain(urdf, base, tip, False).joints
        entry = robot_of_row(dict.fromkeys(COLUMNS, "") | {"name": "arm"} | found, {})
        far = misfit(urdf, entry, chain[0].parent, chain[-1].child)
    if far > WORST_M:
        raise Unfit(f"{1000 * far:.3g} mm from Pinocchio's forward kinematics")
    return found | {"ends": f"{chain[0].parent} {chain[-1].child}"}, off


def difference(found: Comparison) -> str:
    """By what a second source differs, layer by layer, as ``er3a compare`` says it; base, flange and units left out."""
    rows = [row for row in layer_rows(found) if row[0] in ("geometry", "zero", "directions", "limits", "speeds")]
    differs = [f"{name}: {detail}" for name, state, detail in rows if state == "differs"]
    return "; ".join(differs) or "agrees"


def filled(row: dict[str, str], folder: Path, repositories: dict[str, str]) -> dict[str, str]:
    """A row with its numbers, and what its second source says of them."""
    if not row["source"].partition(":")[2].partition(" ")[0].endswith((".urdf", ".xacro")):
        return row
    found, off = read(folder, repositories, row["source"], row["ends"])
    row = row | found
    if off and "right angles" not in row["note"]:
        row["note"] = "; ".join(filter(None, [row["note"], "right angles taken for angles that it prints to 0.01 rad"]))
    second, _, _ = row["second"].partition(": ")
    if second:
        there, _ = read(folder, repositories, second, "")
        one, other = (robot_of_row(each | {"name": "arm"}, {}) for each in (row, row | there))
        row["second"] = f"{second}: {difference(compare(one, other))}"
    return row


def main(folder: Path, again: bool) -> None:
    """Fill in all rows; those that can't be read are named, and keep the numbers that they had, or are left out."""
    with SOURCES.open(encoding="utf-8", newline="") as file:
        repositories = {row["key"]: row["repository"] for row in csv.DictReader(file)}
    with ARMS.open(encoding="utf-8", newline="") as file:
        rows = [dict.fromkeys(COLUMNS, "") | row for row in csv.DictReader(file)]
    for k, row in enumerate(rows):
        if row["a_mm"] and not again:
            continue
        try:
            rows[k] = filled(row, folder, repositories)
        except Exception as error:  # whatever a stranger's file holds: the next one is read all the same
            print(f"{row['name']}: {error}")
    with ARMS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        held = [row for row in rows if row["a_mm"]]
        writer.writerows(sorted(held, key=lambda row: (row["maker"], row["name"])))


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), "--again" in sys.argv)
