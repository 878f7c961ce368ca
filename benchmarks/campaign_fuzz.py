"""Damaged input files: each is refused in one line that names the file, or read as exactly what is written in it."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from testing.evidence import sized
from testing.file_judge import MAX_SECONDS, run
from testing.input_files import seeds

SEED, MUTANTS = 20261120, sized(3000)
KINDS = {
    "traceback": "a traceback, or a warning of a library",
    "hang": f"more than {MAX_SECONDS:g} s of processor time",
    "message": "a message of more than one line, too long, or without the file's name",
    "read otherwise": "accepted, and read as other numbers or words than are written",
}


def table() -> str:
    """The evidence as Markdown."""
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = run(MUTANTS, SEED, Path(folder))
    spent = time.process_time() - start
    faults = [outcome.fault for *_, outcome in found if outcome.fault]
    kinds = {kind: sum(fault.startswith(kind) for fault in faults) for kind in KINDS}
    accepted = sum(outcome.accepted for *_, outcome in found)
    slowest = max(outcome.seconds for *_, outcome in found)
    lines = [
        f"Damaged files: **{len(found):,}** (seed {SEED}), made from {len(seeds())} sound ones; refused "
        f"{len(found) - accepted:,}, accepted {accepted:,}; the slowest took {slowest:.2f} s, all together "
        f"{spent:.0f} s of processor time.",
        "",
        "| what must not happen | seen |",
        "|---|---|",
        *(f"| {words} | {kinds[kind]} |" for kind, words in KINDS.items()),
        "",
        *(f"- `{name}` ({damage}): {outcome.fault}" for name, damage, _, outcome in found if outcome.fault),
    ]
    return "\n".join(lines).rstrip("\n") + "\n"
