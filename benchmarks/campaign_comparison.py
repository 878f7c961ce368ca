"""Whether two tables are of one arm: random arms with known differences, and published tables against URDFs."""

from __future__ import annotations

import math
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import er3a
from er3a.comparison.compare import Comparison
from er3a.files.robot_library import read_arm
from er3a.formats.urdf_tree import read_chain
from er3a.pipeline.messages.comparison import layer_rows
from testing.arm_pairs import (
    KINDS,
    Arm,
    Wrong,
    defined_elsewhere,
    flange_at,
    name,
    random_arm,
    rot,
    shift,
    with_wrong_entries,
)
from testing.evidence import sized
from testing.published_tables import (
    PAIRS,
    POSES,
    Pair,
    best_alignment_mm,
    urdf_flange,
    urdf_path,
    write_csv,
)

ARMS, SEED = sized(40), 20261123
LEFT_MM = 8.0  # that entries which agree to 0.1 deg, and stay as they are printed, can leave

HEAD = """# Is this table that arm: random arms, and published tables

## Random arms

{arms} arms of each kind, of 4 to 8 joints, made and judged without er3a (`testing/arm_pairs.py`): each is compared with
itself; with itself where base, flange, zeros, directions and the feet of normals between parallel axes are chosen
otherwise; and with an arm that has one to four wrong entries (0.6 mm to 300 mm, 0.2 to 90 deg), most of them with other
conventions besides. Only entries that the arm shows beside the others are made wrong, which is computed from plain
kinematics beforehand. *Named*: exactly the wrong entries, or of those that no data can tell apart one of each class.
*Mended*: the corrected table moves as the other arm does, by plain kinematics. Seed {seed}.
"""
PUBLISHED = """
## Published tables against URDFs

Tables as their packages publish them, against URDFs that others publish. What differs is what `er3a compare`
says. The last two columns are computed without er3a (`testing/published_tables.py`): how far the corrected table's
flange is from the URDF's, and how far the published one stays off, whatever base, flange and zeros are chosen.

| table | URDF | verdict | what differs | corrected, mm off | published at best, mm off |
|---|---|---|---|---|---|
"""
NOTES = """
Who errs, where a third source tells:

- UR10: Robotics Toolbox and the URDF agree (612 and 572.3 mm); the catalogue's 612.7 and 571.6 mm are the UR10e's by
  its maker's table (612.7, 571.55).
- UR3: Robotics Toolbox and the URDF agree (d4 112.35, d5 85.35 mm); the catalogue's d4 and d5 are 1.95 mm short.
- UR5: Robotics Toolbox prints d1 = 89.459 mm, the URDF has 89.159 mm and the catalogue 89.2 mm. d1 can't be told from
  where the base is: it shows as a base that is 0.3 mm off.
- IRB 140: both tables agree with each other (70, 360, 380 mm); the URDF of rtb-data is about four times too large, and
  not by one factor.
- Puma 560: a3 is 20.3 mm in Robotics Toolbox and 0 in the catalogue and the URDF, whose zeros differ by the angle that
  it makes; d4 is another in all three (431.8, 433.7, 433.1 mm). Nothing here says which one is right.
- KR 210 L150: a2 is 350 mm in the catalogue and 352.8 mm in the URDF, whose wrist also stands 1 mm to the side of the
  first axis. Nothing here says which one is right.
- Jaco: the URDF is of the arm with the spherical wrist, the table of the one with 60 deg between its wrist's axes.
"""


def robot_of(arm: Arm) -> er3a.Robot:
    """The arm as er3a has it."""
    ends = {"lower": np.where(arm.sliding, 0.0, -2.5), "upper": np.where(arm.sliding, 0.5, 2.5)}
    return er3a.Robot(name="arm", title="arm", convention="standard", **ends, **vars(arm))


def arm_of(robot: er3a.Robot) -> Arm:
    """The arm that plain kinematics turns; of a modified table a and alpha go to the row before, the first to base."""
    values = {field: np.asarray(getattr(robot, field)) for field in Arm.__dataclass_fields__}
    if robot.convention == "modified":
        values["base"] = robot.base @ rot(0, robot.alpha[0]) @ shift(robot.a[0], 0, 0)
        values |= {column: np.append(values[column][1:], 0.0) for column in ("a", "alpha")}
    return Arm(**values)


def apart_mm(one: Arm, other: Arm, random: np.random.Generator) -> float:
    """The largest distance of two flanges over random poses."""
    n = len(one.a)
    q = np.where(one.sliding, random.uniform(0, 0.5, (20, n)), random.uniform(-2.5, 2.5, (20, n)))
    gaps = [flange_at(one, row)[:3, 3] - flange_at(other, row)[:3, 3] for row in q]
    return float(1000 * np.linalg.norm(gaps, axis=1).max())


def is_named(found: Comparison, wrong: Wrong) -> bool:
    """Whether the differences are the wrong entries, class by class."""
    assert found.geometry is not None
    left = [frozenset({each.entry, *each.alike}) for each in found.geometry.differences]
    for entry, alike in zip(wrong.entries, wrong.alike):
        hit = next((own for own in left if name(entry) in own), None) or next(
            (own for own in left if own & alike), None
        )
        if hit is None:
            return False
        left.remove(hit)
    return not left


def random_rows() -> Iterator[str]:
    """A line for each kind of arm, and one for all."""
    total: Counter[str] = Counter()
    for place, kind in enumerate(KINDS):
        tally: Counter[str] = Counter()
        for case in range(ARMS):
            random = np.random.default_rng([SEED, place, case])
            arm = random_arm(random, kind)
            printed = robot_of(arm)
            tally["arms"] += 1
            tally["equal"] += er3a.compare(printed, printed).verdict == "equal"
            tally["same"] += er3a.compare(printed, robot_of(defined_elsewhere(random, arm))).verdict == "same_arm"
            made = with_wrong_entries(random, arm)
            if made is None:
                continue
            other, wrong = made
            if random.random() < 0.7:
                other = defined_elsewhere(random, other)
            found = er3a.compare(printed, robot_of(other))
            tally["wrong"] += 1
            tally["other"] += found.verdict == "other_arm"
            tally["named"] += is_named(found, wrong)
            if found.corrected is not None:
                tally["mended"] += apart_mm(arm_of(found.corrected), other, random) < LEFT_MM
        total.update(tally)
        yield _row(kind.replace("_", " "), tally)
    yield _row("all", total)


def _row(kind: str, tally: Counter[str]) -> str:
    wrong = [f"{tally[each]} of {tally['wrong']}" for each in ("other", "named", "mended")]
    return (
        f"| {kind} | {tally['equal']} of {tally['arms']} | {tally['same']} of {tally['arms']} | {' | '.join(wrong)} |"
    )


def published_rows() -> Iterator[str]:
    """A line for each published table."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for pair in PAIRS:
            table, path = write_csv(pair, Path(folder) / "table.csv"), urdf_path(pair)
            if not path.is_file():
                continue
            yield _published(pair, table, path)


def _published(pair: Pair, table: Path, urdf: Path) -> str:
    printed = read_arm(str(table)).robot
    chain = read_chain(urdf, None, pair.tip, False).joints
    found = er3a.compare(printed, read_arm(str(urdf), tip=pair.tip).robot)
    head = f"| {pair.source.split()[0]} {pair.table} | `{urdf.name}` | {found.verdict.replace('_', ' ')} |"
    differs = [
        f"{layer}: {detail}"
        for layer, state, detail in layer_rows(found)
        if state == "differs" and layer not in ("limits", "speeds")
    ]
    shown = "; ".join(differs).replace("|", "/") or "nothing"
    if found.corrected is None:
        return f"{head} {shown} | | |"
    q = np.random.default_rng(SEED).uniform(-math.pi, math.pi, (POSES, printed.joints))
    frames = np.stack([urdf_flange(urdf, chain[0].parent, chain[-1].child, row) for row in q])
    mended, as_published = arm_of(found.corrected), arm_of(printed)
    gaps = [flange_at(mended, row)[:3, 3] - T[:3, 3] for row, T in zip(q, frames)]
    start = Arm(
        as_published.a,
        as_published.alpha,
        as_published.d,
        mended.offset,
        mended.direction,
        mended.sliding,
        mended.base,
        mended.flange,
    )
    off = 1000 * np.linalg.norm(gaps, axis=1).max()
    return f"{head} {shown} | {off:.3f} | {best_alignment_mm(start, frames, q):.3f} |"


def table() -> str:
    """The page."""
    columns = "| kind | equal to itself | same arm, defined otherwise | another arm | entries named | mended |\n"
    rows = "\n".join(random_rows())
    head = HEAD.format(arms=ARMS, seed=SEED)
    return (
        f"{head}\n{columns}|---|---|---|---|---|---|\n{rows}\n{PUBLISHED}" + "\n".join(published_rows()) + "\n" + NOTES
    )
