"""Published D-H tables beside URDFs of the same arms, and an independent judge of er3a's statements about them.

Tables of Robotics Toolbox for Python are read from the installed package. Those of robotkinematicscatalogue 1.1.2 are
quoted here as numbers. URDFs are those of rtb-data and example-robot-data.
"""

from __future__ import annotations

import importlib
import math
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from testing.arm_pairs import Arm, flange_at, rot, shift

CATALOGUE = "robotkinematicscatalogue 1.1.2"
TOOLBOX = "roboticstoolbox-python 1.5.0"
EXAMPLES = "cmeel.prefix/share/example-robot-data/robots"
POSES = 30

Row = tuple[float, float, float, float, int]
"""a mm, alpha deg, d mm, offset deg, direction."""
QUOTED: dict[str, tuple[Row, ...]] = {
    "UR3": (
        (0, 0, 151.9, 0, 1),
        (0, 90, 0, 180, 1),
        (243.65, 0, 0, 0, 1),
        (213, 0, 110.4, 0, 1),
        (0, -90, 83.4, 0, 1),
        (0, 90, 82.4, 180, 1),
    ),
    "UR5": (
        (0, 0, 89.2, 0, 1),
        (0, 90, 0, 180, 1),
        (425, 0, 0, 0, 1),
        (392, 0, 109.3, 0, 1),
        (0, -90, 94.75, 0, 1),
        (0, 90, 82.5, 180, 1),
    ),
    "UR10": (
        (0, 0, 128, 0, 1),
        (0, 90, 0, 180, 1),
        (612.7, 0, 0, 0, 1),
        (571.6, 0, 163.9, 0, 1),
        (0, -90, 115.7, 0, 1),
        (0, 90, 92.2, 180, 1),
    ),
    "ABB_IRB_140": (
        (0, 0, 352, 0, 1),
        (70, -90, 0, -90, 1),
        (360, 0, 0, 0, 1),
        (0, -90, 380, 0, 1),
        (0, 90, 0, 0, 1),
        (0, -90, 65, 180, 1),
    ),
    "Franka_Emika_Panda": (
        (0, 0, 333, 0, 1),
        (0, -90, 0, 0, 1),
        (0, 90, 316, 0, 1),
        (82.5, -90, 0, 0, 1),
        (-82.5, 90, 384, 0, 1),
        (0, -90, 0, 180, 1),
        (-88, 90, 107, 0, 1),
    ),
    "uFactory_xArm7": (
        (0, 0, 267, 0, 1),
        (0, -90, 0, 0, 1),
        (0, 90, 293, 0, 1),
        (52.2, -90, 0, 180, -1),
        (-77.5, 90, 342.5, 0, 1),
        (0, -90, 0, 0, 1),
        (-76, 90, 97, 180, 1),
    ),
    "KUKA_LBR_iiwa_14_R820": (
        (0, 0, 360, 0, 1),
        (0, -90, 0, 0, 1),
        (0, 90, 420, 0, 1),
        (0, -90, 0, 0, -1),
        (0, 90, 400, 0, 1),
        (0, -90, 0, 0, 1),
        (0, 90, 126, 0, 1),
    ),
    "KUKA_KR16_2": (
        (0, 0, 675, 0, -1),
        (260, -90, 0, 0, 1),
        (680, 0, 0, -90, 1),
        (-35, -90, 670, 0, -1),
        (0, 90, 0, 0, 1),
        (0, -90, 158, 180, -1),
    ),
    "KUKA_KR120_R2500_pro": (
        (0, 0, 675, 0, -1),
        (350, -90, 0, 0, 1),
        (1150, 0, 0, -90, 1),
        (-41, -90, 1000, 0, -1),
        (0, 90, 0, 0, 1),
        (0, -90, 215, 180, -1),
    ),
    "KUKA_KR210_L150_2": (
        (0, 0, 750, 0, -1),
        (350, -90, 0, 0, 1),
        (1250, 0, 0, -90, 1),
        (-55, -90, 1500, 0, -1),
        (0, 90, 0, 0, 1),
        (0, -90, 230, 180, -1),
    ),
    "PUMA_560": (
        (0, 0, 0, 0, 1),
        (0, -90, 139.7, 0, 1),
        (431.8, 0, 0, -180, 1),
        (0, -90, 433.7, 0, 1),
        (0, 90, 0, 0, 1),
        (0, -90, 55.88, 180, 1),
    ),
}


@dataclass(frozen=True)
class Pair:
    """A table and a URDF: the path below site-packages, and the link that the arm ends at."""

    source: str
    table: str
    urdf: str
    tip: str | None = None


PAIRS = (
    Pair(TOOLBOX, "UR3", f"{EXAMPLES}/ur_description/urdf/ur3_robot.urdf"),
    Pair(CATALOGUE, "UR3", f"{EXAMPLES}/ur_description/urdf/ur3_robot.urdf"),
    Pair(TOOLBOX, "UR5", f"{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"),
    Pair(CATALOGUE, "UR5", f"{EXAMPLES}/ur_description/urdf/ur5_robot.urdf"),
    Pair(TOOLBOX, "UR10", f"{EXAMPLES}/ur_description/urdf/ur10_robot.urdf"),
    Pair(CATALOGUE, "UR10", f"{EXAMPLES}/ur_description/urdf/ur10_robot.urdf"),
    Pair(TOOLBOX, "Panda", f"{EXAMPLES}/panda_description/urdf/panda.urdf", "panda_link8"),
    Pair(CATALOGUE, "Franka_Emika_Panda", f"{EXAMPLES}/panda_description/urdf/panda.urdf", "panda_link8"),
    Pair(CATALOGUE, "uFactory_xArm7", f"{EXAMPLES}/xarm_description/urdf/xarm7.urdf"),
    Pair(TOOLBOX, "IRB140", "rtbdata/xacro/abb_irb140_description/urdf/irb140.urdf"),
    Pair(CATALOGUE, "ABB_IRB_140", "rtbdata/xacro/abb_irb140_description/urdf/irb140.urdf"),
    Pair(TOOLBOX, "Puma560", "rtbdata/xacro/unimation_puma560_description/urdf/puma560_robot.urdf"),
    Pair(CATALOGUE, "PUMA_560", "rtbdata/xacro/unimation_puma560_description/urdf/puma560_robot.urdf"),
    Pair(
        CATALOGUE,
        "KUKA_LBR_iiwa_14_R820",
        "rtbdata/xacro/kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf",
    ),
    Pair(CATALOGUE, "KUKA_KR16_2", "rtbdata/xacro/kuka_description/kuka_kr16/urdf/kr16_2.urdf"),
    Pair(CATALOGUE, "KUKA_KR120_R2500_pro", "rtbdata/xacro/kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf"),
    Pair(CATALOGUE, "KUKA_KR210_L150_2", "rtbdata/xacro/kuka_description/kuka_kr210/urdf/kr210l150.urdf"),
    Pair(TOOLBOX, "Baxter", f"{EXAMPLES}/baxter_description/urdf/baxter.urdf", "left_wrist"),
    Pair(TOOLBOX, "AL5D", "rtbdata/xacro/lynxmotion_al5d_description/urdf/al5d_robot.urdf"),
    Pair(TOOLBOX, "Jaco", f"{EXAMPLES}/kinova_description/robots/kinova.urdf"),
)


def urdf_path(pair: Pair) -> Path:
    """The file, in the environment that runs this."""
    folders = (Path(folder) / pair.urdf for folder in sys.path)
    return next((path for path in folders if path.is_file()), Path(pair.urdf))


def table_of(pair: Pair) -> tuple[str, list[Row]]:
    """Convention and rows as published, in mm and deg."""
    if pair.source == CATALOGUE:
        return "modified", list(QUOTED[pair.table])
    models = importlib.import_module("roboticstoolbox").models.DH
    robot = getattr(models, pair.table)()
    rows = [
        (
            1000 * float(link.a),
            math.degrees(link.alpha),
            1000 * float(link.d),
            math.degrees(link.offset),
            -1 if link.isflip else 1,
        )
        for link in robot.links
    ]
    return "modified" if robot.mdh else "standard", rows


def write_csv(pair: Pair, path: Path) -> Path:
    """The table as a person would type it in."""
    convention, rows = table_of(pair)
    lines = ["joint,convention,a_mm,alpha_deg,d_mm,offset_deg,direction"]
    for joint, (a, alpha, d, offset, direction) in enumerate(rows, 1):
        lines.append(f"{joint},{convention},{a:.10g},{alpha:.10g},{d:.10g},{offset:.10g},{direction}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def urdf_flange(path: Path, first: str, last: str, q: np.ndarray) -> np.ndarray:
    """The last link's frame (4, 4) in the first one's, read from the XML alone."""
    joints = dict[str, ElementTree.Element]()
    for joint in ElementTree.parse(path).getroot().iter("joint"):  # those of transmissions have no child
        if (child := joint.find("child")) is not None:
            joints[child.get("link", "")] = joint
    chain, link = list[ElementTree.Element](), last
    while link != first:
        chain.append(joints[link])
        parent = joints[link].find("parent")
        assert parent is not None
        link = parent.get("link", "")
    T, values = np.eye(4), iter(q.tolist())
    for joint in reversed(chain):
        origin = joint.find("origin")
        xyz, rpy = (
            [float(x) for x in (origin.get(key, "0 0 0") if origin is not None else "0 0 0").split()]
            for key in ("xyz", "rpy")
        )
        T = T @ shift(*xyz) @ rot(2, rpy[2]) @ rot(1, rpy[1]) @ rot(0, rpy[0])
        if joint.get("type") in ("revolute", "continuous", "prismatic"):
            stated = joint.find("axis")
            axis = np.array([float(x) for x in (stated.get("xyz", "1 0 0") if stated is not None else "1 0 0").split()])
            axis, value = axis / np.linalg.norm(axis), next(values)
            T = T @ (shift(*(value * axis)) if joint.get("type") == "prismatic" else about(axis, value))
    return np.asarray(T)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """A turn about a unit axis, by Rodrigues' formula."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    T = np.eye(4)
    T[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return T


def best_alignment_mm(arm: Arm, frames: np.ndarray, q: np.ndarray) -> float:
    """The largest distance that is left of an arm's flange to given frames (P, 4, 4) at joint values (P, n) once base,
    flange and zeros are fitted, starting from the arm's own."""
    n = len(arm.a)

    def moved(x: np.ndarray) -> Arm:
        base = arm.base @ shift(*x[:3]) @ rot(2, x[3]) @ rot(1, x[4]) @ rot(0, x[5])
        flange = shift(*x[6:9]) @ rot(2, x[9]) @ rot(1, x[10]) @ rot(0, x[11]) @ arm.flange
        return replace(arm, base=base, flange=flange, offset=arm.offset + x[12:])

    def off(x: np.ndarray) -> np.ndarray:
        own = flange_at(moved(x), q)
        return np.concatenate([(own - frames)[:, :3, 3].ravel(), 0.3 * (own - frames)[:, :3, :3].ravel()])

    found = least_squares(off, np.zeros(12 + n), x_scale=0.1)
    gaps = off(found.x)[: 3 * len(q)].reshape(-1, 3)
    return float(1000 * np.linalg.norm(gaps, axis=1).max())
