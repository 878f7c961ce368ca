"""`er3a` and `python -m er3a`."""

from __future__ import annotations

import os
import sys

from er3a.pipeline.job_server import SETTINGS, hand_over


def main() -> None:
    """Have a running study's server do the job, or do it here."""
    code = hand_over(sys.argv[1:])
    if code is None:
        for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # many small matrices: threads of BLAS only wait
            os.environ.setdefault(name, SETTINGS[name])
        from er3a.pipeline.cli import main as command_line

        command_line()
    sys.exit(code)


if __name__ == "__main__":
    main()
