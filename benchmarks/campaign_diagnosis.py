"""How often the diagnosis finds a fault that was put into a trustworthy table: known mistakes, every entry wrong by
every size, pairs; and what it says of right tables."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from er3a import load_references, load_robot
from er3a.diagnosis.ranking import case_of, usable
from er3a.pipeline.messages.diagnosis import both
from testing.evidence import sized
from testing.known_faults import (
    Mutation,
    Outcome,
    is_identifiable,
    mutations_of,
    noisy,
    random_pairs,
    rank,
    single_scan,
    try_mutation,
)

ROBOTS = ("er3a_c60", "er3_600")
NOISE_MM, DRAWS, RIGHT_DRAWS, BLIND_DRAWS, SEED = 0.5, sized(1), sized(60), sized(20), 20261120
SIZES, NOISY_SIZES, PAIRS, PAIRS_BEYOND = sized(5), sized(2), sized(50), 3.0

HEAD = """# Diagnosis: faults put into each trustworthy table

A case is identifiable if the fault's change of the entries, times the Jacobian of the references with
respect to the entries, moves some reference by more than its uncertainty and the noise in it; that is
computed before any diagnosis. It counts as found if the right table is in the first set, or, for numbers that
may have any value, a hypothesis that explains by the very entries that are wrong. The set is all hypotheses with as few
faults that meet every reference; its size says how many these are. A *wrong accusation* is a first set that
leaves references missed although the right table, which is among what was tried, meets them all.
Noise: uniform up to {noise:g} mm on every length, owned up to in its uncertainty. Seed {seed}.
Written by `make campaigns ARGS=diagnosis`.

Speeds, and extremes over the limits (reach, extents of a drawing), are checked but take no part in a diagnosis.
"""


def tried(
    name: str, mutations: Iterable[Mutation], noise_mm: float, draws: int, random: np.random.Generator
) -> list[Outcome]:
    """Mutations of a robot, each against ``draws`` draws of the noise."""
    robot, stated = load_robot(name), usable(load_references(name))
    return [
        try_mutation(robot, mutation, noisy(stated, noise_mm, random) if noise_mm else stated, noise_mm)
        for mutation in mutations
        for _ in range(draws)
    ]


def pairs(name: str, count: int, random: np.random.Generator) -> tuple[list[Outcome], int]:
    """Pairs of wrong entries that are identifiable as two, and how many had to be drawn."""
    robot, stated = load_robot(name), usable(load_references(name))
    case, drawn, found = case_of(robot, stated), 0, list[Outcome]()
    for pair in random_pairs(case, PAIRS_BEYOND, random):
        drawn += 1
        if is_identifiable(robot, pair, case):
            found.append(replace(try_mutation(robot, pair.both, stated), identifiable=True))
        if len(found) == count:
            break
    return found, drawn


def right_tables(name: str, random: np.random.Generator) -> tuple[int, int]:
    """Right tables that get a diagnosis: with noise that the references own up to, and without."""
    robot, stated = load_robot(name), usable(load_references(name))
    owned = sum(bool(rank(robot, noisy(stated, NOISE_MM, random))) for _ in range(RIGHT_DRAWS))
    blind = 0
    for _ in range(BLIND_DRAWS):
        loud = noisy(stated, NOISE_MM, random)
        ranking = rank(robot, [replace(each, uncertainty=r.uncertainty) for each, r in zip(loud, stated)])
        blind += bool(ranking and ranking.groups)
    return owned, blind


def row(words: Sequence[object], found: Sequence[Outcome]) -> str:
    """A line of a table."""
    seen = [outcome for outcome in found if outcome.identifiable]
    first = [outcome for outcome in seen if outcome.found]
    sizes = [outcome.set_size for outcome in first] or [0]
    share = f"{len(first)} ({len(first) / len(seen):.2%})" if seen else "0"
    accused = sum(outcome.needless for outcome in found)
    cells = (*words, len(found), len(seen), share, f"{np.median(sizes):.0f}", max(sizes), accused)
    return "| " + " | ".join(map(str, cells)) + " |"


def heading(*words: str) -> list[str]:
    """The head of a table."""
    cells = (*words, "cases", "identifiable", "first", "median set", "largest set", "wrong accusations")
    return ["| " + " | ".join(cells) + " |", "|" + "---|" * len(cells)]


def by(key: Callable[[Outcome], str], found: Sequence[Outcome]) -> list[str]:
    """A line for each kind of outcome."""
    kinds = defaultdict(list)
    for outcome in found:
        kinds[key(outcome)].append(outcome)
    return [row((kind,), own) for kind, own in sorted(kinds.items())]


FAMILIES: dict[str, tuple[str, ...]] = {
    "unit": ("wrong_unit",),
    "alpha sign": ("wrong_alpha_sign",),
    "alpha": ("wrong_alpha",),
    "swap": ("swapped_entries",),
    "rows": ("swapped_rows",),
    "limits": ("swapped_limits", "wrong_limits", "wrong_limit"),
    "shift": ("shifted_rows",),
    "offset": ("wrong_offset",),
    "direction": ("reversed_direction",),
    "convention": ("wrong_convention",),
    "length": ("wrong_length",),
    "scale": ("wrong_scale",),
    "base": ("base_elsewhere",),
    "flange": ("flange_elsewhere",),
    "ground": ("counted_from_ground",),
}


def kind_of(outcome: Outcome) -> str:
    """The family of a single fault."""
    return next(name for name, own in FAMILIES.items() if outcome.faults[0].code in own)


def table() -> str:
    """The evidence as Markdown."""
    random = np.random.default_rng(SEED)
    known, scanned, missed = list[Outcome](), list[Outcome](), Counter[str]()
    known_rows, scan_rows, pair_rows, right_rows = list[str](), list[str](), list[str](), list[str]()
    sizes = Counter[int]()
    for name in ROBOTS:
        case = case_of(load_robot(name), usable(load_references(name)))
        for words, noise, draws, count in (
            ("exact", 0.0, 1, SIZES),
            (f"noise {NOISE_MM:g} mm", NOISE_MM, DRAWS, NOISY_SIZES),
        ):
            found = tried(name, mutations_of(load_robot(name)), noise, draws, random)
            scan = tried(name, single_scan(case, count, from_m=2e-3 * noise), noise, 1, random)
            known_rows.append(row((name, words), found))
            scan_rows.append(row((name, words), scan))
            known, scanned = known + found, scanned + scan
            missed.update(_missed(f"{name}, {words}", [*found, *scan]))
            sizes.update(outcome.set_size for outcome in scan if outcome.found)
        both_wrong, drawn = pairs(name, PAIRS, random)
        pair_rows.append(row((name, drawn), both_wrong))
        missed.update(_missed(f"{name}, pair", both_wrong))
        owned, blind = right_tables(name, random)
        right_rows.append(f"| {name} | {owned} of {RIGHT_DRAWS} | {blind} of {BLIND_DRAWS} |")
    lines = [HEAD.format(noise=NOISE_MM, seed=SEED), "## Known mistakes", ""]
    lines += [f"With noise, {DRAWS} draws a case.", "", *heading("robot", "references"), *known_rows, ""]
    lines += ["All of these by family of fault:", "", *heading("fault"), *by(kind_of, known), ""]
    lines += ["## Every entry, every size", ""]
    lines += [
        f"Each length, twist, offset and limit that a reference reacts to, wrong by {SIZES} sizes (with noise",
        f"{NOISY_SIZES}) between 1.05 times the least error that any reference notices (with noise: 1 mm more for a",
        "length) and 500 mm or 170 deg, evenly on a logarithmic scale, either way; and each direction reversed.",
        "",
        *heading("robot", "references"),
        *scan_rows,
        "",
        *heading("fault"),
        *by(kind_of, scanned),
        "",
        f"Sizes of the sets that hold the truth: {_counts(sizes)}.",
        "",
        "## Two entries at once",
        "",
        f"Two entries drawn at random, each wrong by {PAIRS_BEYOND:g} times the least error that is noticed to a gross",
        "one, drawn evenly on a logarithmic scale, either way. Identifiable here: each alone is, and to first order no",
        f"single entry does the same as both. Drawn until {PAIRS} are; exact references.",
        "",
        *heading("robot", "drawn"),
        *pair_rows,
        "",
        "## Not found, though identifiable",
        "",
        *(sorted(f"- {words} ({count})" for words, count in missed.items()) or ["- none"]),
        "",
        "## Right tables",
        "",
        "| robot | diagnosed although right, noise owned up to | diagnosed although right, uncertainty as printed |",
        "|---|---|---|",
        *right_rows,
    ]
    return "\n".join(lines) + "\n"


def _missed(words: str, found: Iterable[Outcome]) -> list[str]:
    return [f"{words}: {both(outcome.faults)}" for outcome in found if outcome.identifiable and not outcome.found]


def _counts(sizes: Counter[int]) -> str:
    return ", ".join(f"{size} ({count})" for size, count in sorted(sizes.items()))
