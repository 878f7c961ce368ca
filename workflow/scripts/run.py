"""What `make run` does: one run at a time, inputs checked first, then Snakemake.

After `kill -9` Snakemake's own lock stays behind. The lock of the operating system that is taken here goes with its
process, so whoever gets it knows that no run is active and may clear Snakemake's.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import subprocess
import sys
from pathlib import Path

from er3a.errors import Er3aError
from er3a.files.kept_files import half_written
from er3a.pipeline.check import check_study
from er3a.pipeline.checksums import corrupted


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", required=True, help="the study file")
    parser.add_argument("words", nargs="*", help="passed on to Snakemake")
    arguments = parser.parse_args()

    state = Path(".snakemake")
    try:
        state.mkdir(exist_ok=True)
        lock = os.open(state / "er3a.lock", os.O_RDWR | os.O_CREAT)
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}; a run writes into this folder", file=sys.stderr)
        return 2
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        print("error: another run is active in this folder; wait for its end, or stop it", file=sys.stderr)
        return 2
    try:
        study = check_study(Path(arguments.study))
        results, reports = Path("results"), Path("reports")
        for path in (*half_written(results), *half_written(reports)):
            path.unlink()
        for path, fault in corrupted(study, results, reports):
            print(f"{fault.file}: {fault.problem}; it is made again")
            path.unlink()
    except Er3aError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2

    snakemake = [sys.executable, "-m", "snakemake"]
    study_file = ["--configfile", arguments.study]  # last: Snakemake takes all words after it for more such files
    if any((state / "locks").glob("*")):
        print("A run that was cut off left its lock; clearing it and going on where it stopped.")
        subprocess.run([*snakemake, "--unlock", "--quiet", "all", *study_file], check=True)
    os.set_inheritable(lock, True)  # held until the last job of this run has ended
    sys.stdout.flush()
    os.execv(sys.executable, [*snakemake, *arguments.words, *study_file])


if __name__ == "__main__":
    raise SystemExit(main())
