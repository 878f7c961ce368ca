"""The command line: `er3a`, and `python -m er3a`."""

from __future__ import annotations

import os

from er3a.pipeline.working_folder import distrust


def main() -> None:
    """The command line."""
    distrust()
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # many small matrices: threads of BLAS only wait
        os.environ.setdefault(name, "1")
    from er3a.pipeline.cli import main as command_line

    command_line()


if __name__ == "__main__":
    main()
