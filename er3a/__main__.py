"""`er3a` and `python -m er3a`."""

from __future__ import annotations

import sys

from er3a.pipeline.job_server import hand_over


def main() -> None:
    """Have a running study's server do the job, or do it here."""
    code = hand_over(sys.argv[1:])
    if code is None:
        from er3a.pipeline.cli import main as command_line

        command_line()
    sys.exit(code)


if __name__ == "__main__":
    main()
