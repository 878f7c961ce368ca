"""Reading reference sets, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import er3a
from er3a.errors import InputError
from er3a.files.reference_sets import FORMATS, check_reference_file, load_references
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward, jacobian
from er3a.references.predict import predict
from er3a.references.reference import expected_of
from er3a.robots.robot import GRADES
from testing.reference_subjects import joint_limit, pose_excess

LIMITS = "joint,lower_deg,upper_deg,uncertainty_deg,source,grade\n"
POSITIONS = "name,point,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,uncertainty_mm,source,grade\n"
AXES = "joint,direction_x,direction_y,direction_z,x_mm,y_mm,z_mm,signed,uncertainty_mm,uncertainty_deg,source,grade\n"
ENVELOPE = "quantity,q2_deg,q3_deg,value_mm,uncertainty_mm,source,grade\n"
REACH = "point,from_axis,extreme,value_mm,uncertainty_mm,source,grade\n"
SPEEDS = "joint,speed_deg_s,uncertainty_deg_s,source,grade\n"


DOCUMENTS = (
    "name,title,publisher,derived_from\nm,a manual,a maker,\ntable,a table,a maker,\ndrawing,a drawing,a maker,\n"
)


def with_origins(text: str) -> str:
    """A table whose rows name their source as their document."""
    header, *rows = text.splitlines()
    return "\n".join([f"{header},origin", *(f"{row},{row.rsplit(',', 2)[1] or 'm'}" for row in rows)]) + "\n"


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(with_origins(text), encoding="utf-8")
    (folder / "documents.csv").write_text(DOCUMENTS, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["er3a_c60", "er3a_c60_article", "er3_600"])
def test_every_committed_reference_has_source_grade_and_uncertainty(name):
    references = load_references(name)
    assert set(references.rows) <= set(FORMATS)
    for reference in references.references:
        assert reference.source
        assert reference.grade in GRADES
        assert reference.uncertainty > 0


def test_folder_and_name_give_the_same_set():
    assert load_references(Path("data/manual_refs/er3_600").resolve()) == load_references("er3_600")


def test_a_limit_that_is_not_given_is_kept_as_not_given():
    blank = [r for r in load_references("er3a_c60").references if r.expected is None]
    assert [r.subject for r in blank] == [joint_limit(6, "lower"), joint_limit(6, "upper")]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        (
            "limits.csv",
            "joint,lower_deg,upper_deg,source,grade\n1,-170,170,m,official\n",
            ["uncertainty_deg", "missing"],
        ),
        ("limits.csv", LIMITS.replace("lower_deg", "lower_rad") + "1,-2,2,0.5,m,official\n", ["lower_rad", "unit"]),
        ("limits.csv", LIMITS + "1,nan,170,0.5,m,official\n", ["row 2", "lower_deg", "finite"]),
        ("limits.csv", LIMITS + "1,-170,170,0.5,m,rumour\n", ["row 2", "grade", "official"]),
        ("limits.csv", LIMITS + "1,-170,170,0.5,,official\n", ["row 2", "source", "empty"]),
        ("limits.csv", LIMITS + "11,-170,170,0.5,m,official\n", ["row 2", "joint 11"]),
        ("limits.csv", LIMITS + "1,170,-170,0.5,m,official\n", ["row 2", "lower_deg", "Swap"]),
        ("limits.csv", LIMITS + "1,170,170,0.5,m,official\n", ["row 2", "lower_deg", "Correct one of them"]),
        ("limits.csv", LIMITS + "1,-170,170,0,m,official\n", ["row 2", "uncertainty_deg", "positive"]),
        ("limits.csv", LIMITS + "1,-2.9,2.9,0.5,m,official\n2,-1,1,0.5,m,official\n", ["radians"]),
        ("limits.csv", LIMITS + "1,-170,170,0.5,m,official\n" * 2, ["row 3", "repeats row 2"]),
        (
            "limits.csv",
            LIMITS + "1,-170,170,0.5,m,official\n1,-165,170,0.5,m,official\n",
            ["row 3", "contradicts row 2", "joint_limit(1, lower)"],
        ),
        ("limits.csv", LIMITS, ["no rows"]),
        ("speeds.csv", SPEEDS + "1,0,0.5,m,official\n", ["row 2", "speed_deg_s"]),
        (
            "positions.csv",
            POSITIONS + "zero,flange,0,0,0,,0,0,1,2,300,0.1,m,cad\n",
            ["row 2", "q4_deg", "empty"],
        ),
        ("positions.csv", POSITIONS + "zero,tip,0,0,0,0,0,0,1,2,300,0.1,m,cad\n", ["point", "wrist_centre"]),
        ("positions.csv", POSITIONS + "zero,flange,0,0,0,0,0,0,0.4,0,0.66,0.1,m,cad\n", ["metres", "1000"]),
        (
            "positions.csv",
            POSITIONS + "zero,flange,0,0,0,0,0,0,374,0,699.5,0.1,m,cad\nup,flange,0,90,0,0,0,0,0.4,0,0.66,0.1,m,cad\n",
            ["row 3", "metres", "Multiply by 1000"],
        ),
        (
            "positions.csv",
            POSITIONS + "up,flange,0,0.7854,0,0,0,0,374,0,699.5,0.1,m,cad\n",
            ["row 2, column q2_deg", "radians", "Write 45"],
        ),
        (
            "positions.csv",
            POSITIONS
            + "one,flange,0.3,0,0,0,0,0,374,0,699.5,0.1,m,cad\ntwo,flange,-0.9,0.2,1.1,0,0,0,0,400,660,0.1,m,cad\n",
            ["row 3", "can only be radians", "units_checked"],
        ),
        (
            "limits.csv",
            LIMITS + "1,-170,170,0.5,m,official\n2,-2.27,1.57,0.5,m,official\n",
            ["row 3", "radians", "Convert"],
        ),
        ("axes.csv", AXES + "1,0,0,2,0,0,0,no,0.1,0.1,m,cad\n", ["row 2", "direction_x", "unit vector"]),
        ("envelope.csv", ENVELOPE + "z,,,100,0.1,m,official\n", ["row 2", "q2_deg", "missing for z"]),
        ("envelope.csv", ENVELOPE + "least_x,5,5,-100,0.1,m,official\n", ["row 2", "q2_deg", "given"]),
        ("reach.csv", REACH + "flange,3,greatest,600,0.5,m,official\n", ["row 2", "from_axis", "1 or 2"]),
        ("limit.csv", LIMITS, ["limit.csv", "limits.csv"]),
    ],
)
def test_one_error_names_file_place_and_remedy(tmp_path, name, text, words):
    path = written(tmp_path, name, text)
    with pytest.raises(InputError) as caught:
        check_reference_file(path)
    for word in [*words, str(path)]:
        assert word in str(caught.value)


def test_sources_may_differ_but_not_contradict_themselves(tmp_path):
    rows = "1,-170,170,0.5,table,official\n1,-165,165,0.5,drawing,official\n"
    written(tmp_path, "limits.csv", LIMITS + rows)
    assert len(load_references(tmp_path).references) == 4


def test_no_table_beside_the_others_is_left_unread(tmp_path):
    written(tmp_path, "limits.csv", LIMITS + "1,-170,170,0.5,table,official\n")
    written(tmp_path, "Speeds.CSV", SPEEDS + "1,4,0.5,m,official\n")
    with pytest.raises(InputError, match=r"Speeds.CSV.*not a kind of reference table"):
        load_references(tmp_path)


def test_unknown_set_and_empty_folder(tmp_path):
    with pytest.raises(InputError, match="er3a_c60"):
        load_references("er4")
    with pytest.raises(InputError, match=r"axes\.csv"):
        load_references(tmp_path)


@pytest.mark.parametrize(
    ("documents", "limits", "words"),
    [
        (DOCUMENTS, LIMITS + "1,-170,170,0.5,m,official\n", ["limits.csv", "column origin", "missing"]),
        (DOCUMENTS, with_origins(LIMITS + "1,-170,170,0.5,m,official\n")[:-2] + "\n", ["row 2", "origin", "empty"]),
        (DOCUMENTS, with_origins(LIMITS + "1,-170,170,0.5,rumour,official\n"), ["row 2", "origin", "'rumour'"]),
        (
            DOCUMENTS.replace("a manual,a maker,", "a manual,a maker,table").replace(
                "a table,a maker,", "a table,a maker,drawing; m"
            ),
            with_origins(LIMITS + "1,-170,170,0.5,m,official\n"),
            ["documents.csv", "derived_from", "circle", "m from table from m"],
        ),
        (
            DOCUMENTS.replace("a manual,a maker,", "a manual,a maker,hearsay"),
            with_origins(LIMITS + "1,-170,170,0.5,m,official\n"),
            ["documents.csv", "row 2", "derived_from", "'hearsay'"],
        ),
        (DOCUMENTS + "m,again,a maker,\n", with_origins(LIMITS + "1,9,20,0.5,m,official\n"), ["row 5", "twice"]),
        (DOCUMENTS.replace("m,a man", "none,a man"), with_origins(LIMITS + "1,9,20,0.5,m,cad\n"), ["row 2", "'none'"]),
    ],
)
def test_documents_that_are_missing_unknown_or_made_from_each_other(tmp_path, documents, limits, words):
    (tmp_path / "documents.csv").write_text(documents, encoding="utf-8")
    (tmp_path / "limits.csv").write_text(limits, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_references(tmp_path)
    for word in words:
        assert word in str(caught.value)


def test_a_set_without_documents_is_refused(tmp_path):
    written(tmp_path, "limits.csv", LIMITS + "1,-170,170,0.5,m,official\n")
    (tmp_path / "documents.csv").unlink()
    with pytest.raises(InputError, match=r"documents\.csv"):
        load_references(tmp_path)


def test_rows_of_one_document_under_two_sources_may_not_contradict_each_other(tmp_path):
    rows = '1,-170,170,0.5,"drawing, view A",official,m\n1,-165,170,0.5,"drawing, view B",official,m\n'
    (tmp_path / "documents.csv").write_text(DOCUMENTS, encoding="utf-8")
    (tmp_path / "limits.csv").write_text(LIMITS.strip() + ",origin\n" + rows, encoding="utf-8")
    with pytest.raises(InputError, match=r"row 3.*contradicts row 2 of the same document"):
        load_references(tmp_path)


def test_standard_deviations_become_95_percent_intervals(tmp_path):
    row = "point,from_axis,extreme,value_mm,uncertainty_mm,source,grade,stated_as,origin\n"
    (tmp_path / "documents.csv").write_text(DOCUMENTS, encoding="utf-8")
    text = row + "flange,1,greatest,600,0.5,m,measured,standard_deviation,m\n"
    (tmp_path / "reach.csv").write_text(text, encoding="utf-8")
    (reference,) = load_references(tmp_path).references
    assert (reference.deviation, reference.uncertainty) == (0.5, pytest.approx(0.98, abs=1e-3))


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("observations.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,joint,point,seen,uncertainty_deg,source,grade\n"
         "0,0,0,0,0,0,5,flange,tilts_up,,m,measured\n", (0.0, 60.0)),
        ("lengths.csv", "joint,length,value_mm,uncertainty_mm,source,grade\n2,a,270,,m,measured\n", (270.0, 0.5)),
        ("angles.csv", "joint,angle,value_deg,uncertainty_deg,source,grade\n3,alpha,-90.0,,m,cad\n", (-90.0, 0.05)),
    ],
)  # fmt: skip
def test_what_is_measured_on_the_arm_itself(tmp_path, name, text, expected):
    written(tmp_path, name, text)
    (reference,) = load_references(tmp_path).references
    assert (reference.expected, reference.uncertainty) == expected
    assert np.abs(predict(load_robot("er3a_c60"), [reference]) - expected[0]) <= reference.uncertainty


def test_a_pose_that_a_source_shows_counts_as_within_the_limits_once(tmp_path):
    row = "up,{},0,90,0,0,0,0,10,0,699.5,0.1,m,cad\n"
    written(tmp_path, "positions.csv", POSITIONS + row.format("flange") + row.format("wrist_centre"))
    subjects = [reference.subject for reference in load_references(tmp_path).references]
    assert subjects.count(pose_excess("up")) == 1


@pytest.mark.parametrize(
    ("name", "text", "uncertainty"),
    [
        ("reach.csv", REACH + "flange,1,greatest,600,,m,official\n", 0.5),
        ("reach.csv", REACH + "flange,1,greatest,592.8,,m,official\n", 0.05),
        ("reach.csv", REACH + "flange,1,greatest,592.80,,m,official\n", 0.005),
        ("positions.csv", POSITIONS + "zero,flange,0,0,0,0,0,0,374,0,699.5,,m,cad\n", 0.05),
        ("limits.csv", LIMITS + "6,,,,m,export\n", 0.5),
        ("speeds.csv", SPEEDS + "1,4.0e2,,m,official\n", 5.0),
    ],
)
def test_without_uncertainty_half_the_last_digit_counts(tmp_path, name, text, uncertainty):
    (row,) = check_reference_file(written(tmp_path, name, text))
    (reference, *_) = row.references()
    assert reference.uncertainty == pytest.approx(uncertainty)


@pytest.mark.long
def test_last_digits_of_joint_values_count_through_the_jacobian(tmp_path):
    robot, random, half = load_robot("er3_600").without_tool(), np.random.default_rng(20261127), np.radians(0.005)
    q = np.radians([*random.uniform(-60, 60, (20, 6)), (0, 0, -45, 22.5, 45, 0)])
    typed = [",".join(f"{value:.2f}" for value in row) for row in np.degrees(q[:-1])] + ["0,0.0,-45,22.5,45,0"]
    points = 1000 * forward(robot, q)[:, :3, 3]
    lines = [f"p{k},flange,{row},{','.join(f'{v:.2f}' for v in points[k])},,m,cad" for k, row in enumerate(typed)]
    written(tmp_path, "positions.csv", POSITIONS + "\n".join(lines) + "\n")
    stated = [each for each in load_references(tmp_path, robot).checkable if each.unit == "mm"]
    expected, uncertainty = expected_of(stated)
    by_joints = 1000 * half * np.abs(jacobian(robot, q)[:, :3]).sum(axis=-1)
    by_joints[-1] = 0.0  # commanded
    assert uncertainty == pytest.approx(0.005 + by_joints.ravel(), rel=1e-3)
    off = np.abs(predict(robot, stated) - expected)
    assert (off > 0.01).any()
    assert (off <= uncertainty).all()
    assert er3a.diagnose(robot, load_references(tmp_path)) == []
    assert len(er3a.diagnose(robot.replace(d=robot.d + np.eye(6)[3] / 2000), load_references(tmp_path))) > 0


@pytest.mark.parametrize("by_cell", [False, True])
@pytest.mark.parametrize("name", ["ur5e", "lbr_iiwa_14"])
def test_joint_values_of_other_digits_in_each_row_or_cell_fail_no_right_arm(tmp_path, name, by_cell):
    robot, random, lines = load_robot(name).without_tool(), np.random.default_rng(20261127), []
    for k in range(48):
        q = random.uniform(robot.lower, robot.upper)
        digits = random.integers(0, 3, robot.joints if by_cell else 1) * np.ones(robot.joints, int)
        typed = [f"{value:.{count}f}" for value, count in zip(np.degrees(q), digits)]
        point = [f"{value:.3f}" for value in 1000 * forward(robot, q)[:3, 3]]
        lines.append(",".join([f"p{k},flange", *typed, *point, ",m,cad"]))
    further = "q6_deg,q7_deg" if robot.joints == 7 else "q6_deg"
    written(tmp_path, "positions.csv", POSITIONS.replace("q6_deg", further) + "\n".join(lines) + "\n")
    stated = load_references(tmp_path, robot).checkable
    expected, uncertainty = expected_of(stated)
    assert (np.abs(predict(robot, stated) - expected) <= uncertainty).all()
    longer = robot.replace(d=robot.d + 0.003 * (np.arange(robot.rows) == 3))
    assert (np.abs(predict(longer, stated) - expected) > uncertainty).sum() > 20
