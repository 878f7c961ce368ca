"""An independent judge of tables and their documents; imports nothing of er3a.

Robot files and reference rows are read from the disk by themselves, standard D-H rows are multiplied out with plain
NumPy, and extremes over the joint limits are looked for on grids. Nothing here is fast, and nothing linearises.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
import yaml
from scipy.optimize import least_squares

DATA = Path(__file__).resolve().parents[1] / "data"
TRUSTED = ("official", "measured", "cad", "export")
SHAPELESS = ("limits", "speeds")  # kinds of rows that say nothing of an arm's shape
COLUMNS = ("a", "d", "alpha", "offset", "direction", "lower", "upper")
IN_UNIT = {"a": 1000.0, "d": 1000.0, "alpha": 180 / np.pi, "offset": 180 / np.pi, "direction": 1.0}
GRID, CLOSER = 31, 6
INSIDE = 0.9  # of a half-width, up to which a fit leaves alone what it meets

Rows = dict[str, np.ndarray]
"""Columns of H tables, (H, 6) each: m and rad."""


def table_of(robot: str) -> Rows:
    """A robot's standard D-H table as written in its file, mm and deg."""
    content = yaml.safe_load((DATA / "robots" / f"{robot}.yaml").read_text(encoding="utf-8"))
    dh, zero, limits = (content[group]["rows"] for group in ("dh", "zero", "limits"))
    columns = {
        "a": [row["a_mm"] / 1000 for row in dh],
        "d": [row["d_mm"] / 1000 for row in dh],
        "alpha": np.radians([row["alpha_deg"] for row in dh]),
        "offset": np.radians([row["offset_deg"] for row in zero]),
        "direction": [row["direction"] for row in zero],
        "lower": np.radians([row["lower_deg"] for row in limits]),
        "upper": np.radians([row["upper_deg"] for row in limits]),
    }
    return {name: np.array([values], float) for name, values in columns.items()}


def value_of(rows: Rows, entry: str) -> float:
    """An entry of the first table, in mm or deg."""
    column, joint = entry[:-1], int(entry[-1]) - 1
    return float(rows[column][0, joint] * IN_UNIT.get(column, 180 / np.pi))


def changed(rows: Rows, **entries: float) -> Rows:
    """A copy with entries set, in mm and deg: ``d4=349.5``."""
    copy = {name: values.copy() for name, values in rows.items()}
    for entry, value in entries.items():
        column, joint = entry[:-1], int(entry[-1]) - 1
        copy[column][:, joint] = value / IN_UNIT.get(column, 180 / np.pi)
    return copy


def stacked(tables: list[Rows]) -> Rows:
    """Tables as one batch."""
    return {name: np.concatenate([each[name] for each in tables]) for name in COLUMNS}


def frames(rows: Rows, q: np.ndarray, joints: int = 6) -> np.ndarray:
    """Frames (H, P, joints + 1, 4, 4) of H tables at P joint vectors (P, 6) in rad; Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    T = np.broadcast_to(np.eye(4), (len(rows["a"]), len(q), 4, 4))
    found = [T]
    for j in range(joints):
        theta = rows["direction"][:, None, j] * q[None, :, j] + rows["offset"][:, None, j]
        a, d, alpha = (rows[name][:, None, j] for name in ("a", "d", "alpha"))
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        link = np.zeros((*theta.shape, 4, 4))
        link[..., 0, 0], link[..., 0, 1], link[..., 0, 2], link[..., 0, 3] = c, -s * ca, s * sa, a * c
        link[..., 1, 0], link[..., 1, 1], link[..., 1, 2], link[..., 1, 3] = s, c * ca, -c * sa, a * s
        link[..., 2, 1], link[..., 2, 2], link[..., 2, 3], link[..., 3, 3] = sa, ca, d, 1.0
        T = T @ link
        found.append(T)
    return np.stack(found, axis=2)


@dataclass(frozen=True)
class Statement:
    """One row of a reference file: its kind, its fields, and the document that it rests on."""

    kind: str
    row: dict[str, str] = field(hash=False)
    document: str
    trusted: bool

    def number(self, name: str) -> float | None:
        """A field as a number; None where it is empty."""
        text = self.row.get(name, "")
        return float(text) if text else None


def statements_of(robot: str) -> list[Statement]:
    """All rows of a reference set."""
    found = []
    for path in sorted((DATA / "manual_refs" / robot).glob("*.csv")):
        if path.stem == "documents":
            continue
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                found.append(Statement(path.stem, row, row["origin"], row["grade"] in TRUSTED))
    return found


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def _apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Unit vectors (H, 3) from one, as vectors as long as the angle between them in deg."""
    chord = _unit(a) - _unit(b)
    length = np.linalg.norm(chord, axis=-1, keepdims=True)
    angle = np.degrees(2 * np.arcsin(np.clip(length / 2, 0, 1)))
    return chord * angle / np.maximum(length, 1e-300)


def _extreme(
    rows: Rows, measure: Callable[[np.ndarray], np.ndarray], sign: float, joints: int, at: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """The greatest (``sign`` 1) or least measure (H, 1) over the joints, on grids that close in on the best place, and
    that place (6,) of the last table; or the measure at a place that is known."""
    if at is not None:
        return measure(frames(rows, at[None], joints)), at
    values, place = [], np.zeros(6)
    for h in range(len(rows["a"])):
        one = {name: each[[h]] for name, each in rows.items()}
        least, most = one["lower"][0, 1:joints], one["upper"][0, 1:joints]
        moving = joints > 4 or bool(one["a"][0, 3])
        counts = [GRID, GRID, 9 if moving else 1, 9][: joints - 1]
        q, seen = _on_grid(one, measure, sign, (least, most), counts)
        best = -np.inf
        upper_half = q[:, 1] > (least[0] + most[0]) / 2
        for turn, half in product(np.unique(q[:, 3]), (False, True)):  # the best place of each is closed in on
            own = (q[:, 3] == turn) & (upper_half == half)
            near, wide = (
                q[own][seen[own].argmax(), 1:joints],
                1.5 * (most - least) / np.maximum(np.array(counts) - 1, 1),
            )
            for _ in range(CLOSER):
                low, high = np.maximum(least, near - wide), np.minimum(most, near + wide)
                closer = [9, 9, 5 if moving else 1, 5][: joints - 1]
                points, values_there = _on_grid(one, measure, sign, (low, high), closer)
                near, wide = points[values_there.argmax(), 1:joints], wide / 2.7
                if values_there.max() > best:
                    best, place = float(values_there.max()), points[values_there.argmax()]
        values.append([sign * best])
    return np.array(values), place


def _on_grid(
    one: Rows,
    measure: Callable[[np.ndarray], np.ndarray],
    sign: float,
    box: tuple[np.ndarray, np.ndarray],
    counts: list[int],
) -> tuple[np.ndarray, np.ndarray]:
    """Joint vectors (P, 6) on a grid over joints 2 and further, and ``sign`` times the measure (P,) there."""
    grid = np.stack(np.meshgrid(*map(np.linspace, *box, counts), indexing="ij"), -1)
    q = np.zeros((grid[..., 0].size, 6))
    q[:, 1 : 1 + len(counts)] = grid.reshape(len(q), -1)
    return q, sign * measure(frames(one, q, 1 + len(counts)))[0]


def components(rows: Rows, said: Statement, at: np.ndarray | None = None) -> list[np.ndarray]:
    """Parts (H, k) by which tables are off a statement, in its half-widths, the length of each being what counts; none
    for what does not depend on an arm's shape. ``at``: where extremes are read instead of being looked for."""
    if said.kind in ("envelope", "reach"):
        return [_extent(rows, said, at)[0]]
    width = said.number("uncertainty_mm")
    if said.kind == "axes":
        joint, signed = int(said.row["joint"]) - 1, said.row["signed"] == "yes"
        T = frames(rows, np.zeros((1, 6)), joint)[:, 0, joint]
        axis = T[:, :3, 2] * rows["direction"][:, joint, None]
        stated = np.array([said.number(f"direction_{c}") for c in "xyz"])
        toward = axis if signed else axis * np.where(axis @ stated < 0, -1.0, 1.0)[:, None]
        point, foot = np.array([said.number(f"{c}_mm") for c in "xyz"]), 1000 * T[:, :3, 3]
        near = foot + axis * np.einsum("hk,hk->h", axis, point - foot)[:, None]
        return [_apart(toward, stated) / said.number("uncertainty_deg"), *np.split((near - point) / width, 3, axis=1)]
    if said.kind == "positions":
        given = [said.number(f"{c}_mm") for c in "xyz"]
        pose = np.radians([[said.number(f"q{j}_deg") for j in range(1, 7)]])
        T = frames(rows, pose)[:, 0, 6 if said.row["point"] == "flange" else 4]
        return [(1000 * T[:, [k], 3] - value) / width for k, value in enumerate(given) if value is not None]
    if said.kind == "directions":
        T = frames(rows, np.zeros((1, 6)), 4)[:, 0]
        if said.row["segment"] == "upper_arm":
            axis, along = T[:, 1, :3, 2], T[:, 2, :3, 3] - T[:, 1, :3, 3]
            along = along - axis * np.einsum("hk,hk->h", axis, along)[:, None]
        else:
            along = T[:, 3, :3, 2]
            toward = np.einsum("hk,hk->h", along, T[:, 4, :3, 3] - T[:, 2, :3, 3])
            along = along * np.where(toward < 0, -1.0, 1.0)[:, None]
        stated, width = said.number("angle_from_vertical_deg"), said.number("uncertainty_deg")
        if stated == 0:
            return [_apart(along, np.array([0.0, 0.0, 1.0])) / width]
        return [(np.degrees(np.arccos(np.clip(_unit(along)[:, [2]], -1, 1))) - stated) / width]
    if said.kind not in SHAPELESS:
        raise ValueError(f"a second opinion on rows of '{said.kind}' is missing")
    return []


def _extent(rows: Rows, said: Statement, at: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """How far (H, 1) tables are off a drawing's label or a reach, and where it was read."""
    width, stated = said.number("uncertainty_mm"), said.number("value_mm")
    if said.kind == "reach":
        count, k = 4 if said.row["point"] == "wrist_centre" else 6, int(said.row["from_axis"]) - 1

        def distance(T: np.ndarray) -> np.ndarray:
            return 1000 * np.linalg.norm(np.cross(T[..., k, :3, 2], T[..., count, :3, 3] - T[..., k, :3, 3]), axis=-1)

        value, at = _extreme(rows, distance, 1.0 if said.row["extreme"] == "greatest" else -1.0, count, at)
        return (value - stated) / width, at
    quantity = said.row["quantity"]
    k = 0 if quantity.endswith("x") else 2

    def section(T: np.ndarray) -> np.ndarray:
        return 1000 * (T[..., 4, k, 3] - (T[..., 0, 0, 3] if k == 0 else T[..., 1, 2, 3]))

    if said.row["q2_deg"]:
        value = section(frames(rows, np.radians([[0, said.number("q2_deg"), said.number("q3_deg"), 0, 0, 0]]), 4))
        return ((np.abs(value) if quantity.startswith("abs") else value) - stated) / width, at
    value, at = _extreme(rows, section, -1.0 if quantity.startswith("least") else 1.0, 4, at)
    return (value - stated) / width, at


def off(rows: Rows, said: Statement) -> np.ndarray | None:
    """How far tables are off a statement (H,), in its half-widths, coordinate by coordinate the worst; None for what
    does not depend on an arm's shape."""
    lengths = [np.linalg.norm(part, axis=1) for part in components(rows, said)]
    return np.max(lengths, axis=0) if lengths else None


def worst(rows: Rows, stated: list[Statement]) -> np.ndarray:
    """The largest deviation (H,) from statements, in half-widths; up to 1 is within the uncertainty."""
    found = [each for each in (off(rows, said) for said in stated) if each is not None]
    return np.max(found, axis=0) if found else np.zeros(len(rows["a"]))


def fitted(rows: Rows, stated: list[Statement], free: list[str], passes: int = 40) -> Rows:
    """A table near one (a batch of one) whose entries ``free`` bring what exceeds the half-widths down, by least
    squares of the excess."""
    scale = np.array([1e-3 if entry[0] in "ad" and entry[1].isdigit() else 2e-3 for entry in free])

    def at(steps: np.ndarray) -> Rows:
        copy = {name: np.repeat(values, len(steps), axis=0) for name, values in rows.items()}
        for k, entry in enumerate(free):
            copy[entry[:-1]][:, int(entry[-1]) - 1] += steps[:, k] * scale[k]
        return copy

    def excess(steps: np.ndarray, places: dict[int, np.ndarray | None]) -> np.ndarray:
        tables, found = at(steps), []
        for n, said in enumerate(stated):
            for part in components(tables, said, places.get(n)):
                length = np.linalg.norm(part, axis=1, keepdims=True)
                found.append(part * np.maximum(1 - INSIDE / np.maximum(length, 1e-300), 0))
        return np.concatenate(found, axis=1)

    def slope(steps: np.ndarray) -> np.ndarray:
        here = at(steps[None])
        places = {
            n: _extent(here, said, None)[1] for n, said in enumerate(stated) if said.number("value_mm") is not None
        }
        moved = np.concatenate([steps + 1e-4 * np.eye(len(free)), steps - 1e-4 * np.eye(len(free))])
        values = excess(moved, places)
        return (values[: len(free)] - values[len(free) :]).T / 2e-4

    found = least_squares(lambda steps: excess(steps[None], {})[0], np.zeros(len(free)), slope, max_nfev=passes)
    return at(found.x[None])


def tool_off(rows: Rows, others: Rows, poses: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    """How far (mm and deg, (H,) each) the flanges of other tables are off the first's, at random joints in its
    limits."""
    random = np.random.default_rng(5)
    q = random.uniform(rows["lower"][0], rows["upper"][0], (poses, 6))
    ends = np.array(list(product(*zip(rows["lower"][0], rows["upper"][0]))))
    own = frames(rows, np.concatenate([q, ends]))[0, :, 6]
    mm, deg = [], []
    for h in range(len(others["a"])):
        T = frames({name: each[[h]] for name, each in others.items()}, np.concatenate([q, ends]))[0, :, 6]
        mm.append(1000 * np.linalg.norm(T[:, :3, 3] - own[:, :3, 3], axis=-1).max())
        trace = np.einsum("pij,pij->p", T[:, :3, :3], own[:, :3, :3])
        deg.append(np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))).max())
    return np.array(mm), np.array(deg)
