"""How often ``er3a confirm`` names what is between a model and its controller: nine causes, alone and in pairs."""

from __future__ import annotations

import time
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from er3a.confirmation.fit import Fitter
from er3a.confirmation.layers import search
from er3a.files.arm_catalogue import known_arms
from er3a.files.robot_library import load_robot
from er3a.robots.robot import Robot
from testing.controller_cases import CAUSES, DIGIT, POSES, case, judged
from testing.evidence import sized

SHIPPED = ("er3_600", "er3a_c60", "lbr_iiwa_14", "ur5e")
JOINTS = 6, 7
EVERY = 18
"""Pairs of causes are tried on every eighteenth arm."""


@dataclass
class Tally:
    """What was said of some cases, processor times (s), and those that were missed."""

    said: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    seconds: list[float] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)

    def tried(self, name: str, robot: Robot, causes: tuple[str, ...]) -> None:
        """Try causes on an arm, and count the answer."""
        made = case(robot, causes, seed=len(name))
        start = time.process_time()
        answer = judged(search(Fitter(robot, made.pairs)), made.truth)
        self.seconds.append(time.process_time() - start)
        self.said[answer] += 1
        if answer == "missed":
            self.missed.append(f"{name}: {' + '.join(causes) or 'none'}")

    def row(self, label: str) -> str:
        """A row of the table."""
        count = len(self.seconds)
        shares = (f"{self.said[each] / count:.1%}" for each in ("first", "alike", "missed"))
        return f"| {label} | {count} | {' | '.join(shares)} | {np.median(self.seconds):.2f} | {max(self.seconds):.1f} |"


def arms() -> dict[str, Robot]:
    """The arms that come with er3a and those of its catalogue that have six or seven joints."""
    found = {name: load_robot(name) for name in SHIPPED}
    found |= {name: arm.robot for name, arm in known_arms().items() if arm.robot.joints in JOINTS}
    return dict(list(found.items())[: sized(len(found), len(SHIPPED))])


def table() -> str:
    """The evidence as Markdown."""
    known, alone, pairs = arms(), {each: Tally() for each in ("none", *CAUSES)}, Tally()
    for name, robot in known.items():
        for label, tally in alone.items():
            tally.tried(name, robot, () if label == "none" else (label,))
    for name in list(known)[::EVERY]:
        for causes in combinations(CAUSES, 2):
            pairs.tried(name, known[name], causes)
    missed = [line for each in (*alone.values(), pairs) for line in each.missed]
    both = Tally()
    for each in alone.values():
        both.seconds += each.seconds
        for answer, count in each.said.items():
            both.said[answer] += count
    return "\n".join(
        [
            "# Confirmation: causes put between a model and its controller",
            "",
            f"{len(known)} arms of six or seven joints, those of the catalogue among them; {POSES} poses over the",
            f"limits, rounded to {DIGIT:g} mm and deg, joint values too. *First*: the cause, and no other, is named.",
            "*Alike*: it is listed as one that explains the poses as well. Pairs are tried on every 18th arm.",
            "Written by `make campaigns ARGS=confirm`.",
            "",
            "| cause | cases | named first | listed as alike | missed | median s | at most s |",
            "|---|---|---|---|---|---|---|",
            *(tally.row(label) for label, tally in alone.items()),
            both.row("**alone**"),
            pairs.row("**in pairs**"),
            "",
            f"Missed: {'; '.join(missed) or 'none'}.",
        ]
    )
