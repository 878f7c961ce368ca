"""The small study, killed at random moments and started again, over and over."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from random import Random

from er3a.pipeline.results import OVERALL
from er3a.pipeline.viewing.viewer import without_statistics
from testing.evidence import sized
from testing.small_study import contents, environment, finished, fresh, run_command

KILLS, SEED = sized(12), 20261120
LONGEST_S = 40.0  # a kill comes at a moment drawn evenly from this long after each start
GROWING = frozenset(f"reports/{name}" for name in OVERALL)  # written anew while a run lasts, with what is there
RERUN = Path(sys.executable).with_name("rerun")


def one_run(folder: Path, kill_after: float) -> tuple[bool, bool]:
    """Start or resume the study and kill its whole process group after a while: (ended before that, in order)."""
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        run_command(), cwd=folder, env=environment(folder), stdout=quiet, stderr=quiet, start_new_session=True
    )
    try:
        return True, process.wait(timeout=kill_after) == 0
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return False, True


def faults_of(folder: Path, sound: dict[str, bytes], whole: bool) -> list[str]:
    """Files that are not as in a run that nobody disturbed; ``whole``: all of them must be there."""
    found = contents(folder)
    names = {name for name in found if whole or not Path(name).name.startswith(".")}
    compared = names if whole else names - GROWING
    faults = [f"{name}: other bytes" for name in sorted(compared) if found[name] != sound.get(name)]
    cut = [name for name in names & GROWING if not found[name].rstrip().endswith(b"</html>")]
    faults += [f"{name}: cut short" for name in sorted(cut)]
    if whole:
        faults += [f"{name}: missing" for name in sorted(set(sound) - names)]
    recordings = [str(path) for path in folder.glob("reports/*/*.rrd")]
    if recordings:
        command = [RERUN, "rrd", "verify", *recordings]
        with without_statistics() as quiet:
            done = subprocess.run(command, env=quiet, capture_output=True, text=True, check=False)
        faults += [] if done.returncode == 0 else [f"recordings: {done.stderr[-200:]}"]
    return faults


def campaign(kills: int, seed: int, work: Path, sound: dict[str, bytes]) -> tuple[list[float], int, list[str]]:
    """Moments of the kills (s after a start), completed runs, and all faults found."""
    random = Random(seed)
    moments: list[float] = []
    completed, faults = 0, []
    folder = fresh(work / "killed")
    while len(moments) < kills or completed == 0:
        limit = random.uniform(0, LONGEST_S) if len(moments) < kills else 3600.0
        ended, in_order = one_run(folder, limit)
        if not ended:
            moments.append(limit)
        faults += faults_of(folder, sound, whole=ended)
        faults += [] if in_order else ["a run that was resumed ended with an error"]
        if ended:
            completed += 1
            shutil.rmtree(folder)
            if len(moments) < kills:
                fresh(folder)
        print(f"{len(moments)} kills, {completed} runs completed, {len(faults)} faults", flush=True)
        if not in_order:
            break
    return moments, completed, faults


def table() -> str:
    """The evidence as Markdown."""
    with tempfile.TemporaryDirectory() as folder:
        sound = contents(finished(Path(folder) / "sound"))
        moments, completed, faults = campaign(KILLS, SEED, Path(folder), sound)
    pages = sum(name.endswith(".html") for name in sound)
    lines = [
        f"Kills of the whole process group (SIGKILL): **{len(moments)}**, at moments drawn evenly from 0 to "
        f"{LONGEST_S:g} s after each start (seed {SEED}), and in between resumed with the same command. Runs that came "
        f"to their end: {completed}.",
        "",
        f"After every kill, each file that stands in `results/` and each page is compared with the undisturbed run's, "
        f"byte for byte, and each recording is verified. The index and the comparison of robots, which grow while a "
        f"run lasts, must be complete pages after a kill, and the same bytes after a completed run. After "
        f"every completed run none of {len(sound) - pages} result files and {pages} pages may be missing. "
        f"Differences found: **{len(faults)}**.",
        *([""] if faults else []),
        *(f"- {fault}" for fault in faults[:20]),
    ]
    return "\n".join(lines) + "\n"
