"""Two arms that a laser tracker has measured: errors at poses that no fit has seen, intervals, and what remains."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import scipy

import er3a
from er3a.calibration.calibrate import Calibration, TermEstimate
from er3a.calibration.cross_validation import TriedTerm
from er3a.pipeline.messages.calibration import term_name
from testing.evidence import sized
from testing.real_arms import ARMS, PARTS, Unseen, halves, load, unseen

TITLES = {"ur5": "UR5", "wam": "WAM"}
PUBLISHED = {"ur5": 0.1549, "wam": 2.9178}
REPEATABILITY = {"ur5": 0.1, "wam": 2.0}
SPLITS, SEED = sized(400), 20261123
TRIED_PARTS = {False: sized(PARTS), True: sized(PARTS // 2)}
DRAWS, DRAWN = 2000, (20, 40)
MAX_WORST_MM, MAX_MEAN_MM = 0.16, 0.1
NEAREST = 4


def table() -> str:
    """The evidence as Markdown."""
    found = {name: er3a.calibrate(*load(name)) for name in ARMS}
    runs = {(name, far): unseen(name, far, SEED, parts) for name in ARMS for far, parts in TRIED_PARTS.items()}
    few, many = (min(count, *(len(runs[name, False].table) for name in ARMS)) for count in DRAWN)
    lines = [
        "# Two real arms",
        "",
        "A Universal Robots UR5 (1000 positions) and a Barrett WAM (216, seven joints, cable drives), measured by a",
        "laser tracker; `data/measurements/README.md` says where the data come from. Written by `make campaigns",
        f"ARGS=real_arms`; seed {SEED}.",
        "",
        "## Errors at poses that a fit has not seen",
        "",
        f"The poses in {PARTS} parts, left out one after the other: each time a whole calibration, terms chosen anew,",
        f"from the other parts. At random: parts are drawn, {TRIED_PARTS[False]} are left out; far away: they are",
        f"neighbourhoods in joint space, of which {TRIED_PARTS[True]} are left out. Distances in mm, mean and worst.",
        "The plain fit knows nothing of er3a",
        "(`testing/plain_calibration.py`: scipy, all entries, beta of each joint, base and tool, weakly damped).",
        "",
        "| arm | left out | as commanded | plain fit | robot file | with terms | worst: plain | worst: with terms |",
        "|---|---|---|---|---|---|---|---|",
        *(_row(name, far, runs[name, far], found[name].rms_before_mm) for name in ARMS for far in (False, True)),
        "",
        "As commanded: root mean square of a coordinate over all positions, times root 3.",
        "",
        "The data's publication gives mean errors at 20 random poses for a geometric model with a neural network on",
        "top:",
        *(f"{TITLES[name]} {PUBLISHED[name]} mm (repeatability {REPEATABILITY[name]} mm)." for name in ARMS),
        "Those 20 poses of each arm are not among the data here: arm, tracker and the poses to fit from are the same,",
        "the poses that are judged by are not.",
        "",
        "## What the robot file holds",
        "",
        "A robot file holds table, base and tool, and ratios and couplings of joints (as its coupling), chosen as",
        "terms are, without the others. The table alone, and with these: mean distance at all poses, which it is",
        "fitted to, and left out (tenths at random and neighbourhoods; the choice of terms has seen all of them).",
        "Chosen anew: the poses left out at random above, by calibrations that have not seen them at all; their mean,",
        f"and of {DRAWS} times {many} of them, drawn from all, the share whose own mean is at most {MAX_MEAN_MM} mm.",
        "",
        "| arm | coupling (1/1000) | table alone: fitted | left out | far away "
        f"| with coupling: fitted | left out | far away | chosen anew | means of {many} <= {MAX_MEAN_MM} |",
        "|---|---|---|---|---|---|---|---|---|---|",
        *(_file_row(name, found[name], runs[name, False], many) for name in ARMS),
        "",
        "## Are the worst poses outliers?",
        "",
        "If what remains were noise of one size in three coordinates, distances would be as Maxwell's distribution has",
        "them. Worst of all poses as found and as its median is for noise of that size; the median of the worst of",
        f"{few} and of {many} poses drawn from these, and how often it is at most {MAX_WORST_MM} mm in {DRAWS} draws;",
        "of the 10 worst poses how many are among the 10 worst by the other models (robot file, plain fit).",
        "",
        f"| arm | model | poses | worst | worst by noise | of {few} | <= {MAX_WORST_MM} | of {many} "
        f"| <= {MAX_WORST_MM} | 10 worst: robot file | plain fit |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(line for name in ARMS for line in _worst_rows(name, runs[name, False], (few, many))),
        "",
        "The pose that is worst with terms:",
        "",
        *(_worst_pose(name, found[name], runs[name, False]) for name in ARMS),
        "",
        "## Terms beyond the table",
        "",
        "Taken if both squared errors at poses left out fall by 1 % and noise can't have done it; change of the",
        f"squared error when the term was tried, and in how many of the {sum(TRIED_PARTS.values())} calibrations above",
        "it was taken (neighbouring numbers of times a turn can stand for each other). Of those that noise may have",
        "made one line for each kind: how many, with the largest changes and the least p. Robot file: what it can",
        "hold, tried beside none of the others.",
        "",
        "| arm | term | at random | far away | p | verdict | taken above |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ARMS:
        others = [each for far in (False, True) for each in runs[name, far].found]
        whole = [term for each in others if each.beyond for term in each.beyond.terms]
        lines += _tried_rows(TITLES[name], found[name].tried, whole)
        own = [term for each in others for term in each.ratios]
        lines += _tried_rows(f"{TITLES[name]}, robot file", found[name].tried_for_file, own)
    lines += [
        "",
        "## Do the intervals hold?",
        "",
        f"{SPLITS} times the poses in two halves, the table from each: how often the difference of an entry's two",
        "values lies in the 95 % interval that both halves' errors give it. No standard deviation is stated: errors",
        "are estimated from what remains at each pose.",
        "",
        "| arm | entries | all entries | lowest of one entry | highest of one entry |",
        "|---|---|---|---|---|",
    ]
    for name in ARMS:
        names, inside = halves(name, SPLITS, SEED)
        share = inside.mean(axis=0)
        low, high = int(share.argmin()), int(share.argmax())
        lines.append(
            f"| {TITLES[name]} | {len(names)} | {inside.mean():.1%} | {share[low]:.1%} ({names[low]}) "
            f"| {share[high]:.1%} ({names[high]}) |"
        )
    return "\n".join(lines) + "\n"


def _tried_rows(title: str, tried: Sequence[TriedTerm], taken: Sequence[TermEstimate]) -> list[str]:
    """A line for each term that is more than noise, and for each kind of the rest; ``taken`` by other calibrations."""
    often = Counter((term.kind, term.joint, term.turns, term.by) for term in taken)
    kinds: dict[str, list[TriedTerm]] = {}
    for each in tried:
        kinds.setdefault(each.kind if each.verdict == "noise" else term_name(each), []).append(each)
    return [
        f"| {title} | {name}{f': {len(own)}' if own[0].verdict == 'noise' else ''} "
        f"| {min(each.change for each in own):+.1%} | {min(each.far_change for each in own):+.1%} "
        f"| {min(each.probability for each in own):.1e} | {own[0].verdict.replace('_', ' ')} "
        f"| {sum(often[each.kind, each.joint, each.turns, each.by] for each in own)} |"
        for name, own in kinds.items()
    ]


def _worst_rows(name: str, run: Unseen, sizes: tuple[int, ...]) -> list[str]:
    """Whether the greatest distances are those that noise of the same size would have."""
    random = np.random.default_rng(SEED)
    models = {"plain fit": run.plain, "robot file": run.table, "with terms": run.model}
    worst = {model: set(np.argsort(distances)[-10:].tolist()) for model, distances in models.items()}
    rows = []
    for model, distances in models.items():
        size = float(np.sqrt((distances**2).mean() / 3))
        by_noise = size * scipy.stats.maxwell.ppf(0.5 ** (1 / len(distances)))
        drawn = [[random.choice(distances, count, replace=False).max() for _ in range(DRAWS)] for count in sizes]
        of_few = " | ".join(f"{np.median(w):.3f} | {np.mean(np.array(w) <= MAX_WORST_MM):.1%}" for w in drawn)
        shared = " | ".join(str(len(worst[model] & worst[other])) for other in ("robot file", "plain fit"))
        rows.append(
            f"| {TITLES[name]} | {model} | {len(distances)} | {distances.max():.3f} "
            f"| {by_noise:.3f} | {of_few} | {shared} |"
        )
    return rows


def _file_row(name: str, found: Calibration, run: Unseen, count: int) -> str:
    """Errors by the robot's file with and without a coupling."""
    robot, rows = load(name)
    alone, random = er3a.calibrate(robot, rows, ["ratios"]), np.random.default_rng(SEED)
    means = [random.choice(run.table, count, replace=False).mean() for _ in range(DRAWS)]
    ratios = ", ".join(f"{term_name(each)} {each.coefficients[0]:+.2f}" for each in found.ratios)
    errors = [
        f"{each.without_terms().distances_mm(rows).mean():.4f} | {each.left_out.mean_mm:.4f} "
        f"| {each.left_out.far_mean_mm:.4f}"
        if each.left_out
        else "– | – | –"
        for each in (alone, found)
    ]
    share = np.mean(np.array(means) <= MAX_MEAN_MM)
    return f"| {TITLES[name]} | {ratios} | {' | '.join(errors)} | {run.table.mean():.4f} | {share:.1%} |"


def _worst_pose(name: str, found: Calibration, run: Unseen) -> str:
    """Where it is among the others, and how far the models are from it."""
    rows = run.rows
    poses = np.array([row.pose for row in rows])
    worst = int(run.model.argmax())
    own, others = poses[worst], np.delete(poses, worst, axis=0)
    out = [f"J{k + 1}" for k in np.flatnonzero((own < others.min(axis=0)) | (own > others.max(axis=0)))]
    low, high = poses.min(axis=0), poses.max(axis=0)
    where = ", ".join(f"{value:.1f} of {a:.0f} to {b:.0f}" for value, a, b in zip(own, low, high))
    near = np.argsort(np.linalg.norm((poses - own) / poses.std(axis=0), axis=1))[1 : NEAREST + 1]
    beside = ", ".join(f"{value:.3f}" for value in run.model[near])
    return (
        f"- {TITLES[name]}: row {rows[worst].row}, joints at {where} deg; beyond all others in "
        f"{', '.join(out) or 'no joint'}. Left out, with terms {run.model[worst]:.3f} mm off, by the robot file "
        f"{run.table[worst]:.3f} mm; fitted with all poses {found.distances_mm(rows)[worst]:.3f} mm; the {NEAREST} "
        f"poses nearest to it, left out: {beside} mm."
    )


def _row(name: str, far: bool, run: Unseen, rms_mm: float) -> str:
    where = "far away" if far else "at random"
    return (
        f"| {TITLES[name]} | {where} | {3**0.5 * rms_mm:.3f} | {run.plain.mean():.4f} | {run.table.mean():.4f} "
        f"| {run.model.mean():.4f} | {run.plain.max():.3f} | {run.model.max():.3f} |"
    )
