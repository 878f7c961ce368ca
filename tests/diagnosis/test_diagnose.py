"""The diagnosis names the fault that a table has, and says when it can't."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import er3a
from er3a.diagnosis.diagnose import Hypothesis
from er3a.diagnosis.faults import Faults, rounded
from er3a.diagnosis.ranking import usable
from er3a.errors import InputError
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.references.reference import expected_of
from er3a.robots.robot import to_modified
from testing.known_faults import mutations_of, noisy, rank, try_mutation
from testing.reference_subjects import point_at_pose

TRUSTED = ("er3a_c60", "er3_600")
OFFSET_MISSING = fact("wrong_offset", joint=2, given_deg=0.0, fits_deg=-90.0)


def alike(hypothesis: Hypothesis) -> list[Faults]:
    """The faults of a hypothesis and of those that no reference tells from it, fitted numbers rounded."""
    return [tuple(map(rounded, faults)) for faults in (hypothesis.faults, *hypothesis.indistinguishable_from)]


def changed(name: str, **entries) -> er3a.Robot:
    """A robot with single entries changed: ``column=(joint, value)``."""
    robot = load_robot(name)
    for column, (joint, value) in entries.items():
        robot = robot.replace(**{column: np.where(np.arange(1, 7) == joint, value, getattr(robot, column))})
    return robot


def test_the_articles_zero_pose_lacks_an_offset_on_joint_2():
    first, second = er3a.diagnose(load_robot("er3a_c60_article"), "er3a_c60_article")[:2]
    assert first.faults == (OFFSET_MISSING,)
    assert first.residual_after < 0.05
    assert first.explains
    assert first.indistinguishable_from == ()
    assert first.residual_before == pytest.approx(np.hypot(777.21 - 650, 819.77 + 607.44), abs=1e-6)
    assert second.residual_after > 0.5
    assert not second.explains


@pytest.mark.long
def test_no_fault_or_two_makes_the_article_the_real_arm():
    ranked = er3a.diagnose(load_robot("er3a_c60_article"), "er3a_c60")
    assert not any(hypothesis.explains for hypothesis in ranked)
    assert min(hypothesis.residual_after for hypothesis in ranked) > 300


@pytest.mark.parametrize("name", TRUSTED)
def test_a_right_table_gets_no_diagnosis(name):
    assert er3a.diagnose(load_robot(name), name) == []
    assert er3a.diagnose(to_modified(load_robot(name)), name) == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ({"offset": (2, 0.0)}, OFFSET_MISSING),
        ({"offset": (3, np.pi)}, fact("wrong_offset", joint=3, given_deg=180.0, fits_deg=0.0)),
        ({"direction": (3, 1.0)}, fact("reversed_direction", joint=3)),
        ({"alpha": (3, np.pi / 2)}, fact("wrong_alpha_sign", joint=3, given_deg=90.0, fits_deg=-90.0)),
        ({"a": (3, 0.0)}, fact("wrong_length", joint=3, column="a", given_mm=0.0, fits_mm=70.0)),
        ({"d": (6, 0.0)}, fact("wrong_length", joint=6, column="d", given_mm=0.0, fits_mm=78.5)),
        ({"d": (4, 0.3015)}, fact("wrong_length", joint=4, column="d", given_mm=301.5, fits_mm=299.0)),
        ({"lower": (3, np.radians(75))}, fact("wrong_limits", joint=3, fault="lower_sign")),
    ],
)
def test_single_faults_are_named(entries, named):
    first = er3a.diagnose(changed("er3a_c60", **entries), "er3a_c60")[0]
    assert (named,) in alike(first)
    assert first.explains


@pytest.mark.long
def test_unit_swap_scale_and_convention_are_named():
    robot = load_robot("er3a_c60")
    modified = to_modified(robot)
    for faulty, named in (
        (robot.replace(a=robot.a / 1000), fact("wrong_unit", entries="a", misread="metres_as_millimetres")),
        (
            robot.replace(alpha=np.radians(robot.alpha)),
            fact("wrong_unit", entries="alpha", misread="radians_as_degrees"),
        ),
        (robot.replace(a=robot.d, d=robot.a), fact("swapped_entries", joint=None)),
        (robot.replace(a=robot.a * 1.05, d=robot.d * 1.05), fact("wrong_scale", factor=0.952381)),
        (modified.replace(convention="standard"), fact("wrong_convention", read_as="standard")),
        (
            robot.replace(lower=np.radians(robot.lower), upper=np.radians(robot.upper)),
            fact("wrong_unit", entries="limits", misread="radians_as_degrees"),
        ),
        (robot.replace(lower=robot.upper, upper=robot.lower), fact("wrong_limits", joint=None, fault="crossed")),
    ):
        assert (named,) in alike(er3a.diagnose(faulty, "er3a_c60")[0])


@pytest.mark.long
def test_two_faults_are_found_together():
    faulty = changed("er3a_c60", offset=(2, 0.0), d=(6, 0.0))
    first = er3a.diagnose(faulty, "er3a_c60")[0]
    assert set(map(rounded, first.faults)) == {
        OFFSET_MISSING,
        fact("wrong_length", joint=6, column="d", given_mm=0.0, fits_mm=78.5),
    }
    np.testing.assert_allclose(first.corrected.d, load_robot("er3a_c60").d, atol=1e-5)


def test_a_tool_in_the_robots_file_does_not_count():
    tool = np.eye(4)
    tool[:3, 3] = 0.0, 0.05, 0.2
    assert er3a.diagnose(load_robot("er3_600").replace(tool=tool), "er3_600") == []


def test_what_references_cannot_tell_apart_is_named():
    """Parallel axes 2 and 3: a sideways shift may stand in either row."""
    first = er3a.diagnose(changed("er3_600", d=(2, 0.02)), "er3_600")[0]
    lengths = [fault for faults in alike(first) for fault in faults if is_one(fault, "wrong_length")]
    assert any((fault.joint, fault.column, fault.given_mm) == (2, "d", 20.0) for fault in lengths)
    assert any((fault.joint, fault.column) == (3, "d") for fault in lengths)


@pytest.mark.long
@pytest.mark.parametrize(("times", "off"), [(1, 0), (10, 6)])
def test_members_of_a_set_differ_by_less_than_the_uncertainty_everywhere(times, off):
    """Where uncertainties are so large that some are like the best, but not like each other, too."""
    stated = [replace(each, uncertainty=times * each.uncertainty) for each in usable(load_references("er3_600"))]
    stated[12] = replace(stated[12], expected=stated[12].expected + off * stated[12].uncertainty)
    ranking = rank(changed("er3_600", alpha=(4, -np.pi / 2)), stated)
    _, uncertainty = expected_of(ranking.case.references)
    assert len(ranking.groups[0]) > 1
    for group in ranking.groups:
        difference = ranking.pool.difference[list(group)]
        assert (np.ptp(difference, axis=0) < uncertainty).all()


@pytest.mark.long
@pytest.mark.parametrize("name", TRUSTED)
def test_noise_raises_no_alarm(name, random):
    """Neither noise that the references own up to, nor ten times more than they say."""
    robot, stated = load_robot(name), usable(load_references(name))
    for _ in range(3):
        honest = noisy(stated, 0.5, random)
        assert er3a.diagnose(robot, honest) == []
        silent = [replace(loud, uncertainty=r.uncertainty) for r, loud in zip(stated, honest)]
        assert er3a.diagnose(robot, silent) == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "noise_mm", "every"),
    [
        ("er3a_c60", 0.5, 20),
        ("er3_600", 0.0, 20),
        *(pytest.param(name, noise, 8, marks=pytest.mark.long) for name, noise in zip(TRUSTED, (0.5, 0.0))),
    ],
)
def test_faults_that_references_see_are_ranked_first(name, noise_mm, every, random):
    robot, stated = load_robot(name), usable(load_references(name))
    outcomes = [
        try_mutation(robot, mutation, noisy(stated, noise_mm, random) if noise_mm else stated, noise_mm)
        for mutation in list(mutations_of(robot))[::every]
    ]
    seen = [outcome for outcome in outcomes if outcome.identifiable]
    assert len(seen) > 0.85 * len(outcomes)
    assert [outcome.faults for outcome in seen if not outcome.found] == []
    assert not any(outcome.needless for outcome in outcomes)
    assert np.median([outcome.set_size for outcome in seen]) == 1


def test_too_few_references_leave_many_hypotheses():
    stated = [r for r in usable(load_references("er3a_c60")) if r.subject == point_at_pose("zero pose", "flange", "z")][
        :1
    ]
    first = er3a.diagnose(changed("er3a_c60", d=(1, 0.2)), stated)[0]
    assert len(first.indistinguishable_from) > 5


def test_an_unknown_reference_set_is_one_clear_error():
    with pytest.raises(InputError, match="er3a_c60"):
        er3a.diagnose(load_robot("er3_600"), "er4")


def test_references_that_contradict_each_other_accuse_no_table():
    robot = load_robot("er3_600")
    stated = usable(load_references("er3_600"))
    flange = next(r for r in stated if r.subject == point_at_pose("zero pose", "flange", "x"))
    rumour = replace(flange, expected=flange.expected + 10, source="another catalogue")
    assert er3a.diagnose(robot, (*stated, rumour)) == []
    faulty = er3a.diagnose(changed("er3_600", offset=(2, 0.0)), (*stated, rumour))
    assert faulty[0].faults == (OFFSET_MISSING,)
