"""Further tests of every arm of the fleet: inverse kinematics on singular sets, and a study of all stages."""

from __future__ import annotations

import contextlib
import io
import json
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml

from er3a.files.kept_files import ROOT
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import scaled_jacobian
from er3a.pipeline.new_study.arms import arm_of
from er3a.pipeline.new_study.write import write_study
from er3a.pipeline.stages import run
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.study import load_study
from er3a.pipeline.viewing.figures import house_style
from er3a.robots.robot import Robot

ON_SET = 1e-9
SCANNED = 33
MET = 1e-7  # m and parts of 1: a row that is farther from its pose is invented
SMALLER = {
    "validation": {"round_trips": 50, "reach_starts": 8},
    "workspace": {"samples": 40000, "blocks": 4, "cells_across": 16, "proof_cells": 500},
    "capability": {"directions": 40, "rolls": 2},
    "collision": {"samples": 2000, "cells_across": 8},
    "inverse": {"round_trips": 50},
}


class TooLong(Exception):
    """An arm took more than its time."""


@contextlib.contextmanager
def at_most(seconds: int) -> Iterator[None]:
    """Raise :class:`TooLong` in the body after this many seconds."""

    def end(*_: object) -> None:
        raise TooLong(f"more than {seconds} s")

    signal.signal(signal.SIGALRM, end)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def singular_joints(robot: Robot, count: int = 2) -> np.ndarray:
    """Joint values (k, n) within the limits at which the arm is singular: all joints at 0, zeros of the determinant."""
    zero = np.clip(np.zeros(robot.joints), robot.lower, robot.upper)
    found = [zero] if _smallest(robot, zero) < ON_SET else []
    random = np.random.default_rng(11)
    for _ in range(20 * count if robot.joints == 6 else 0):
        if len(found) > count:
            break
        q, j = random.uniform(robot.lower, robot.upper), int(random.integers(1, 6))
        line = np.repeat(q[None], SCANNED, axis=0)
        line[:, j] = np.linspace(robot.lower[j], robot.upper[j], SCANNED)
        sign = np.sign(np.linalg.det(scaled_jacobian(robot, line)))
        for k in np.flatnonzero(sign[1:] * sign[:-1] < 0)[:1]:
            low, high = line[k].copy(), line[k + 1].copy()
            for _ in range(60):
                middle = (low + high) / 2
                same = np.sign(np.linalg.det(scaled_jacobian(robot, middle[None]))[0]) == sign[k]
                low, high = (middle, high) if same else (low, middle)
            if _smallest(robot, low) < ON_SET:
                found.append(low)
    return np.array(found).reshape(-1, robot.joints)


def _smallest(robot: Robot, q: np.ndarray) -> float:
    return float(np.linalg.svd(scaled_jacobian(robot, q[None])[0], compute_uv=False)[-1])


def round_trip(robot: Robot, q: np.ndarray, same: float, whole_pose: bool) -> str | None:
    """Why the inverse of the pose at joints (n,), asked near them, is not in order; None if it is."""
    T = forward(robot, q)
    rows = inverse(robot, T, q).q
    if not len(rows):
        return "no row"
    away = np.where(robot.slides, rows - q, np.mod(rows - q + np.pi, 2 * np.pi) - np.pi)
    if (least := np.abs(away).max(axis=1).min()) > same:
        return f"own row {least:.1e} away"
    off = np.abs(forward(robot, rows) - T)
    off = off.max(axis=(1, 2)) if whole_pose else off[:, :3, 3].max(axis=1)
    return f"a row {off.max():.1e} off its pose" if off.max() > MET else None


def small_study(robot_file: Path, folder: Path) -> tuple[dict[str, str], list[str]]:
    """A new study of a robot, all stages computed and shown.

    Returns
    -------
    verdicts : of each stage its status
    broken : what is missing: stages that apply and were not computed, pages that were not written
    """
    with contextlib.redirect_stderr(io.StringIO()):
        write_study(arm_of(None, None, str(robot_file)), folder)
    with contextlib.chdir(folder):
        _made_small(Path("config/config.yaml"))
        study = load_study("config/config.yaml")
        (name,) = study.robots
        verdicts, broken = {}, []
        for stage in STAGES.values():
            if not stage.is_configured(study, name):
                continue
            results, page = Path("results") / name / stage.name, Path("reports") / name / f"{stage.name}.html"
            with contextlib.redirect_stderr(io.StringIO()):
                run.compute(stage.name, study, name, results)
            verdict = json.loads((results / "summary.json").read_text(encoding="utf-8"))["verdict"]
            verdicts[stage.name] = verdict["status"]
            if verdict["status"] == "not_computed" and verdict["code"] == "stage.not_computed":
                broken.append(f"{stage.name}: {verdict['params']['reason'][:100]}")
            if "report" in stage.views:
                try:
                    with house_style():
                        run.show("report", stage.name, study, name, results, page)
                except TooLong:
                    raise
                except Exception as error:  # whatever it is, it stands in the table
                    broken.append(f"{stage.name}'s page: {type(error).__name__} {str(error)[:80]}")
    return verdicts, broken


def _made_small(file: Path) -> None:
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    small = yaml.safe_load((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
    for key, values in small.items():
        if isinstance(values, dict) and key != "robots":
            scene = {"scene": "data/scenes/cell.yaml"} if "scene" in values else {}
            content[key] = values | scene | SMALLER.get(key, {})
    content.pop("vision", None)
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
