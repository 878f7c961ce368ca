"""Evidence: each campaign writes its page in docs/evidence/, or its part of another page of docs/, again.

make campaigns                             those whose pages tell of other code than is here, two at a time
make campaigns ARGS="kinematics --again"   one, in any case
make campaigns ARGS="--share 0.01"         each with a hundredth of its cases, printed and not written
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from importlib import import_module

from testing.evidence import CAMPAIGNS, PAGES, SHARE, evidence, is_of_this_code, made_from, page_of

END = "<!-- end of {name} -->"
ALONE = ("speed", "pages", "teach")  # they measure times on the wall
FIRST = ("fleet", "classes", "motion", "diagnosis", "kills", "hand_eye", "faults")  # the longest
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")  # BLAS, of small matrices, else waits
_WRITING = threading.Lock()  # several write parts of one page


def write(name: str, text: str, line: str) -> None:
    """Write a campaign's page, or replace its part of a page between the comments that mark it; name the code."""
    page, text = page_of(name), f"{text.rstrip()}\n\n{line}\n"
    if name in PAGES:
        page.write_text(text, encoding="utf-8")
        return
    start, end = f"<!-- written by: make campaigns ARGS={name} -->\n", END.format(name=name)
    before, _, rest = page.read_text(encoding="utf-8").partition(start)
    after = rest.partition(end)[2]
    page.write_text(f"{before}{start}\n{text}\n{end}{after}", encoding="utf-8")


def _carried_out(name: str, share: float) -> float | None:
    """Run one campaign in a process of its own, and write its page unless only a share of it was tried.

    Returns
    -------
    processor time (s) that it took, with its own processes; None if it failed
    """
    line = "" if share < 1 else made_from(name, 0)
    command = [sys.executable, "-m", "benchmarks.campaigns", "--table", name]
    env = ({} if name in ALONE else ONE_THREAD) | os.environ | {SHARE: f"{share:g}"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, encoding="utf-8", check=False)
    with _WRITING:
        if done.returncode:
            print(f"{name}: failed\n{done.stderr[-3000:]}", file=sys.stderr, flush=True)
            return None
        text, _, seconds = done.stdout.rstrip().rpartition("\n")
        print(f"{name}: done in {seconds} s of processor time", flush=True)
        if line:
            write(name, text, line.replace("in 0 s", f"in {seconds} s"))
        else:
            print(text, flush=True)
    return float(seconds)


def main(words: Sequence[str]) -> int:
    """Carry out the campaigns that are named, or all."""
    parser = argparse.ArgumentParser(prog="make campaigns", description="Writes pages of evidence again.")
    parser.add_argument("names", nargs="*", help=", ".join(CAMPAIGNS))
    parser.add_argument("--again", action="store_true", help="also those whose pages tell of the code that is here")
    parser.add_argument("--share", type=float, default=1.0, help="of the cases; below 1 no page is written")
    parser.add_argument("--jobs", type=int, default=2, help="campaigns at a time")
    parser.add_argument("--table", metavar="NAME", help="print a campaign's text, and its processor time in s")
    asked = parser.parse_args(words)
    if unknown := sorted({*asked.names, *([asked.table] if asked.table else [])} - {*CAMPAIGNS}):
        print(f"error: no campaign '{unknown[0]}'; known: {', '.join(CAMPAIGNS)}", file=sys.stderr)
        return 2
    if asked.table:
        with redirect_stdout(sys.stderr):  # rows as they come are progress; the page holds them once
            text = import_module(f"benchmarks.campaign_{asked.table}").table()
        print(f"{text.rstrip()}\n{sum(os.times()[:4]):.0f}")
        return 0
    kept = {each.campaign for each in evidence() if is_of_this_code(each)} if asked.share == 1 else set()
    names = [name for name in asked.names or CAMPAIGNS if asked.again or name not in kept]
    try:
        if asked.share == 1 and names:
            made_from(names[0], 0)
    except RuntimeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    names.sort(key=lambda name: FIRST.index(name) if name in FIRST else len(FIRST))
    start = time.monotonic()
    with ThreadPoolExecutor(asked.jobs) as pool:
        beside = [name for name in names if name not in ALONE]
        ended = dict(zip(beside, pool.map(lambda name: _carried_out(name, asked.share), beside)))
    ended |= {name: _carried_out(name, asked.share) for name in names if name in ALONE}
    failed = [name for name, busy in ended.items() if busy is None]
    wall, spent = time.monotonic() - start, sum(filter(None, ended.values()))
    print(f"{len(ended)} campaigns in {wall:.0f} s, {spent:.0f} s of processor time")
    print(f"failed: {', '.join(failed) or 'none'}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
