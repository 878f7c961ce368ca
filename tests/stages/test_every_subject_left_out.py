"""Each subject of what a stage did not examine is listed where it was left out, and only there.

Each stage's list begins with the least that it ever lists. One change of what it was given adds or takes what is named.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
import yaml

from er3a.collision.along import bodies_of
from er3a.collision.scene import Scene, Sphere
from er3a.errors import DoubtfulUnit
from er3a.files.robot_file import Placement
from er3a.files.robot_library import load_robot
from er3a.files.vision_file import load_vision
from er3a.kinematics.solutions import MANY_TARGETS, ByClass, ClosedForm, Iteration
from er3a.pipeline.language import using
from er3a.pipeline.messages.left_out import left_out_text
from er3a.pipeline.results import LeftOut, LeftOutSubject
from er3a.pipeline.stages.collision.compute import compute as collision
from er3a.pipeline.stages.dynamics.compute import unknowns
from er3a.pipeline.stages.dynamics.entry import DynamicsSettings
from er3a.pipeline.stages.left_out import (
    left_out_of_collisions,
    left_out_of_intrinsics,
    left_out_of_limits,
    left_out_of_rates,
    left_out_of_units,
    left_out_of_values,
    left_out_without_tool,
)
from er3a.pipeline.stages.programs.compute import compute as programs
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.validation import model as validated
from er3a.pipeline.stages.workspace.model import CapabilityMissing, PlacementSummary, PlacementTooLong, TaskSummary
from er3a.pipeline.study import Study, load_study
from er3a.planning.names import StrategyName
from er3a.program_check.program_check_findings import LoadAbovePayload, NotFollowed
from er3a.references.rows import GROUPS
from er3a.robots.masses import Drives, Masses
from er3a.robots.robot import Envelope, Robot, Source
from er3a.vision.boards import BoardlessImage
from er3a.vision.hand_eye import TouchCheck

ROBOT = "er3a_c60"
Listed = tuple[LeftOut, ...]


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study("config/small.yaml")


def left_out(stage: str, *given, **named) -> Listed:
    """What a stage's own list holds."""
    return tuple(STAGES[stage].module("compute")._left_out(*given, **named))


def of(**values) -> SimpleNamespace:
    """Something with these attributes, of which a list asks for no others."""
    return SimpleNamespace(**values)


def differs(found: Listed, least: Listed, more: Listed, less: Listed = ()) -> bool:
    """Whether a list is not the least one with this added and that taken; none is listed twice."""
    return sorted(map(repr, found)) != sorted(map(repr, [*(each for each in least if each not in less), *more]))


# --- programs ---

ALWAYS_OF_PROGRAMS = (
    *(LeftOut("program_again"), LeftOut("controller_language")),
    *(LeftOut("controller_ramps"), LeftOut("torques")),
)  # no text of a program tells of them


def a_program(*findings, lines=()) -> SimpleNamespace:
    return of(name="job", not_examined=lines, findings=[of(finding=each) for each in findings])


@pytest.mark.parametrize(
    ("program", "starts", "more"),
    [
        (a_program(), (), ()),
        (a_program(lines=(5, 7)), (), (LeftOut("program_lines", ("job: 5, 7",)),)),
        (a_program(), ("job",), (LeftOut("program_starts", ("job",)),)),
        (a_program(NotFollowed("E1", "external_axes")), (), (LeftOut("outer_axes", ("job",)),)),
        (a_program(LoadAbovePayload(4.5, 3.0)), (), (LeftOut("program_loads", ("job: 4.5 kg",)),)),
    ],
)
def test_programs(program, starts, more):
    assert not differs(left_out("programs", [program], starts), ALWAYS_OF_PROGRAMS, more)


@pytest.mark.parametrize(("outer", "named"), [("", None), (",E1 500", ("job",))])
def test_a_program_that_moves_an_outer_axis_is_named(study, tmp_path, outer, named):
    """The stage lists for a whole program what no text tells of, too."""
    lines = ["DEF job( )", "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", f"PTP {{A1 5{outer}}}", "END"]
    (tmp_path / "job.src").write_text("\n".join(lines), encoding="utf-8")
    listed = {"kind": "programs", "programs": [{"name": "job", "title": "Job", "file": str(tmp_path / "job.src")}]}
    (tmp_path / "programs.yaml").write_text(json.dumps(listed), encoding="utf-8")
    entry = study.robots[ROBOT].model_copy(update={"programs": str(tmp_path / "programs.yaml")})
    found = programs(study.model_copy(update={"robots": {ROBOT: entry}}), ROBOT).summary.not_examined
    assert [each.names for each in found if each.subject == "outer_axes"] == ([named] if named else [])
    assert set(ALWAYS_OF_PROGRAMS) <= set(found)


# --- trajectory ---


def a_path(name: str, verdict="safe", undecided=()) -> SimpleNamespace:
    return of(name=name, verdict=verdict, undecided=undecided)


NOT_FOLLOWED = of(name="lost", refused=""), of(name="refused", refused="no motion has a known start")


@pytest.mark.parametrize(
    ("paths", "skipped", "only", "expected"),
    [
        ((a_path("a"),), (), None, ()),
        ((a_path("a"), a_path("b")), (), None, (LeftOut("ways_between"),)),
        ((a_path("a", undecided=("a stretch",)),), (), None, (LeftOut("path_stretches", ("a",)),)),
        ((a_path("a", "none found"),), (), None, (LeftOut("plans", ("a",)),)),
        ((a_path("a", "collides"),), (), None, ()),
        ((), NOT_FOLLOWED[:1], None, (LeftOut("paths", ("lost",)),)),
        ((), NOT_FOLLOWED[1:], None, (LeftOut("paths", ("refused: no motion has a known start",)),)),
        ((), (), "slow", (LeftOut("strategies", tuple(name for name in get_args(StrategyName) if name != "slow")),)),
    ],
)
def test_paths(paths, skipped, only, expected):
    assert left_out("trajectory", paths, skipped, only) == expected


# --- targets ---

TRIPS, ALL = of(poses=7), ClosedForm()
OF_TARGETS = LeftOut("round_trips", amount=7), LeftOut("ways_between")
BY_CLASS = {"arm_class": "general", "named": False}


def a_target(method=ALL, obstacle=None, advice=()) -> SimpleNamespace:
    return of(name="a", method=method, obstacle=obstacle, advice=advice)


@pytest.mark.parametrize(
    ("target", "given", "more", "less"),
    [
        (a_target(), {}, (), ()),
        (a_target(ByClass(certain=True, **BY_CLASS)), {}, (), ()),
        (a_target(ByClass(certain=False, **BY_CLASS)), {}, (LeftOut("uncertain_solutions", ("a",)),), ()),
        (a_target(Iteration(20)), {}, (LeftOut("uncertain_solutions", ("a",)),), ()),
        (a_target(), {"trips": None}, (LeftOut("all_solutions"),), OF_TARGETS[:1]),
        (a_target(), {"many": True}, (LeftOut("turns", amount=MANY_TARGETS),), ()),
        (a_target(obstacle="too far", advice=("shift it",)), {}, (), ()),
        (a_target(obstacle="too far"), {}, (LeftOut("advice", ("a",)),), ()),
        (a_target(), {"mix": {"limits": 1.0, "time": 1.0}}, (LeftOut("rules", ("time",)),), ()),
        (a_target(), {"mix": {"limits": 1.0}}, (), ()),
    ],
)
def test_targets(target, given, more, less):
    robot = load_robot(ROBOT).replace(speed=np.full(6, np.nan))
    settings = {"many": False, "mix": {}, "trips": TRIPS} | given
    assert not differs(left_out("inverse", robot, [target], **settings), OF_TARGETS, more, less)


# --- collisions ---


def test_free_space_names_what_it_did_not_find_where_there_is_such(study, tmp_path):
    """Of one random joint vector, no cell is lost, and none is joined. The line leaves the reach half-way."""
    line = yaml.safe_load(Path(f"data/paths/{ROBOT}.yaml").read_text(encoding="utf-8"))
    paths = {each["name"]: each for each in line["paths"]}
    targets = {"kind": "targets", "targets": [{"name": "near", "q_deg": [0, -10, -10, 0, -70, 0]}]}
    (tmp_path / "targets.yaml").write_text(yaml.safe_dump(targets), encoding="utf-8")
    quick = {"cells_across": 4, "rounds": 0, "neighbours": 1}
    found = {}
    for name, samples in (("line_clean", 1), ("line_out", 1000)):
        file = tmp_path / f"{name}.yaml"
        file.write_text(yaml.safe_dump(line | {"paths": [paths[name]]}), encoding="utf-8")
        given = {"paths": str(file), "targets": str(tmp_path / "targets.yaml")}
        made = study.model_copy(
            update={
                "robots": {ROBOT: study.robots[ROBOT].model_copy(update=given)},
                "collision": study.collision.model_copy(update=quick | {"samples": samples}),
            }
        )
        summary = collision(made, ROBOT).summary
        found[name] = {each.subject: each for each in summary.not_examined}, summary.places
    (few, places), (many, more_places) = found["line_clean"], found["line_out"]
    assert (places.reached, places.clear, places.joined) == (1, 1, 0)
    assert "lost_cells" not in few
    assert few["unjoined_cells"] == LeftOut("unjoined_cells", amount=1)
    assert many["lost_cells"] == LeftOut("lost_cells", amount=more_places.reached - more_places.clear)
    assert many["lost_cells"].amount > 0
    assert (few.get("path_stretches"), many["path_stretches"].names) == (None, ("line_out",))
    assert "no pose of the arm is known" in left_out_text(many["path_stretches"])
    assert {"targets", "paths", "turns"}.isdisjoint(few)


@pytest.mark.parametrize(("reached", "clear", "joined"), [(5, 5, 5), (5, 4, 4), (5, 5, 3), (5, 3, 1)])
def test_cells_that_are_all_found_are_not_listed(reached, clear, joined):
    own = STAGES["collision"].module("compute")._left_out_of_places
    lost = (LeftOut("lost_cells", amount=reached - clear),) if reached > clear else ()
    unjoined = (LeftOut("unjoined_cells", amount=clear - joined),) if clear > joined else ()
    places = of(reached=reached, clear=clear, joined=joined, cell_m=0.05)
    assert tuple(own(places)) == (*lost, *unjoined, LeftOut("within_cells", amount=50.0))


def a_motion(*, followed=True, known=True, rest: Listed = (), meant_safe=True) -> SimpleNamespace:
    q = np.array([[0.0], [0.0 if known else np.nan]])
    return of(name="a", motion=of(q=q) if followed else None, left_out=rest, meant_safe=meant_safe)


@pytest.mark.parametrize(
    ("solved", "many", "motion", "expected"),
    [
        (True, 1, a_motion(), ()),
        (False, 1, a_motion(), (LeftOut("targets", ("near",)),)),
        (True, 0, a_motion(), (LeftOut("turns", amount=0),)),
        (True, 1, a_motion(followed=False), (LeftOut("paths", ("a",)),)),
        (True, 1, a_motion(known=False), (LeftOut("path_stretches", ("a",)),)),
        (True, 1, a_motion(rest=(LeftOut("program_rest", ("a: 3",)),)), (LeftOut("program_rest", ("a: 3",)),)),
        (True, 1, a_motion(rest=(LeftOut("program_rest", ("a: 3",)),), meant_safe=False), ()),
    ],
)
def test_clearances_of_targets_and_paths(study, tmp_path, monkeypatch, solved, many, motion, expected):
    targets = {"kind": "targets", "targets": [{"name": "near", "q_deg": [0, -10, -10, 0, -70, 0]}]}
    (tmp_path / "targets.yaml").write_text(yaml.safe_dump(targets), encoding="utf-8")
    entry = study.robots[ROBOT].model_copy(update={"targets": str(tmp_path / "targets.yaml")})
    made = study.model_copy(update={"robots": {ROBOT: entry}})
    monkeypatch.setattr(STAGES["collision"].module("compute"), "MANY_TARGETS", many)
    found = of(target=np.array(["near"] if solved else ["another"]))
    assert left_out("collision", made, ROBOT, found, [motion]) == expected


def of_collisions(robot: Robot, scene: Scene | None = None, **more) -> dict[str, LeftOut]:
    listed = left_out_of_collisions(robot, bodies_of(robot, scene), scene, **more)
    assert len({each.subject for each in listed}) == len(listed)
    return {each.subject: each for each in listed}


def test_pairs_whose_shapes_can_not_be_right_are_named():
    """The base as a ball of 3 m, in which the arm is in every pose."""
    robot = load_robot("er3_600").replace(pair_rules=())
    base = Envelope(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 3.0)
    swollen = of_collisions(robot.replace(envelopes=(base, *robot.envelopes[1:])))
    assert swollen["unexamined_pairs"].names == ("base/link_3", "base/link_4", "base/link_6")
    assert "unexamined_pairs" not in of_collisions(robot)


def test_what_is_given_of_surroundings_is_named_as_given_and_the_rest_as_missing():
    robot, ball = load_robot(ROBOT), (Sphere("ball", np.eye(4), 0.01),)
    far = (Sphere("far", np.array([[1.0, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]), 0.01),)
    none, solids = LeftOut("obstacles"), LeftOut("scene_shapes")
    bare, held = LeftOut("carried"), LeftOut("carried_shapes")
    for scene, *named in (
        (None, none, bare),
        (Scene("a", far), solids, bare),
        (Scene("a", (), ball), none, held),
        (Scene("a", far, ball), solids, held),
    ):
        assert [each for each in of_collisions(robot, scene).values() if each in (none, solids, bare, held)] == named
    assert of_collisions(robot, tolerance_mm=2.0)["shallow_overlaps"].amount == 2.0
    assert "shallow_overlaps" not in of_collisions(robot)


# --- what several stages leave out alike ---


def test_rates_and_tool():
    known = np.array([True, False, True])
    everything = LeftOut("own_speeds", ("J2",)), LeftOut("own_accelerations"), LeftOut("jerk")
    assert left_out_of_rates(known, acceleration=False, jerk=False) == everything
    assert left_out_of_rates(np.ones(3, bool), acceleration=True, jerk=True) == ()
    robot = load_robot(ROBOT)
    assert left_out_without_tool(robot) == (LeftOut("tool"),)
    assert left_out_without_tool(robot.replace(tool=np.diag([-1.0, -1.0, 1.0, 1.0]))) == ()


@pytest.mark.parametrize("grade", ["inferred", "claim"])
def test_groups_of_the_robots_file(grade):
    """What a study gives in their place is not assumed."""
    robot = load_robot(ROBOT).replace(sources={group: Source("guessed", grade) for group in ("limits", "zero", "tool")})
    limits, values = (LeftOut("own_limits", ("guessed",)),), (LeftOut("own_values", ("zero", "tool")),)
    assert left_out_of_limits(robot) == (limits if grade == "inferred" else ())
    assert left_out_of_values(robot, ()) == (values if grade == "inferred" else ())
    assert left_out_of_values(robot, ("zero", "tool")) == ()


def test_numbers_in_doubt():
    doubts = [DoubtfulUnit(f"key{k}", "1.57 deg", "radians", file="a.yaml") for k in range(22)]
    assert left_out_of_units(doubts[:1]) == (LeftOut("units", ("a.yaml: key0: 1.57 deg",)),)
    (many,) = left_out_of_units(doubts)
    assert (len(many.names), many.names[-1]) == (21, "+ 2")
    assert left_out_of_units([]) == ()


# --- dynamics ---

OF_TORQUES = LeftOut("torque_peaks", amount=50), LeftOut("program_torques"), LeftOut("drive_behaviour")


@pytest.mark.parametrize(
    ("lacks", "named"),
    [
        (None, None),
        ("armature", LeftOut("rotor_inertias")),
        ("coulomb", LeftOut("friction")),
        ("viscous", LeftOut("friction")),
        ("rated", LeftOut("rated_torques")),
        ("peak", LeftOut("peak_torques")),
    ],
)
@pytest.mark.parametrize("joints", [(2, 5), (1, 2, 3, 4, 5, 6)])
def test_what_is_not_known_of_drives(lacks, named, joints):
    """Each is named by its joints, whether some or all of them lack it."""
    known = {name: np.ones(6) for name in ("armature", "gear_ratio", "coulomb", "viscous", "rated", "peak")}
    whole = load_robot(ROBOT)
    of_drives = {"rotor_inertias", "friction", "rated_torques", "peak_torques"}
    if lacks:
        known[lacks] = np.where(np.isin(np.arange(1, 7), joints), np.nan, 1.0)
    masses = Masses(whole.masses.links, Drives(**known), whole.masses.wrist)
    robot = whole.replace(masses=masses, sources={})
    found = left_out("dynamics", robot, (), (), unknowns(robot, ()), 50)
    expected = [replace(named, names=tuple(f"J{joint}" for joint in joints))] if named else []
    assert [each for each in found if each.subject in of_drives] == expected


@pytest.mark.parametrize(
    ("given", "more"),
    [
        ({}, ()),
        ({"paths": (of(name="a", counts=True),)}, ()),
        ({"paths": (of(name="a", counts=False),)}, (LeftOut("paths_not_run", ("a",)),)),
        ({"skipped": ("b",)}, (LeftOut("paths_not_run", ("b",)),)),
        ({"unknown": (of(what="masses", numbers=(3,)),)}, (LeftOut("link_masses", ("3",)),)),
        ({"unknown": (of(what="payload", numbers=()),)}, (LeftOut("wrist_limits"),)),
        ({"unknown": (of(what="wrist_moment", numbers=(5,)),)}, (LeftOut("wrist_limits", ("J5",)),)),
        ({"unknown": (of(what="load", numbers=()),)}, (LeftOut("load"),)),
        ({"unknown": (of(what="tool", numbers=()),)}, (LeftOut("load", ("tool",)),)),
    ],
)
def test_torques(given, more):
    settings = {"paths": (), "skipped": (), "unknown": (), "samples": 50} | given
    assert not differs(left_out("dynamics", load_robot(ROBOT), **settings), OF_TORQUES, more)


@pytest.mark.parametrize(
    ("gravity", "base", "expected"),
    [
        (9.81, Placement(xyz_mm=[0.0, 0.0, 500.0]), ()),
        (9.81, None, (LeftOut("mounting"),)),
        (1.62, Placement(xyz_mm=[0.0, 0.0, 500.0]), (LeftOut("other_gravity", amount=1.62),)),
    ],
)
def test_weight(study, gravity, base, expected):
    entry = study.robots[ROBOT].model_copy(update={"base": base})
    made = study.model_copy(update={"robots": {ROBOT: entry}})
    own = STAGES["dynamics"].module("compute")._weight
    assert tuple(own(made, ROBOT, DynamicsSettings(gravity_m_s2=gravity))) == expected


# --- workspace ---

TASK = TaskSummary((300.0, 200.0, 50.0), (0.0, 0.0, -1.0), 15.0, 2.0, 0.0, 100.0)
OF_REACH = LeftOut("joint_vectors", amount=700), LeftOut("colliding_reach")
OF_TOOL = *OF_REACH, LeftOut("tool_directions", amount=40)
BETWEEN, PLACED = LeftOut("between_places", amount=50.0), LeftOut("placed_box")
SAMPLED = LeftOut("sampled_places", amount=3)


def what_tools_do(**changes) -> SimpleNamespace:
    return of(**{"asked": "directions", "directions": 40, "clear": of(without=0)} | changes)


def placed(places=("a place",)) -> PlacementSummary:
    return PlacementSummary(None, 10.0, TASK, (0.05, 0.03, 0.05), 9, 20, 3, places)


@pytest.mark.parametrize(
    ("given", "more", "less"),
    [
        ({}, (), ()),
        ({"bounds": (0.75, 1.0)}, (LeftOut("undecided_volume", amount=250.0),), ()),
        ({"width": 0.2}, (LeftOut("hidden_voids", amount=20.0),), ()),
        ({"capability": CapabilityMissing("a reason")}, (LeftOut("capability"),), OF_TOOL[2:]),
        ({"capability": what_tools_do(clear=of(without=9))}, (LeftOut("lost_cells", amount=9),), ()),
        ({"placement": PlacementTooLong(TASK)}, (LeftOut("places"),), ()),
        ({"placement": placed()}, (SAMPLED, BETWEEN, PLACED), ()),
        ({"placement": placed(())}, (SAMPLED, BETWEEN, LeftOut("tray_nowhere", ("300 × 200 × 50 mm",))), ()),
        (
            {"placement": placed(), "capability": what_tools_do(asked="turns")},
            (SAMPLED, BETWEEN, PLACED, LeftOut("box_directions")),
            (),
        ),
        ({"capability": what_tools_do(asked="turns")}, (), ()),
    ],
)
def test_reach_and_what_the_tool_can_do(given, more, less):
    own = {"bounds": (1.0, 1.0), "width": 0.1}
    own |= {"capability": what_tools_do(), "placement": None} | given
    proven = of(proof=of(bounds=own["bounds"], width=own["width"]))
    tool = of(capability=own["capability"], placement=own["placement"])
    found = left_out("workspace", of(samples=700), proven, tool)
    assert not differs(found, OF_TOOL, more, less)


def test_a_tray_in_a_solid():
    place = of(centre_m=(0.5, 0.0, 0.125), size_m=(0.2, 0.15, 0.05))
    own, robot = STAGES["workspace"].module("compute")._in_solids, load_robot(ROBOT)
    inside, beside = np.eye(4), np.eye(4)
    inside[:3, 3], beside[:3, 3] = (0.5, 0, 0.125), (0.8, 0, 0.125)
    for middle, expected in ((inside, (LeftOut("places_in_solids", ("1: ball",)),)), (beside, ())):
        scene = Scene("a", (Sphere("ball", middle, 0.01),))
        assert tuple(own(robot, scene, placed((place,)))) == expected
        assert tuple(own(robot, None, placed((place,)))) == ()
        assert tuple(own(robot, scene, PlacementTooLong(TASK))) == ()


# --- validation ---


def judged(group: str, status="pass") -> validated.ReferenceCheck:
    """A reference's check, of which the list asks for group, subject and status."""
    made = object.__new__(validated.ReferenceCheck)
    for name, value in {"group": group, "subject": f"of {group}", "status": status}.items():
        object.__setattr__(made, name, value)
    return made


def open_check(group: str, note=None, subject="another") -> validated.Unjudged:
    return validated.Unjudged(subject, group, "mm", note)


LOOSE = validated.TooUncertain(90.0, 45.0)
OF_TABLE = (
    LeftOut("more_faults"),
    LeftOut("round_trips", amount=400),
    LeftOut("reach_starts", amount=3),
    LeftOut("the_arm_itself"),
)


def evidence_of(*statuses: str) -> SimpleNamespace:
    return of(entries=[of(entry=f"d{k}", status=status) for k, status in enumerate(statuses, start=1)])


@pytest.mark.parametrize(
    ("given", "more", "less"),
    [
        ({}, (), ()),
        ({"without": "reach"}, (LeftOut("references", ("reach",)),), ()),
        ({"checks": [open_check("limits")]}, (LeftOut("references", ("limits",)),), ()),
        ({"checks": [open_check("limits", subject="of limits")]}, (), ()),
        (
            {"checks": [open_check("limits", LOOSE), open_check("axes", LOOSE), open_check("axes", LOOSE)]},
            (LeftOut("references", ("axes", "limits")), LeftOut("loose_references", ("limits", "axes"))),
            (),
        ),
        ({"checks": [judged("reach", "conflict")]}, (LeftOut("conflicting_references", ("reach",)),), ()),
        ({"checks": [judged("reach", "fail")]}, (), ()),
        ({"evidence": evidence_of("settled", "contradicted", "open")}, (LeftOut("table_entries", ("d2", "d3")),), ()),
        ({"evidence": evidence_of("settled", "gauge", "given")}, (), ()),
        ({"evidence": None}, (LeftOut("table_entries"),), ()),
        ({"diagnoses": None}, (LeftOut("diagnosis"),), OF_TABLE[:1]),
        ({"checks": [open_check("round_trips")]}, (LeftOut("all_solutions"),), OF_TABLE[1:2]),
        ({"trips": of(near_singular=12)}, (LeftOut("near_singular_poses", amount=12),), ()),
    ],
)
def test_a_table(given, more, less):
    own = {"without": None, "checks": [], "diagnoses": (), "trips": of(near_singular=0)}
    own |= {"evidence": evidence_of("settled")} | given
    checks = [judged(group) for group in GROUPS if group != own["without"]] + own["checks"]
    settings = of(round_trips=400, reach_starts=3)
    rest = [own[name] for name in ("diagnoses", "trips", "evidence")]
    assert not differs(left_out("validation", settings, checks, *rest), OF_TABLE, more, less)


def test_tool_and_base_of_the_study():
    own, robot = STAGES["validation"].module("compute")._left_out_of_places, load_robot(ROBOT)
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    for names in ((), ("tool",), ("base",), ("tool", "base")):
        expected = (LeftOut("tool_and_base", names),) if names else ()
        assert tuple(own(robot.replace(**dict.fromkeys(names, turned)), robot)) == expected


# --- vision ---


@pytest.mark.parametrize(
    ("images", "simulated", "setup", "touched", "expected"),
    [
        (of(views=of(shared="estimated")), False, "eye_in_hand", False, ()),
        (of(views=of(shared=None)), False, "eye_to_hand", True, (LeftOut("given_intrinsics"),)),
        (None, False, "eye_to_hand", False, (LeftOut("open_intrinsics"),)),
        (None, False, "eye_to_hand", True, (LeftOut("pose_intrinsics"),)),
        (None, False, "eye_in_hand", True, (LeftOut("open_intrinsics"),)),  # they show where the board is
        (None, True, "eye_in_hand", False, (LeftOut("pose_intrinsics"),)),
    ],
)
def test_intrinsics_of_images_and_of_poses(images, simulated, setup, touched, expected):
    found = left_out_of_intrinsics(of(setup=setup), images, simulated, touched)
    assert tuple(map(LeftOut, found)) == expected


def test_touched_points_confirm_what_the_gripper_needs_and_no_more():
    """Points 5.2 mm off may be no contradiction where intervals are wide."""
    near, wide = [0.001, 0.0, 0.0], np.full((2, 3), 0.01)
    close, far = (TouchCheck(np.array([near, off]), wide, 0.5) for off in ([0.0, 0.002, 0.0], [0.005, 0.0, 0.0015]))
    within = STAGES["vision"].module("compute").touched_within
    assert [within(each, (4.0, 6.0, 6.0)) for each in (None, close, far)] == [False, True, False]


@pytest.mark.parametrize(
    ("given", "more"),
    [
        ({}, ()),
        ({"simulated": True}, (LeftOut("real_camera"),)),
        ({"boardless": (BoardlessImage("a", "a.png", 3),)}, (LeftOut("boardless_images", ("a",)),)),
        ({"rejected": ("a", "b")}, (LeftOut("left_out_samples", ("a", "b")),)),
        ({"copies": ("a",)}, (LeftOut("copied_samples", ("a",)),)),
        ({"zeros": ("J1", "J6")}, (LeftOut("joint_zeros", ("J1", "J6")),)),
        ({"least_zero": 0.5}, (LeftOut("small_joint_zeros", amount=0.5),)),
        ({"touch": None}, (LeftOut("touched_points"),)),
    ],
)
def test_a_calibration(given, more):
    own = {"simulated": False, "boardless": (), "zeros": (), "least_zero": 0.0}
    own |= {"rejected": (), "copies": (), "touch": of(largest=0.0)} | given
    found = of(rejected=own["rejected"], copies=own["copies"], touch=own["touch"]), own["zeros"], own["least_zero"]
    images = of(boardless=own["boardless"], views=of(shared="estimated"))
    listed = STAGES["vision"].module("compute").left_out_of_calibration
    assert listed(None, of(simulated=own["simulated"]), images, found) == more


@pytest.mark.parametrize(
    ("given", "more"),
    [
        ({}, ()),
        ({"view": {"farthest_mm": 900.0}}, (LeftOut("objects_out_of_view", ("can",)),)),
        ({"arm": {"repeatability_mm": 0.0}}, (LeftOut("arm_errors"),)),
    ],
)
def test_a_cell_with_a_camera(given, more):
    file = load_vision(Path(f"data/vision/{ROBOT}.yaml"), load_robot(ROBOT))
    parts = {part: getattr(file, part).model_copy(update=given.get(part, {})) for part in ("view", "arm")}
    seen = file.model_copy(update=parts | {"objects": file.objects[:1]})
    assert tuple(STAGES["vision"].module("compute")._left_out_of_file(seen)) == more


def test_every_subject_has_words_in_chinese():
    with using("zh"):
        texts = [left_out_text(LeftOut(subject, amount=3.0)) for subject in get_args(LeftOutSubject)]
    assert all(any("\u4e00" <= letter <= "\u9fff" for letter in text) for text in texts)
