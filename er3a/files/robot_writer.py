"""Writes a :class:`Robot` as a robot file (YAML, mm and degrees)."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import yaml

from er3a.errors import InputWarning
from er3a.files.kept_files import write_atomically, write_text
from er3a.files.robot_file import (
    MAX_NOTES,
    MIN_LONGEST_MM,
    RESIDUE_MM,
    SHORTEST_PLAIN_LENGTH_MM,
    BodyFields,
    RobotFile,
    drive_keys,
)
from er3a.files.robot_library import VALUES_OF_ROW
from er3a.files.yaml_file import Content, parse
from er3a.formats.mesh_file import stl_of
from er3a.geometry.transforms import rpy_of
from er3a.numerics.si_units import from_si, split_unit
from er3a.robots.joint_limits import shown
from er3a.robots.masses import MassBody
from er3a.robots.robot import CombinedLimit, LinkMesh, Robot, Source


def mass_groups(robot: Robot) -> dict[str, Content]:
    """The groups of masses, drives, wrist loads and weight for a robot file, as far as they are known.

    Returns
    -------
    groups : by key of the file (``inertia``, ``drives``, ``wrist_load``, ``weight``), in its units. Bodies are in the
        frames that move with the joints. Sources and grades are not among them.
    """
    masses = robot.masses
    found: dict[str, Content] = {}
    if masses.links:
        found["inertia"] = {"frame": "joint", "links": [_link(each.link, each.body) for each in masses.links]}
    if masses.drives:
        rows = [{"joint": k + 1, **_drive(robot, k)} for k in range(robot.joints)]
        found["drives"] = {"rows": [row for row in rows if len(row) > 1] or rows[:1]}
    if masses.wrist:
        by_joint: dict[int, Content] = {}
        for key, values in (("moment_n_m", masses.wrist.moment), ("inertia_kg_m2", masses.wrist.inertia)):
            for joint, value in values:
                by_joint.setdefault(joint, {"joint": joint})[key] = value
        payload = {"payload_kg": masses.wrist.payload} if np.isfinite(masses.wrist.payload) else {}
        found["wrist_load"] = payload | {"rows": [by_joint[joint] for joint in sorted(by_joint)]}
    if np.isfinite(masses.weight):
        found["weight"] = {"kg": masses.weight}
    return found


def _link(link: int, body: MassBody) -> Content:
    named = {name: split_unit(name) for name in BodyFields.model_fields}
    row = {name: np.asarray(from_si(unit, getattr(body, stem))).tolist() for name, (stem, unit) in named.items()}
    return row | {"link": link, "centre_mm": list(map(_tidy, row["centre_mm"]))}


def _drive(robot: Robot, k: int) -> dict[str, float]:
    drives = robot.masses.drives
    assert drives is not None
    named = {key: getattr(drives, name)[k] for name, key in drive_keys(bool(robot.slides[k])).items()}
    return {key: float(value) for key, value in named.items() if np.isfinite(value)}


_UNKNOWN = Source("not stated", "inferred")


def robot_file(robot: Robot, path: Path | None = None) -> RobotFile:
    """The file model of a robot; mm and degrees to 1e-11, so that rounding noise does not reach the file.

    Raises
    ------
    InputError
        if the robot's values make no acceptable file; it names ``path``
    """

    zero_rows, dh_rows = list[Content](), list[Content]()
    for k, sliding in enumerate(robot.sliding):
        angles = {name: _tidy(np.degrees(getattr(robot, name)[k])) for name in ("alpha", "beta", "offset")}
        zero_rows.append({"direction": int(robot.direction[k]), "offset_deg": None if sliding else angles["offset"]})
        row: Content = {f"{name}_mm": _tidy(getattr(robot, name)[k] * 1000) for name in ("a", "d")}
        row |= {"type": "prismatic", "theta_deg": angles["offset"]} if sliding else {}
        dh_rows.append(row | {"alpha_deg": angles["alpha"], "beta_deg": angles["beta"] or None})
    lengths = np.abs(np.concatenate([robot.a, robot.d])) * 1000
    groups: dict[str, Content] = {
        "dh": {
            "convention": robot.convention,
            "calibrated": _short(lengths) or bool(robot.beta.any()) or _shifted(robot.base) or _shifted(robot.flange),
            "rows": _rows(robot, "dh", dh_rows),
        },
        "zero": {"rows": _rows(robot, "zero", zero_rows)},
        "limits": {"rows": _limit_rows(robot), "combined": [_combined_row(robot, each) for each in robot.combined]},
        **mass_groups(robot),
        **dict(_placements(robot)),
    }
    if np.isfinite(robot.speed).any():
        groups["speeds"] = {"rows": _speed_rows(robot)}
    if robot.coupling is not None:
        groups["coupling"] = {"rows": _coupling_rows(robot.coupling)}
    if robot.envelopes or robot.hulls or robot.meshes:
        groups["envelopes"] = _shapes(robot)
    content: Content = {
        "kind": "robot",
        "name": robot.name,
        "title": robot.title,
        "zero_pose": robot.zero_pose or "not stated",
        "references": list(robot.references),
        "notes": list(robot.notes[:MAX_NOTES]),
        "visuals": _surfaces(robot.visuals),
        "home_deg": None if robot.home is None else list(map(_tidy, shown(robot, robot.home))),
    }
    if robot.pair_rules:
        content["collision"] = {rule: _decided(robot, rule) for rule in ("allow", "watch")}
    for group, fields in groups.items():
        source = robot.sources.get(group, _UNKNOWN)
        content[group] = fields | {"source": source.source, "grade": source.grade, "origin": source.origin or None}
    with warnings.catch_warnings(action="ignore", category=InputWarning):  # for those who write numbers by hand
        return parse(RobotFile, content, path).with_surfaces((*robot.meshes, *robot.visuals))


def _short(lengths_mm: np.ndarray) -> bool:
    """Whether a table has lengths so short that a person's would be taken for metres."""
    return bool(
        ((lengths_mm > 0) & (lengths_mm < SHORTEST_PLAIN_LENGTH_MM)).any() or 0 < lengths_mm.max() < MIN_LONGEST_MM
    )


def _shifted(T: np.ndarray) -> bool:
    """Whether a base or flange is where only a calibration or a URDF puts it, less than 2 mm off."""
    return bool(RESIDUE_MM < np.abs(T[:3, 3]).max() * 1000 < SHORTEST_PLAIN_LENGTH_MM)


def _placements(robot: Robot) -> Iterator[tuple[str, dict]]:
    """Base, flange and tool where they are moved, each as position and roll, pitch, yaw."""
    for key in ("base", "flange", "tool"):
        T = getattr(robot, key)
        if not np.array_equal(T, np.eye(4)):
            yield key, {"xyz_mm": [*map(_tidy, T[:3, 3] * 1000)], "rpy_deg": [*map(_tidy, np.degrees(rpy_of(T)))]}


def _speed_rows(robot: Robot) -> list[dict]:
    """A row for each joint, with its speed where one is known."""
    speeds = zip(np.where(robot.slides, "speed_mm_s", "speed_deg_s").tolist(), shown(robot, robot.speed))
    return _rows(robot, "speeds", [{key: _tidy(value)} if np.isfinite(value) else {} for key, value in speeds])


def _limit_rows(robot: Robot) -> list[dict]:
    ends = zip(robot.lower, robot.upper, robot.slides, robot.continuous)
    return _rows(robot, "limits", [{"continuous": True} if endless else _ends(*each) for *each, endless in ends])


def _rows(robot: Robot, group: str, rows: list[Content]) -> list[dict]:
    """The rows of a group, with the numbers of their joints, and the documents of those that have their own."""
    return [{"joint": k, **row, **_origins(robot, group, k)} for k, row in enumerate(rows, start=1)]


def _ends(lower: float, upper: float, slides: bool) -> Content:
    """Limits (m or rad) in the units of a file."""
    unit, scale = ("mm", 1000.0) if slides else ("deg", np.degrees(1.0))
    return {f"lower_{unit}": _tidy(scale * lower), f"upper_{unit}": _tidy(scale * upper)}


def _combined_row(robot: Robot, limit: CombinedLimit) -> dict:
    slides = bool(robot.slides[np.flatnonzero(limit.factors)].all())
    return _weighted(np.array(limit.factors)) | _ends(limit.lower, limit.upper, slides)


def _coupling_rows(coupling: np.ndarray) -> list[dict]:
    own = np.eye(*coupling.shape)
    joints = coupling.shape[1]
    changed = [k for k in range(len(coupling)) if k >= joints or not np.array_equal(coupling[k], own[k])]
    return [{"row": k + 1, **_weighted(coupling[k])} for k in changed or [0]]


def _weighted(factors: np.ndarray) -> dict:
    joints = np.flatnonzero(factors) if factors.any() else np.array([0])
    return {"joints": (joints + 1).tolist(), "factors": factors[joints].tolist()}


def _shapes(robot: Robot) -> Content:
    """Capsules and hulls as the file has them."""

    def point(values: Iterable[float]) -> list[float]:
        return [_tidy(value * 1000) for value in values]

    return {
        "capsules": [
            {"link": c.link, "from_mm": point(c.start), "to_mm": point(c.end), "radius_mm": _tidy(c.radius * 1000)}
            for c in robot.envelopes
        ],
        "hulls": [
            {"link": h.link, "margin_mm": _tidy(h.margin * 1000), "points_mm": [point(p) for p in h.points]}
            for h in robot.hulls
        ],
        "surfaces": _surfaces(robot.meshes),
    }


def surface_files(robot: Robot) -> dict[Path, bytes]:
    """The STL files of an arm's surfaces, those that are checked and those that it is drawn by.

    Returns
    -------
    files : content by place below the robot file's folder; names hold the link and the first 16 digits of the checksum
    """
    return {_stl_place(each): stl_of(each) for each in (*robot.meshes, *robot.visuals)}


def _surfaces(meshes: Sequence[LinkMesh]) -> list[Content]:
    """Triangles as the file names them."""
    return [{"link": each.link, "stl": _stl_place(each).as_posix(), "sha256": _checksum(each)} for each in meshes]


def _stl_place(mesh: LinkMesh) -> Path:
    return Path("meshes", f"link_{mesh.link}_{_checksum(mesh)[:16]}.stl")


def _checksum(mesh: LinkMesh) -> str:
    return hashlib.sha256(stl_of(mesh)).hexdigest()


def _decided(robot: Robot, rule: str) -> list[Content]:
    """The pairs that a person decided on by one rule."""
    return [
        {"pair": [each.first, each.second], "reason": each.reason} for each in robot.pair_rules if each.rule == rule
    ]


def write_robot(robot: Robot, path: Path) -> None:
    """Write a robot file that :func:`er3a.load_robot` reads back to the same numbers, to 1e-12 m and rad.

    Parameters
    ----------
    path : of the YAML file; STL files of surfaces are written to a folder ``meshes`` in the same folder

    Raises
    ------
    WriteError
        if the disk is full or permission is missing; an older file then stays as it is
    """
    text = robot_text(robot_file(robot, path))
    for place, content in surface_files(robot).items():
        write_atomically(path.parent / place, partial(Path.write_bytes, data=content))
    write_text(path, text)


def robot_text(content: RobotFile) -> str:
    """The content of a robot file as YAML.

    Returns
    -------
    text : mm and deg; keys whose value is the default, or nothing, are left out
    """
    return yaml_text(content.model_dump(exclude_none=True, exclude_defaults=True))


def yaml_text(content: Content) -> str:
    """The content of one of er3a's files as YAML.

    Parameters
    ----------
    content : plain values, lists and mappings only

    Returns
    -------
    text : lists of plain values in brackets, keys in the order given, other alphabets as they are, lines to 110 letters
    """
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=110, default_flow_style=None)


def _origins(robot: Robot, group: str, joint: int) -> dict[str, str | None]:
    """The documents of a row, where they are others than the group's."""
    named = {column: robot.origins.get(f"{column}{joint}") for column in VALUES_OF_ROW[group]}
    direction = named.pop("direction", None)
    row = next(iter(named.values()))
    return {"origin": row} | ({"direction_origin": direction} if direction not in (None, row) else {})


def _tidy(value: float) -> float:
    return round(float(value), 11) + 0.0
