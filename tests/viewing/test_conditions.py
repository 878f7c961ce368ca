"""Before pages advise to run, mount or choose something they say what was left out and what nothing confirms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from er3a.identifiability.entry_evidence import Tolerance
from er3a.identifiability.proposals import LookAtMotion
from er3a.identifiability.reactions import CheckCounts, CheckTally
from er3a.identifiability.statements import ToolOff
from er3a.pipeline.messages.left_out import say_reserved
from er3a.pipeline.messages.validation import how_far_off, settled_parts, unconfirmed
from er3a.pipeline.messages.vision import say
from er3a.pipeline.results import LeftOut
from er3a.pipeline.stages.dynamics.model import NoLimits
from er3a.pipeline.stages.inverse.model import RankingRows
from er3a.pipeline.stages.inverse.report import _rule_rows
from er3a.pipeline.stages.validation.model import LeftOpen, PartFound
from er3a.pipeline.stages.vision.model import GraspCounts
from er3a.pipeline.viewing.index import _condition, _proposed

TALLY = CheckTally(24)
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
        "Confirmed by independent documents: 16 of 17 lengths and twists (for 10 of these only the size; the sign "
        "follows from open entries), 5 of 12 zeros and directions (for 5 of these only the size; the sign follows from "
        f"open entries). Not confirmed: {names}."
    )
    assert names in _condition(FOUND.parts, FOUND.unbounded)
    nothing = tuple(replace(part, settled=0, up_to_signs=0) for part in FOUND.parts)
    assert unconfirmed(nothing, FOUND.unbounded) == ("all lengths and twists, all zeros and directions, all limits")


def test_a_table_without_evidence_is_a_condition_and_a_confirmed_one_is_none():
    assert _condition((), ()).startswith("Run nothing on the arm until its table is confirmed")
    assert _condition([replace(part, settled=part.entries, up_to_signs=0, open=()) for part in FOUND.parts], ()) == ""


def test_weak_entries_which_have_no_name_here_are_counted():
    weak = replace(FOUND.parts[1], settled=5, up_to_signs=0, open=("offset6",))
    assert unconfirmed([weak], ()) == "offset 6, 6 more of the zeros and directions"


def test_a_turned_flange_moves_the_tip_of_a_tool():
    (first, _) = how_far_off(FOUND)
    assert first.startswith(
        "If an open or weak entry (alpha 6, offset 6) is wrong, the tool point (without a tool: the"
    )
    assert "off by up to 2 times its distance from there. Run no Cartesian target with a tool" in first
    (quarter, _) = how_far_off(replace(FOUND, off=ToolOff(0.0, 90.0)))
    chord = np.linalg.norm(np.array([1.0, 0.0]) - [0.0, 1.0])  # of a quarter turn
    assert f"{chord:.2g} times its distance" in quarter
    weak = replace(FOUND, parts=(replace(FOUND.parts[0], settled=5), *FOUND.parts[1:]))
    assert "If an open or weak entry is wrong" in how_far_off(weak)[0]  # one more is not settled, and has no name here


def test_other_entries_are_to_be_checked_only_where_there_are_others():
    only = replace(FOUND, parts=(PartFound("zero_and_directions", "open", 12, 11, 0, (), (), TURNED),))
    only = replace(only, unbounded=("direction1",))
    assert "Then check the other" not in _proposed(only)["measurement"]
    assert "Then check the other" in _proposed(replace(only, unbounded=("direction1", "direction2")))["measurement"]
    assert "Then check the other" in _proposed(FOUND)["measurement"]
    assert "at reduced speed (T1), jog +J1 a few degrees" in _proposed(FOUND)["measurement"]


def test_a_verdict_says_what_it_is_not_to_be_taken_for():
    grasped = GraspCounts(2, 2, (), (), None, (), simulated=False)
    torque = NoLimits(5, 2, 14.0, 4.1, "N m", "arc", (), 0, None)
    assert say_reserved(grasped, [LeftOut("carried")]).endswith("This is of the bare arm: no gripper was checked.")
    assert say_reserved(torque, [LeftOut("friction")]).endswith("lower bounds, so don't choose motors by them.")
    for found in (grasped, torque):
        assert say_reserved(found, [LeftOut("jerk")]) == say(found)


def test_an_arm_that_nothing_can_meet_has_infinite_clearance():
    one = (["t"], [0], ["found_arm"], ["clearance"], [np.inf], [1])
    assert _rule_rows(RankingRows(*map(np.array, one)), ["clearance"])[0][1].startswith("∞")
