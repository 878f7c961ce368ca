"""One fault after the other put into a finished small study: what is said, and whether a rerun mends it."""

from __future__ import annotations

import fcntl
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from er3a.pipeline.results import FORMAT_VERSION
from testing.small_study import contents, environment, finished, run, run_command

ROBOT = "er3_600"
OLDER = FORMAT_VERSION - 1
MEMORY = 700_000 * 1024  # bytes of address space


@dataclass(frozen=True)
class Fault:
    """A fault, the command that meets it, and the file (or words) that its one line must name."""

    name: str
    make: Callable[[Path, ExitStack], None]
    words: tuple[str, ...]
    names: str
    root: bool = False
    memory: int | None = None


def flip(name: str, share: float = 0.5) -> Callable[[Path, ExitStack], None]:
    """Turn one bit of a file, in the middle or at another share of its length."""

    def make(folder: Path, _: ExitStack) -> None:
        content = bytearray((folder / name).read_bytes())
        content[int(share * len(content))] ^= 1
        (folder / name).write_bytes(bytes(content))

    return make


def halve(name: str) -> Callable[[Path, ExitStack], None]:
    """Cut a file in half."""

    def make(folder: Path, _: ExitStack) -> None:
        (folder / name).write_bytes((folder / name).read_bytes()[: (folder / name).stat().st_size // 2])

    return make


def disk(name: str, options: str) -> Callable[[Path, ExitStack], None]:
    """Put a small or read-only file system in a folder's place."""

    def make(folder: Path, stack: ExitStack) -> None:
        stack.enter_context(mounted(folder / name, options))

    return make


@contextmanager
def mounted(folder: Path, options: str) -> Iterator[None]:
    """A tmpfs on a folder; needs root."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "er3a-campaign", folder], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", folder], check=True)


def in_the_way(folder: Path, stack: ExitStack) -> None:
    """A file where a folder is to be made."""
    results, kept = folder / "results", folder / "kept"
    results.rename(kept)
    stack.callback(kept.rename, results)
    results.write_text("in the way")
    stack.callback(results.unlink)


def older(folder: Path, _: ExitStack) -> None:
    """Results of an older format version."""
    path = folder / f"results/{ROBOT}/trajectory/summary.json"
    path.write_text(path.read_text().replace(f'"format_version": {FORMAT_VERSION}', f'"format_version": {OLDER}', 1))


def taken(folder: Path, stack: ExitStack) -> None:
    """The lock that a run holds."""
    lock = stack.enter_context((folder / ".snakemake/er3a.lock").open())
    fcntl.flock(lock, fcntl.LOCK_EX)


STAGE = f"results/{ROBOT}/trajectory"
VIEWS = ("views", ROBOT, "trajectory")
COMPUTE = ("compute", "trajectory", ROBOT)
VIEW = f"reports/{ROBOT}/trajectory"
FAULTS = (
    Fault("disk full: results", disk(STAGE, "size=16k"), COMPUTE, f"{STAGE}/samples.parquet", root=True),
    Fault("disk full: recording", disk(f"reports/{ROBOT}", "size=16k"), VIEWS, f"{VIEW}.rrd", root=True),
    Fault("results can't be written", disk(STAGE, "ro"), COMPUTE, f"{STAGE}/samples.parquet", root=True),
    Fault("reports can't be written", disk(f"reports/{ROBOT}", "ro"), VIEWS, f"{VIEW}.rrd", root=True),
    Fault("a file where a folder must be", in_the_way, COMPUTE, "results"),
    Fault("memory limit (ulimit -v)", lambda *_: None, ("compute", "workspace", ROBOT, "--study", "large.yaml"),
          f"er3a compute workspace {ROBOT}", memory=MEMORY),
    Fault("table cut in half", halve(f"{STAGE}/checks.parquet"), VIEWS, "checks.parquet: damaged"),
    Fault("table with a flipped bit", flip(f"{STAGE}/checks.parquet"), VIEWS, "checks.parquet: damaged"),
    Fault("summary cut in half", halve(f"{STAGE}/summary.json"), VIEWS, "summary.json: damaged"),
    Fault("summary with a flipped bit", flip(f"{STAGE}/summary.json"), VIEWS, "summary.json: damaged"),
    Fault("checksums with a flipped bit", flip(f"{STAGE}/SHA256SUMS", 0), VIEWS, f"{STAGE}/checks.parquet: damaged"),
    Fault("results of an older version", older, VIEWS, f"summary.json: format version {OLDER}"),
    Fault("recording cut in half", halve(f"{VIEW}.rrd"), ("view", ROBOT), f"{VIEW}.rrd: damaged"),
    Fault("two runs at once", taken, (), "another run is active in this folder"),
)  # fmt: skip


def er3a(folder: Path, words: tuple[str, ...], memory: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command of er3a in a copy (no words: a whole run), if asked with limited memory."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))

    command = [sys.executable, "-m", "er3a", *words] if words else run_command()
    return subprocess.run(
        command, cwd=folder, env=environment(folder), capture_output=True, text=True, check=False,
        preexec_fn=limit if memory else None, timeout=600,
    )  # fmt: skip


def meet(fault: Fault, folder: Path) -> tuple[str, bool]:
    """Put a fault in and run into it: the line that is said, and whether it is one and names what it must."""
    with ExitStack() as stack:
        fault.make(folder, stack)
        done = er3a(folder, fault.words, fault.memory)
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    line = lines[-1] if lines else "(nothing)"
    return line, done.returncode == 2 and len(lines) == 1 and line.startswith("error: ") and fault.names in line


def campaign(folder: Path, faults: tuple[Fault, ...] = FAULTS) -> list[tuple[Fault, str, bool, bool]]:
    """Each fault with its line, whether that is as it must be, and whether a rerun gives the first run's bytes."""
    study = (folder / "config/small.yaml").read_text().replace("cells_across: 24", "cells_across: 300")
    (folder / "large.yaml").write_text(study)
    sound, found = contents(folder), []
    for fault in faults:
        line, clear = meet(fault, folder)
        mended = run(folder).returncode == 0 and contents(folder) == sound
        print(f"{fault.name}: {line} | clear {clear}, mended {mended}", flush=True)
        found.append((fault, line.replace(str(folder), "."), clear, mended))
    return found


def table() -> str:
    """The evidence as Markdown."""
    root = os.geteuid() == 0
    with tempfile.TemporaryDirectory() as work:
        found = campaign(finished(Path(work) / "study"), tuple(fault for fault in FAULTS if root or not fault.root))
    lines = [
        f"{len(found)} faults put into a finished small study, one at a time. *One line*: the command ends with code 2 "
        "and a single line that names the file. *Mended*: afterwards `make run` gives the first run's bytes.",
        "",
        "| fault | what is said | one line | mended |",
        "|---|---|---|---|",
        *(
            f"| {fault.name} | {line.replace('`', '*')} | {_word(clear)} | {_word(mended)} |"
            for fault, line, clear, mended in found
        ),
    ]
    if not root:
        skipped = ", ".join(fault.name for fault in FAULTS if fault.root)
        lines += ["", f"Not run here, because they need root: {skipped}."]
    return "\n".join(lines) + "\n"


def _word(holds: bool) -> str:
    return "yes" if holds else "**no**"
