"""Each recipe of CONTRIBUTING.md, carried out on a copy of the project with nothing but the files that it names.

A new stage has a module of its own, `tests/integration/test_toy_stage.py`.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from typing import get_args

import pytest
import yaml

from er3a.kinematics.classes.class_solvers import ARM_CLASSES, ArmClassCode
from er3a.pipeline.messages.kinematics import ARM_CLASSES as ARM_CLASS_WORDS
from er3a.planning.avoidance.strategies import STRATEGIES
from er3a.planning.names import StrategyName
from er3a.programs.languages import LANGUAGES
from er3a.programs.program_names import LanguageName
from er3a.selection.rule_names import RuleName
from er3a.selection.select import RULES
from testing.small_study import ROOT, environment, fresh

Edit = str | tuple[tuple[str, str], ...]
"""A new file's text, or what is replaced by what in one that is there."""
PATH = re.compile(r"`((?:er3a|data|tests)/[\w./]+)`")
CarryOut = Callable[[str, Mapping[str, Edit], str], None]


def recipe(title: str) -> str:
    """The paragraph of CONTRIBUTING.md that begins with a title."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.search(rf"^\*\*{re.escape(title)}\*\* .*?(?=\n\n)", text, re.MULTILINE | re.DOTALL)[0]


def names(title: str, path: str) -> bool:
    """Whether a recipe names a file; NAME stands for what the new thing is called."""
    named = (re.escape(each).replace("NAME", r"\w+") for each in PATH.findall(recipe(title)))
    return any(re.fullmatch(pattern + (r"\w+(\.\w+)+" if pattern.endswith("/") else ""), path) for pattern in named)


@pytest.fixture
def carry_out(tmp_path) -> CarryOut:
    """Applies edits, each to a file that the recipe names, to a copy, and runs a script there."""

    def carry_out(title: str, edits: Mapping[str, Edit], script: str) -> None:
        folder = fresh(tmp_path / "project")
        for path, edit in edits.items():
            assert names(title, path), f"the recipe '{title}' does not name {path}"
            file = folder / path
            assert file.exists() != isinstance(edit, str)
            file.parent.mkdir(parents=True, exist_ok=True)
            text = edit if isinstance(edit, str) else file.read_text(encoding="utf-8")
            for old, new in () if isinstance(edit, str) else edit:
                assert text.count(old) == 1, f"{path}: {old!r} stands there {text.count(old)} times"
                text = text.replace(old, new)
            file.write_text(text, encoding="utf-8")
        command = [sys.executable, "-c", script]
        done = subprocess.run(
            command, cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, done.stderr

    return carry_out


def test_files_that_recipes_name_are_there():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = {path for path in PATH.findall(text) if "NAME" not in path}
    assert len(named) > 20
    assert [path for path in sorted(named) if not (ROOT / path).exists()] == []


def test_a_stage_is_made_of_files_that_its_recipe_names():
    text = (ROOT / "tests/integration/test_toy_stage.py").read_text(encoding="utf-8")
    made = re.findall(r'^    "(pipeline/[\w./]+)":', text, re.MULTILINE)
    assert len(made) == 7
    for path in (*(f"er3a/{each}" for each in made), "er3a/pipeline/stages/registry.py"):
        inside = "er3a/pipeline/stages/toy/"
        file = path.removeprefix(inside)
        assert f"`{file}`" in recipe("A stage.") if path.startswith(inside) else names("A stage.", path)


def test_each_name_has_its_entry():
    assert list(LANGUAGES) == list(get_args(LanguageName))
    assert list(RULES) == list(get_args(RuleName))
    assert set(ARM_CLASSES) == set(ARM_CLASS_WORDS) == set(get_args(ArmClassCode))
    assert [*STRATEGIES, "planned"] == list(get_args(StrategyName))  # around bodies, by AvoidanceTask


def test_the_hook_checks_the_files_of_every_language():
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    pattern = next(each["files"] for each in hooks if each["id"] == "er3a-check-program")
    suffixes = [suffix for name, each in LANGUAGES.items() if name != "csv" for suffix in each.suffixes]
    assert [suffix for suffix in suffixes if not re.search(pattern, f"cell/pick{suffix}")] == []
    assert not re.search(pattern, "cell/cell.yaml")


@pytest.mark.long
def test_a_kind_of_reference(carry_out):
    row = '''@dataclass(frozen=True)
class HeightRow(Row):
    """How high the flange stands with all joints at 0."""

    kind: ClassVar[str] = "heights"
    groups: ClassVar[tuple[str, ...]] = ("zero_pose",)
    height_mm: float
    uncertainty_mm: float

    def scalars(self) -> Iterator[Scalar]:
        quantity = quantities.PointCoordinate(quantities.ZERO_POSE, "flange", "z")
        yield subjects.PointAtPose("zero", "flange", "z"), "zero_pose", quantity, self.height_mm, self.uncertainty_mm


KINDS: dict'''
    table = """    "heights": Format({"height_mm": _NUMBER, "uncertainty_mm": _OPTIONAL}, digits=("height_mm",)),
    "angles": Format("""
    edits = {
        "er3a/references/rows.py": (
            ("KINDS: dict", row),
            ("        AngleRow,\n    )", "        AngleRow,\n        HeightRow,\n    )"),
        ),
        "er3a/files/reference_sets.py": (('    "angles": Format(', table),),
        "data/manual_refs/README.md": (
            ("| `lengths.csv`", "| `heights.csv` | how high the flange is |\n| `lengths.csv`"),
        ),
    }
    script = """
from pathlib import Path
import er3a
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.pipeline.messages.references import say
from er3a.references.predict import predict

folder = Path("heights")
folder.mkdir()
text = "height_mm,uncertainty_mm,source,grade,origin\\n642.5,,a ruler,measured,notes\\n"
(folder / "heights.csv").write_text(text)
(folder / "documents.csv").write_text("name,title,publisher,derived_from\\nnotes,Notes,me,\\n")
(reference,) = load_references(folder).references
assert (reference.group, reference.expected, reference.uncertainty) == ("zero_pose", 642.5, 0.05)
robot = load_robot("er3_600")
expected = er3a.forward(robot.without_tool(), robot.lower * 0)[2, 3] * 1000
assert abs(predict(robot, [reference])[0] - expected) < 1e-9
assert "flange" in say(reference.subject)
"""
    carry_out("A kind of reference.", edits, script)


@pytest.mark.long
def test_an_error_term_of_calibrate(carry_out):
    branch = """        if self.kind == "bent":
            return own[:, None] ** 2
        if self.kind == "sag":"""
    edits = {
        "er3a/calibration/terms.py": (
            ('"ripple", "coupling"]', '"ripple", "coupling", "bent"]'),
            ('        if self.kind == "sag":', branch),
        ),
        "er3a/pipeline/messages/calibration.py": (
            ('    "ratio": N_("ratio"),', '    "ratio": N_("ratio"),\n    "bent": N_("bent"),'),
        ),
    }
    script = """
import numpy as np
from er3a.calibration.terms import FOR_ALL_JOINTS, JointErrors, JointTerm, candidates, terms_of
from er3a.files.robot_library import load_robot
from er3a.pipeline.messages.calibration import term_name

robot = load_robot("er3_600")
term = JointTerm("bent", 2)
assert term in candidates(robot) and term in terms_of(robot)
for kinds, missing in zip(FOR_ALL_JOINTS, ((), ("coupling",), ("coupling", "ripple"))):
    assert "bent" in kinds and not {*missing} & {*kinds}
x = np.full((3, 6), 0.5)
amounts = JointErrors(robot, (term,), np.array([2e-3])).amounts(x, np.zeros((3, 3)))
np.testing.assert_allclose(amounts, np.full((3, 1), 5e-4) * (np.arange(6) == 1))
assert term_name(term) == "J2 bent"
"""
    carry_out("An error term of `er3a calibrate`.", edits, script)


@pytest.mark.long
def test_a_rule_that_ranks_solutions(carry_out):
    measure = """def _base_move(robot: Robot, q: Reals, q_ref: Reals, scene: Scene | None) -> Reals:
    return np.degrees(np.abs(q - q_ref)[..., 0])


RULES: dict"""
    edits = {
        "er3a/selection/rule_names.py": (('"clearance"]', '"clearance", "base_at_rest"]'),),
        "er3a/selection/select.py": (
            ("RULES: dict", measure),
            ('    "clearance": Rule(', '    "base_at_rest": Rule("deg", "least", _base_move),\n    "clearance": Rule('),
        ),
    }
    script = """
import re
from pathlib import Path
import numpy as np
import er3a
from er3a.pipeline.messages import language
from er3a.pipeline.messages.kinematics import say
from er3a.pipeline.stages.inverse.entry import InverseSettings
from er3a.pipeline.study import load_study
from er3a.selection.select import select

text = Path("config/small.yaml").read_text()
Path("config/own.yaml").write_text(re.sub("mix: .*", "mix: {base_at_rest: 2, time: 1}", text))
study = load_study("config/own.yaml")
assert study.section(InverseSettings).mix == {"base_at_rest": 2, "time": 1}

robot = er3a.load_robot("er3_600")
reference = np.radians([40.0, 10.0, -20.0, 30.0, 50.0, 20.0])
solutions = er3a.inverse(robot, er3a.forward(robot, np.radians([10.0, 20.0, -30.0, 40.0, 50.0, 60.0])), reference)
ranking = select(robot, solutions, "base_at_rest", reference)
moves = np.degrees(np.abs(solutions.q[:, 0] - reference[0]))
assert len(ranking.order) > 1
assert (np.diff(moves[ranking.order]) > -1e-9).all()
for code in ("en", "zh"):
    language.use(code)
    assert "base_at_rest" in say(ranking.chosen_reason)
"""
    carry_out("A rule that ranks solutions.", edits, script)


@pytest.mark.long
def test_a_strategy_of_singularity_avoidance(carry_out):
    module = '''"""Wait at the start."""

from __future__ import annotations

from er3a.planning.avoidance.avoidance import BeginsInRegion, NotPossible
from er3a.planning.avoidance.avoidance import Avoidance, SingularSegment


def wait(segment: SingularSegment) -> Avoidance | NotPossible:
    """Do the first tenth of the path alone."""
    last = len(segment.t) // 10
    return Avoidance(segment.along(0, last), done=0.1) if segment.good[:last].all() else BeginsInRegion()
'''
    edits = {
        "er3a/planning/names.py": (('"planned"]', '"wait", "planned"]'),),
        "er3a/planning/avoidance/wait.py": module,
        "er3a/planning/avoidance/strategies.py": (
            ('    "stop": stop,\n', '    "stop": stop,\n    "wait": wait,\n'),
            (
                "from er3a.planning.follow import",
                "from er3a.planning.avoidance.wait import wait\nfrom er3a.planning.follow import",
            ),
        ),
    }
    script = """
import re
from pathlib import Path
import numpy as np
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.singularity import NearSingular
from er3a.pipeline.messages.trajectory import strategy_word
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.study import load_study
from er3a.planning.avoidance.avoidance import singular_segment
from er3a.planning.avoidance.strategies import compare_strategies
from er3a.planning.follow import follow
from er3a.planning.moves import line
from er3a.planning.timing import joint_limits

text = Path("config/small.yaml").read_text()
Path("config/own.yaml").write_text(re.sub("avoidance: .*", "avoidance: wait", text))
assert load_study("config/own.yaml").section(TrajectorySettings).avoidance == "wait"

robot = load_robot("er3a_c60")
forward = [0, np.pi / 2, 0]
way = line(transform([0.4, -0.15, 0.65], forward), transform([0.4, 0.15, 0.65], forward), 4.0)
followed = follow(robot, way, np.linspace(0, 4, 400))
near = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
segment = singular_segment(followed, near, joint_limits(robot, np.radians([180] * 6), 0.25))
(result,) = compare_strategies(segment, "wait")
assert result.cost.done == 0.1
assert [reason.code for reason in result.reasons] == ["path_not_finished"]
assert strategy_word("wait") == "wait"
"""
    carry_out("A strategy of singularity avoidance.", edits, script)


def test_what_chinese_alone_needs_stands_where_pages_are_set():
    files = [path for part in ("er3a", "workflow") for path in (ROOT / part).rglob("*.*") if path.suffix != ".po"]
    texts = {path.name: path.read_text("utf-8") for path in files if path.suffix in (".py", ".j2", ".smk")}
    named = {name for name, text in texts.items() if '"zh"' in text}
    assert named == {"language.py", "page.py", "figures.py", "base.html.j2"}


@pytest.mark.long
def test_a_language_of_pages(carry_out):
    edits = {
        "er3a/pipeline/messages/language.py": (('Literal["en", "zh"]', 'Literal["en", "zh", "de"]'),),
        "er3a/pipeline/messages/locale/de/LC_MESSAGES/er3a.po": "",
    }
    script = """
import subprocess, sys
from pathlib import Path
from er3a.pipeline.messages import language
from er3a.pipeline.messages.language import tr
from er3a.pipeline.study import ReportSettings, load_study

subprocess.run(["make", "words", f"BIN={Path(sys.executable).parent}", "-o", ".venv/dev.stamp"], check=True)
file = language.catalogue_file("de")
text, entry = file.read_text(), '\\nmsgid "time (s)"\\nmsgstr "'
assert text.count(entry + '"') == 1
file.write_text(text.replace(entry, entry + "Zeit (s)"))
assert load_study("config/article.yaml").article_pages()["de"] == "article_de.html"
language.use(ReportSettings(language="de").language)
assert tr("time (s)") == "Zeit (s)"
assert tr("distance / threshold") == "distance / threshold"
"""
    carry_out("A language of pages.", edits, script)


@pytest.mark.long
def test_a_language_of_robot_programs(carry_out):
    reader = '''"""Reads plain programs: GO and six angles in degrees."""

from __future__ import annotations

import numpy as np

from er3a.programs.code_builder import CodeBuilder
from er3a.programs.instructions import ArmMotion, JointTarget, Place, Rate
from er3a.programs.lexing import ProgramText
from er3a.programs.syntax import Fixed, Program


def read_plain(source: ProgramText) -> Program:
    """The program of a .plain file."""
    builder = CodeBuilder("MAIN", (), Place(source.path, 1))
    for number, line in enumerate(source.lines, 1):
        words, place = line.split(), Place(source.path, number)
        if words[:1] == ["GO"]:
            target = JointTarget(np.radians([float(word) for word in words[1:]]))
            builder.add(Fixed(place, ArmMotion("joint", target, "GO", speed=Rate(0.5, "share"))))
        elif words:
            builder.unknown(place, line)
    routine = builder.routine(Place(source.path, len(source.lines)))
    return Program("plain", source.path.stem, source.path, {"MAIN": routine}, "MAIN", lines=source.lines)
'''
    writer = '''"""Writes plain programs."""

from __future__ import annotations

import numpy as np

from er3a.programs.instructions import Output, Pause
from er3a.programs.writing import ReadyMotion, Writer, fixed


class PlainWriter(Writer):
    """Writes GO and six angles."""

    languages = ("plain",)

    def files(self, head: list[str]) -> dict[str, str]:
        return {".plain": "\\n".join((*self.lines, ""))}

    def motion(self, ready: ReadyMotion) -> None:
        if ready.joints is None:
            self.omit(ready.motion)
        else:
            self.lines.append(" ".join(("GO", *(fixed(each, 4) for each in np.degrees(ready.joints).tolist()))))

    def begin_loop(self) -> None: ...

    def end_loop(self) -> None: ...

    def comment(self, text: str) -> None: ...

    def pause(self, pause: Pause) -> None: ...

    def output(self, output: Output) -> None: ...

    def verbatim(self, text: str) -> None: ...
'''
    record = '''"""Plain programs among the languages."""

from __future__ import annotations

import re

from er3a.programs.program_language import SIX_ANGLES, Language
from er3a.programs.plain.reader import read_plain
from er3a.programs.plain.writer import PlainWriter
from er3a.programs.rpl.dialect import RplDialect

PLAIN = Language("PLAIN", (".plain",), re.compile(r"(?m)^GO "), read_plain, RplDialect, PlainWriter, SIX_ANGLES)
'''
    edits = {
        "er3a/programs/program_names.py": (('"rapid", "csv"]', '"rapid", "csv", "plain"]'),),
        "er3a/programs/plain/__init__.py": "",
        "er3a/programs/plain/language.py": record,
        "er3a/programs/plain/reader.py": reader,
        "er3a/programs/plain/writer.py": writer,
        "er3a/programs/languages.py": (
            ('    "csv": CSV', '    "plain": PLAIN,\n    "csv": CSV'),
            (
                "from er3a.programs.program_findings",
                "from er3a.programs.plain.language import PLAIN\nfrom er3a.programs.program_findings",
            ),
        ),
    }
    script = """
import subprocess, sys
from pathlib import Path
import numpy as np
import er3a
from er3a.pipeline.check import check_file
from er3a.pipeline.study import load_study
from er3a.pipeline.settings import TrajectorySettings

Path("moves.plain").write_text("GO 0 10 -20 0 30 0\\nGO 10 10 -20 5 30 0\\n")
program = er3a.read_program("moves.plain")
assert program.language == "plain"
robot = er3a.load_robot("er3_600")
listing = er3a.execute(program, robot).listing()
written = er3a.write_program(listing, "plain", er3a.WriteOptions(robot))
Path("again.plain").write_text(written.files[".plain"])
again = er3a.execute(er3a.read_program("again.plain"), robot).listing()
joints = [motion.target.joints for motion in listing.motions]
assert len(joints) == 2
np.testing.assert_allclose([motion.target.joints for motion in again.motions], joints, atol=1e-6)
assert "PTP" in er3a.write_program(listing, "krl", er3a.WriteOptions(robot)).files[".src"]
assert check_file(Path("moves.plain")) == "a robot program"
text = Path("config/small.yaml").read_text()
Path("config/own.yaml").write_text(text.replace("\\ntrajectory:", "\\ntrajectory:\\n  programs: [plain]", 1))
assert load_study("config/own.yaml").section(TrajectorySettings).programs == ["plain"]
words = ["program", "write", "none.yaml", "--robot", "er3_600", "--language"]
known = subprocess.run([sys.executable, "-m", "er3a", *words, "other"], capture_output=True, text=True).stderr
assert "'plain'" in known, known
checked = subprocess.run([sys.executable, "-m", "er3a", "check-program", "moves.plain", "--robot", "er3_600"])
assert checked.returncode == 0
"""
    carry_out("A language of robot programs.", edits, script)


@pytest.mark.long
def test_a_class_of_arm_in_closed_form(carry_out):
    module = '''"""One joint that turns."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import inverse_rigid, poses_of
from er3a.numerics.arrays import Reals

MISSED = 1e-6


def solve_turntable(links: Reals, T: Reals) -> Reals:
    """The angle (N, 1) that takes the chain to poses (N, 4, 4); NaN where there is none."""
    turn = inverse_rigid(links[0]) @ T @ inverse_rigid(links[1])
    q = np.arctan2(turn[:, 1, 0], turn[:, 0, 0])[:, None]
    missed = np.abs(np.array([poses_of(links, each) for each in q]) - T).max(axis=(1, 2))
    return np.where(missed[:, None] < MISSED, q, np.nan)
'''
    solver = '''@dataclass(frozen=True, eq=False)
class Turntable(WithoutParameters):
    """One joint that turns."""

    links: Reals
    code: ArmClassCode = "turntable"
    slots: int = 1

    def rows(self, T: Reals, values: Reals) -> tuple[Reals, Integers]:
        return solve_turntable(self.links, T)[:, None], np.full(len(T), CERTAIN)


@dataclass(frozen=True, eq=False)
class ScaraSolver('''
    edits = {
        "er3a/kinematics/classes/turntable.py": module,
        "er3a/kinematics/classes/class_solvers.py": (
            ('    "unsolved",\n]', '    "unsolved",\n    "turntable",\n]'),
            ('    "dependent": Arm', '    "turntable": ArmClassTraits(closed_form=True),\n    "dependent": Arm'),
            ("@dataclass(frozen=True, eq=False)\nclass ScaraSolver(", solver),
            (
                "from er3a.kinematics.closed_form",
                "from er3a.kinematics.classes.turntable import solve_turntable\nfrom er3a.kinematics.closed_form",
            ),
        ),
        "er3a/kinematics/classes/chain_solvers.py": (
            (
                "    _as_scara,\n",
                "    _as_scara,\n"
                "    lambda links, slide: class_solvers.Turntable(links) if slide.tolist() == [False] else None,\n",
            ),
        ),
    }
    script = """
import numpy as np
import er3a
from er3a.pipeline.messages.kinematics import say
from er3a.robots.robot import Robot

one = np.ones(1)
robot = Robot("made", "made", "standard", 0.3 * one, 0 * one, 0.2 * one, one, 0 * one, -3 * one, 3 * one)
for angle in (-2.0, 0.4, 1.5):
    found = er3a.inverse(robot, er3a.forward(robot, angle * one), 0 * one)
    assert found.method.arm_class == "turntable"
    np.testing.assert_allclose(found.q, [[angle]], atol=1e-12)
assert "turntable" in say(found.method)
missed = er3a.forward(robot, one)
missed[2, 3] += 0.1
assert len(er3a.inverse(robot, missed, 0 * one).q) == 0
"""
    carry_out("A class of arm in closed form.", edits, script)


@pytest.mark.long
def test_a_column_and_its_plot(carry_out):
    column = """    mass_kg: Reals = column("mass of the load")
    weight_n: Reals = column("weight of the load at rest", heading=N_("weight at rest"))
"""
    values = """        across_mm=1000 * diagram.across[:, :last].ravel(),
        weight_n=gravity * np.repeat(diagram.mass, last),
"""
    plot = '''def weight_figure(rows: DiagramRows):
    """The loads' weights."""
    figure, ax = new_figure(1, 1)
    ax.plot(rows.along_mm, rows.weight_n)
    ax.set_xlabel(axis_label(rows, "along_mm"))
    ax.set_ylabel(axis_label(rows, "weight_n"))
    return figure


def diagram_figure('''
    folder = "er3a/pipeline/stages/dynamics"
    edits = {
        f"{folder}/model.py": ((column.splitlines(keepends=True)[0], column),),
        f"{folder}/compute.py": ((values.splitlines(keepends=True)[0], values),),
        f"{folder}/report.py": (("def diagram_figure(", plot),),
    }
    script = """
from dataclasses import replace
from pathlib import Path
import numpy as np
import pyarrow.parquet as pq
from er3a.files.robot_library import load_robot
from er3a.pipeline.dictionary import data_dictionary
from er3a.pipeline.messages import language
from er3a.pipeline.stages.dynamics.compute import diagram_rows
from er3a.pipeline.stages.dynamics.model import DiagramRows
from er3a.pipeline.stages.dynamics.report import weight_figure
from er3a.robots.masses import WristLoad

robot = load_robot("er3_600")
wrist = WristLoad(3.0, moment=((5, 6.0), (6, 4.0)))
rows = diagram_rows(robot.replace(masses=replace(robot.masses, wrist=wrist)), None, 9.81)
assert len(rows)
np.testing.assert_allclose(rows.weight_n, 9.81 * rows.mass_kg)
rows.write(Path("rows.parquet"))
assert DiagramRows.read(Path("rows.parquet").read_bytes()) == rows
assert pq.read_schema("rows.parquet").field("weight_n").metadata[b"unit"] == b"N"
assert "weight of the load at rest" in data_dictionary()
for code, label in (("en", "weight at rest (N)"), ("zh", "weight at rest（N）")):
    language.use(code)
    (axes,) = weight_figure(rows).axes
    assert axes.get_ylabel() == label
assert axes.get_xlabel().endswith("（mm）")
"""
    carry_out("A column, and its plot.", edits, script)


@pytest.mark.long
def test_a_setting(carry_out):
    """Of two stages: a class under a key of its own, which both list; all others keep what they are computed from."""
    settings = "from er3a.pipeline.settings import TrajectorySettings\n"
    both = settings.replace("import T", "import FixtureSettings, T")
    fixture = """


class FixtureSettings(StrictModel):
    \"\"\"``height_mm``: of the fixture that the arm stands on.\"\"\"

    height_mm: Annotated[float, Field(ge=0, le=10_000)] = 0
"""
    last = "    write_unsafe: bool = False\n"
    edits = {"er3a/pipeline/settings.py": ((last, last + fixture),)}
    for stage, own in (("inverse", "InverseSettings"), ("dynamics", "DynamicsSettings")):
        listed = f'settings={{"{stage}": {own}, '
        edits[f"er3a/pipeline/stages/{stage}/entry.py"] = (
            (settings, both),
            (listed, listed + '"fixture": FixtureSettings, '),
        )
    script = """
import yaml
from er3a.pipeline.settings import FixtureSettings
from er3a.pipeline.study import STAGES, load_study

from pathlib import Path

def computed(height):
    content = yaml.safe_load(Path("config/small.yaml").read_text())
    content["fixture"] = {"height_mm": height} if height is not None else {}
    Path("fixture.yaml").write_text(yaml.safe_dump(content))
    study = load_study("fixture.yaml")
    assert study.section(FixtureSettings).height_mm == (height or 0)
    return {stage: study.computed_from("er3a_c60", stage) for stage in STAGES}

before, after = computed(None), computed(25.0)
assert {stage for stage in STAGES if before[stage] != after[stage]} == {"inverse", "dynamics"}
try:
    computed(-1.0)
except Exception as error:
    assert "fixture.height_mm" in str(error), error
else:
    raise AssertionError
"""
    carry_out("A setting.", edits, script)


@pytest.mark.long
def test_a_finding(carry_out):
    """Another suspect sample of a hand-eye calibration, in both languages."""
    finding = '''class LateSample(Finding):
    """The board was seen some time after the arm had its pose."""

    sample: str
    late_s: float


Suspect = LateSample | RotationMismatch'''
    text = '        "late_sample": "{sample}: seen {late_s:.2f} s after the arm was there",\n'
    translated = 'msgctxt "key"\nmsgid "late_sample"\nmsgstr "{sample}：晚了 {late_s} s"\n\n'
    first, anchor = (
        '        "far_from_fit": (\n',
        "#. {sample}: {off_mm:.3g} mm and {off_deg:.2g} deg from what the other samples\n",
    )
    edits = {
        "er3a/vision/vision_findings.py": (("Suspect = RotationMismatch", finding),),
        "er3a/pipeline/messages/vision.py": ((first, text + first),),
        "er3a/pipeline/messages/locale/zh/LC_MESSAGES/er3a.po": ((anchor, translated + anchor),),
    }
    script = """
from typing import get_args

from er3a.pipeline.messages import vision
from er3a.pipeline.messages.language import using
from er3a.pipeline.messages.say import say
from er3a.vision.vision_findings import LateSample, Suspect

assert LateSample in get_args(Suspect)
found = LateSample("shot_7", 0.5)
assert found.code == "late_sample"
assert say(found) == "shot_7: seen 0.50 s after the arm was there"
with using("zh"):
    assert say(found) == "shot_7：晚了 0.50 s", say(found)
"""
    carry_out("A finding.", edits, script)


@pytest.mark.long
def test_a_command(carry_out):
    command = '''@options.app.command(rich_help_panel=options.FIRST)
def robots(study: options.StudyFile = options.DEFAULT_STUDY):
    """Print the robots of a study."""
    from er3a.pipeline.study import load_study

    options.print_table(("robot", "joints"), [("er3_600", str(load_study(study).robot("er3_600").joints))])


@options.app.command(rich_help_panel=options.FIRST)
def verdicts(
'''
    anchor = "@options.app.command(rich_help_panel=options.FIRST)\ndef verdicts(\n"
    script = """
import subprocess
import sys

def er3a(*words):
    return subprocess.run([sys.executable, "-m", "er3a", *words], capture_output=True, text=True)

done = er3a("robots", "--study", "config/small.yaml")
words = [word for word in done.stdout.split() if word.isascii()]
assert (done.returncode, words) == (0, ["robot", "joints", "er3_600", "6"]), done.stdout + done.stderr
assert "Print the robots of a study." in er3a("--help").stdout
missing = er3a("robots", "--study", "no.yaml")
assert (missing.returncode, missing.stdout) == (2, "")
assert "no.yaml" in missing.stderr
"""
    carry_out("A command.", {"er3a/pipeline/commands/studies.py": ((anchor, command),)}, script)


@pytest.mark.long
def test_a_shape_of_a_scene(carry_out):
    solid = '''@dataclass(frozen=True, eq=False)
class Capsule(ByValue):
    """A rod with round ends about its own middle, along its z axis.

    Attributes
    ----------
    T : (4, 4), T_world_capsule; radius, length : m, the length without the ends
    """

    name: str
    T: Reals
    radius: float
    length: float

    @property
    def measures(self) -> str:
        """Where it is, radius and length, in mm."""
        return f"{_place(self.T)}; radius {1000 * self.radius:.6g}, length {1000 * self.length:.6g}"


Solid = Box | Capsule | Cylinder | Sphere | Plane | Mesh'''
    body = """        case Capsule():
            half = solid.length / 2
            points, radius, kind, disc = np.array([[0, 0, -half], [0, 0, half]]), solid.radius, HULL, 0.0
        case Sphere():
"""
    model = '''class CapsuleObstacle(CylinderObstacle):
    """A rod with round ends along its own z axis."""

    def solid(self) -> library.Capsule:
        """In the units of the library."""
        return library.Capsule(self.name, self.place(), self.radius_mm / 1000, self.length_mm / 1000)


class MeshObstacle(Obstacle):
'''
    words = """            case Capsule():
                size = tr("capsule ⌀ {wide:g} × {long:g}", wide=2000 * each.radius, long=1000 * each.length)
            case Sphere():
"""
    imports = ("scene import Box, Cylinder", "scene import Box, Capsule, Cylinder")
    key = "    cylinders: list[CylinderObstacle] = []\n    spheres: list[SphereObstacle] = []\n"
    added = key + "    capsules: list[CapsuleObstacle] = []\n"
    edits = {
        "er3a/collision/scene.py": (("Solid = Box | Cylinder | Sphere | Plane | Mesh", solid),),
        "er3a/collision/shapes.py": (imports, ("        case Sphere():\n", body)),
        "er3a/files/scene_file.py": (
            ('SHAPES = ("boxes", "cylinders",', 'SHAPES = ("boxes", "capsules", "cylinders",'),
            ("class MeshObstacle(Obstacle):\n", model),
            (f"{key}    meshes", f"{added}    meshes"),
            (f"{key}    planes", f"{added}    planes"),
        ),
        "er3a/pipeline/messages/collision.py": (imports, ("            case Sphere():\n", words)),
    }
    script = """
import dataclasses
from pathlib import Path

import numpy as np

import er3a
from er3a.collision.convex import distances_from_hull
from er3a.collision.scene import Scene
from er3a.collision.shapes import hull_faces, solid_bodies, solid_pieces
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.pipeline.messages.collision import solid_rows
from er3a.pipeline.player.player import scene_data
from er3a.pipeline.player.turning import scene_layers
from er3a.pipeline.stages.workspace.capability_section import outlines
from er3a.pipeline.viewing.arm import solid_shapes

Path("cell.yaml").write_text(
    "kind: scene\\ntitle: a cell\\ncapsules:\\n"
    "- {name: pipe, xyz_mm: [500, 0, 400], rpy_deg: [90, 0, 0], radius_mm: 50, length_mm: 400}\\n"
    "carried: {capsules: [{name: rod, xyz_mm: [0, 0, 50], radius_mm: 10, length_mm: 80}]}\\n"
)
scene, robot = load_scene("cell.yaml"), load_robot("er3_600")
(pipe,) = scene.solids
low, high = np.array([0.45, -0.25, 0.35]), np.array([0.55, 0.25, 0.45])
np.testing.assert_allclose(np.abs(np.array(pipe.T)[:3, 2]), [0, 1, 0], atol=1e-12)

# A ball 300 mm beside the pipe is as far from it as lines and radii say.
(core,) = solid_bodies(pipe)
distance = np.empty(1)
distances_from_hull(np.array([[0.2, 0.1, 0.4]]), core.points, distance)
assert abs(distance[0] - core.radius - 0.25) < 1e-9
q = np.random.default_rng(7).uniform(robot.lower, robot.upper, (300, 6))
thinner = Scene("the same, thinner", (dataclasses.replace(pipe, radius=0.04),), scene.carried)
thick, thin = (er3a.clearance(robot, q, each) for each in (scene, thinner))
of_pipe = np.array([thick.pair[i] is not None and "pipe" in thick.pair[i].names for i in range(300)])
chosen = of_pipe & (thick.distance > 0) & (thin.distance - thick.distance > 0.009)
assert chosen.sum() > 20
np.testing.assert_allclose((thin.distance - thick.distance)[chosen].max(), 0.01, atol=1e-9)

assert solid_rows(scene) == [["pipe", "capsule ⌀ 100 × 400", "(500, 0, 400)"]]
(piece,) = solid_pieces(pipe)
near = {"atol": 2e-3}  # its ends are drawn by corners
np.testing.assert_allclose([piece.min(axis=0), piece.max(axis=0)], [low, high], **near)
(outline,) = outlines(pipe, [0, 2])
np.testing.assert_allclose([outline.min(axis=0), outline.max(axis=0)], [low[[0, 2]], high[[0, 2]]], **near)
(layer,) = scene_layers(scene)
seen = layer.points_mm[np.isfinite(layer.points_mm).all(axis=1)] / 1000
np.testing.assert_allclose([seen.min(axis=0), seen.max(axis=0)], [low, high], **near)
(drawn,) = scene_data(scene.solids)
corners, faces = np.array(drawn["points"]), np.array(drawn["faces"])
a, b, c = corners[faces].transpose(1, 0, 2)
volume = np.einsum("ij,ij->", a - pipe.T[:3, 3], np.cross(b - a, c - a)) / 6
exact = np.pi * 0.05**2 * (0.4 + 4 / 3 * 0.05)
assert 0.96 < volume / exact < 1, volume / exact
((name, _, _),) = solid_shapes(scene.solids, robot, (1, 2, 3, 255))
assert name == "pipe"
"""
    carry_out("A shape of a scene.", edits, script)
