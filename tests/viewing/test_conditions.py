"""Before pages advise to run, mount or choose something they say what was left out and what nothing confirms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.proposals import LookAtMotion
from er3a.identifiability.reactions import CheckCounts, CheckTally
from er3a.identifiability.statements import ToolOff
from er3a.pipeline.messages.left_out import say_reserved
from er3a.pipeline.messages.pages import caveat
from er3a.pipeline.messages.validation import how_far_off, settled_parts, unconfirmed
from er3a.pipeline.messages.vision import say
from er3a.pipeline.overview.index import condition, proposed
from er3a.pipeline.results import FORMAT_VERSION, LeftOut, plain, read_foundation, write_checksums
from er3a.pipeline.stages.dynamics.model import NoLimits
from er3a.pipeline.stages.inverse.model import RankingRows
from er3a.pipeline.stages.inverse.page.report import rule_rows
from er3a.pipeline.stages.validation.model import LeftOpen, PartFound
from er3a.pipeline.stages.workspace.entry import BoxTask
from er3a.pipeline.stages.workspace.model import PlacementSummary, PlaceSummary, StandSummary
from er3a.pipeline.stages.workspace.page.capability_section import tray_rows
from er3a.pipeline.stages.workspace.page.tray import trays
from er3a.pipeline.stages.workspace.tool_capability import task_summary

TALLY = CheckTally(24)
FILE = "data/robots/arm.yaml"
TURNED = ToolOff(0.0, 180.0)
FOUND = LeftOpen(
    CheckCounts(TALLY, TALLY, CheckTally()),
    0,
    ("a set",),
    (),
    (),
    (
        PartFound("geometry", "open", 17, 6, 10, (), ("alpha6",), TURNED),
        PartFound("zero_and_directions", "open", 12, 0, 5, (), ("offset6",), TURNED),
        PartFound("limits", "weak", 12, 0, 0, (), (), ToolOff(0.0, 0.0)),
    ),
    Tolerance(),
    TURNED,
    at_least=False,
    unbounded=tuple(f"direction{k}" for k in range(1, 7)),
    next_measurement=LookAtMotion("direction1", 1, "flange", (0.0,) * 6, "left"),
    contradiction=None,
)


def test_what_nothing_confirms_is_named_entry_by_entry_or_as_a_whole():
    names = "alpha 6, offset 6, direction 1, 2, 3, 4, 5, 6, all limits"
    assert unconfirmed(FOUND.parts, FOUND.unbounded) == names
    assert settled_parts(FOUND) == (
        "Confirmed by independent documents: 16 of 17 lengths and twists (10 of these only as long as the open "
        "entries are right), 5 of 12 zeros and directions (5 of these only as long as the open entries are right). "
        f"Not confirmed: {names}."
    )
    assert names in condition(FOUND.parts, FOUND.unbounded)
    nothing = tuple(replace(part, settled=0, up_to_signs=0) for part in FOUND.parts)
    assert unconfirmed(nothing, FOUND.unbounded) == ("all lengths and twists, all zeros and directions, all limits")


def test_a_table_without_evidence_is_a_condition_and_a_confirmed_one_is_none():
    assert condition((), ()).startswith("Run no path or program on the arm until its table is confirmed")
    assert condition(FOUND.parts, (), "joint speeds").endswith(", joint speeds (assumed).")
    assert condition([replace(part, settled=part.entries, up_to_signs=0, open=()) for part in FOUND.parts], ()) == ""


def test_weak_entries_which_have_no_name_here_are_counted():
    weak = replace(FOUND.parts[1], settled=5, up_to_signs=0, open=("offset6",))
    assert unconfirmed([weak], ()) == "offset 6, 6 more of the zeros and directions"


def test_a_turned_flange_moves_the_tip_of_a_tool():
    unbounded, first = how_far_off(FOUND)  # the larger error stands first
    assert unbounded.endswith("the tool could be off by any amount.")
    assert first.startswith(
        "If an open or weak entry (alpha 6, offset 6) is wrong, the tool point (without a tool: the"
    )
    assert "off by up to 2 times its distance from there. Run no Cartesian target with a tool" in first
    (_, quarter) = how_far_off(replace(FOUND, off=ToolOff(0.0, 90.0)))
    chord = np.linalg.norm(np.array([1.0, 0.0]) - [0.0, 1.0])  # of a quarter turn
    assert f"{chord:.2g} times its distance" in quarter
    weak = replace(FOUND, parts=(replace(FOUND.parts[0], settled=5), *FOUND.parts[1:]))
    assert "If an open or weak entry is wrong" in how_far_off(weak)[1]  # one more is not settled, and has no name here


def test_other_entries_are_to_be_checked_only_where_there_are_others():
    only = replace(FOUND, parts=(PartFound("zero_and_directions", "open", 12, 11, 0, (), (), TURNED),))
    only = replace(only, unbounded=("direction1",))
    assert "Then check the other" not in proposed(only, FILE)["measurement"]
    assert (
        "Then check the other" in proposed(replace(only, unbounded=("direction1", "direction2")), FILE)["measurement"]
    )
    assert "Then check the other" in proposed(FOUND, FILE)["measurement"]
    assert "at reduced speed (T1), jog +J1 a few degrees" in proposed(FOUND, FILE)["measurement"]
    assert f"turn its sign in {FILE}" in proposed(FOUND, FILE)["measurement"]


def test_a_verdict_says_what_it_is_not_to_be_taken_for():
    torque = NoLimits(5, 2, 14.0, 4.1, "N m", "arc", (), 0, None)
    assert say_reserved(torque, [LeftOut("friction")]).endswith("known masses alone: don't choose motors by them.")
    assert say_reserved(torque, [LeftOut("jerk")]) == say(torque)


def test_an_arm_that_nothing_can_meet_has_infinite_clearance():
    one = (["t"], [0], ["found_arm"], ["clearance"], [np.inf], [1], [""])
    assert rule_rows(RankingRows(*map(np.array, one)), ["clearance"])[0][1].startswith("∞")


def test_of_a_table_that_nothing_settles_each_page_says_so_first(tmp_path):
    none = replace(FOUND, parts=tuple(replace(part, settled=0, up_to_signs=0) for part in FOUND.parts))
    assert say(none).startswith("Don't rely on this table: ")
    assert "none settles any entry of it" in say(none)
    assert "but not all of it is settled" in say(FOUND)
    assert (_foundation(none, tmp_path), _foundation(FOUND, tmp_path)) == ("unsettled", "caution")
    assert caveat("unsettled").text.startswith("No entry of this D-H table is settled by an independent document")


def _foundation(found: LeftOpen, folder: Path) -> str:
    verdict = {"status": "caution", "params": plain(found)}
    head = {"format_version": FORMAT_VERSION, "robot": "r", "stage": "validation", "figures": []}
    (folder / "summary.json").write_text(json.dumps(head | {"verdict": verdict, "provenance": {}}), encoding="utf-8")
    write_checksums(folder)
    return read_foundation(folder)


def placed(**stands) -> SimpleNamespace:
    """The workspace stage's results, which put a box of 200 x 150 x 50 mm at (350, 0, 400) mm."""
    spot = PlaceSummary((0.35, 0.0, 0.4), (0.15, 0.2, 0.05), True, None, 1, 1, None, (0,) * 3, (0,) * 3)
    stand = [StandSummary("table", 0.1, None, None, "in_the_way", spot)] if stands.get("over") else []
    task = task_summary(BoxTask())
    found = PlacementSummary(None, 20, task, (0.02,) * 3, 45, 1, 1, (spot,), tuple(stand))
    return SimpleNamespace(results=SimpleNamespace(summary=SimpleNamespace(placement=found)))


def test_the_workspace_page_says_how_far_a_tray_can_be_moved():
    results = placed().results
    placement = results.summary.placement
    spot = replace(placement.best, room_down_m=(0.075, 0.2, 0.2), room_up_m=(0.075, 0.175, 0.05))
    results.summary = SimpleNamespace(placement=replace(placement, places=(spot,)), not_examined=[LeftOut("tool")])
    results.places = None
    (found,) = trays(results.summary)
    rows = dict(tray_rows(found, results, results.summary.placement, "At most 2 kg."))
    room = "x ±75, y −200 to 175, z −200 to 50"
    assert rows["Margins"].endswith(f"Reach and limits allow to move it by {room} mm, one direction at a time.")
    assert rows["Payload there"] == "At most 2 kg."
    assert rows["Place"].startswith("In the air: no surface is known there, centre (350, 0, 400) mm")
    assert "put the tray into the study's scene file as a box, and run again" in rows["What to do first"]
    assert "No tool is given" in rows["What to do first"]


def test_a_tray_stands_on_a_surface_or_on_a_stand_over_it():
    (tray,) = trays(placed(over=True).results.summary)
    assert tray.line == (
        "On a stand 275 mm high on table (z = 100 mm), centre (350, 0, 400) mm, edges 150 × 200 × 50 mm along x, y, z"
    )
    assert tray.row[1:3] == ["350, 0, 400", "150 × 200 × 50"]
    half = replace(tray, place=replace(tray.place, size_m=(0.0125, 0.15, 0.05)))
    assert half.edges == "12.5 × 150 × 50"
    assert trays(SimpleNamespace()) == []
