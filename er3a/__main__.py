"""The commands: `er3a`, `python -m er3a`, and `rerun-importer-er3a`, which Rerun's viewer calls."""

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


def draw_for_rerun() -> int:
    """Draw a file for Rerun's viewer; the exit code that it knows."""
    distrust()
    from er3a.pipeline.viewing.importer import main as draw

    return draw()


if __name__ == "__main__":
    main()
