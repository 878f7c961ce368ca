"""Copies of the project in which tests and campaigns run, and may damage, the small study."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from er3a.pipeline.study import load_study

ROOT = Path(__file__).resolve().parents[1]
STUDY = "config/small.yaml"
PARTS = ("Snakefile", "Makefile", "workflow", "er3a", "config", "data", "profiles")

LEAST = {"samples": 5000, "cloud_points": 500, "proof_cells": 200, "directions": 20}
LEAST |= {"round_trips": 20, "reach_starts": 4}


CALLS = """
import json, sys
from er3a.pipeline.cli import main
for words in json.loads(sys.argv.pop()):
    sys.argv[1:] = words
    try:
        main()
    except SystemExit as ended:
        if ended.code:
            raise
"""
"""Code for ``python -c``: calls er3a with each list of words of a JSON list, in one process that loads once."""


def on_least_budgets(study: str) -> str:
    """The text of a study with budgets so small that a run shows only that all of it works."""
    for name, budget in LEAST.items():
        study = re.sub(rf"^(  {name}:) \d+$", rf"\1 {budget}", study, flags=re.MULTILINE)
    return study


def fresh(folder: Path, project: Path = ROOT) -> Path:
    """A copy of the project without results; compiled modules are kept."""
    folder.mkdir(parents=True)
    for part in PARTS:
        source = project / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("*.pyc.*"))
        else:
            shutil.copy2(source, folder / part)
    return folder


def environment(folder: Path) -> dict[str, str]:
    """The environment in which the copy's package is the one that is imported."""
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    return os.environ | {"PYTHONPATH": str(folder), "ER3A_STUDY": STUDY, **single}


def run_command(*words: str) -> list[str]:
    """What `make run` runs on the small study."""
    return [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--", "--cores", "2", *words]


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the small study in a copy to its end."""
    command = run_command()
    return subprocess.run(command, cwd=folder, env=environment(folder), capture_output=True, text=True, check=False)


def finished(folder: Path) -> Path:
    """A copy of the project with the small study run in it."""
    done = run(fresh(folder))
    if done.returncode != 0:
        raise SystemExit(f"the small study does not run:\n{done.stdout}\n{done.stderr}")
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """Results and pages by path; sampled blocks, which go when a run is done, left out."""
    found = [*folder.glob("results/*/*/*"), *folder.glob("reports/**/*.html")]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found if path.is_file()}


def stages_of(robot: str) -> tuple[str, ...]:
    """The stages that a robot of the small study goes through."""
    return load_study(ROOT / "config/small.yaml").stages(robot)
