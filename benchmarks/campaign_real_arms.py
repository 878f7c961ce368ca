"""Two arms that a laser tracker has measured: errors at poses that no fit has seen, intervals, and what remains."""

from __future__ import annotations

from collections import Counter

import numpy as np
import scipy

from er3a import calibrate
from er3a.pipeline.messages.calibration import term_name
from testing.evidence import sized
from testing.real_arms import ARMS, PARTS, Unseen, halves, load, unseen

TITLES = {"ur5": "UR5", "wam": "WAM"}
PUBLISHED = {"ur5": 0.1549, "wam": 2.9178}
REPEATABILITY = {"ur5": 0.1, "wam": 2.0}
SPLITS, SEED = sized(100), 20261123
TRIED_PARTS = sized(PARTS)


def table() -> str:
    """The evidence as Markdown."""
    found = {name: calibrate(*load(name)) for name in ARMS}
    runs = {(name, far): unseen(name, far, SEED, TRIED_PARTS) for name in ARMS for far in (False, True)}
    lines = [
        "# Two real arms",
        "",
        "A Universal Robots UR5 (1000 positions) and a Barrett WAM (216, seven joints, cable drives), measured by a",
        "laser tracker; `data/measurements/README.md` says where the data come from. Written by `make campaigns",
        f"ARGS=real_arms`; seed {SEED}.",
        "",
        "## Errors at poses that a fit has not seen",
        "",
        f"The poses in {PARTS} parts, {TRIED_PARTS} of them left out one after the other: each time a whole",
        "calibration, terms chosen anew, from the other parts. At random: parts are drawn; far away: they are",
        "neighbourhoods in joint space. Distances in mm, mean and worst. The plain fit knows nothing of er3a",
        "(`testing/plain_calibration.py`: scipy, all entries, beta of each joint, base and tool, weakly damped).",
        "",
        "| arm | left out | as commanded | plain fit | table alone | with terms | worst: plain | worst: with terms |",
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
        "## Are the worst poses outliers?",
        "",
        "If what remains were noise of one size in three coordinates, distances would be as Maxwell's distribution has",
        "them. Worst of all poses as found and as its median is for noise of that size; the median of the worst of 20",
        "poses drawn from these; and of the 10 worst poses how many are among the 10 worst by the other models (table",
        "alone, plain fit).",
        "",
        "| arm | model | poses | worst | worst by noise | worst of 20 | 10 worst: table alone | plain fit |",
        "|---|---|---|---|---|---|---|---|",
        *(line for name in ARMS for line in _worst_rows(name, runs[name, False])),
        "",
        "## Terms beyond the table",
        "",
        "Taken if both squared errors at poses left out fall by 1 % and noise can't have done it; change of the",
        f"squared error when the term was tried, and in how many of the {2 * TRIED_PARTS} calibrations above",
        "it was taken (neighbouring numbers of times a turn can stand for each other).",
        "",
        "| arm | term | at random | far away | p | verdict | taken above |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ARMS:
        often = Counter(
            (term.kind, term.joint, term.turns)
            for far in (False, True)
            for each in runs[name, far].found
            for term in (each.beyond.terms if each.beyond else ())
        )
        lines += [
            f"| {TITLES[name]} | {term_name(each)} | {each.change:+.1%} | {each.far_change:+.1%} "
            f"| {each.probability:.1e} | {each.verdict.replace('_', ' ')} "
            f"| {often[each.kind, each.joint, each.turns]} |"
            for each in found[name].tried
        ]
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
    lines += [
        "",
        "## What remains",
        "",
        "Correlation of residuals at neighbouring poses and from row to row of the file, with their probabilities for",
        "noise (500 orders tried, so 0.002 is the least), the joint whose angle explains most, and the one whose last",
        "move's direction does (play, friction), with the angle or way by which it stops short.",
        "",
        "| arm | model | neighbours | row to row | joint | share | came from | share | 1/1000 | noise |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in ARMS:
        beyond = found[name].beyond
        for title, left in (
            ("table alone", found[name].residuals),
            ("with terms", beyond.residuals if beyond else None),
        ):
            if left:
                lines.append(
                    f"| {TITLES[name]} | {title} | {left.neighbours:.2f} ({left.neighbours_probability:.3f}) "
                    f"| {left.order:.2f} ({left.order_probability:.3f}) | J{left.joint} | {left.share:.1%} "
                    f"| J{left.play_joint} | {left.play_share:.1%} | {left.play:.3f} "
                    f"| {'yes' if left.is_noise else 'no'} |"
                )
    return "\n".join(lines) + "\n"


def _worst_rows(name: str, run: Unseen) -> list[str]:
    """Whether the greatest distances are those that noise of the same size would have."""
    random = np.random.default_rng(SEED)
    models = {"plain fit": run.plain, "table alone": run.table, "with terms": run.model}
    worst = {model: set(np.argsort(distances)[-10:].tolist()) for model, distances in models.items()}
    rows = []
    for model, distances in models.items():
        size = float(np.sqrt((distances**2).mean() / 3))
        by_noise = size * scipy.stats.maxwell.ppf(0.5 ** (1 / len(distances)))
        of_20 = np.median([random.choice(distances, 20, replace=False).max() for _ in range(2000)])
        shared = " | ".join(str(len(worst[model] & worst[other])) for other in ("table alone", "plain fit"))
        rows.append(
            f"| {TITLES[name]} | {model} | {len(distances)} | {distances.max():.3f} "
            f"| {by_noise:.3f} | {of_20:.3f} | {shared} |"
        )
    return rows


def _row(name: str, far: bool, run: Unseen, rms_mm: float) -> str:
    where = "far away" if far else "at random"
    return (
        f"| {TITLES[name]} | {where} | {3**0.5 * rms_mm:.3f} | {run.plain.mean():.4f} | {run.table.mean():.4f} "
        f"| {run.model.mean():.4f} | {run.plain.max():.3f} | {run.model.max():.3f} |"
    )
