"""What files expect of targets and paths, and what becomes of the verdict."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

import er3a.pipeline.messages.expectations  # noqa: F401
from er3a.errors import InputError
from er3a.files.path_file import load_paths
from er3a.files.target_file import read_targets
from er3a.pipeline.messages.expectations import as_expected
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.expectations import Outcome, demonstrations, unmet_expectations


@dataclass(frozen=True)
class Came:
    """Something that was judged."""

    name: str
    outcome: Outcome
    expect: Outcome | tuple[Outcome, ...] | None = None


def test_what_is_expected_and_comes_is_a_demonstration():
    judged = [Came("out", "unreachable", "unreachable"), Came("fine", "safe", "safe"), Came("bad", "collides")]
    assert unmet_expectations(judged) is None
    assert [shown.name for shown in demonstrations(judged, "safe")] == ["out"]


@dataclass(frozen=True)
class Judged(Came):
    """Something that can come to more than one outcome."""

    outcomes: tuple[Outcome, ...] = ()


def test_what_comes_besides_the_expected_is_not_expected():
    """A path that also collides is as expected only if both are given."""
    both: tuple[Outcome, ...] = ("collides", "leaves limits")
    part = Judged("line", "leaves limits", "leaves limits", both)
    unmet = unmet_expectations([part])
    assert unmet is not None
    assert say(unmet) == "Expectations not met: 1 of 1: line (collides, leaves limits; expected: leaves limits)."
    assert demonstrations([part], "safe") == ()
    assert as_expected(part) == "as expected; not expected: collides"
    given = Judged("line", "leaves limits", both[::-1], both)
    assert unmet_expectations([given]) is None
    shown = demonstrations([given], "safe")
    assert [(each.name, each.found) for each in shown] == [("line", both)]
    assert as_expected(given) == ""
    assert as_expected(Judged("line", "collides", "leaves limits", ("collides",))) == "not as expected"
    assert as_expected(Came("a", "safe")) == ""


def test_what_comes_otherwise_is_named_with_both_outcomes():
    found = unmet_expectations(
        [Came("out", "safe", "unreachable"), Came("line", "too fast", "safe"), Came("x", "safe")]
    )
    assert found is not None
    assert [each.name for each in found.unmet] == ["out", "line"]
    assert say(found) == (
        "Expectations not met: 2 of 2: out (pass; expected: unreachable); line (too fast; expected: pass)."
    )
    assert demonstrations([Came("out", "safe", "unreachable")], "safe") == ()


def test_what_expects_nothing_and_fails_is_named_beside_an_expectation_that_is_not_met():
    judged = [Came("out", "safe", "unreachable"), Came("line", "collides"), Came("arc", "safe")]
    found = unmet_expectations(judged, "safe")
    assert say(found).endswith(" Of what expects nothing: line (collides).")


def test_files_hold_expectations(tmp_path):
    table = tmp_path / "targets.csv"
    table.write_text(
        "name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,expect\na,500,0,400,180,0,0,\nb,900,0,9,0,0,0,unreachable\n"
    )
    assert [target.expect for target in read_targets(table)] == [None, "unreachable"]
    paths = tmp_path / "paths.yaml"
    text = (
        "kind: paths\npaths:\n  - {name: a, kind: joint, title: A, samples: 9, duration_s: 1, expect: EXPECT,\n"
        "     start_deg: [0, 0, 0, 0, 0, 0], end_deg: [10, 0, 0, 0, 0, 0]}\n"
    )
    paths.write_text(text.replace("EXPECT", "leaves limits"))
    assert load_paths(paths).paths[0].expected == ("leaves limits",)
    paths.write_text(text.replace("EXPECT", "[leaves limits, collides]"))
    assert load_paths(paths).paths[0].expected == ("leaves limits", "collides")
    paths.write_text(text.replace("EXPECT", "[]"))
    with pytest.raises(InputError, match=r"paths\[0\].expect"):
        load_paths(paths)
    paths.write_text(text.replace("EXPECT", "fine"))
    with pytest.raises(InputError, match=r"paths\[0\].expect"):
        load_paths(paths)
