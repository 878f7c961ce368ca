"""The command line: `er3a`, and `python -m er3a`."""

from __future__ import annotations

import gc
import os
import sys
from io import TextIOWrapper

from er3a.pipeline.working_folder import distrust

FEW_POSES = {"arms", "compare"}
"""Commands that numpy has answered of one or two arms before numba has started; of more, compiled code is faster."""


def main() -> None:
    """The command line."""
    gc.set_threshold(500_000)  # work makes many objects, few of them garbage: looking for some took a tenth of it
    distrust()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # many small matrices: threads of BLAS only wait
        os.environ.setdefault(name, "1")
    if FEW_POSES.intersection(sys.argv[1:2]) and len(sys.argv) in (3, 4):
        os.environ.setdefault("NUMBA_DISABLE_JIT", "1")
    os.environ.setdefault("PYTHONUTF8", "1")  # of jobs and viewers, whatever the console's code page
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if sys.platform == "win32" and isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding="utf-8")
    from er3a.pipeline.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
