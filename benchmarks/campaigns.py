"""Evidence at full size: each campaign writes its page in docs/evidence/, or its part of another page of docs/, again.

make campaigns                       all of them
make campaigns ARGS="kinematics"     one
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

from testing.evidence import CAMPAIGNS, PAGES, code_line, page_of

END = "<!-- end of {name} -->"


def write(name: str, text: str) -> None:
    """Write a campaign's page, or replace its part of a page between the comments that mark it; name the code."""
    page, text = page_of(name), f"{text.rstrip()}\n\n{code_line(name)}\n"
    if name in PAGES:
        page.write_text(text, encoding="utf-8")
        return
    start, end = f"<!-- written by: make campaigns ARGS={name} -->\n", END.format(name=name)
    before, _, rest = page.read_text(encoding="utf-8").partition(start)
    after = rest.partition(end)[2]
    page.write_text(f"{before}{start}\n{text}\n{end}{after}", encoding="utf-8")


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make campaigns", description="Writes pages of evidence again.")
    parser.add_argument("names", nargs="*", help=f"all if absent: {', '.join(CAMPAIGNS)}")
    names = parser.parse_args(words).names
    unknown = [name for name in names if name not in CAMPAIGNS]
    if unknown:
        print(f"error: no campaign '{unknown[0]}'; known: {', '.join(CAMPAIGNS)}", file=sys.stderr)
        return 2
    for name in names or CAMPAIGNS:
        print(f"{name} ...", flush=True)
        text = import_module(f"benchmarks.campaign_{name}").table()
        write(name, text)
        print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
