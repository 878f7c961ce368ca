"""D-H tables as books, articles and spreadsheets print them: every one gives the numbers that its book means."""

from __future__ import annotations

import numpy as np
import pytest

import er3a
from er3a.errors import DoubtfulUnit, InputError
from er3a.files.dh_table import read_dh_table
from er3a.files.robot_library import robot_of
from testing.arms import dh_matrix

CRAIG = """i,α(i−1),a(i−1),d(i),θ(i)
1,0,0,0,θ1
2,−90°,0,0,θ2
3,0,431.8,149.09,θ3
4,−90°,20.32,433.07,θ4
5,90°,0,0,θ5
6,−90°,0,0,θ6
"""
PI_FRACTIONS = """Link,a_i (m),α_i,d_i (m),θ_i
1,0.07,−π/2,0.352,q1*
2,0.36,0,0,q2 - π/2
3,0.05,-pi/2,0,-q3
4,0,0.5*pi,0.38,q4+1.5
"""
SPREADSHEET = """Gelenk;a [mm];alpha [°];d [mm];theta [°];;\r
1;260,5;-90;675,0;th1;;\r
2;680,0;0;0;q2-90;;\r
;;;;;;\r
"""
STANFORD = """Link,θ,d,a,α
1,θ1*,412,0,-90
2,θ2*,154,0,90
3,-90,d3*,0,0
4,θ4*,0,0,-90
"""
CHINESE = """关节i,连杆长度a/mm,扭转角α/(°),偏距d/mm,关节角θ/(°)
1,150,-90,450,θ1(0)
2,590,0,0,θ2（-90）
"""
AT_ZERO = """joint,theta_deg,d_mm,a_mm,alpha_deg
J1,0,450,150,-90
J2,-90,0,590 mm,0
"""
RADIANS = """j,theta,d,a,alpha
1,q1,400,70,pi/2
2,q2-1.5707963267949,0,360,0
"""
# (a mm, alpha deg, d mm, direction, offset deg or None where the joint slides) for each row
MEANT = {
    "craig": (CRAIG, "modified", [(0, 0, 0, 1, 0), (0, -90, 0, 1, 0), (431.8, 0, 149.09, 1, 0)]),
    "pi": (PI_FRACTIONS, "standard", [(70, -90, 352, 1, 0), (360, 0, 0, 1, -90), (50, -90, 0, -1, 0)]),
    "spreadsheet": (SPREADSHEET, "standard", [(260.5, -90, 675, 1, 0), (680, 0, 0, 1, -90)]),
    "stanford": (
        STANFORD,
        "standard",
        [(0, -90, 412, 1, 0), (0, 90, 154, 1, 0), (0, 0, 0, 1, None), (0, -90, 0, 1, 0)],
    ),
    "chinese": (CHINESE, "standard", [(150, -90, 450, 1, 0), (590, 0, 0, 1, -90)]),
    "at zero": (AT_ZERO, "standard", [(150, -90, 450, 1, 0), (590, 0, 0, 1, -90)]),
    "radians": (RADIANS, "standard", [(70, 90, 400, 1, 0), (360, 0, 0, 1, -90)]),
}


@pytest.mark.parametrize("name", MEANT)
def test_a_printed_table_gives_the_numbers_that_it_means(tmp_path, name):
    text, convention, rows = MEANT[name]
    (tmp_path / "arm.csv").write_bytes(text.encode("utf-8-sig"))
    content, _ = read_dh_table(tmp_path / "arm.csv", "arm")
    assert content.dh.convention == convention
    for row, zero, (a, alpha, d, direction, offset) in zip(content.dh.rows, content.zero.rows, rows):
        np.testing.assert_allclose([row.a_mm, row.alpha_deg, row.d_mm], [a, alpha, d], atol=1e-9)
        assert zero.direction == direction
        assert (row.type == "prismatic") == (offset is None)
        assert zero.offset_deg is None or zero.offset_deg == pytest.approx(offset, abs=1e-9)


def test_its_arm_stands_where_plain_matrices_put_it(tmp_path):
    (tmp_path / "arm.csv").write_text(CRAIG, encoding="utf-8")
    robot = robot_of(read_dh_table(tmp_path / "arm.csv", "arm")[0])
    q = np.radians([10, -20, 30, 40, -50, 60])
    T = np.eye(4)
    for (alpha, a, d), angle in zip([(0, 0, 0), (-90, 0, 0), (0, 431.8, 149.09), (-90, 20.32, 433.07)], q):
        T = T @ dh_matrix("modified", a / 1000, np.radians(alpha), d / 1000, angle)
    T = T @ dh_matrix("modified", 0, np.pi / 2, 0, q[4]) @ dh_matrix("modified", 0, -np.pi / 2, 0, q[5])
    np.testing.assert_allclose(er3a.forward(robot, q), T, atol=1e-12)


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("1,70,90,352,θ1+θ2", "two variables"),
        ("1,70,-π/2°,352,θ1", "is in rad and in deg"),
        ("1,70,90°00',352,θ1", "is not a number"),
        ('1,"1,070",90,352,θ1', "nothing between thousands"),
        ("1,70,90,352,2θ1", "is not a number"),
        ("1,70,90,0.5d1,0", "is not a number"),
    ],
)
def test_a_cell_that_can_mean_two_things_is_refused(tmp_path, row, told):
    (tmp_path / "arm.csv").write_text(f"i,a (mm),α,d (mm),θ\n{row}\n", encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read_dh_table(tmp_path / "arm.csv", "arm")


def test_offsets_in_two_columns_are_refused(tmp_path):
    (tmp_path / "arm.csv").write_text("i,a,alpha,d,theta,offset\n1,70,90,352,q1-90,90\n", encoding="utf-8")
    with pytest.raises(InputError, match="offsets too"):
        read_dh_table(tmp_path / "arm.csv", "arm")


@pytest.mark.filterwarnings("ignore::er3a.errors.DoubtfulUnit")
@pytest.mark.parametrize(("longest", "unit"), [(350, "mm"), (0.35, "m")])
def test_one_short_length_makes_no_table_of_metres(tmp_path, longest, unit):
    """The longest length says what unit all are in, where no heading does."""
    rows = "".join(f"{joint},{a:g},90,0\n" for joint, a in enumerate((longest, longest / 50, longest / 2), 1))
    (tmp_path / "arm.csv").write_text(f"joint,a,alpha_deg,d\n{rows}", encoding="utf-8")
    content, notes = read_dh_table(tmp_path / "arm.csv", "arm", as_printed=True)
    assert robot_of(content).a == pytest.approx([0.35, 0.007, 0.175])
    assert any("metres" in note for note in notes) == (unit == "m")


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", range(6))
def test_rows_in_which_nothing_moves_are_fixed_transforms_wherever_they_stand(tmp_path, convention, seed):
    """Against a product of plain matrices of all rows, with fixed rows before, between and after the joints."""
    random = np.random.default_rng(seed)
    kinds = [*"0q", *("0" if seed % 2 else "q"), *"q0d", *"q00q", "0", "tool"]
    rows, lines = [], ["link,theta (deg),d (mm),a (mm),alpha (deg)"]
    joint = 0
    for place, kind in enumerate(kinds):
        a, d = (float(random.choice([0, random.integers(20, 400)])) for _ in range(2))
        alpha, theta = (float(random.choice([0, 90, -90, 180, 37])) for _ in range(2))
        joint += kind in "qd"
        rows.append((kind, a, alpha, d, theta))
        turn = f"q{joint}{theta:+g}" if kind == "q" else f"{theta:g}"
        slide = f"d{joint}+{d:g}" if kind == "d" else f"{d:g}"
        lines.append(f"{'tool' if kind == 'tool' else place + 1},{turn},{slide},{a:g},{alpha:g}")
    (tmp_path / "arm.csv").write_text("\n".join(lines), encoding="utf-8")
    robot = robot_of(read_dh_table(tmp_path / "arm.csv", "arm", convention)[0])
    assert robot.joints == joint
    assert robot.tool[:3, 3].any() == bool(rows[-1][1] or rows[-1][3])
    q = np.where(robot.slides, 0.123, random.uniform(-3, 3, joint))
    T, moved = np.eye(4), iter(q.tolist())
    for kind, a, alpha, d, theta in rows:
        step = next(moved) if kind in "qd" else 0.0
        turn, slide = (step, 0.0) if kind == "q" else (0.0, step)
        T = T @ dh_matrix(convention, a / 1000, np.radians(alpha), d / 1000 + slide, np.radians(theta) + turn)
    np.testing.assert_allclose(er3a.forward(robot, q), T, atol=1e-9)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (("1,0,90,100,q1", "2,300,0,0,q3", "3,0,0,50,q2"), "number 3 where that of joint 2"),
        (("1,0,90,100,q1", "2,300,0,0,q1"), "number 1 where that of joint 2"),
        (("1,0,90,100,q1", "3,300,0,0,q2"), "the joints are 1, 3"),
        (("1,0,90,100,q1", "2,300,0,0,0", "9,0,0,50,q2"), "the joints are 1, 9"),
        (("1,0,90,100,0",), None),
        (("1,0,90,100,q0", "2,300,0,0,q1"), None),
        (("J1,0,90,100,0", "J2,300,0,0,0", "Flange,0,0,50,0"), None),
    ],
)
def test_the_numbers_of_variables_and_joints_agree_with_the_order_of_the_rows(tmp_path, rows, told):
    (tmp_path / "arm.csv").write_text("\n".join(["joint,a (mm),alpha (deg),d (mm),theta (deg)", *rows]))
    if told:
        with pytest.raises(InputError, match=told):
            read_dh_table(tmp_path / "arm.csv", "arm")
    else:
        content, _ = read_dh_table(tmp_path / "arm.csv", "arm")
        assert len(content.dh.rows) == sum(not row.startswith("Flange") for row in rows)


@pytest.mark.parametrize("said", [True, False])
def test_a_robot_made_of_a_table_says_what_the_table_does_not(tmp_path, said):
    """The convention and the directions are in the robot's file, whose pages show the source."""
    head, more = "joint,a_mm,alpha_deg,d_mm,offset_deg", ",direction,convention" if said else ""
    rows = [f"{joint},100,90,200,0{',1,standard' if said else ''}" for joint in (1, 2, 3)]
    (tmp_path / "arm.csv").write_text("\n".join([head + more, *rows]) + "\n")
    content, _ = read_dh_table(tmp_path / "arm.csv", "arm")
    assert ("read as standard D-H, which it does not say" in content.dh.source) == (not said)
    assert ("gives no directions" in content.zero.source) == (not said)


@pytest.mark.parametrize("columns", ["lower_deg,upper_deg", "speed_deg_s"])
def test_limits_and_speeds_in_radians_are_doubted_although_a_joint_turns_more_than_once(tmp_path, columns):
    wide = np.radians([[-165, 165], [-110, 110], [-400, 400]])
    cells = wide if "lower" in columns else np.radians([[150], [180], [420]])
    rows = "".join(f"{j},200,90,100,{','.join(f'{x:.5f}' for x in row)}\n" for j, row in enumerate(cells, 1))
    (tmp_path / "arm.csv").write_text(f"joint,a_mm,alpha_deg,d_mm,{columns}\n{rows}", encoding="utf-8")
    with pytest.warns(DoubtfulUnit, match="radians"):
        read_dh_table(tmp_path / "arm.csv", "arm")


@pytest.mark.long
def test_a_table_of_very_many_rows_is_refused_as_no_arm(tmp_path):
    rows = "".join(f"{i},1,90,1,q{i}\n" for i in range(1, 100_001))
    (tmp_path / "arm.csv").write_text(f"joint,a_mm,alpha_deg,d_mm,theta\n{rows}", encoding="utf-8")
    with pytest.raises(InputError, match="larger than 200000 bytes"):
        read_dh_table(tmp_path / "arm.csv", "arm")
