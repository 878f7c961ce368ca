"""`python -m er3a`."""

from er3a.cli import main

main()
