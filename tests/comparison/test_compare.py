"""Whether two tables are of one arm, against arms that are made here from D-H matrices alone."""

from __future__ import annotations

import itertools
import json
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.comparison.compare import ANGLE_UNITS, LENGTH_UNITS, best_of
from er3a.errors import InputError
from er3a.files.robot_library import read_arm
from er3a.files.robot_writer import write_robot
from er3a.formats.urdf_tree import read_chain, tip_after
from er3a.geometry.transforms import rot_x, rot_z, translation
from er3a.pipeline.cli import app
from er3a.pipeline.messages.comparison import headline, layer_rows
from er3a.robots.masses import LinkMass, MassBody, Masses
from er3a.robots.robot import CombinedLimit
from testing.arm_pairs import KINDS, Arm, defined_elsewhere, flange_at, name, pose, random_arm, with_wrong_entries
from testing.arms import made_of
from testing.published_tables import PAIRS, best_alignment_mm, urdf_flange, urdf_path, write_csv
from testing.readme import README


def robot(arm: Arm) -> er3a.Robot:
    ends = {"lower": np.where(arm.sliding, 0.0, -2.5), "upper": np.where(arm.sliding, 0.5, 2.5)}
    return er3a.Robot(name="arm", title="arm", convention="standard", **ends, **vars(arm))


def arm_of(robot: er3a.Robot) -> Arm:
    return Arm(*(getattr(robot, field) for field in Arm.__dataclass_fields__))


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_no_right_table_is_accused(kind):
    random = np.random.default_rng(KINDS.index(kind))
    for _ in range(3):
        arm = random_arm(random, kind)
        printed = robot(arm)
        assert er3a.compare(printed, printed).verdict == "equal"
        other = defined_elsewhere(random, arm)
        found = er3a.compare(printed, robot(other))
        assert (found.verdict, found.geometry.differences) == ("same_arm", ())
        assert found.aligned_mm < 0.5
        q = random.uniform(printed.lower, printed.upper, (20, printed.joints))
        gaps = [np.linalg.norm((flange_at(arm, row) - flange_at(other, row))[:3, 3]) for row in q]
        assert found.as_printed_mm > 1000 * max(gaps) * 0.5
        mended = arm_of(found.corrected)
        assert er3a.compare(found.corrected, robot(other)).verdict == "equal"
        far = max(np.linalg.norm((flange_at(mended, row) - flange_at(other, row))[:3, 3]) for row in q)
        assert 1000 * far == pytest.approx(0, abs=4.0)  # angles that agree to 0.1 deg stay as printed


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_wrong_entries_are_named(kind):
    """Every other kind with its base, flange and zeros defined elsewhere; the campaign has forty times as many."""
    random = np.random.default_rng(100 + KINDS.index(kind))
    arm = random_arm(random, kind)
    other, wrong = with_wrong_entries(random, arm)
    if KINDS.index(kind) % 2:
        other = defined_elsewhere(random, other)
    found = er3a.compare(robot(arm), robot(other))
    assert found.verdict == "other_arm"
    named = [frozenset({each.entry, *each.alike}) for each in found.geometry.differences]
    assert len(named) == len(wrong.entries)
    for entry, alike in zip(wrong.entries, wrong.alike):
        assert any(name(entry) in own or own & alike for own in named), (entry, named)
    assert er3a.compare(found.corrected, robot(other)).geometry.same


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "seed", "case", "entries"),
    [
        ("offset_wrist", 3434, 79, {"alpha3", "alpha5"}),  # a wrong twist makes two axes parallel
        ("parallel", 34029, 93, {"alpha2", "d7"}),  # parallel axes lean, and lengths along others are sums
        ("generic", 34029, 61, {"a1", "alpha2", "alpha3"}),  # the sign of a length between nearly parallel axes
        ("nearly_parallel", 34029, 190, {"a2", "a3"}),  # a normal far away, where a is 0 as printed
    ],
)
def test_wrong_entries_beside_axes_that_are_or_nearly_are_parallel_are_named(kind, seed, case, entries):
    random = np.random.default_rng([seed, KINDS.index(kind), case])
    arm = random_arm(random, kind)
    defined_elsewhere(random, arm)
    other, wrong = with_wrong_entries(random, arm)
    assert {name(entry) for entry in wrong.entries} == entries
    assert random.random() < 0.7
    other = robot(defined_elsewhere(random, other))
    found = er3a.compare(robot(arm), other)
    assert {each.entry for each in found.geometry.differences} == entries
    assert er3a.compare(found.corrected, other).verdict == "equal"


@pytest.mark.long
def test_a_twist_of_a_half_turn_has_no_sign():
    random = np.random.default_rng([20261123, KINDS.index("parallel"), 26])
    arm = random_arm(random, "parallel")
    defined_elsewhere(random, arm)
    other, wrong = with_wrong_entries(random, arm)
    found = er3a.compare(robot(arm), robot(other))
    assert sorted(each.entry for each in found.geometry.differences) == sorted(map(name, wrong.entries))
    assert er3a.compare(found.corrected, robot(other)).verdict == "equal"


def article() -> er3a.Robot:
    return er3a.load_robot("er3a_c60_article")


@pytest.mark.long
def test_the_articles_table_is_another_arm():
    found = er3a.compare(article(), er3a.load_robot("er3a_c60"))
    assert found.verdict == "other_arm"
    assert {each.entry: (each.a, each.b) for each in found.geometry.differences} == {
        "a1": (0, 50),
        "a2": (650, 270),
        "a3": (0, 70),
        "d4": (651.61, 299),
    }
    assert (found.directions.reversed, found.base.turn.deg, found.flange.turn.deg) == ((2, 3, 5), 0, 0)
    text = " ".join(README.read_text(encoding="utf-8").split())
    assert f"{found.as_printed_mm:.0f} mm off as printed, and {found.aligned_mm:.0f} mm off after" in text
    assert er3a.compare(found.corrected, er3a.load_robot("er3a_c60")).verdict == "equal"


@pytest.mark.long
@pytest.mark.parametrize(
    ("slip", "cause"),
    [
        (lambda arm: arm.replace(a=arm.d, d=arm.a), "a_and_d_swapped"),
        (lambda arm: arm.replace(convention="modified"), "other_convention"),
        (lambda arm: arm.replace(a=arm.a * 1.3, d=arm.d * 1.3), "scale"),
        (lambda arm: arm.replace(d=np.roll(arm.d, 1)), "rows_shifted"),
        (
            lambda arm: arm.replace(**{each: np.roll(getattr(arm, each), 1) for each in ("a", "alpha", "d")}),
            "rows_shifted",
        ),
    ],
)
def test_slips_are_named(slip, cause):
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    found = er3a.compare(slip(right), right)
    assert found.verdict == "other_arm"
    assert [(each.code, each.side) for each in found.causes] == [(cause, "a")]


def test_all_alphas_negated_of_an_arm_that_is_its_own_mirror_image_are_one_slip():
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    found = er3a.compare(right.replace(alpha=-right.alpha), right)
    assert (found.verdict, found.geometry.same) == ("same_arm", True)
    assert [each.code for each in found.causes] == ["all_alphas_negated"]


@pytest.mark.long
@pytest.mark.parametrize(("slide", "end"), [(0, "base"), (3, "flange")])
def test_a_slip_is_named_where_base_or_flange_take_up_the_turn_of_a_slide(slide, end):
    rows = [("R", 20, 90, 100, -150, 150), ("R", 300, 0, 120, -150, 150), ("R", 250, 90, 40, -150, 150)]
    rows.insert(slide, ("P", 0, 90, 70, 0, 300))
    right = made_of(rows)
    over = rot_x(np.pi / 2 * (slide == 3))  # the twist of the last row
    other = right.replace(offset=np.where(np.arange(4) == slide, 0.3, 0.0), **{end: over.T @ rot_z(-0.3) @ over})
    assert er3a.compare(right, other).verdict == "equal"
    causes = er3a.compare(right.replace(a=right.d, d=right.a), other).causes
    assert [(each.code, each.side) for each in causes] == [("a_and_d_swapped", "a")]


@pytest.mark.long
@pytest.mark.parametrize(("convention", "row"), [("standard", 3), ("modified", 4)])
@pytest.mark.parametrize(("slide", "column"), [(False, "alpha"), (True, "beta")])
def test_a_lean_of_the_next_axis_is_a_twist_unless_that_takes_two_entries(slide, column, convention, row):
    """Of coincident axes alpha will do with other zeros of both; a slide's theta is an entry of its own."""
    on_axis = ("P", 0, 0, 0, 0, 300) if slide else ("R", 0, 0, 200, -150, 150)
    others = [("R", a, 90, d, -150, 150) for a, d in ((0, 100), (100, 0), (0, 50), (80, 0))]
    arm = made_of([*others[:2], on_axis, *others[2:]])
    right = arm.replace(convention=convention, a=np.roll(arm.a, row - 3), alpha=np.roll(arm.alpha, row - 3))
    found = er3a.compare(right, right.replace(beta=np.radians(2) * (np.arange(1, 6) == row)))
    assert [(each.entry, each.a, each.b) for each in found.geometry.differences] == [
        (f"{column}{row}", 0, pytest.approx(2))
    ]


@pytest.mark.parametrize("row", [0, 3, 4])
def test_a_twist_of_the_wrong_sign_is_named_where_it_only_moves_zeros(row):
    right = er3a.to_standard(er3a.load_robot("ur5e"))
    found = er3a.compare(right.replace(alpha=np.where(np.arange(6) == row, -1, 1) * right.alpha), right)
    assert (found.verdict, found.geometry.same) == ("same_arm", True)
    assert [each.entries for each in found.causes] == [(f"alpha{row + 1}",)]


def test_a_twist_of_the_wrong_sign_is_named_against_other_frames():
    right = er3a.to_standard(er3a.load_robot("ur5e"))
    turned = right.replace(  # the last axis written the other way, as a URDF may have it
        alpha=right.alpha + np.pi * (np.arange(6) == 4),
        d=np.where(np.arange(6) == 5, -1, 1) * right.d,
        direction=np.where(np.arange(6) == 5, -1, 1) * right.direction,
        flange=rot_x(np.pi) @ right.flange,
    )
    assert er3a.compare(right, turned).verdict == "equal"
    found = er3a.compare(right.replace(alpha=np.where(np.arange(6) == 3, -1, 1) * right.alpha), turned)
    assert [each.entries for each in found.causes] == [("alpha4",)]


@pytest.mark.long
def test_a_twist_of_the_wrong_sign_beside_an_offset_is_one_entry():
    right = er3a.Robot.from_dh(
        a=[0, 0.43, 0.02, 0, 0, 0], alpha=np.radians([90, 0, -90, 90, -90, 0]), d=[0.67, 0.15, 0, 0.43, 0, 0]
    )
    found = er3a.compare(right.replace(alpha=np.where(np.arange(6) == 2, -1, 1) * right.alpha), right)
    assert [(each.entry, each.a, each.b) for each in found.geometry.differences] == [("alpha3", 90, -90)]
    assert (found.zero.same, found.directions.same) == (True, True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "entry"),
    [("er3a_c60", "a1"), ("er3a_c60", "a3"), ("er3a_c60", "d4"), ("er3_600", "a3"), ("ur5e", "d5")],
)
@pytest.mark.parametrize("elsewhere", [False, True])
def test_a_length_of_the_wrong_sign_is_named(name, entry, elsewhere):
    """It is the same arm with a base or a flange turned over, whose joints turn the other way."""
    right = er3a.to_standard(er3a.load_robot(name))
    values = getattr(right, entry[0]) * np.where(np.arange(6) == int(entry[1]) - 1, -1, 1)
    if elsewhere:
        right = right.replace(base=rot_z(0.4) @ right.base, flange=right.flange @ rot_z(1.0))
    found = er3a.compare(right.replace(base=er3a.load_robot(name).base, **{entry[0]: values}), right)
    assert found.verdict == "same_arm"
    causes = found.causes
    assert [(each.code, each.entries) for each in causes] == [("one_length_negated", (entry,))]


@pytest.mark.long
def test_arms_that_only_stand_or_count_otherwise_have_no_length_of_the_wrong_sign():
    right = er3a.to_standard(er3a.load_robot("er3a_c60"))
    over = np.diag([1.0, -1.0, -1.0, 1.0])
    for other in (right.replace(base=over @ right.base), right.replace(direction=-right.direction)):
        found = er3a.compare(right, other)
        assert (found.verdict, found.causes) == ("same_arm", ())


@pytest.mark.parametrize(
    ("columns", "factor"),
    [
        ("a d", 10.0),
        ("a d", 1000.0),
        ("a", 25.4),
        ("d", 1000.0),
        ("alpha", np.degrees(1.0)),
        ("alpha offset", np.radians(1.0)),
        ("offset", np.degrees(1.0)),
    ],
)
@pytest.mark.parametrize("side", ["a", "b"])
def test_a_unit_that_makes_two_tables_equal_is_named_with_its_table(columns, factor, side):
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    right = right.replace(offset=np.radians([0, -90, 37, 180, 12, 0]), speed=np.radians([400, 300, 520, 500, 530, 840]))
    slipped = right.replace(**{column: getattr(right, column) / factor for column in columns.split()})
    found = er3a.compare(slipped, right) if side == "a" else er3a.compare(right, slipped)
    assert found.verdict == "same_arm"
    assert [(each.side, " ".join(each.entries)) for each in found.units.causes] == [(side, columns)]
    assert found.units.causes[0].amount == pytest.approx(factor)
    layers = (found.geometry, found.zero, found.directions, found.base, found.flange, found.limits, found.speeds)
    assert all(layer.same for layer in layers)
    assert er3a.compare(found.corrected, right).verdict == "equal"


@pytest.mark.long
@pytest.mark.parametrize(
    ("heading", "own", "told"),
    [
        ("alpha_rad", "180/π rad", "rad → 180/π rad 57.2958"),
        ("alpha_deg", "rad", "deg → rad 57.2958"),
        ("a_mm", "dm", "mm → dm 100"),
        ("a_cm", "dm", "cm → dm 10"),
        ("a_m", "ft", "m → ft 0.3048"),
        ("a_in", "ft", "in → ft 12"),
        ("a_cm", "mm", "cm → mm 0.1"),
    ],
)
@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
def test_the_unit_that_is_named_is_the_one_of_the_heading(tmp_path, heading, own, told):
    """A column of a table in units of its own, under a heading that says another."""
    right, unit = er3a.to_standard(er3a.load_robot("er3_600")), heading.partition("_")[2]
    size = (LENGTH_UNITS | ANGLE_UNITS)[own]
    lengths, angles = (unit, "deg") if heading[:2] == "a_" else ("mm", unit)
    a, d = (1000 * column / (size if lengths != "mm" or own == "dm" else 1) for column in (right.a, right.d))
    alpha = np.degrees(right.alpha) / (size if own in ANGLE_UNITS else 1)
    rows = [f"joint,a_{lengths},alpha_{angles},d_{lengths},offset_deg"]
    rows += [
        f"{k + 1},{','.join(f'{v:.9g}' for v in row)}"
        for k, row in enumerate(zip(a, alpha, d, np.degrees(right.offset)))
    ]
    table = tmp_path / "table.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    for pair in ((str(table), "er3_600"), ("er3_600", str(table))):
        done = CliRunner().invoke(app, ["compare", *pair])
        assert (done.exit_code, f"({told})" in done.stdout) == (1, True), done.output


@pytest.mark.long
def test_a_unit_is_named_beside_an_entry_that_is_wrong_too():
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    slipped = right.replace(a=(right.a + np.array([0, 0, 0.02, 0, 0, 0])) / 25.4, d=right.d / 25.4)
    found = er3a.compare(slipped, right)
    assert (found.verdict, found.units.causes[0].amount) == ("other_arm", 25.4)
    assert [each.entry for each in found.geometry.differences] == ["a3"]


def test_couplings_and_counts_and_kinds():
    right = er3a.load_robot("er3_600")
    coupling = np.eye(6)
    coupling[2, 1] = 1.0
    coupled = er3a.compare(right, right.replace(coupling=coupling))
    assert (coupled.verdict, coupled.coupling.rows, coupled.geometry.same) == ("same_arm", (3,), True)
    assert er3a.compare(right, er3a.load_robot("lbr_iiwa_14")).verdict == "other_joint_count"
    slides = er3a.compare(right, right.replace(sliding=np.arange(6) == 2))
    assert (slides.verdict, slides.geometry.differences[0].entry) == ("other_arm", "type3")


@pytest.mark.long
def test_limits_are_compared_as_the_other_arms_zeros_and_directions_have_them():
    right = er3a.load_robot("er3a_c60")
    moved, turned = np.radians([0, 30, -20, 0, 10, 0]), np.where(np.arange(6) == 2, -1, 1)
    ends = turned * (right.lower - right.direction * moved), turned * (right.upper - right.direction * moved)
    same = {"offset": right.offset + moved, "direction": turned * right.direction}
    other = right.replace(**same, lower=np.minimum(*ends), upper=np.maximum(*ends))
    compared = er3a.compare(right, other)
    assert compared.limits.same
    np.testing.assert_allclose(compared.corrected.lower, other.lower, atol=1e-9)
    np.testing.assert_allclose(compared.corrected.upper, other.upper, atol=1e-9)
    found = er3a.compare(right, other.replace(upper=other.upper + np.radians([0, 0, 0, 0, 2, 0]))).limits
    assert [(each.joint, each.entry) for each in found.differences] == [(5, "upper")]
    assert found.differences[0].b - found.differences[0].a == pytest.approx(2)


@pytest.mark.long
def test_limits_on_sums_of_joints_are_not_compared_and_follow_corrected_zeros_and_directions():
    right = er3a.load_robot("er3a_c60")
    limit = CombinedLimit((0.0, 1.0, 1.0, 0.0, 0.0, 0.0), *np.radians([-60.0, 90.0]))
    for one, other in ((right, right.replace(combined=(limit,))), (right.replace(combined=(limit,)), right)):
        found = er3a.compare(one, other)
        assert "limits_on_sums" in found.not_examined
        assert ("limits on sums of joints", "not compared", "") in layer_rows(found)
    moved, turned = np.radians([0, 30, -20, 0, 10, 0]), np.where(np.arange(6) == 2, -1, 1)
    ends = turned * (right.lower - right.direction * moved), turned * (right.upper - right.direction * moved)
    same = {"offset": right.offset + moved, "direction": turned * right.direction}
    other = right.replace(**same, lower=np.minimum(*ends), upper=np.maximum(*ends))
    off = float((right.direction * moved)[1:3].sum())
    found = er3a.compare(right.replace(combined=(limit,)), other)
    assert found.limits.same
    (there,) = found.corrected.combined
    np.testing.assert_allclose(there.factors, [0, 1, -1, 0, 0, 0])
    np.testing.assert_allclose([there.lower, there.upper], [limit.lower - off, limit.upper - off])


def test_what_is_aligned_exactly_is_0_mm_off_in_words():
    right = er3a.load_robot("er3a_c60")
    turned = right.replace(offset=right.offset + np.radians([0, 0, 90, 0, 0, 0]))
    assert headline(er3a.compare(turned, right)).endswith("aligned by 0 mm and 0°)")


def test_a_flange_that_is_only_turned_is_named_with_its_angle():
    """About axis 6, no point of it is off: what a half turn there does to a tool is the angle."""
    right = er3a.load_robot("er3a_c60")
    found = er3a.compare(right.replace(offset=right.offset + np.radians([0, 0, 0, 0, 0, 180])), right)
    assert (round(found.as_printed_mm, 6), round(found.as_printed_deg, 6)) == (0, 180)
    assert found.aligned_deg < 1e-6
    assert "by 0.0 mm and 180.00° at the worst found" in headline(found)


def test_tools_that_differ_are_said_not_to_be_compared(tmp_path):
    longer = er3a.load_robot("er3a_c60").replace(name="longer", tool=er3a.pose([0, 0, 0.1], [0, 0, 0]))
    write_robot(longer, tmp_path / "longer.yaml")
    for other, told in ((str(tmp_path / "longer.yaml"), True), ("er3a_c60", False)):
        done = CliRunner().invoke(app, ["compare", "er3a_c60", other])
        assert done.exit_code == 0
        assert ("tools are not compared; these differ (their points by 100 mm)" in done.stderr) == told


def test_a_joint_without_limits_differs_from_one_of_a_turn():
    arm = er3a.load_robot("er3_600")
    lower, upper = np.array(arm.lower), np.array(arm.upper)
    lower[5], upper[5] = -np.pi, np.pi
    limited = arm.replace(lower=lower, upper=upper)
    endless = limited.replace(continuous=np.arange(6) == 5)
    found = er3a.compare(endless, limited)
    assert (found.verdict, found.limits.same) == ("same_arm", False)
    assert [(each.joint, each.a, round(each.b)) for each in found.limits.differences] == [
        (6, None, -180),
        (6, None, 180),
    ]
    assert er3a.compare(endless, endless).verdict == "equal"


def test_what_is_not_compared_is_named_beside_equal():
    arm = er3a.load_robot("er3_600")
    speed = np.array(arm.speed)
    speed[3] = np.nan
    bare = arm.replace(envelopes=(), hulls=(), pair_rules=(), masses=Masses())
    equal = headline(er3a.compare(arm, bare))
    assert "0.0 mm and 0.00°" in equal
    assert "not compared" not in equal
    arm = bare
    found = er3a.compare(arm, arm.replace(speed=speed))
    assert (found.verdict, found.speeds.same) == ("equal", None)
    assert headline(found) == f"{equal}; not compared: speeds"
    assert found.not_examined == ("speeds",)


def test_beside_equal_stands_how_far_the_flange_is_off_within_the_tolerances():
    arm = er3a.load_robot("er3_600")
    found = er3a.compare(arm, arm.replace(a=arm.a + 0.0004, alpha=arm.alpha + np.radians(0.08)))
    assert found.verdict == "equal"
    assert found.as_printed_mm > 1 > found.geometry.worst_mm
    assert f"{found.as_printed_mm:.1f} mm and {found.as_printed_deg:.2f}°" in headline(found)


def test_what_both_arms_give_and_no_layer_compares_is_named_and_only_that():
    arm = er3a.load_robot("er3a_c60")
    weighed = arm.replace(tool=translation(0, 0, 0.1), masses=Masses((LinkMass(1, MassBody(5.0)),), weight=60.0))
    heavier = weighed.replace(masses=Masses((LinkMass(1, MassBody(9.0)),), weight=90.0))
    found = er3a.compare(weighed, heavier)
    assert found.not_examined == ("speeds", "tool", "envelopes", "inertia", "weight")
    assert headline(found).endswith("°); not compared: speeds, tool, shapes of links, masses, weight")
    assert layer_rows(found)[-4:] == [
        (name, "not compared", "") for name in ("tool", "shapes of links", "masses", "weight")
    ]
    bare = arm.replace(envelopes=(), hulls=(), pair_rules=(), masses=Masses())
    assert er3a.compare(weighed, bare).not_examined == ("speeds",)
    seven = er3a.load_robot("lbr_iiwa_14").replace(masses=weighed.masses, tool=arm.tool)
    assert er3a.compare(seven, weighed).verdict == "other_joint_count"
    assert er3a.compare(seven, weighed).not_examined[-2:] == ("inertia", "weight")


INERTIAL = '<inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
OF_URDF = """<robot name="r"><link name="base"/>
<link name="one">{inertial}</link><link name="two"/><link name="beside">{beside}</link>
<joint name="j1" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="{effort}" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="one"/><child link="two"/><origin xyz="0.3 0 0.2"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="{effort}" velocity="1"/></joint>
<joint name="camera" type="fixed"><parent link="base"/><child link="beside"/></joint></robot>"""


@pytest.mark.long
def test_masses_drives_and_shapes_of_two_urdfs_are_named_as_not_compared(tmp_path):
    shape = '<collision><geometry><mesh filename="package://nowhere/none.stl"/></geometry></collision>'
    links = {
        "one": (INERTIAL.format(mass=5) + shape, 10),
        "two": (INERTIAL.format(mass=9) + shape, 30),
        "bare": ("", 0),
    }
    for file, (inertial, effort) in links.items():
        text = OF_URDF.format(inertial=inertial, beside=shape, effort=effort)
        (tmp_path / f"{file}.urdf").write_text(text, encoding="utf-8")

    def ran(one, other, *more):
        files = [str(tmp_path / f"{each}.urdf") for each in (one, other)]
        return CliRunner().invoke(app, ["compare", *files, "--tip", "two", *more])

    done = ran("one", "two", "--html", str(tmp_path / "page.html"))
    assert done.exit_code == 0
    told = "not compared: shapes of links, masses, drives"
    assert done.output.splitlines()[0].endswith(told)
    assert re.search(r"^  masses +not compared$", done.output, re.MULTILINE)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert re.search(r"masses\s*</td>\s*<td[^>]*>\s*not compared", page)
    assert json.loads(ran("one", "two", "--json").output)["not_examined"] == ["envelopes", "inertia", "drives"]
    assert json.loads(ran("one", "bare", "--json").output)["not_examined"] == ["envelopes"]


@pytest.mark.long
def test_numbers_of_doubtful_unit_stand_where_the_verdict_does(tmp_path):
    arm = er3a.load_robot("er3_600").replace(name="arm", references=(), tool=translation(0, 0, 0.0002))
    write_robot(arm, tmp_path / "arm.yaml")
    words = ["compare", str(tmp_path / "arm.yaml"), str(tmp_path / "arm.yaml"), "--html", str(tmp_path / "page.html")]
    told = f"{tmp_path / 'arm.yaml'}: tool.xyz_mm: [0.0, 0.0, 0.2] mm may be metres"
    with pytest.warns(er3a.InputWarning):
        assert f"units       in doubt {told}" in CliRunner().invoke(app, words).stdout
    with pytest.warns(er3a.InputWarning):
        record = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert record["doubtful_units"] == [told]
    assert record["notes"] == []
    assert "mm may be metres" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_arm_that_fits_best_comes_first():
    right = er3a.load_robot("er3_600")
    others = {f"{mm}": right.replace(a=right.a + np.array([0, mm / 1000, 0, 0, 0, 0])) for mm in (300, 20, 0, -50)}
    assert [name for name, _ in best_of(right, others)] == ["0", "20", "-50", "300"]
    shifts = {"three slight": [2, -1, 1, 0, 0, 0], "two gross": [0, 300, 90, 0, 0, 0], "one": [0, 300, 0, 0, 0, 0]}
    others = {name: right.replace(a=right.a + np.array(mm) / 1000) for name, mm in shifts.items()}
    assert [name for name, _ in best_of(right, others)] == ["one", "three slight", "two gross"]


def with_columns(folder, *, scale: float = 1.0, twice: bool = False):
    """The table of a UR5 as a person would type it in, lengths times a factor."""
    (pair,) = (each for each in PAIRS if each.table == "UR5" and each.source.startswith("roboticstoolbox"))
    path = write_csv(pair, folder / "table.csv")
    lines = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
    for cells in lines[1:]:
        for place in (2, 4):
            cells[place] = f"{float(cells[place]) * scale:.6f}"
        if twice:
            cells[3] = f"{np.degrees(float(cells[3])):.4f}"
    path.write_text("\n".join(",".join(cells) for cells in lines), encoding="utf-8")
    return path


def compared(*words) -> tuple[int, str]:
    """Exit code and output of a comparison on the command line."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", er3a.InputWarning)
        done = CliRunner().invoke(app, ["compare", *map(str, words)])
    return done.exit_code, done.stdout


@pytest.mark.long
@pytest.mark.parametrize("given", [{"scale": 1e-3}, {"scale": 1 / 25.4}, {"scale": 0.1}, {"twice": True}])
def test_a_table_in_other_units_than_it_says_is_not_usable_as_printed(given, tmp_path):
    right = with_columns(tmp_path).rename(tmp_path / "right.csv")
    slipped, page = with_columns(tmp_path, **given), tmp_path / "page.html"
    code, said = compared(slipped, right, "--html", page)
    first = said.splitlines()[0].partition(";")[0]
    assert (code, "in another unit" in first, "in the first table" in first) == (1, True, True)
    verdict = page.read_text(encoding="utf-8").partition('<h1><span class="')[2].partition("</h1>")[0]
    assert "in another unit" in verdict
    assert not verdict.startswith("pass")
    assert compared(right, right)[0] == 0


@pytest.mark.long
def test_a_page_says_the_unit_in_doubt_before_another_arm_as_the_command_line_does(tmp_path):
    """Half the angles in radians, another upper arm: no change of units explains it, so the unit stays a doubt."""
    right = with_columns(tmp_path).rename(tmp_path / "right.csv")
    lines = right.read_text(encoding="utf-8").splitlines()
    mixed, page = tmp_path / "mixed.csv", tmp_path / "page.html"
    cells = [line.split(",") for line in lines[1:]]
    for row in cells:
        row[3] = f"{np.radians(float(row[3])):.4f}"
    cells[1][2], cells[3][3] = "-625.0", "90"
    mixed.write_text("\n".join([lines[0], *map(",".join, cells)]), encoding="utf-8")
    code, said = compared(mixed, right, "--html", page)
    first = said.splitlines()[0]
    assert (code, "may be radians; another arm" in first) == (1, True)
    verdict = page.read_text(encoding="utf-8").partition("<h1><span")[2].partition(">")[2].partition("</span>")[0]
    assert first.startswith(verdict.removesuffix(".").replace("°", " deg"))
    assert "another arm" in verdict


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
@pytest.mark.parametrize(("given", "remedy"), [({"scale": 1e-3}, ("--length-unit", "mm")), ({"twice": True}, ())])
def test_no_table_passes_on_a_guess_of_its_units(given, remedy, tmp_path):
    path = with_columns(tmp_path, **given)
    assert compared(path, path)[0] == 1
    assert json.loads(compared(path, path, "--json")[1])["verdict"] == "in_doubt"
    with pytest.raises(InputError, match=r"metres|ten turns"):
        read_arm(str(path))
    if remedy:
        assert compared(path, path, *remedy)[0] == 0


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
def test_lengths_that_can_only_be_metres_need_no_heading(tmp_path):
    right = with_columns(tmp_path).rename(tmp_path / "right.csv")
    bare = with_columns(tmp_path, scale=1e-3)
    header, *rows = bare.read_text(encoding="utf-8").splitlines()
    bare.write_text("\n".join([re.sub("_(mm|deg)", "", header), *rows]), encoding="utf-8")
    assert compared(bare, right)[0] == compared(bare, bare)[0] == 0


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
@pytest.mark.parametrize("decimals", [6, 3])
def test_inches_are_recognised_where_they_are_round_millimetres(decimals, tmp_path):
    path = tmp_path / "inches.csv"
    lengths = ((0, 13.779528), (10.629921, 0), (2.755906, 0), (0, 11.771654), (0, 0), (0, 3.090551))
    lengths = tuple((round(a, decimals), round(d, decimals)) for a, d in lengths)
    rows = [f"{k},{a},{alpha},{d}" for k, ((a, d), alpha) in enumerate(zip(lengths, (-90, 0, -90, 90, -90, 0)), 1)]
    path.write_text("\n".join(["joint,a_mm,alpha_deg,d_mm", *rows]), encoding="utf-8")
    with pytest.raises(InputError, match="--length-unit in "):
        read_arm(str(path))
    path.write_text("\n".join(["joint,a,alpha,d", *rows]), encoding="utf-8")
    found = read_arm(str(path), as_printed=True)
    assert found.robot.a[1] == pytest.approx(0.27, abs=25.4 * 10.0**-decimals / 1000)
    assert any("read as inches" in text for text in found.notes)
    assert read_arm(str(path), length_unit="mm").robot.a[1] == pytest.approx(lengths[1][0] / 1000)


@pytest.mark.long
def test_lengths_of_a_small_arm_without_a_unit_are_asked_back(tmp_path):
    bare = tmp_path / "ur3.csv"
    lengths = (0, 5.98), (-9.59, 0), (-8.4, 0), (0, 4.42), (0, 3.36), (0, 3.22)  # of a UR3
    rows = [f"{k},{a},{alpha},{d}" for k, ((a, d), alpha) in enumerate(zip(lengths, (90, 0, 0, 90, -90, 0)), 1)]
    bare.write_text("\n".join(["joint,a,alpha,d", *rows]), encoding="utf-8")
    with pytest.raises(InputError, match="say no unit"):
        read_arm(str(bare), as_printed=True)
    assert read_arm(str(bare), length_unit="in").robot.a[1] == pytest.approx(-0.24365, abs=1e-4)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
@pytest.mark.parametrize("decimals", [2, 4])
def test_twists_in_radians_are_named_or_read_where_no_heading_says_degrees(decimals, tmp_path):
    right = with_columns(tmp_path).rename(tmp_path / "right.csv")
    lines = [line.split(",") for line in right.read_text(encoding="utf-8").splitlines()]
    for cells in lines[1:]:
        cells[3] = f"{np.radians(float(cells[3])):.{decimals}f}"
    path = tmp_path / "radians.csv"
    path.write_text("\n".join(",".join(cells) for cells in lines), encoding="utf-8")
    code, said = compared(path, right)
    assert code == 1
    assert said.startswith("alpha: the angles are in another unit")
    assert compared(path, right, "--angle-unit", "rad")[0] == 1  # of both
    path.write_text("\n".join([",".join(lines[0]).replace("alpha_deg", "alpha"), *map(",".join, lines[1:])]))
    assert any("--angle-unit deg" in text for text in read_arm(str(path), as_printed=True).notes)
    assert compared(path, right)[0] == 0


@pytest.mark.parametrize("twist", ["1.571,-3", "0.5,1.2", "1.047,-0.785"])
def test_twists_that_are_small_are_degrees(twist, tmp_path):
    first, second = twist.split(",")
    path = tmp_path / "small.csv"
    rows = ["joint,a_mm,alpha_deg,d_mm", f"1,0,{first},400", f"2,300,{second},0", "3,0,0,100"]
    path.write_text("\n".join(rows), encoding="utf-8")
    assert np.degrees(read_arm(str(path)).robot.alpha[0]) == pytest.approx(float(first))


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
def test_short_lengths_beside_long_ones_are_meant(tmp_path):
    path = tmp_path / "short.csv"
    rows = ("1,0,90,284.8", "2,0,90,1", "3,-0.35,-90,410", "4,0,0,50")
    path.write_text("\n".join(["joint,a_mm,alpha_deg,d_mm", *rows]), encoding="utf-8")
    arm = read_arm(str(path), as_printed=True).robot
    assert arm.d[1] == pytest.approx(0.001)
    assert er3a.compare(arm, arm).verdict == "equal"


@pytest.mark.long
@pytest.mark.parametrize("place", range(len(PAIRS)))
def test_what_is_said_of_published_tables_holds_without_er3a(place, tmp_path):
    pair = PAIRS[place]
    if not (path := urdf_path(pair)).is_file():
        pytest.skip("the package with this URDF is not installed")
    printed = read_arm(str(write_csv(pair, tmp_path / "table.csv"))).robot
    chain = read_chain(path, None, pair.tip, False).joints
    found = er3a.compare(printed, read_arm(str(path), tip=pair.tip).robot)
    q = np.random.default_rng(place).uniform(-np.pi, np.pi, (20, printed.joints))
    frames = np.stack([urdf_flange(path, chain[0].parent, chain[-1].child, row) for row in q])
    mended = arm_of(er3a.to_standard(found.corrected))
    gaps = [np.linalg.norm((flange_at(mended, row) - T)[:3, 3]) for row, T in zip(q, frames)]
    assert 1000 * max(gaps) < 1.0
    own = arm_of(er3a.to_standard(printed))
    start = replace(mended, a=own.a, alpha=own.alpha, d=own.d)
    left = best_alignment_mm(start, frames, q)
    assert (left > 1.0) == (found.verdict == "other_arm")


def irb120() -> er3a.Robot:
    rows = [
        ("R", 0, -90, 290),
        ("R", 270, 0, 0),
        ("R", 70, -90, 0),
        ("R", 0, 90, 302),
        ("R", 0, -90, 0),
        ("R", 0, 0, 72),
    ]
    right = made_of([(*row, -180, 180) for row in rows])
    return right.replace(offset=np.radians([0, -90, 0, 0, 0, 180]))


def changed(robot: er3a.Robot, column: str, values: dict[int, float]) -> er3a.Robot:
    own = getattr(robot, column).copy()
    for row, value in values.items():
        own[row - 1] = value
    return robot.replace(**{column: own})


@pytest.mark.long
@pytest.mark.parametrize("offsets", [{}, {2: 0.0}, {2: 0.0, 6: 0.0}, {3: np.pi / 2, 5: 0.7}])
def test_a_length_of_the_wrong_sign_is_named_where_zeros_differ_too(offsets):
    right = irb120()
    wrong = changed(changed(right, "a", {3: -0.07}), "offset", offsets)
    found = er3a.compare(wrong, right)
    assert (found.verdict, found.directions.reversed, found.base.same) == ("same_arm", (), True)
    assert [(each.code, each.entries) for each in found.causes] == [("one_length_negated", ("a3",))]
    assert er3a.compare(found.corrected, right).verdict == "equal"


@pytest.mark.parametrize("angle", [90, 180])
def test_a_turn_at_the_flange_is_one_of_the_last_row(angle):
    right = irb120()
    found = er3a.compare(changed(right, "offset", {6: right.offset[5] - np.radians(angle)}), right)
    assert (found.zero.same, found.directions.same, found.base.same, found.causes) == (True, True, True, ())
    assert [(each.entry, each.difference) for each in found.flange.entries] == [("offset6", pytest.approx(angle))]


def test_a_flange_turned_about_a_diagonal_is_alpha_and_offset_of_the_last_row():
    right = irb120()
    wrong = changed(changed(right, "offset", {6: np.pi / 2}), "alpha", {6: np.pi / 2})
    found = er3a.compare(wrong, right)
    assert {each.entry for each in found.flange.entries} == {"alpha6", "offset6"}
    assert er3a.compare(found.corrected, right).verdict == "equal"


@pytest.mark.long
def test_two_exchanged_rows_are_one_slip():
    right, order = irb120(), [0, 1, 2, 4, 3, 5]
    wrong = right.replace(**{column: getattr(right, column)[order] for column in ("a", "alpha", "d")})
    found = er3a.compare(wrong, right)
    assert [each.code for each in found.causes] == ["rows_exchanged"]
    assert {each.entry for each in found.geometry.differences} == {"alpha4", "d4", "alpha5", "d5"}
    assert found.directions.same


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "entry", "factor"),
    [("er3_600", "d4", 1.1), ("lrmate200id4sc", "d4", -1), ("ma2010", "alpha1", -1), ("cr7ia", "a1", 1.3)],
)
def test_the_table_that_is_tested_is_blamed_for_the_other_convention_with_another_wrong_entry(name, entry, factor):
    right = er3a.to_standard(er3a.load_robot(name))
    column, row = entry[:-1], int(entry[-1]) - 1
    values = np.array(getattr(right, column))
    values[row] *= factor
    found = er3a.compare(right.replace(**{column: values, "convention": "modified"}), right)
    assert ("other_convention", "a") in [(each.code, each.side) for each in found.causes]
    assert {each.side for each in found.causes} == {"a"}
    assert [each.entry for each in found.geometry.differences] == [entry]
    assert er3a.compare(found.corrected, right).verdict == "equal"


@pytest.mark.long
def test_two_arms_of_other_geometry_are_aligned_as_well_as_can_be():
    """Axes 5 and 6 that are a little off each other move the flange a little; other zeros and ends take up the rest."""
    right = irb120()
    wrong = changed(right, "a", {5: 0.3})
    found = er3a.compare(wrong, right)
    assert [each.entry for each in found.geometry.differences] == ["a5"]
    assert found.aligned_mm < 30


@pytest.mark.parametrize(("joints", "tip"), [(3, "left1"), (4, "right2"), (2, "link2"), (5, None)])
def test_the_one_chain_of_a_urdf_with_as_many_joints_as_the_table_is_taken(tmp_path, joints, tip):
    chain = ["base", "link1", "link2"]
    pairs = [*itertools.pairwise(chain), ("link2", "left1"), ("link2", "right1"), ("right1", "right2")]
    links = "".join(f'<link name="{name}"/>' for name in dict.fromkeys(name for pair in pairs for name in pair))
    made = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="{parent}"/><child link="{child}"/></joint>'
        for k, (parent, child) in enumerate(pairs)
    )
    path = tmp_path / "two_ends.urdf"
    path.write_text(f'<robot name="two_ends">{links}{made}</robot>')
    assert tip_after(path, None, joints) == tip


@pytest.mark.long
@pytest.mark.parametrize("names", [("irb1600_6_12", "irb2400"), ("puma560", "irb140")])
def test_the_alignment_found_is_the_least_wherever_the_search_begins(names):
    """Base, flange and zeros are free, and the last bit of a number says nothing: the distance left is the same."""
    one, other = map(er3a.load_robot, names)
    random = np.random.default_rng(1)
    zeros = other.offset + random.uniform(-3, 3, 6) * other.direction
    elsewhere = other.replace(base=pose(random) @ other.base, flange=other.flange @ pose(random), offset=zeros)
    pairs = [(one, other), (one.replace(a=one.a * (1 + 1e-15)), other), (one, elsewhere)]
    left = [er3a.compare(*pair).aligned_mm for pair in pairs]
    np.testing.assert_allclose(left, left[0], rtol=1e-3)
