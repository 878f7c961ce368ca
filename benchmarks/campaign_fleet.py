"""Evidence at full size: robots that no one of the project wrote, from import to the inverse.

Every D-H model of Robotics Toolbox and every serial chain of ``rtb-data`` and ``example-robot-data`` is read, checked,
compared with Pinocchio (which reads the URDF itself), solved back at random and at singular poses, written and read
again, and goes through a small study of all stages.
"""

from __future__ import annotations

import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np
import pinocchio as pin

from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.formats.urdf import UrdfImport, export_urdf, import_urdf
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.forward import forward, jacobian
from er3a.pipeline.check import check_file
from er3a.robots.robot import Robot
from testing.evidence import sized
from testing.fleet import DhModel, UrdfFile, chains_of, dh_models, urdf_files
from testing.fleet_study import MET, at_most, round_trip, singular_joints, small_study

POSES, INVERSE_POSES = 100, 5
EXACT = 1e-9  # m, rad, m/rad
SAME_JOINTS, SAME_AT_SINGULAR = 1e-6, 1e-5
MAX_SECONDS = 240  # for one arm


EVERY = 1000 // sized(1000)  # arm is tried; all of them at full size
STUDIES = 1  # of each class and number of joints
_STUDIES: Counter[tuple[str, int]] = Counter()


@dataclass
class Outcome:
    """What came of one arm: the figures, and what failed."""

    name: str
    joints: int = 0
    arm_class: str = ""
    forward: float = np.nan
    jacobian: float = np.nan
    found: str = ""
    stages: str = ""
    failed: list[str] = field(default_factory=list)


def table() -> str:
    """The page's text."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tried, refused = _all(Path(folder))
    passed = sum(not each.failed for each in tried)
    share = 100 * passed / max(len(tried), 1)
    studied = sum(bool(each.stages) for each in tried)
    classes = Counter(each.arm_class for each in tried)
    lines = [
        "# The fleet",
        "",
        "Every D-H model of Robotics Toolbox and every serial chain of `rtb-data` and `example-robot-data`, as pip",
        "installs them. Written by `make campaigns ARGS=fleet`.",
        "",
        f"{len(tried)} arms were read, {passed} of them ({share:.1f} %) pass everything: the",
        "robot file is written, checked and read back; forward kinematics and Jacobian are those of the source's own",
        f"reading (Pinocchio, or the toolbox) to {EXACT:g} on {POSES} poses; the inverse finds the joints that made",
        f"{INVERSE_POSES} poses, and those of up to three singular ones, and no row that is off its pose by more",
        f"than {MET:g}; URDF export and import give the same arm; of the first arm of each class and number",
        "of joints the study that `er3a new` writes is computed in all stages and shown on pages",
        f"({studied} studies, small budgets). A stage that says why it does not apply passes, one that breaks not.",
        f"{MAX_SECONDS} s are the most that an arm may take. {len(refused)} could not be read.",
        "",
        "| arm | joints | class | forward off | Jacobian off | joints found again | stages | failed |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(each) for each in tried),
        "",
        "Not read, with the reason:",
        "",
        *(f"- `{name}`: {reason}" for name, reason in refused),
        "",
        f"Classes: {', '.join(f'{name} {count}' for name, count in classes.items())}.",
    ]
    return "\n".join(lines)


def _row(each: Outcome) -> str:
    figures = [each.joints, each.arm_class, f"{each.forward:.1e}", f"{each.jacobian:.1e}", each.found, each.stages]
    return f"| {each.name} | {' | '.join(map(str, figures))} | {'; '.join(each.failed) or 'none'} |"


def _all(folder: Path) -> tuple[list[Outcome], list[tuple[str, str]]]:
    tried, refused = [], []
    for model in islice(dh_models(), 0, None, EVERY):
        if isinstance(model, DhModel):
            tried.append(_of_model(model, folder))
        else:
            refused.append(model)
    for name, found in islice(_chains(folder), 0, None, EVERY):
        if isinstance(found, str):
            refused.append((name, found))
        else:
            tried.append(_of_chain(name, *found, folder))
    return tried, refused


def _chains(folder: Path) -> Iterator[tuple[str, str | tuple[UrdfFile, UrdfImport]]]:
    for file in urdf_files(folder):
        if not isinstance(file, UrdfFile):
            yield file
            continue
        for name, found in chains_of(file):
            if isinstance(found, UrdfImport):
                yield name, (file, found)
            else:
                yield name, f"{found.problem}. {found.remedy}"


def _of_model(model: DhModel, folder: Path) -> Outcome:
    robot, outcome = model.robot, Outcome(f"DH {model.name}", model.robot.joints)
    q = _joints(robot, POSES)
    outcome.forward = float(np.abs(forward(robot, q) - model.poses(q)).max())
    outcome.jacobian = _against_differences(robot, q[:10])
    _common(robot, outcome, folder)
    return outcome


def _of_chain(name: str, file: UrdfFile, found: UrdfImport, folder: Path) -> Outcome:
    outcome = Outcome(name, found.robot.joints)
    try:
        plain = import_urdf(file.path, base=found.base, tip=found.tip)  # as the file has it, without rounding angles
        q = _joints(plain.robot, POSES)
        T, J = _pinocchio(file.path, plain, q)
        outcome.forward = float(np.abs(forward(plain.robot, q) - T).max())
        outcome.jacobian = float(np.abs(jacobian(plain.robot, q) - J).max())
    except Exception as error:  # what the peer can't read, or we: either way the arm does not pass
        outcome.failed.append(f"comparison: {type(error).__name__} {' '.join(str(error).split())[:80]}")
    _common(found.robot, outcome, folder)
    return outcome


def _pinocchio(path: Path, found: UrdfImport, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flange poses and Jacobians in the base link's frame, by Pinocchio's own reading of the file."""
    model = pin.buildModelFromUrdf(str(path), mimic=found.robot.coupling is not None)
    data = model.createData()
    base, tip = (model.getFrameId(name, pin.FrameType.BODY) for name in (found.base, found.tip))
    joints = [model.joints[model.getJointId(name)] for name in found.joints]
    columns = [joint.idx_v for joint in joints]
    T, J = np.empty((len(q), 4, 4)), np.empty((len(q), 6, len(joints)))
    for n, row in enumerate(q):
        full = pin.neutral(model)
        for joint, value in zip(joints, row):
            full[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else [np.cos(value), np.sin(value)]
        pin.framesForwardKinematics(model, data, full)
        start, end = data.oMf[base], data.oMf[tip]
        T[n] = (start.inverse() * end).homogeneous
        whole = pin.computeFrameJacobian(model, data, full, tip, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)
        R = start.rotation.T
        J[n] = np.vstack([R @ whole[:3, columns], R @ whole[3:, columns]])
    return T, J


def _studied(robot: Robot, arm_class: str) -> bool:
    """Whether this arm is one of the first of its class and number of joints; counts it."""
    _STUDIES[arm_class, robot.joints] += 1
    return _STUDIES[arm_class, robot.joints] <= STUDIES


def _common(robot: Robot, outcome: Outcome, folder: Path) -> None:
    """File, class, inverse, export: what every arm goes through."""
    for figure, what in ((outcome.forward, "forward kinematics"), (outcome.jacobian, "Jacobian")):
        if figure > EXACT:
            outcome.failed.append(what)
    try:
        _through(robot, outcome, folder)
    except Exception as error:  # whatever it is, it stands in the table
        outcome.failed.append(f"{type(error).__name__} {' '.join(str(error).split())[:100]}")


def _through(robot: Robot, outcome: Outcome, folder: Path) -> None:
    with at_most(MAX_SECONDS):
        path = folder / f"{robot.name}.yaml"
        write_robot(robot, path)
        check_file(path)
        again, q = load_robot(path), _joints(robot, 20)
        if np.abs(forward(again, q) - forward(robot, q)).max() > EXACT:
            outcome.failed.append("robot file")
        outcome.arm_class = str(arm_solver(again).chain.code)
        outcome.found = _round_trips(again, outcome)
        urdf = folder / f"{len(list(folder.iterdir()))}_out.urdf"
        urdf.write_text(export_urdf(again), encoding="utf-8")
        back = import_urdf(urdf, base="base", tip="tool").robot
        if np.abs(forward(back, q) - forward(robot, q)).max() > EXACT:
            outcome.failed.append("export and import")
        if _studied(robot, outcome.arm_class):
            outcome.stages = _stages(path, folder / f"study_{len(list(folder.iterdir()))}", outcome)


def _round_trips(robot: Robot, outcome: Outcome) -> str:
    """How many poses give back the joints that made them, each asked near them; at random and at singular joints."""
    whole = outcome.arm_class not in ("free_roll", "position", "scara")
    kinds = {
        "": (_joints(robot, INVERSE_POSES), SAME_JOINTS),
        " singular": (singular_joints(robot), SAME_AT_SINGULAR),
    }
    told = []
    for kind, (own, same) in kinds.items():
        if outcome.arm_class == "unsolved":  # random starts promise a solution, not this one
            same = np.inf
        problems = [round_trip(robot, q, same, whole) for q in own]
        outcome.failed += [f"inverse{kind}: {problem}" for problem in dict.fromkeys(problems) if problem]
        if len(own):
            told.append(f"{problems.count(None)} of {len(own)}{kind}")
    return ", ".join(told) + (" (some solution)" if outcome.arm_class == "unsolved" else "")


def _stages(path: Path, folder: Path, outcome: Outcome) -> str:
    """The stages' verdicts of a small study; what is broken counts as failed."""
    verdicts, broken = small_study(path, folder)
    outcome.failed += broken
    return ", ".join(f"{count} {verdict}" for verdict, count in Counter(verdicts.values()).items())


def _against_differences(robot: Robot, q: np.ndarray) -> float:
    """Greatest difference of the Jacobian's linear rows from Richardson's differences of positions, over a metre."""
    step, eye = 1e-3, np.eye(robot.joints)

    def slope(size: float) -> np.ndarray:
        ahead, behind = (forward(robot, q[:, None] + sign * size * eye)[..., :3, 3] for sign in (1, -1))
        return (ahead - behind) / (2 * size)

    refined = (slope(step / 4) * 64 - slope(step / 2) * 20 + slope(step)) / 45
    return float(np.abs(np.swapaxes(refined, 1, 2) - jacobian(robot, q)[:, :3]).max())


def _joints(robot: Robot, count: int) -> np.ndarray:
    return np.random.default_rng(7).uniform(robot.lower, robot.upper, (count, robot.joints))
