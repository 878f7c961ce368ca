"""A second opinion on tables and their documents that imports none of er3a.

Robot files and reference rows are read from the disk by themselves, standard D-H rows are multiplied out with plain
NumPy, and extremes over the joint limits are looked for on grids. Nothing here is fast, and nothing linearises.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np
import yaml

DATA = Path(__file__).resolve().parents[1] / "data"
TRUSTED = ("official", "measured", "cad", "export")
COLUMNS = ("a", "d", "alpha", "offset", "direction", "lower", "upper")
IN_UNIT = {"a": 1000.0, "d": 1000.0, "alpha": 180 / np.pi, "offset": 180 / np.pi, "direction": 1.0}
GRID = 25

Rows = dict[str, np.ndarray]
"""Columns of H tables, (H, 6) each: m and rad."""


def table_of(robot: str) -> Rows:
    """A robot's standard table as its file prints it."""
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


def frames(rows: Rows, q: np.ndarray) -> np.ndarray:
    """Frames (H, P, 7, 4, 4) of H tables at P joint vectors (P, 6) in rad; Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    count, poses = len(rows["a"]), len(q)
    T = np.broadcast_to(np.eye(4), (count, poses, 4, 4))
    found = [T]
    for j in range(6):
        theta = rows["direction"][:, None, j] * q[None, :, j] + rows["offset"][:, None, j]
        a, d, alpha = (np.broadcast_to(rows[name][:, None, j], theta.shape) for name in ("a", "d", "alpha"))
        c, s, ca, sa, none = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha), np.zeros_like(theta)
        link = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [none, sa, ca, d], [none] * 3 + [none + 1]]
        T = T @ np.moveaxis(np.array(link), (0, 1), (-2, -1))
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


def _angle(a: np.ndarray, b: np.ndarray, signed: bool) -> np.ndarray:
    cosine = (a @ b) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b)
    return np.degrees(np.arccos(np.clip(cosine if signed else np.abs(cosine), -1, 1)))


def _extreme(rows: Rows, measure, sign: float) -> np.ndarray:
    """The greatest (``sign`` 1) or least measure (H,) over joints 2 to 4, on a grid that closes in on its best place."""
    values = []
    for h in range(len(rows["a"])):
        one = {name: each[[h]] for name, each in rows.items()}
        low, high = one["lower"][0, 1:4], one["upper"][0, 1:4]
        turns = GRID if one["a"][0, 3] or abs(np.sin(one["alpha"][0, 3])) < 1e-12 else 1
        counts, best = (4 * GRID, 4 * GRID, turns), -np.inf
        for _ in range(6):
            grid = np.array(list(product(*(np.linspace(a, b, n) for a, b, n in zip(low, high, counts)))))
            q = np.zeros((len(grid), 6))
            q[:, 1:4] = grid
            seen = sign * measure(frames(one, q))[0]
            best = max(best, float(seen.max()))
            at, wide = grid[seen.argmax()], (high - low) / 8
            low = np.maximum(one["lower"][0, 1:4], at - wide)
            high = np.minimum(one["upper"][0, 1:4], at + wide)
            counts = (GRID, GRID, min(turns, 9))
        values.append(sign * best)
    return np.array(values)


def off(rows: Rows, said: Statement) -> np.ndarray | None:
    """How far tables are off a statement (H,), in its half-widths, coordinate by coordinate the worst; None for what
    says nothing of an arm's shape."""
    width = said.number("uncertainty_mm")
    if said.kind == "axes":
        joint, signed = int(said.row["joint"]) - 1, said.row["signed"] == "yes"
        T = frames(rows, np.zeros((1, 6)))[:, 0, joint]
        axis = T[:, :3, 2] * rows["direction"][:, joint, None]
        stated = np.array([said.number(f"direction_{c}") for c in "xyz"])
        turned = _angle(axis, stated, signed) / said.number("uncertainty_deg")
        point = np.array([said.number(f"{c}_mm") for c in "xyz"])
        foot = 1000 * T[:, :3, 3]
        near = foot + axis * np.einsum("hk,hk->h", axis, point - foot)[:, None]
        return np.maximum(turned, np.abs(near - point).max(axis=1) / width)
    if said.kind == "positions":
        given = [said.number(f"{c}_mm") for c in "xyz"]
        places = [k for k, value in enumerate(given) if value is not None]
        if not places:
            return None
        pose = np.radians([[said.number(f"q{j}_deg") for j in range(1, 7)]])
        T = frames(rows, pose)[:, 0, 6 if said.row["point"] == "flange" else 4]
        return np.abs(1000 * T[:, places, 3] - np.array([given[k] for k in places])).max(axis=1) / width
    if said.kind == "directions":
        T = frames(rows, np.zeros((1, 6)))[:, 0]
        if said.row["segment"] == "upper_arm":
            axis, along = T[:, 1, :3, 2], T[:, 2, :3, 3] - T[:, 1, :3, 3]
            along = along - axis * np.einsum("hk,hk->h", axis, along)[:, None]
        else:
            along = T[:, 3, :3, 2]
            toward = np.einsum("hk,hk->h", along, T[:, 4, :3, 3] - T[:, 2, :3, 3])
            along = along * np.where(toward < 0, -1.0, 1.0)[:, None]
        stated, width = said.number("angle_from_vertical_deg"), said.number("uncertainty_deg")
        return np.abs(_angle(along, np.array([0.0, 0.0, 1.0]), True) - stated) / width
    if said.kind == "envelope":

        def section(T: np.ndarray, k: int) -> np.ndarray:
            origin = T[..., 0, 0, 3] if k == 0 else T[..., 1, 2, 3]
            return 1000 * (T[..., 4, k, 3] - origin)

        quantity, stated = said.row["quantity"], said.number("value_mm")
        k = 0 if quantity.endswith("x") else 2
        if said.row["q2_deg"]:
            q = np.radians([[0, said.number("q2_deg"), said.number("q3_deg"), 0, 0, 0]])
            value = section(frames(rows, q), k)[:, 0]
            value = np.abs(value) if quantity.startswith("abs") else value
        else:
            value = _extreme(rows, lambda T: section(T, k), -1.0 if quantity.startswith("least") else 1.0)
        return np.abs(value - stated) / width
    if said.kind == "reach":

        def distance(T: np.ndarray) -> np.ndarray:
            k = int(said.row["from_axis"]) - 1
            point = T[..., 4 if said.row["point"] == "wrist_centre" else 6, :3, 3]
            return 1000 * np.linalg.norm(np.cross(T[..., k, :3, 2], point - T[..., k, :3, 3]), axis=-1)

        sign = 1.0 if said.row["extreme"] == "greatest" else -1.0
        return np.abs(_extreme(rows, distance, sign) - said.number("value_mm")) / width
    return None


def worst(rows: Rows, stated: list[Statement]) -> np.ndarray:
    """The greatest miss (H,) of statements, in half-widths; 1 and less is met."""
    found = [each for each in (off(rows, said) for said in stated) if each is not None]
    return np.max(found, axis=0) if found else np.zeros(len(rows["a"]))


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
