"""What documents settle of a table: the shipped robots, changed ones, foreign ones, against independent computation."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

import er3a
from er3a.diagnosis.diagnose import diagnosis_of
from er3a.errors import InputError
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.finding import Finding, is_one
from er3a.identifiability.alternatives import reversed_about
from er3a.identifiability.continuous import Extent
from er3a.identifiability.entries import continuous_of, entries_of
from er3a.identifiability.entry_evidence import Evidence, Tolerance
from er3a.identifiability.evidence import NOT_OFF, evidence_of
from er3a.identifiability.proposals import proposals_of
from er3a.kinematics.table_batch import robot_of, tables_of
from er3a.pipeline.results import read_results
from er3a.pipeline.stages.validation.checks import parts_found
from er3a.pipeline.stages.validation.model import RESULTS
from er3a.pipeline.study import load_study
from er3a.references.quantities import Limit, PointCoordinate, QuantityAtPose
from er3a.references.reference import Document, Documents, Reference
from er3a.robots.robot import Robot
from testing.made_once import made_once
from testing.proposed_measurements import measured
from testing.reference_subjects import joint_limit, point_at_pose

TRACKER = ("tracker", "measured", "tracker")
SETTLED = ("settled", "settled_up_to_signs")
LENGTHS = ("a1", "a2", "a3", "d1", "d4", "d6")


@cache
def evidence(name: str) -> Evidence:
    return made_once(f"evidence_{name}", lambda: er3a.evidence(load_robot(name)))


def about(robot: Robot, *only: str, extra: tuple[Reference, ...] = ()) -> Evidence:
    """Evidence about some entries, from the sets that the robot's file names and further references."""
    sets = [load_references(name) for name in robot.references]
    documents = {name: document for each in sets for name, document in each.documents.by_name.items()}
    stated = [reference for each in sets for reference in each.references]
    every = [*stated, *extra]
    corrected = [each.corrected for each in diagnosis_of(robot, every)[:1] if each.explains]
    return evidence_of(robot, every, Documents(documents), only=only, corrected=corrected)


def changed(robot: Robot, entry: str, by: float) -> Robot:
    """A robot with one entry changed by an amount in its unit."""
    found = next(each for each in entries_of(robot) if each.name == entry)
    column = getattr(robot, found.column).copy()
    column[found.joint - 1] += by / found.in_unit
    return robot.replace(**{found.column: column})


def turned(robot: Robot, *joints: int) -> Robot:
    """A robot with joints reversed."""
    signs = np.array([-1.0 if joint in joints else 1.0 for joint in range(1, 7)])
    return robot.replace(direction=robot.direction * signs)


@pytest.mark.long
def test_signs_that_no_document_fixes_are_open():
    found = evidence("er3_600")
    for joint in (1, 4, 5, 6):
        assert found[f"direction{joint}"].status == "open"
        (reading,) = [each for each in found[f"direction{joint}"].alternatives if each.off.moves]
        assert reading.entries == ((f"direction{joint}", -1.0),)
    assert found["direction5"].off.mm == pytest.approx(2 * 78.5)
    same = [{name for name, _ in each.entries} for each in found["direction5"].alternatives if not each.off.moves]
    assert {"direction5", "offset4", "offset6"} in same


@pytest.mark.parametrize("name", ["er3_600", "er3a_c60"])
@pytest.mark.parametrize("joint", [2, 3, 5])
def test_a_joint_reversed_about_an_angle_stands_there_as_before_and_mirrored_beside_it(name, joint):
    robot, about, moved = load_robot(name), 30.0, 0.2
    flip = reversed_about(joint - 1, about)
    other = robot_of(flip.undone(tables_of(robot)), 0, robot)
    q = np.tile(np.radians([10.0, 20.0, -15.0, 40.0, 25.0, 5.0]), (3, 1))
    q[:, joint - 1] = np.radians(about) + np.array([0.0, moved, -moved])
    np.testing.assert_allclose(er3a.forward(other, q), er3a.forward(robot, q[[0, 2, 1]]), atol=1e-12)
    assert flip.entries == (f"direction{joint}", f"offset{joint}")


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3_600", "er3a_c60"])
def test_lengths_along_parallel_axes_mean_something_together_only(name):
    found = evidence(name)
    for entry in ("d2", "d3"):
        assert found[entry].status == "gauge"
        shifts = [dict(each.entries) for each in found[entry].alternatives if not each.off.moves]
        assert {"d2": 5.0, "d3": -5.0} in [{k: round(v, 6) for k, v in each.items()} for each in shifts]
    assert [each.entry for each in found.combinations] == ["d2 + d3"]


@pytest.mark.long
def test_what_the_second_cad_model_settles_of_the_er3a_c60():
    found = evidence("er3a_c60")
    for entry in LENGTHS:
        assert found[entry].status in SETTLED
        assert found[entry].by == ("vrml_2020",)
        low, high = found[entry].interval
        assert low < found[entry].value < high < found[entry].value + 1
    for joint in range(1, 7):
        direction = found[f"direction{joint}"]
        assert direction.status == "consistent"
        assert [each.excluded_by for each in direction.alternatives if each.off.moves] == [("urdf_2017",)]
    assert found["offset6"].status == found["alpha6"].status == "open"  # nothing shows how the flange is turned
    assert found["upper6"].status == "consistent"
    assert found["base"].status == found["tool"].status == "given"


@pytest.mark.long
def test_the_table_read_from_the_step_model_is_consistent_with_it():
    found = evidence("er3_600")
    assert {found[entry].status for entry in ("d1", "d6", "a5", "alpha4", "offset5")} == {"consistent"}
    assert {found[entry].status for entry in ("a1", "a2", "offset2")} == {"weak"}  # by the drawing: arms askew meet it
    assert found["a2"].by == ("drawing_v1_1", "quick_manual")
    assert {found[entry].status for entry in ("d4", "a3", "offset3")} == {"weak"}  # one for the other
    assert {found[f"direction{joint}"].status for joint in (2, 3)} == {"consistent"}
    assert found["speed1"].status == found["lower1"].status == "consistent"
    assert [round(bound, 1) for bound in found["upper2"].interval] == [84.6, 85.0]  # the drawing's least x


def test_an_entry_for_which_no_table_meets_the_documents_has_no_interval():
    assert Extent(np.nan, np.nan, NOT_OFF).interval is None
    assert Extent(1 - 1e-12, 2.0, NOT_OFF).interval == (1, 2)


@pytest.mark.long
def test_every_interval_holds_its_value_and_every_status_has_its_reason():
    for name in ("er3_600", "er3a_c60"):
        for each in evidence(name).entries:
            if each.interval is not None:
                assert each.interval[0] <= each.value <= each.interval[1]
            assert each.by or each.status in ("open", "given")


def test_the_validation_of_a_study_says_the_same_to_the_last_digit(small_results):
    folder = small_results("validation", "er3_600", load_study("config/small.yaml"))
    assert read_results(folder, RESULTS).results.summary.evidence.entries == evidence("er3_600").entries


@pytest.mark.long
def test_values_are_contradicted_outside_their_intervals():
    found = about(changed(changed(load_robot("er3a_c60"), "d4", 0.5), "lower1", 10.0), "d4", "lower1")
    assert found["d4"].status == found["lower1"].status == "contradicted"


def test_a_table_that_documents_contradict_is_judged_from_the_one_that_diagnosis_finds(monkeypatch):
    """The article's, by its own text."""
    monkeypatch.setattr("er3a.files.by_name.evidence_of", lambda *_, corrected: corrected)
    found = er3a.evidence(load_robot("er3a_c60_article"), "er3a_c60_article")
    assert [np.degrees(each.offset[1]) for each in found] == [pytest.approx(-90)]


@pytest.mark.long
def test_one_wrong_length_accuses_no_other():
    others = {"a2", "d4"}
    found = about(changed(load_robot("er3a_c60"), "d1", 5.0), "base", *others)
    assert found["base"].status == "contradicted"  # d1 and the base act alike
    assert {found[each].status for each in others} <= set(SETTLED)


@pytest.mark.long
def test_a_sign_that_its_own_document_excludes_is_contradicted():
    assert about(turned(load_robot("er3_600"), 2), "direction2")["direction2"].status == "contradicted"


@pytest.mark.long
def test_the_proposed_measurement_contradicts_another_arm():
    """That it settles the arm that it is taken of is seen below, where that of every entry is put in."""
    robot, entry = load_robot("er3a_c60"), "offset6"
    proposal = proposals_of(evidence("er3a_c60"))[entry]
    other = changed(robot, entry, 20.0)
    assert about(robot, entry, extra=(measured(proposal, other),))[entry].status == "contradicted"


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3_600", "er3a_c60"])
def test_what_is_not_settled_has_a_measurement_proposed(name):
    found = evidence(name)
    settled = (*SETTLED, "given", "gauge")
    unsettled = {each.entry for each in (*found.entries, *found.combinations) if each.status not in settled}
    assert set(proposals_of(found)) == unsettled


def as_rows(proposal: Finding, robot: Robot) -> tuple[str, str]:
    """The file that a person enters a measurement in, and its line, as read off the robot."""
    j = proposal.joint
    if is_one(proposal, "look_at_motion"):
        pose = ",".join(f"{angle:g}" for angle in proposal.pose_deg)
        return "observations.csv", f"{pose},{j},{proposal.point},{proposal.seen},,seen on the arm,measured,measured"
    if is_one(proposal, "read_limit"):
        value = np.degrees(getattr(robot, proposal.side)[j - 1])
        both = f"{value},," if proposal.side == "lower" else f",{value},"
        return "limits.csv", f"{j},{both}{proposal.half_width_deg},read off,measured,measured"
    if is_one(proposal, "time_joint"):
        value = np.degrees(robot.speed[j - 1])
        return "speeds.csv", f"{j},{value},{proposal.half_width_deg_s},timed,measured,measured"
    if is_one(proposal, "measure_angle"):
        value = np.degrees(getattr(robot, proposal.column)[j - 1])
        return "angles.csv", f"{j},{proposal.column},{value},{proposal.half_width_deg},measured,measured,measured"
    value = 1000 * getattr(robot, proposal.column)[j - 1]
    return "lengths.csv", f"{j},{proposal.column},{value},{proposal.half_width_mm},measured,measured,measured"


HEADS = {
    "observations.csv": "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,joint,point,seen,uncertainty_deg,source,grade,"
    "origin",
    "angles.csv": "joint,angle,value_deg,uncertainty_deg,source,grade,origin",
    "lengths.csv": "joint,length,value_mm,uncertainty_mm,source,grade,origin",
}


@pytest.mark.long
def test_all_that_is_proposed_entered_in_files_settles_every_entry(tmp_path):
    """A reference set with a line for each proposal: nothing is left open of the ER3-600."""
    robot, proposals = load_robot("er3_600"), proposals_of(evidence("er3_600")).values()
    folder = tmp_path / "measured"
    shutil.copytree("data/manual_refs/er3_600", folder)
    with (folder / "documents.csv").open("a", encoding="utf-8") as file:
        file.write("measured,Measurements on the arm,its owner,\n")
    for proposal in proposals:
        name, line = as_rows(proposal, robot)
        path = folder / name
        if not path.exists():
            path.write_text(HEADS[name] + "\n", encoding="utf-8")
        with path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
    found = er3a.evidence(robot, folder)
    left = {each.entry: each.status for each in (*found.entries, *found.combinations)}
    assert {entry: status for entry, status in left.items() if status not in ("settled", "gauge", "given")} == {}
    assert found.table_meets
    assert {part.status for part in parts_found(found)} == {"settled"}


@pytest.mark.long
def test_parts_say_how_far_the_tool_could_be_off():
    parts = {part.part: part for part in parts_found(evidence("er3_600"))}
    assert parts["zero_and_directions"].status == "open"
    assert parts["zero_and_directions"].off_mm > 1300  # with joint 1 reversed, at 90 deg, stretched out
    assert {parts["limits"].status, parts["speeds"].status} <= {"weak", "consistent"}
    assert "speeds" not in {part.part for part in parts_found(evidence("er3a_c60"))}


@pytest.mark.long
def test_a_tighter_tolerance_settles_less():
    robot = load_robot("er3a_c60")
    references = load_references("er3a_c60")
    found = evidence_of(robot, references.references, references.documents, Tolerance(0.5, 0.05), only=["a3", "d4"])
    assert found["a3"].status == "weak"
    assert found["d4"].status in SETTLED


def puma() -> Robot:
    """Puma 560, standard D-H (Corke and Armstrong-Helouvry, ICRA 1994)."""
    right = np.pi / 2
    return Robot(
        name="puma560",
        title="Puma 560",
        convention="standard",
        a=np.array([0, 431.8, 20.3, 0, 0, 0]) / 1000,
        alpha=np.array([right, 0, -right, right, -right, 0]),
        d=np.array([671.8, 0, 150.05, 431.8, 0, 56.25]) / 1000,
        direction=np.ones(6),
        offset=np.zeros(6),
        lower=np.radians([-160, -110, -135, -266, -100, -266]),
        upper=np.radians([160, 110, 135, 266, 100, 266]),
    )


def frame_of(robot: Robot, q_deg: np.ndarray) -> np.ndarray:
    """Forward kinematics of standard rows, by itself."""
    T = np.eye(4)
    for k, angle in enumerate(np.radians(q_deg)):
        theta = robot.direction[k] * angle + robot.offset[k]
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(robot.alpha[k]), np.sin(robot.alpha[k])
        a, d = robot.a[k], robot.d[k]
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return T


def tracked(robot: Robot, poses: np.ndarray, half_width: float) -> list[Reference]:
    """Positions of the flange as a tracker would show them."""
    found = []
    for n, pose in enumerate(poses):
        at = tuple(float(angle) for angle in pose)
        for k, coordinate in enumerate("xyz"):
            quantity = PointCoordinate(at, "flange", coordinate)
            subject = point_at_pose(f"pose {n}", "flange", coordinate)
            expected = float(frame_of(robot, pose)[k, 3] * 1000)
            found.append(Reference(subject, "key_poses", quantity, expected, half_width, *TRACKER))
    return found


def poses(random: np.random.Generator, count: int) -> np.ndarray:
    return np.round(np.degrees(random.uniform(puma().lower, puma().upper, (count, 6))))


@pytest.mark.long
def test_a_tracker_settles_a_foreign_arm_but_for_how_its_flange_is_turned(random):
    robot, stated = puma(), tracked(puma(), poses(random, 20), 0.1)
    expected = dict.fromkeys(("direction2", "a2", "d4", "alpha1", "offset3"), SETTLED)
    expected |= {"d2": ("gauge",)} | dict.fromkeys(("offset6", "direction6"), ("open", "weak"))
    found = evidence_of(robot, stated, Documents(), only=tuple(expected))
    for name, statuses in expected.items():
        assert found[name].status in statuses


@dataclass(frozen=True)
class CarriedCoordinate(QuantityAtPose):
    """A coordinate (base frame, mm) of a point that the flange carries, at a pose."""

    offset_mm: tuple[float, float, float]
    coordinate: str

    def value(self, state):
        T = state.at(self.pose)[..., -1, :3, :]
        k = "xyz".index(self.coordinate)
        return T[..., k, 3] * 1000 + T[..., k, :3] @ np.array(self.offset_mm)

    @property
    def vector(self):
        return self.pose, self.offset_mm


@pytest.mark.long
def test_standard_deviations_give_the_interval_of_least_squares(random):
    """Three points that the flange carries: 1.96 standard errors, from a Jacobian made by itself."""
    robot, at, sigma = puma(), poses(random, 15), 0.2
    points = [(0.0, 0.0, 0.0), (100.0, 0.0, 0.0), (0.0, 100.0, 50.0)]
    names = [entry.name for entry in continuous_of(robot) if entry.name != "d2"]

    def seen(arm: Robot) -> np.ndarray:
        frames = [frame_of(arm, pose) for pose in at]
        return np.concatenate([T[:3, 3] * 1000 + T[:3, :3] @ np.array(point) for T in frames for point in points])

    quantities = [
        CarriedCoordinate(tuple(map(float, pose)), point, coordinate)
        for pose in at
        for point in points
        for coordinate in "xyz"
    ]
    stated = [
        Reference(point_at_pose("p", "flange", None), "key_poses", quantity, value, 1.96 * sigma, *TRACKER, sigma)
        for quantity, value in zip(quantities, seen(robot).tolist())
    ]
    found = evidence_of(robot, stated, Documents(), only=["a2", "d4", "offset3", "alpha5"])
    J = np.array([(seen(changed(robot, name, 1e-4)) - seen(changed(robot, name, -1e-4))) / 2e-4 for name in names]).T
    error = sigma * np.linalg.norm(np.linalg.pinv(J), axis=1)
    for name in ("a2", "d4", "offset3", "alpha5"):
        low, high = found[name].interval
        assert (high - low) / 2 == pytest.approx(1.96 * error[names.index(name)], rel=0.02)


@pytest.mark.long
def test_no_feasible_table_lies_outside_the_intervals(random):
    """Tables on rays from the true one, as far as an own forward kinematics says that they are feasible."""
    robot, at, half_width = puma(), poses(random, 8), 0.5
    free = [entry for entry in continuous_of(robot) if entry.name != "d2"]
    asked = [entry.name for entry in free][::5]
    found = evidence_of(robot, tracked(robot, at, half_width), Documents(), only=asked)
    true = np.array([frame_of(robot, pose)[:3, 3] * 1000 for pose in at])
    scale = np.array([1.0 if entry.unit == "mm" else 0.1 for entry in free])

    def feasible(amounts: np.ndarray) -> bool:
        columns = {entry.column: getattr(robot, entry.column).copy() for entry in free}
        for entry, amount in zip(free, amounts):
            columns[entry.column][entry.joint - 1] += amount / entry.in_unit
        arm = robot.replace(**columns)
        places = np.array([frame_of(arm, pose)[:3, 3] * 1000 for pose in at])
        return bool(np.abs(places - true).max() <= half_width)

    J = np.array([_slope(robot, entry.name, at) for entry in free]).T * scale
    for ray in range(20):
        direction = random.normal(size=len(free))
        if ray % 2:
            direction = np.linalg.lstsq(J, random.uniform(-half_width, half_width, len(J)), rcond=1e-6)[0]
        inside, outside = 0.0, 64.0
        for _ in range(30):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if feasible(middle * direction * scale) else (inside, middle)
        for entry, amount in zip(free, inside * direction * scale):
            if entry.name in asked and found[entry.name].status != "gauge":
                low, high = found[entry.name].interval
                assert low - 0.02 * (high - low) <= found[entry.name].value + amount <= high + 0.02 * (high - low)


def _slope(robot: Robot, name: str, at: np.ndarray) -> np.ndarray:
    arms = [changed(robot, name, step) for step in (1e-4, -1e-4)]
    up, down = (np.concatenate([frame_of(arm, pose)[:3, 3] * 1000 for pose in at]) for arm in arms)
    return (up - down) / 2e-4


@pytest.mark.long
@pytest.mark.parametrize(("parents", "status"), [((), "settled"), (("drawing",), "consistent")])
def test_derived_documents_prove_nothing(parents, status):
    """The same limit, read off by a document of its own, and by one with an ancestor in common with the table's."""
    robot = puma().replace(origins={entry.name: "manual" for entry in entries_of(puma())})
    stated = Reference(joint_limit(3, "upper"), "limits", Limit(3, "upper"), 135.0, 0.5, *TRACKER)
    documents = Documents.of(
        [
            Document("drawing", "a drawing", "a maker"),
            Document("manual", "a manual", "a maker", ("drawing",)),
            Document("tracker", "a tracker", "a laboratory", parents),
        ]
    )
    assert evidence_of(robot, [stated], documents, only=["upper3"])["upper3"].status == status


@pytest.mark.long
@pytest.mark.parametrize(("manual", "counts"), [pytest.param(-5.0, True, marks=pytest.mark.long), (0.0, False)])
def test_a_contradiction_outvotes_a_measurement_only_where_the_table_meets_it(manual, counts):
    """A tracker shows the flange 5 mm higher than the table has it; the table's own manual states something else."""
    robot = puma().replace(origins={entry.name: "manual" for entry in entries_of(puma())})
    (seen,) = tracked(robot, np.zeros((1, 6)), 0.1)[2:]
    stated = [replace(seen, expected=seen.expected + 5.0)]
    stated += [replace(seen, expected=seen.expected + manual, origin="manual")]
    found = evidence_of(robot, stated, Documents(), only=["d1"])["d1"]
    assert (found.status != "consistent") == counts


def test_a_table_that_names_an_unknown_document_is_refused():
    """It would count as independent of the document that it was read from."""
    robot = load_robot("er3_600")
    wrong = {**robot.sources, "dh": replace(robot.sources["dh"], origin="step_v9")}
    with pytest.raises(InputError, match=r"dh\.origin: the document 'step_v9' is not known"):
        er3a.evidence(robot.replace(sources=wrong))


@pytest.mark.long
def test_a_robot_without_references_has_everything_open():
    found = evidence_of(puma(), [], Documents())
    assert {each.status for each in found.entries} == {"open", "gauge", "given"}
    assert found.table_meets


def ur5e() -> Robot:
    """Universal Robots UR5e, standard D-H, from its maker's table."""
    right = np.pi / 2
    return puma().replace(
        a=np.array([0, -425, -392.2, 0, 0, 0]) / 1000,
        alpha=np.array([right, 0, 0, right, -right, 0]),
        d=np.array([162.5, 0, 0, 133.3, 99.7, 99.6]) / 1000,
        lower=np.full(6, -2 * np.pi),
        upper=np.full(6, 2 * np.pi),
    )


@pytest.mark.long
def test_entries_of_which_another_arm_has_others_are_not_settled_by_few_poses():
    """Eight places of the flange that another arm comes to as well, but for less than half a millimetre."""
    robot, half_width = ur5e(), 0.5
    at = np.array(
        [
            (9, 324, -256, 323, -135, -55),
            (236, -65, 36, -340, 183, 27),
            (-123, 208, -142, -33, -263, -70),
            (-214, -171, 180, -158, -11, 346),
            (332, 162, 30, -161, -244, 338),
            (12, -277, 89, 199, 81, 300),
            (-331, 21, -29, -315, 102, 254),
            (67, -173, 245, 7, 8, 182),
        ],
        float,
    )
    other = robot.replace(
        a=np.array([-4.258, -423.067, -388.83, 0.095, -61.207, -10.0]) / 1000,
        d=np.array([156.389, 0, 7.895, 133.3, 77.407, 74.286]) / 1000,
        alpha=np.radians([89.149, 1.331, 4.799, 93.4, -76.991, -0.042]),
        offset=np.radians([0.982, -0.116, -0.939, 1.21, -38.99, 110.788]),
    )
    places = [[frame_of(arm, pose)[:3, 3] * 1000 for pose in at] for arm in (robot, other)]
    assert np.abs(np.subtract(*places)).max() < half_width
    names = ("d1", "a6", "alpha1", "offset1", "offset3")
    found = evidence_of(robot, tracked(robot, at, half_width), Documents(), only=names)
    for name in names:
        low, high = found[name].interval
        apart = next(entry for entry in continuous_of(robot) if entry.name == name).value(other)
        assert found[name].status == "weak"
        assert found[name].at_least or low <= apart <= high
