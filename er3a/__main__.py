"""`python -m er3a`."""

from er3a.pipeline.cli import main

main()
