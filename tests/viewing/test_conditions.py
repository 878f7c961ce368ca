"""Before pages advise to run, mount or choose something they say what was left out and what nothing confirms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import er3a.pipeline.messages.dynamics  # noqa: F401
from er3a.files.robot_library import load_robot
from er3a.finding import Finding, fact
from er3a.kinematics.inverse import inverse
from er3a.pipeline.messages.pages import caveat
from er3a.pipeline.messages.say import say
from er3a.pipeline.messages.validation import condition, how_far_off, settled_parts, unconfirmed
from er3a.pipeline.results import FORMAT_VERSION, plain, read_foundation, write_checksums
from er3a.pipeline.scope import Open
from er3a.pipeline.stages.programs.model import ProgramMotion, ProgramsResults
from er3a.pipeline.stages.trajectory.model import PathChecks, TrajectoryResults
from er3a.pipeline.stages.vision.model import PathRows, VisionResults
from er3a.pipeline.stages.workspace.entry import BoxTask
from er3a.pipeline.stages.workspace.model import PlacementSummary, PlaceSummary, StandSummary
from er3a.pipeline.stages.workspace.page.capability_section import tray_rows
from er3a.pipeline.stages.workspace.page.tray import enters, placing
from er3a.pipeline.stages.workspace.tool_capability import task_summary


def _part(part: str, entries: int, settled: int, up_to_signs: int, *open_: str) -> Finding:
    counted = {"entries": entries, "settled": settled, "up_to_signs": up_to_signs}
    return fact("part_found", part=part, **counted, contradicted=(), open=open_)


FOUND = fact(
    "validation.left_open",
    counts=(fact("counted_checks", kind="independent", passed=24, total=24),),
    conflicting=0,
    why="uncontradicted",
    claims=(),
    own_text=(),
    parts=(
        _part("geometry", 17, 6, 10, "alpha6"),
        _part("zero_and_directions", 12, 0, 5, "offset6"),
        _part("limits", 12, 0, 0),
    ),
    settled_mm=5.0,
    settled_deg=0.5,
    off_mm=0.0,
    off_deg=180.0,
    at_least=False,
    unbounded=tuple(f"direction{k}" for k in range(1, 7)),
    next_measurement=fact(
        "look_at_motion", entry="direction1", joint=1, point="flange", pose_deg=(0.0,) * 6, seen="left"
    ),
    contradiction=None,
)


def test_what_nothing_confirms_is_named_entry_by_entry_or_as_a_whole():
    names = "alpha 6, offset 6, direction 1, 2, 3, 4, 5, 6, all limits"
    assert unconfirmed(FOUND.parts, FOUND.unbounded) == names
    assert settled_parts(FOUND).endswith(f"Not confirmed: {names}.")
    for counted in ("5 mm and 0.5°", "16 of 17 lengths and twists (10 of", "5 of 12 zeros and directions (5 of"):
        assert counted in settled_parts(FOUND)
    assert names in condition(FOUND.parts, FOUND.unbounded)
    nothing = tuple(part.but(settled=0, up_to_signs=0) for part in FOUND.parts)
    assert unconfirmed(nothing, FOUND.unbounded) == ("all lengths and twists, all zeros and directions, all limits")


def test_a_table_without_evidence_is_a_condition_and_a_confirmed_one_is_none():
    assert condition((), ()).startswith("Run no path or program on the arm until its table is confirmed")
    assert condition([part.but(settled=part.entries, up_to_signs=0, open=()) for part in FOUND.parts], ()) == ""


def test_weak_entries_which_have_no_name_here_are_counted():
    weak = FOUND.parts[1].but(settled=5, up_to_signs=0)
    assert unconfirmed([weak], ()) == "offset 6, 6 more of the zeros and directions"


def test_a_turned_flange_moves_the_tip_of_a_tool():
    unbounded, first = how_far_off(FOUND)  # the larger error stands first
    assert "direction 1, 2, 3, 4, 5, 6" in unbounded
    assert first.startswith(
        "If an open or weak entry (alpha 6, offset 6) is wrong, the tool is off by up to 0 mm and 180"
    )
    assert "off by up to 2 times its distance" in first
    assert "Run no Cartesian target with a tool" in first
    (_, quarter) = how_far_off(FOUND.but(off_deg=90.0))
    chord = np.linalg.norm(np.array([1.0, 0.0]) - [0.0, 1.0])  # of a quarter turn
    assert f"{chord:.2g} times its distance" in quarter
    weak = FOUND.but(parts=(FOUND.parts[0].but(settled=5), *FOUND.parts[1:]))
    assert "If an open or weak entry is wrong" in how_far_off(weak)[1]  # one more is not settled, and has no name here


def test_of_a_table_that_nothing_settles_each_page_says_so_first(tmp_path):
    none = FOUND.but(why="unsettled", parts=tuple(part.but(settled=0, up_to_signs=0) for part in FOUND.parts))
    assert say(none) != say(FOUND)
    assert (_foundation(none, tmp_path), _foundation(FOUND, tmp_path)) == ("unsettled", "caution")
    assert caveat("unsettled").text.startswith("No entry of this D-H table is settled by an independent document")


def _foundation(found: Finding, folder: Path) -> str:
    verdict = {"status": "caution", "params": plain(found.params)}
    head = {"format_version": FORMAT_VERSION, "robot": "r", "stage": "validation", "figures": []}
    (folder / "summary.json").write_text(json.dumps(head | {"verdict": verdict, "provenance": {}}), encoding="utf-8")
    write_checksums(folder)
    return read_foundation(folder)


@pytest.mark.long
def test_a_point_enters_a_box_when_a_dense_walk_along_its_polyline_does(random):
    """Also if no vertex lies in the box; a vertex that is not known hides only the pieces that it ends."""
    low, high = np.array([-0.3, -0.2, -0.1]), np.array([0.2, 0.3, 0.25])
    entered = 0
    for _ in range(300):
        points = random.uniform(-1, 1, (8, 3))
        points[3, :2] = points[2, :2]  # straight up
        times = np.linspace(0, 7, 20_001)
        walked = np.column_stack([np.interp(times, np.arange(8), column) for column in points.T])
        inside = ((walked >= low) & (walked <= high)).all(axis=1).any()
        found = enters(points, low, high)
        assert found >= inside  # a corner may be cut between two points of the walk
        if found and not inside:
            assert not enters(points, low + 1e-3, high - 1e-3)
        entered += inside
    assert 50 < entered < 250
    across = np.array([[-1.0, 0, 0], [1, 0, 0]])
    assert enters(across, low, high)
    assert enters(across + np.array([0, 0, 0.25]), low, high)  # along a face
    assert not enters(across + np.array([0, 0, 0.26]), low, high)
    assert not enters(np.array([[-1.0, 0, 0], [np.nan] * 3, [1, 0, 0]]), low, high)
    assert enters(np.array([[-1.0, 0, 0], [np.nan] * 3, [1, 0, 0], [0, 0, 0]]), low, high)


def placed(**stands) -> SimpleNamespace:
    """The workspace stage's results, which put a box of 200 x 150 x 50 mm at (350, 0, 400) mm."""
    spot = PlaceSummary((0.35, 0.0, 0.4), (0.15, 0.2, 0.05), True, None, 1, None)
    stand = [StandSummary("table", 0.1, None, None, "in_the_way", spot)] if stands.get("over") else []
    task = task_summary(BoxTask())
    found = PlacementSummary(None, 20, task, (0.02,) * 3, 45, 1, 1, (spot,), tuple(stand))
    return SimpleNamespace(results=SimpleNamespace(summary=SimpleNamespace(placement=found)))


def moving(kind, table, key, summary, motions) -> SimpleNamespace:
    """Results of a stage with motions, all from x = 0 to x = 1000 mm in 10 s, at y and z of each, by name."""
    rows = [(name, 10.0 * x, (1000.0 * x, y, z)) for name, (y, z) in motions.items() for x in (0, 0.5, 1)]
    columns = {name: np.zeros((len(rows), 6) if each.is_group else len(rows)) for name, each in table.columns().items()}
    columns["t_s"] = np.array([row[1] for row in rows])
    columns |= {key: np.array([row[0] for row in rows]), "xyz_mm": np.array([row[2] for row in rows]).reshape(-1, 3)}
    return SimpleNamespace(results=kind(summary, *([table(**columns)] * (5 if kind is TrajectoryResults else 3))))


def named(*names) -> list[SimpleNamespace]:
    return [SimpleNamespace(name=name, chosen=None) for name in names]


@pytest.mark.parametrize("over", [False, True])
def test_motions_through_the_tray_or_its_stand_are_counted(over):
    """Of those that pass without it; the others do not count."""
    paths = SimpleNamespace(paths=named("into", "below", "beside"))
    programs = SimpleNamespace(programs=named("through", "still"))
    motions = {"into": (99.0, 424.0), "below": (0.0, 150.0), "beside": (101.0, 400.0)}
    stored = {
        "workspace": placed(over=over),
        "trajectory": moving(TrajectoryResults, PathChecks, "path", paths, motions),
        "programs": moving(ProgramsResults, ProgramMotion, "program", programs, {"through": (0.0, 376.0)}),
    }
    sound = {"trajectory": ["below", "beside"], "programs": ["through", "still"]}
    found = placing(stored, load_robot("er3a_c60"), {}, sound)
    names = "below, through" if over else "through"
    assert line_of(found).endswith(f"in the way of {1 + over} of the 4 motions that pass without it: {names}.")
    assert found.tried[0].hindered == (["below", "through"] if over else ["through"])


def line_of(found):
    """Where the tray is put, and what it is in the way of there."""
    return f"{found.tray.line}: {found.hindrance}."


def test_the_place_that_fewest_motions_meet_comes_first():
    """The floor's is 500 mm to the side, where the tool point does not come."""
    robot = load_robot("er3a_c60")
    programs = SimpleNamespace(programs=named("through"))
    stored = {
        "workspace": placed(over=True),
        "programs": moving(ProgramsResults, ProgramMotion, "program", programs, {"through": (0.0, 376.0)}),
    }
    sound = {"programs": ["through"]}
    assert line_of(placing(stored, robot, {}, sound)) == (
        "On a stand 275 mm high on table, centre (350,\u00a00,\u00a0400) mm, edges 150 × 200 × 50 mm along x, y, z: "
        "in the way of 1 of the 1 motions that pass without it: through."
    )
    placement = stored["workspace"].results.summary.placement
    aside = replace(placement.places[0], centre_m=(0.35, 0.5, 0.4))
    floor = StandSummary("floor", 0.0, None, None, "in_the_way", aside)
    stored["workspace"].results.summary.placement = replace(placement, stands=(*placement.stands, floor))
    found = placing(stored, robot, {}, sound)
    assert line_of(found) == (
        "On a stand 375 mm high on floor, centre (350,\u00a0500,\u00a0400) mm, edges 150 × 200 × 50 mm along x, y, z: "
        "in the way of 0 of the 1 motions that pass without it."
    )
    assert [each.hindered for each in found.tried] == [[], ["through"]]
    half = replace(found.tray.place, size_m=(0.0125, 0.15, 0.05))
    assert replace(found.tray, place=half).edges == "12.5 × 150 × 50"


def test_links_of_grasps_meet_the_tray_where_the_tool_point_does_not():
    """J1 carries the flange from -60 deg towards 0, up to where by hand its chord is short of the tray at
    y = -100 mm; the wrist's shapes are in it before."""
    robot = load_robot("er3a_c60")
    down = np.array([[1.0, 0, 0, 0.35], [0, -1, 0, 0], [0, 0, -1, 0.4], [0, 0, 0, 1]])
    there = np.degrees(inverse(robot, down, np.zeros(6)).q[0])
    q = np.stack(
        [
            there - np.array([60.0, 0, 0, 0, 0, 0]),
            there - np.array([20.0, 0, 0, 0, 0, 0]),
            there - np.array([20.0, 0, 0, 0, 0, -30.0]),
        ]
    )
    names = np.array(["can"] * 3 + ["missed"] * 3)
    ways = PathRows(names, names, np.arange(6), np.tile([0.0, 2, 3], 2), np.vstack([q, q]))
    objects = [SimpleNamespace(name=name, outcome=outcome) for name, outcome in GRASPED.items()]
    empty = VisionResults(SimpleNamespace(objects=objects), *(None,) * 3)
    vision = SimpleNamespace(results=replace(empty, ways=ways))
    sound = {"vision": ["can"]}
    found = placing({"workspace": placed(), "vision": vision}, robot, {}, sound)
    assert 350 * np.sin(np.radians(20)) > 100
    assert line_of(found).endswith("in the way of 1 of the 1 motions that pass without it: can.")


GRASPED = {"can": "grasped", "missed": "not graspable"}


def test_the_workspace_page_says_where_a_tray_stands_and_what_to_do_first():
    results = placed().results
    results.summary = SimpleNamespace(placement=results.summary.placement, assumed=[Open("tool")])
    results.places = None
    found = placing({"workspace": SimpleNamespace(results=results)}, load_robot("er3a_c60"), {}, {})
    rows = dict(tray_rows(found, results, results.summary.placement, "At most 2 kg."))
    assert rows["Payload there"] == "At most 2 kg."
    assert rows["Place"].startswith("In the air: no surface is known there, centre (350,\u00a00,\u00a0400) mm")
    assert "scene file as boxes, and run again" in rows["What to do first"]
    assert "No tool is given" in rows["What to do first"]


def test_without_motions_or_without_a_place_nothing_is_said_to_be_free():
    assert placing({}, None, {}, {}) is None
    alone = placing({"workspace": placed()}, None, {}, {})
    assert line_of(alone).endswith(": no path, program or grasp was compared with it.")
    clear = moving(
        ProgramsResults, ProgramMotion, "program", SimpleNamespace(programs=named("far")), {"far": (500.0, 0.0)}
    )
    found = placing({"workspace": placed(), "programs": clear}, load_robot("er3a_c60"), {}, {"programs": ["far"]})
    assert line_of(found).endswith("in the way of 0 of the 1 motions that pass without it.")
    nothing = placing({"workspace": placed(), "programs": clear}, load_robot("er3a_c60"), {}, {"programs": []})
    assert line_of(nothing).endswith("in the way of 0 of the 0 motions that pass without it.")
