"""Evidence at full size: each campaign writes its table in docs/evidence/ again.

make campaigns                       all of them
make campaigns ARGS="kinematics"     one
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

EVIDENCE = Path(__file__).resolve().parents[1] / "docs" / "evidence"
CAMPAIGNS = (
    "kinematics",
    "singularities",
    "speed",
    "diagnosis",
    "identification",
    "workspace",
    "paths",
    "clearance",
    "capability",
    "teach",
)


def main(names: list[str]) -> int:
    unknown = [name for name in names if name not in CAMPAIGNS]
    if unknown:
        print(f"error: no campaign '{unknown[0]}'; known: {', '.join(CAMPAIGNS)}", file=sys.stderr)
        return 2
    for name in names or CAMPAIGNS:
        print(f"{name} ...", flush=True)
        text = import_module(f"campaign_{name}").table()
        (EVIDENCE / f"{name}.md").write_text(text, encoding="utf-8")
        print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
