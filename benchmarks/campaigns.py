"""Evidence at full size: each campaign writes its page in docs/evidence/, or its part of another page of docs/, again.

make campaigns                       all of them
make campaigns ARGS="kinematics"     one
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
EVIDENCE = DOCS / "evidence"
PARTS = {"fuzz": "reliability.md", "faults": "reliability.md", "kills": "reliability.md", "slurm": "cluster.md"}
CAMPAIGNS = (
    "kinematics",
    "singularities",
    "speed",
    "diagnosis",
    "calibration",
    "workspace",
    "paths",
    "clearance",
    "capability",
    "teach",
    "pages",
    "estimate",
    *PARTS,
)


def write_part(name: str, text: str) -> None:
    """Replace a campaign's part of a page of docs/, between the comments that mark it."""
    page = DOCS / PARTS[name]
    start, end = f"<!-- written by: make campaigns ARGS={name} -->\n", f"<!-- end of {name} -->"
    before, _, rest = page.read_text(encoding="utf-8").partition(start)
    after = rest.partition(end)[2]
    page.write_text(f"{before}{start}\n{text}\n{end}{after}", encoding="utf-8")


def main(names: list[str]) -> int:
    unknown = [name for name in names if name not in CAMPAIGNS]
    if unknown:
        print(f"error: no campaign '{unknown[0]}'; known: {', '.join(CAMPAIGNS)}", file=sys.stderr)
        return 2
    for name in names or CAMPAIGNS:
        print(f"{name} ...", flush=True)
        text = import_module(f"benchmarks.campaign_{name}").table()
        if name in PARTS:
            write_part(name, text)
        else:
            (EVIDENCE / f"{name}.md").write_text(text, encoding="utf-8")
        print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
