"""Whether an input file is refused in one line that names it, or read as exactly what is written in it.

What is written is read a second time by other software (libyaml's parser with all scalars as text, pandas' CSV parser,
exact fractions), and a robot's pose is worked out again from that text.
"""

from __future__ import annotations

import re
import shutil
import signal
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from pydantic import BaseModel
from scipy.spatial.transform import Rotation

from er3a.collision.scene import Plane, Scene, Solid
from er3a.errors import InputError, InputWarning
from er3a.files.by_name import load_measurements
from er3a.files.csv_file import read_csv
from er3a.files.hand_eye_file import POINTS, HandEyeFile, sample_rows
from er3a.files.path_file import PathTable, load_paths, read_path_table
from er3a.files.program_file import ProgramsFile
from er3a.files.reference_sets import check_reference_file, load_documents
from er3a.files.robot_file import RobotFile
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import SHAPES, SceneFile, load_scene
from er3a.files.target_file import read_targets
from er3a.files.vision_file import VisionFile
from er3a.files.yaml_file import load
from er3a.kinematics.forward import forward
from er3a.pipeline.check import check_file
from er3a.pipeline.study import load_study
from testing.input_files import ROOT, mutants, seeds

MAX_SECONDS = 5.0  # of processor time, for one file
LONGEST_MESSAGE = 1000
NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
WORDS_OF = {None: ("", "~", "null", "Null", "NULL"), True: ("true", "yes", "on"), False: ("false", "no", "off")}


@dataclass(frozen=True)
class Outcome:
    """The outcome for a damaged file; ``fault`` is None if it is correct."""

    accepted: bool
    seconds: float
    fault: str | None


def judge(path: Path) -> Outcome:
    """Check a file and look for what must not happen: a traceback, a hang, an unclear message, other numbers."""
    start = time.process_time()
    before = signal.signal(signal.SIGVTALRM, _stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, MAX_SECONDS)
    accepted, fault = False, None
    try:
        with warnings.catch_warnings(action="error"):
            warnings.simplefilter("ignore", InputWarning)  # what a person reads about the file, not of a library
            check_file(path)
        accepted = True
    except InputError as error:
        fault = unclear(str(error), path)
    except TimeoutError:
        fault = f"hang: more than {MAX_SECONDS:g} s"
    except Exception:  # whatever else comes out is what the campaign looks for
        fault = "traceback: " + " / ".join(traceback.format_exc().strip().splitlines()[-3:])
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)
    seconds = time.process_time() - start
    if accepted:
        try:
            differences = differing_table(path) if path.suffix == ".csv" else differing_file(path)
            fault = f"read otherwise: {differences[0]}" if differences else None
        except Exception:  # an accepted file that the independent reader can't read is a finding too
            fault = "read otherwise: " + " / ".join(traceback.format_exc().strip().splitlines()[-3:])
    return Outcome(accepted, seconds, fault)


def _stop(*_):
    raise TimeoutError


def unclear(message: str, path: Path) -> str | None:
    """What is wrong with an error message, if anything. It names the file, or one that is missing and written in it."""
    missing = message.partition(": there is no such file")[0]
    if path.name not in message and missing not in path.read_text(encoding="utf-8", errors="replace"):
        return f"message without the file's name: {message[:200]!r}"
    if not message.isprintable():
        return f"message with line ends or control characters: {message[:200]!r}"
    return f"message of {len(message)} characters" if len(message) > LONGEST_MESSAGE else None


def differing_file(path: Path) -> list[str]:
    """Where what er3a read from a YAML file is not what libyaml says is written there."""
    node = yaml.compose(path.read_bytes(), Loader=yaml.CBaseLoader)
    written = {key.value: value for key, value in node.value}
    kind = written["kind"].value
    if kind == "robot":
        robot, content = load_robot(path), load(RobotFile, path)
        return [*_differing(content, node, ""), *_differing_poses(robot, written)]
    if kind == "targets":
        targets, nodes = read_targets(path), written["targets"].value
        found = [] if len(targets) == len(nodes) else [f"{len(targets)} targets of {len(nodes)}"]
        return found + [word for target, each in zip(targets, nodes) for word in _differing(target, each, each.tag)]
    if kind == "scene":
        return [*_differing(load(SceneFile, path), node, ""), *_differing_solids(load_scene(path), written)]
    models = {"programs": ProgramsFile, "vision": VisionFile, "hand_eye": HandEyeFile}
    if kind in models:
        return _differing(load(models[kind], path), node, "")
    loaders = {"study": load_study, "paths": load_paths}
    return _differing(loaders[kind](path), node, "")


def _given(model: BaseModel) -> dict[str, object]:
    """The values of a model that were written, by the keys that people write."""
    fields = type(model).model_fields
    return {fields[name].alias or name: getattr(model, name) for name in model.model_fields_set}


def _differing(value: object, node: yaml.Node, where: str) -> list[str]:
    if isinstance(value, BaseModel | dict):
        if not isinstance(node, yaml.MappingNode):
            return [f"{where}: a group from {node.value!r:.80}"]
        names = [key.value for key, _ in node.value]
        members = value if isinstance(value, dict) else _given(value)
        if sorted(names) != sorted(members):
            return [f"{where}: keys {sorted(names)} read as {sorted(members)}"]
        return [
            word for key, part in node.value for word in _differing(members[key.value], part, f"{where}.{key.value}")
        ]
    if where.endswith(".expect") and isinstance(value, list) and isinstance(node, yaml.ScalarNode):
        value = value[0] if len(value) == 1 else value  # one word stands for a list of it
    if isinstance(value, list | tuple):
        if not isinstance(node, yaml.SequenceNode) or len(node.value) != len(value):
            return [f"{where}: a list of {len(value)} from {node.value!r:.80}"]
        return [word for i, part in enumerate(node.value) for word in _differing(value[i], part, f"{where}[{i}]")]
    text = node.value
    plain = isinstance(node, yaml.ScalarNode) and not node.style
    if value is None or isinstance(value, bool):
        same = plain and (text if value is None else text.lower()) in WORDS_OF[value]
    elif isinstance(value, int | float):
        same = plain and same_number(value, text)
    else:
        same = value == text
    return [] if same else [f"{where}: {text!r:.80} read as {value!r:.80}"]


def same_number(value: float, text: str) -> bool:
    """Whether a number is the nearest to a text in decimal notation, and not zero unless that is."""
    if not NUMBER.fullmatch(text):
        return False
    exact = Fraction(text)
    try:
        return float(exact) == value and (exact == 0) == (value == 0)
    except OverflowError:
        return False


def _differing_poses(robot, written: dict[str, yaml.Node]) -> list[str]:
    """The tool's pose by the model, and by plain products of matrices from the text's own numbers."""

    def column(group: str, name: str, default: str = "0") -> list[float]:
        members = {key.value: value for key, value in written[group].value}
        rows = [{key.value: value.value for key, value in row.value} for row in members["rows"].value]
        return [float(row.get(name) or default) for row in rows]

    def placement(group: str) -> np.ndarray:
        T = np.eye(4)
        if group in written and isinstance(written[group], yaml.MappingNode):
            members = {key.value: value for key, value in written[group].value}
            triples = {name: _floats(members[name]) for name in members if name[3] == "_"}
            T[:3, 3] = np.array(triples.get("xyz_mm", [0, 0, 0])) / 1000
            T[:3, :3] = Rotation.from_euler("xyz", triples.get("rpy_deg", [0, 0, 0]), degrees=True).as_matrix()
        return T

    convention = {key.value: value.value for key, value in written["dh"].value}["convention"]
    low, high = np.array(column("limits", "lower_deg")), np.array(column("limits", "upper_deg"))
    q_deg = low + (high - low) * np.resize([0.3, 0.6, 0.2, 0.8, 0.4, 0.7], len(low))
    T = placement("base")
    rows = zip(
        column("dh", "a_mm"), column("dh", "alpha_deg"), column("dh", "d_mm"), column("dh", "beta_deg"), strict=True
    )
    turns = zip(column("zero", "direction"), column("zero", "offset_deg"), strict=True)
    for (a, alpha, d, beta), (direction, offset), angle in zip(rows, turns, q_deg, strict=True):
        about_z, across = np.eye(4), np.eye(4)
        about_z[:3, :3] = Rotation.from_euler("z", direction * angle + offset, degrees=True).as_matrix()
        about_z[2, 3] = d / 1000
        across[:3, :3] = Rotation.from_euler("XY", [alpha, beta], degrees=True).as_matrix()
        across[0, 3] = a / 1000
        T = T @ about_z @ across if convention == "standard" else T @ across @ about_z
    worst = np.abs(forward(robot, np.radians(q_deg)) - T @ placement("tool")).max()
    return [] if worst < 1e-9 else [f"the pose differs from that of the written table by {worst:.3g} m"]


def _floats(node: yaml.Node) -> float | list[float]:
    return [float(part.value) for part in node.value] if isinstance(node, yaml.SequenceNode) else float(node.value)


def _differing_solids(scene: Scene, written: dict[str, yaml.Node]) -> list[str]:
    """A scene's solids in metres, and what plain arithmetic makes of the text's own numbers."""

    def worst(solid: Solid, row: dict[str, yaml.Node]) -> float:
        numbers = {
            name: np.array(
                [float(part.value) for part in value.value] if value.id == "sequence" else float(value.value)
            )
            for name, value in row.items()
            if name != "name"
        }
        if isinstance(solid, Plane):
            length = np.sqrt(np.sum(numbers["normal"] ** 2))
            found = [solid.normal - numbers["normal"] / length, solid.offset - numbers["offset_mm"] / 1000 / length]
        else:
            turn = Rotation.from_euler("xyz", numbers.get("rpy_deg", np.zeros(3)), degrees=True).as_matrix()
            found = [solid.T[:3, 3] - numbers["xyz_mm"] / 1000, solid.T[:3, :3] - turn]
            lengths = [name for name in ("size", "radius", "length") if hasattr(solid, name)]
            found += [getattr(solid, name) - numbers[f"{name}_mm"] / 1000 for name in lengths]
        return max(np.abs(difference).max() for difference in found)

    nodes = [node for shape in SHAPES if shape in written for node in written[shape].value]
    return [
        f"{solid.name}: differs from the written solid"
        for solid, node in zip(scene.solids, nodes, strict=True)
        if worst(solid, {key.value: value for key, value in node.value}) > 1e-9
    ]


def differing_table(path: Path) -> list[str]:
    """Where what er3a read from a CSV file is not what pandas says is written there."""
    text = path.read_bytes().decode("utf-8-sig")
    header = text.lstrip("\r\n").splitlines()[0]
    separator = max(",;\t", key=header.count)
    table = pd.read_csv(
        StringIO(text, newline=""), sep=separator, dtype=str, keep_default_na=False, skip_blank_lines=True
    )
    table = table.map(str.strip).rename(columns=str.strip)
    table = table[(table != "").any(axis=1)]
    if path.parent.name == "paths":
        return _differing_points(read_path_table(path), table)
    if path.parent.name == "targets":
        rows: list = list(read_targets(path))
    elif {"target_x_mm", "seen_x_mm"} & set(table.columns):
        samples = read_csv(path, POINTS) if "seen_x_mm" in table else sample_rows(path)[0]
        rows = [[value for name, value in row.items() if name != "row"] for row in samples]
    elif path.name == "documents.csv":
        table["derived_from"] = table["derived_from"].str.replace(" ", "")
        rows = [replace(each, derived_from=(";".join(each.derived_from),)) for each in load_documents(path)]
    else:
        rows = list(
            load_measurements(path) if "q1_deg" in table and "grade" not in table else check_reference_file(path)
        )
    if len(rows) != len(table):
        return [f"{len(rows)} rows of {len(table)}"]
    return [word for row, (_, line) in zip(rows, table.iterrows()) for word in _differing_row(row, line)]


def _differing_points(points: PathTable, table: pd.DataFrame) -> list[str]:
    """The rows of a path's table whose times, joints, positions or orientations were read otherwise."""
    if len(points.rows) != len(table):
        return [f"{len(points.rows)} rows of {len(table)}"]

    def written(*names: str) -> np.ndarray:
        return np.array([[float(text) for text in table[name]] for name in names]).T

    differences = [] if points.times is None else [points.times - written("t_s")[:, 0]]
    if points.joints is not None:
        differences.append(np.degrees(points.joints) - written(*(f"q{joint}_deg" for joint in range(1, 7))))
    else:
        differences.append(points.poses[:, :3, 3] * 1000 - written("x_mm", "y_mm", "z_mm"))
        if "qw" in table:
            turns = Rotation.from_quat(written("qx", "qy", "qz", "qw")).as_matrix()
        else:
            turns = Rotation.from_euler("xyz", written("roll_deg", "pitch_deg", "yaw_deg"), degrees=True).as_matrix()
        differences.append((points.poses[:, :3, :3] - turns).reshape(len(turns), 9))
    worst = max(np.abs(difference).max() for difference in differences)
    return [] if worst < 1e-6 else [f"points differ by {worst:.3g}"]


def _differing_row(row: object, line: pd.Series) -> list[str]:
    """Words and numbers that are written in a line and not held by the row that was read from it."""
    held = Counter(_leaves(row))
    for name, text in line.items():
        numbers = [value for value in held if isinstance(value, int | float) and same_number(value, text)]
        candidates = [text] if held[text] else numbers
        if text and not candidates:
            return [f"column {name}: {text!r:.80} is not among {sorted(map(str, held))}"]
        if text:
            held[candidates[0]] -= 1
            held = +held
    return []


def _leaves(value: object) -> list:
    if isinstance(value, BaseModel):
        return [leaf for name in value.model_fields_set for leaf in _leaves(getattr(value, name))]
    if is_dataclass(value):
        return [
            leaf
            for field in fields(value)
            if field.name not in ("line", "row")
            for leaf in _leaves(getattr(value, field.name))
        ]
    if isinstance(value, list | tuple):
        return [leaf for part in value for leaf in _leaves(part)]
    if isinstance(value, bool):
        return ["yes" if value else "no"]
    return [] if value is None else [value]


def run(count: int, seed: int, folder: Path) -> list[tuple[str, str, bytes, Outcome]]:
    """Judge ``count`` damaged files, each among the sound ones: path, damage, content and outcome of each."""
    found, sound = [], dict(seeds())
    shutil.copytree(ROOT / "data", folder / "data", dirs_exist_ok=True)
    for name, content in sound.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    for name, content, damage in mutants(count, seed):
        path = folder / name
        path.write_bytes(content)
        found.append((name, damage, content, judge(path)))
        path.write_bytes(sound[name])
    return found
