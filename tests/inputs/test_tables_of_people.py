"""D-H tables in the forms in which people have them: read as they are meant, or refused with both readings."""

from __future__ import annotations

import io
import json
import warnings
from itertools import permutations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import er3a
from er3a.errors import InputError
from er3a.files.arithmetic import amount_of
from er3a.files.dh_table import read_dh_table
from er3a.pipeline.study import load_study

# a mm, alpha deg, d mm, offset deg of an IRB 120
IRB120 = [(0, -90, 290, 0), (270, 0, 0, -90), (70, -90, 0, 0), (0, 90, 302, 0), (0, -90, 0, 0), (0, 0, 72, 180)]
NAMES = {"a": 0, "alpha": 1, "d": 2, "theta": 3}
GREEK = {"a": "a", "alpha": "α", "d": "d", "theta": "θ"}
LATEX = {"a": "a_i", "alpha": r"\alpha_i", "d": "d_i", "theta": r"\theta_i"}
CHINESE = {"a": "连杆长度a", "alpha": "扭转角α", "d": "偏距d", "theta": "关节角θ"}


def shown(value, places=6):
    return f"{round(value, places):g}" if value else "0"


def cells_of(rows, order, variable, minus="-"):
    """Cells in mm and degrees; theta is a sum of the joint's variable and its offset."""
    lines = []
    for joint, row in enumerate(rows, 1):
        texts = {name: shown(row[k]) for name, k in NAMES.items()}
        if variable:
            offset = f" {'-' if row[3] < 0 else '+'} {abs(row[3])}" if row[3] else ""
            texts["theta"] = variable.format(joint) + offset
        lines.append([str(joint), *(texts[name].replace("-", minus) for name in order)])
    return lines


def si(value, angle):
    if not angle:
        return shown(value / 1000)
    return {0: "0", 90: "pi/2", -90: "-pi/2", 180: "pi", -180: "-pi"}.get(value, f"{value}*pi/180")


def markdown(rows, order, variable):
    head = ["Joint", *(f"{GREEK[name]} ({'°' if NAMES[name] % 2 else 'mm'})" for name in order)]
    lines = [head, ["---"] * len(head), *cells_of(rows, order, variable, "−")]
    return "Some text.\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n\nMore of it.\n"


def latex(rows, order, variable):
    units = "mm", r"$^\circ$"
    head = ["$i$", *(f"${LATEX[name]}$ [{units[NAMES[name] % 2]}]" for name in order)]
    lines = [head, *([f"${cell}$" for cell in line] for line in cells_of(rows, order, variable))]
    body = " \\\\ \\hline\n".join(" & ".join(line) for line in lines)
    return f"\\begin{{tabular}}{{|c|*{{4}}{{c}}|}}\n\\hline\n{body} \\\\\n\\end{{tabular}}"


def html(rows, order, variable):
    head = "".join(f"<th>{GREEK[name]}<sub>i</sub> ({'deg' if NAMES[name] % 2 else 'mm'})</th>" for name in order)
    lines = ["".join(f"<td>{cell}</td>" for cell in line) for line in cells_of(rows, order, variable)]
    return f"<p>D-H</p><table><tr><th>Link</th>{head}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def tabs(rows, order, variable):
    lines = [["关节", *(f"{CHINESE[name]}({'°' if NAMES[name] % 2 else 'mm'})" for name in order)]]
    return "\n".join("\t".join(line) for line in lines + cells_of(rows, order, variable))


def semicolons(rows, order, variable):
    lines = [
        ["i", *(f"{name} [{'deg' if NAMES[name] % 2 else 'mm'}]" for name in order)],
        *cells_of(rows, order, variable),
    ]
    return "\n".join(";".join(line).replace(".", ",") for line in lines)


def blanks(rows, order, variable):
    lines = [["i", *(f"{GREEK[name]}i ({'deg' if NAMES[name] % 2 else 'mm'})" for name in order)]]
    return "Table 2. Parameters\n" + "\n".join(" ".join(line) for line in lines + cells_of(rows, order, variable, "−"))


def box(rows, order, variable):
    lines = [["j", *(f"{GREEK[name]}ⱼ" for name in order)]]
    for joint, row in enumerate(rows, 1):
        texts = {"a": shown(row[0] / 1000), "d": shown(row[2] / 1000), "alpha": f"{row[1]:.1f}°"}
        texts["theta"] = f"q{joint}" + (f" {'-' if row[3] < 0 else '+'} {abs(row[3])}°" if row[3] else "")
        lines.append([str(joint), *(texts[name] for name in order)])
    drawn = "\n".join(f"│ {' │ '.join(line)} │" for line in lines)
    return f"DHRobot: x, standard DH parameters\n┌───┬───┐\n{drawn}\n└───┴───┘"


def turned(rows, order, variable):
    lines = [["joint", *(f"{name} ({'deg' if NAMES[name] % 2 else 'mm'})" for name in order)]]
    return "\n".join(",".join(column) for column in zip(*(lines + cells_of(rows, order, variable))))


def links(rows, order, variable):
    made = [
        f"L({j}) = Link([0 {si(d, 0)} {si(a, 0)} {si(al, 1)} 0 {si(o, 1)}]);" for j, (a, al, d, o) in enumerate(rows, 1)
    ]
    return "% theta d a alpha\n" + "\n".join(made) + "\nrobot = SerialLink(L, 'name', 'x');\nq = [0 0.1 0];\n"


def revolutes(rows, order, variable):
    made = [
        f"    RevoluteDH(d={si(d, 0)}, a={si(a, 0)}, alpha={si(al, 1)}, offset={si(o, 1)}, qlim=[-pi, pi]),  # d=9"
        for a, al, d, o in rows
    ]
    return "robot = DHRobot([\n" + "\n".join(made) + "\n], name='x')"


def dictionaries(rows, order, variable):
    keyed = [{"name": f"joint{j}"} | {name: row[NAMES[name]] for name in order} for j, row in enumerate(rows, 1)]
    return json.dumps({"robot": "x", "dh": keyed})


def yaml_lists(rows, order, variable):
    lines = [f"  joint{j}: [{', '.join(shown(row[NAMES[name]]) for name in order)}]" for j, row in enumerate(rows, 1)]
    return f"dh:  # [{', '.join(order)}]\n" + "\n".join(lines)


def yaml_blocks(rows, order, variable):
    return "dh:\n" + "\n".join(
        f"  - {order[0]}: {row[NAMES[order[0]]]}\n" + "".join(f"    {name}: {row[NAMES[name]]}\n" for name in order[1:])
        for row in rows
    )


def matrix(rows, order, variable):
    lines = [
        f"    [{', '.join(si(row[NAMES[name]], NAMES[name] % 2) for name in order)}],  # joint {j}"
        for j, row in enumerate(rows, 1)
    ]
    return f"# {', '.join(order)}\ndh = np.array([\n" + "\n".join(lines) + "\n])\nT = np.array([[1, 0], [0, 1]])"


def vectors(rows, order, variable):
    names = "a", "alpha", "d", "offset"
    return "\n".join(f"{name} = [{' '.join(si(row[k], k % 2) for row in rows)}];" for k, name in enumerate(names))


def symbols(rows, order, variable):
    lines = [f"{j},a{j},{al},d{j},{o}" for j, (_, al, _, o) in enumerate(rows, 1)]
    values = [f"a{j} = {shown(a)} mm, d{j} = {shown(d)} mm" for j, (a, _, d, _) in enumerate(rows, 1)]
    return "\n".join(["i,a,alpha (deg),d,theta (deg)", *lines, "", *values])


FORMS = (markdown, latex, html, tabs, semicolons, blanks, box, turned, links, revolutes, dictionaries, yaml_lists)
FORMS += yaml_blocks, matrix, vectors, symbols
ORDERS = st.permutations(list(NAMES))


def read(tmp_path, text, name="table.txt", **options):
    (tmp_path / name).write_text(text, encoding="utf-8", newline="")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return read_dh_table(tmp_path / name, "arm", as_printed=True, **options)


def numbers(content):
    return [
        (row.a_mm, row.alpha_deg, row.d_mm, zero.offset_deg) for row, zero in zip(content.dh.rows, content.zero.rows)
    ]


CALLS = """
def dh(theta, d, a, alpha):
    return np.array([[cos(theta), d], [sin(theta), a]])
T1 = dh(q[0], 0.29, 0, -pi/2)
T2 = dh(q[1] - M_PI_2, 0, 0.27, 0)
"""
DECLARED = """
Matrix4d link(double alpha, double a, double d, double theta);
return link(-M_PI_2, 0, 0.29, q(0)) * link(0, 0.27, 0, q(1) - Eigen::PI / 2);
"""
KDL = """
chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame::DH(0, -KDL::PI / 2, 0.29, 0)));
chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame::DH(0.27, 0, 0, -M_PI_2)));
"""
DEFINED = """
#define DH_A1 0
#define DH_A2 0.27
#define DH_ALPHA1 -M_PI / 2
#define DH_ALPHA2 0
#define DH_D1 0.29
#define DH_D2 0
#define DH_THETA1 q1
#define DH_THETA2 q2 - M_PI_2
"""
TOML = "[[joint]]\na = 0\nalpha = -90\nd = 290\noffset = 0\n[[joint]]\na = 270\nalpha = 0\nd = 0\noffset = -90\n"
WORDS = (
    "Gelenk;Drehwinkel θ [Grad];Achsabstand d [mm];Länge a [mm];Verdrehung α [Grad]\n1;θ1;290;0;-90\n2;θ2-90;0;270;0\n"
)
NO_ANGLE = '{"a": 0, "d": 290, "alpha": -90, "theta": null, "offset": 0}, '
NO_ANGLE += '{"a": 270, "d": 0, "alpha": 0, "theta": null, "offset": -90}'
ARRAYS = (
    "d = np.array([0.29, 0])\nal = np.array([-np.pi/2, 0])\na = np.array([0, 0.27])\noffset = np.array([0, -np.pi/2])\n"
)


TYPED = "struct Row {\n  float d;  // offset\n  float a;\n  float alpha;\n  float offset;\n};\n"
TYPED += "const Row rows[] = {\n {0.29f, 0.0f, -M_PI_2, 0.0f},\n {0.0f, 0.27f, 0.0f, -M_PI_2}\n};\n"
ENTITIES = "&alpha; | a | d | &theta;\n:--|:--|:--|:--\n-&pi;/2 | 0 | 0.29 | q&#8321;\n0 | 0.27 | 0 | q&#8322;-&pi;/2\n"
NUMBERED = "a1 = 0; alpha1 = -pi/2; d1 = 0.29; th1 = th(1);\na2 = 0.27; alpha2 = 0; d2 = 0; th2 = th(2)-pi/2;\n"
TWO_NAMES = (
    "a1, a2 = 0, 0.27\na_1 = -pi/2\na_2 = 0\noffset = [0, a_1]\nd = [0.29, 0]\na = [a1, a2]\nalpha = [a_1, a_2]\n"
)
HELD = "self.d1 = 0.29\nself.a2 = 0.27\nlinks = [RevoluteDH(d=self.d1, a=0, alpha=-np.pi / 2),\n"
HELD += "RevoluteDH(d=0, a=self.a2, alpha=0, offset=-np.pi / 2)]\n"
NAMED = "Row = namedtuple('Row', ['a', 'alpha', 'd', 'theta'])\n"
NAMED += "arm = [Row(0, -FRAC_PI_2, 0.29, 'q1'), Row(0.27, 0, 0, 'q2-pi/2')]\n"
CELLS = "% theta, d, a, alpha\nDH = {'q1' 0.29 0 -pi/2;\n  'q2-pi/2' 0 0.27 0};\n"


@pytest.mark.parametrize(
    "text",
    [
        TYPED,
        HELD,
        ENTITIES,
        NUMBERED,
        TWO_NAMES,
        NAMED,
        CELLS,
        CALLS,
        DECLARED,
        KDL,
        DEFINED,
        TOML,
        WORDS,
        NO_ANGLE,
        ARRAYS,
    ],
)
def test_two_rows_of_an_irb_120_are_read_in_programs_and_files_of_others(tmp_path, text):
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_a_table_is_read_as_it_is_meant_in_every_form(tmp_path, form):
    content, _ = read(tmp_path, form(IRB120, ["theta", "d", "a", "alpha"], "θ{}"))
    np.testing.assert_allclose(numbers(content), IRB120, atol=1e-9)


# No longest link of an arm is shorter: a table without units would be in metres.
LENGTHS = st.one_of(
    st.just(0), st.integers(10, 900), st.integers(-900, -10), st.integers(100, 9000).map(lambda n: n / 10)
)
ROWS = st.tuples(LENGTHS, st.sampled_from([0, 90, -90, 180, 60]), LENGTHS, st.sampled_from([0, 0, 90, -90, 180, 30]))


@pytest.mark.long
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(ROWS, min_size=2, max_size=7),
    form=st.sampled_from(FORMS),
    order=ORDERS,
    variable=st.sampled_from(["", "q{}", "θ{}", "q_{}", "th({})", "θ{}*"]),
)
def test_a_table_in_any_form_is_read_back_or_refused(tmp_path, rows, form, order, variable):
    try:
        content, _ = read(tmp_path, form(rows, order, variable))
    except InputError:
        return
    np.testing.assert_allclose(numbers(content), rows, atol=1e-6)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("dh = [[0, 0.29, 0, 1], [0.27, 0, 0, 2]]", "--column"),  # no names
        ("dh = [[0, 0.29, 0, (pi/2)], [0.27, 0, 0, 2]]", "line 1: a matrix"),
        ("theta,d,a,alpha,a\n0,290,0,90,0\n0,0,270,0,0\n", "--column"),  # one twice
        (
            "a, alpha, d, t = symbols('a:d')\ndh = [[0, 0.29, 0, 1], [0.27, 0, 0, 2]]",
            "separators|--column",
        ),  # of no row
        ("a,alpha,d\n15,90,20\n30,0,0\n", "--length-unit"),
        ("i,a (m),α (deg),d (m),t\n1,0,90,0.27,1\n2,0,0,0.2,0\n", "type"),
        ("i,α,d,θ,r\n1,90,270,θ1,300\n2,0,200,θ2,0\n", "--column"),  # Khalil's d is a
        ("i,a,alpha,d,theta\n1,a1,90,300,q1\n2,270,0,0,q2\n", "a1 = "),
        ("rows = [[q1, 290, 0, -pi/2], [q2, 270, 0, pi/2], [q3, 0, 70, 0]]", "no names"),
        ("num_dof = 1\n# a alpha d theta\nM = [[0, -pi/2, 290, 0], [270, 0, 0, 0]]", "says 1 joints"),
        ("a1 = 0; a2 = 10\na2 = in_metres(a2)\n# a alpha d theta\nM = [[a1, pi/2, 1, 0], [a2, 0, 0, 0]]", "two values"),
        ("# d, a, alpha\nrows = [[0.3, 0, -pi/2],\n        [0, 0.3, 0]]\noffsets_left = [0, pi/2]", "offsets_left"),
        (
            "Name theta [rad] a [m] d [m] alpha [rad] Mass [kg]\nJoint 1 0 0 0.1 0 2.5\nJoint 2 0 0.4 0 0 3.5 1\n",
            "fields",
        ),
        ("# d, a, alpha\nrows = [[0.3, 0, -pi/2],\n        [0, 0.3, 0]]\nq_offset = [0, pi/2, 0]", "q_offset"),
        ("# d, a, alpha\nrows = [[0.3, 0, -pi/2],\n        [0, 0.3, 0]]\ntheta0 = [0, pi/2]", "theta0"),
        ("L = [Link([0 0.3 0 pi/2])];\nL(2).offset = 1;\nL(3).offset = 2;", "call"),
        ("L(1) = Link([0 0.1 0 pi/2]);\nL(2) = Link(dh(2,:));", "line 2"),
        ("for i in range(3):\n  links.append(RevoluteDH(d=0.1, a=0.2))", "row for each"),
        (
            "i,a,alpha,d,theta\n1,0,90,300,0\n2,270,0,0,0\n\ni,a,alpha,d,theta\n1,0,90,301,0\n2,270,0,0,0\n",
            "one of them",
        ),
        ("a (mm),alpha (deg),d (mm)\n0,pi/2°,3\n", "one unit|without a unit"),
        ("a = [0, 0.3]\nd = [0.2, 0]\nalpha = [pi/2, 0]\ntheta = [0, -pi/2]", "offset"),  # zeros or a pose
        ("a = [0, 0.3]\nd = [0.2, 0]\nalpha = [pi/2, 0]\nd = [0.1, 0]", "another list of d"),
        ("a = [0, 0.3]\nd = [0.2, 0]\nalpha = [pi/2, 0]\noffset = [pi]", "offset 1|length"),
        ('dh = {"a": [0, 0.3, 0], "d": [0.2, 0, 0], "alpha": [1, 0, 0], "theta": [0, 1]}', "theta 2"),
        ("l = [0.1, 0.2, 0.3]\n# a alpha d\ndh = [[l[1], 0, 0], [0, 0, l[2]]]", "l1 = "),  # from 0 or from 1
        ("i,a (mm),alpha (deg),d (mm),theta (deg)\n1,0,90,300,0\n2,270,0,0,180 + β\n", "β = "),
        ("th1 = pi/6; th2 = 0\nd1 = 0.3; d2 = 0\na1 = 0; a2 = 0.4\nalpha1 = pi/2; alpha2 = 0", "pose"),
        ("q1 = q1; q2 = q2\nd1 = 0.3; d2 = 0\na1 = 0\nalpha1 = pi/2; alpha2 = 0", "a 1|different"),
        ("% theta d a alpha\nDH = [0 0 0 pi/2;\n0 0 0.3 0];\nL(1) = Link([DH(1,:) 1 0]);", "line 4"),
        ("i;a [mm];alpha [gon];d [mm]\n1;0;100;300\n2;270;0;0\n", "alpha_deg"),
        ("j = rigidBodyJoint(['j' n],'prismatic');\n% a alpha d theta\nM = [0 0 0.3 0;\n0.2 0 0 0];", "types"),
        ("a,alpha,d\n0.1,90,0.06\n2.61,0,0.1\n", "say no unit"),  # metres, or inches
        ("a,alpha,d\n300,1.05,0\n200,0,0\n", "--angle-unit"),
        ("a,alpha,d,type\n300,90,0,1\n200,0,0,1\n", "turns"),
        (
            "# a, alpha, d, theta\nM = [[0, 0.3, 0, 1], [0, 0, 0.2, 1]]\nfor theta, d, a, alpha in M:\n",
            "the program theta",
        ),
        ("a = [0, 1]\nalpha = [0, 0]\nd = [1, 0]\ntheta = [q['a'], 1]", "column theta: 'q"),
        ("r = [0, 1]\nl = [1, 2]\nd = [1, 0]\nalpha = [0, 0]", "'l' is another list of a"),
        ("a = [pi, 0]\nl = [0, 1]\nd = [1, 0]\nalpha = [0, 0]", "another list of alpha than 'a' of line 1"),
        ("% a alpha d theta\nL1 = [0 0 1 0];\nL2 = [1 0 0 0];\nR1 = [0 0 1 0];\nx = [L1; L2; R1];", "--column"),
        (
            "if x:\n  d1 = 0.1\nelse:\n  d1 = 0.29\n# a alpha d theta\nM = [[0, 0, d1, 0], [0.27, 0, 0, 0]]\n",
            "two values",
        ),
        (
            "def f():\n  d1 = 1\ndef g():\n  d1 = 2\n# a alpha d theta\nM = [[0, 0, d1, 0], [1, 0, 0, 0]]\n",
            "two values",
        ),
        ("i,a,alpha,d\n1,L,0,0\n2,0,0,1\n\nL = f * g\n", "holds L = f"),
        ("d1 = 0.1\nd1 = 0.29\n# a alpha d theta\nM = [[0, 0, d1, 0], [1, 0, 0, 0]]\n", "two values"),
        ("# theta, d, a, alpha\nM = [(radians(45), 0.5, 1.0, 0), (radians(30), 0, 1.0, 0)]\n", "row 2, .* of a pose"),
        ("i,a (mm),alpha (deg),d (mm),theta (deg)\n1,0,90,300,0\n2,270,0,0,-79.4\n", "offset if theta = q"),
        ("d1 = 1\nd1 += 1\n# a alpha d theta\nM = [[0, 0, d1, 0], [1, 0, 0, 0]]\n", "two values"),
        ("# a alpha d theta\nDH: [0, 0, 0.3, 0,\n 0.2, 0, 0, 0]\ntype_joints: 'RP'\n", "types"),
        ("# a alpha d theta\nM = [[0, 0, 0.3, 0], [0.2, 0, 0, 0]]\nsigma = [0, 1]", "types"),
        (
            "M = [[0, 0, 0.3, 0], [0.2, 0, 0, 0]]\nT = row(a=M[0][0], alpha=M[0][1], d=M[0][2], theta=M[0][3] - q)",
            "--column",
        ),
        ("i,length a,offset d,theta\n1,0,0,q1\n", "lacks alpha"),
        ('{"dh": [[0, 321.5, 50, -90], [-90, 0, 270, 0]]}', "--column"),
        ("M = [0 0 0.3 0;\n 0.2 0 0 0];\nsetFixedTransform(j, trvec2tform(M(1,1:3)));", "--column"),
        (
            "L(1) = Link([0 1 0 0]);\nL(2) = Link([0 0 1 0]);\nR(1) = Link([0 1 1 0]);\nR(2) = Link([0 0 1 0]);",
            "one of them",
        ),
        (
            "".join(f"{arm}.append(RevoluteDH(a=0.1, d={d}))\n" for d, arm in enumerate(["one"] * 2 + ["two"] * 2)),
            "one of them",
        ),
        ("i,a (m),α (deg),d (m),θ\n1,0,-90,0.29,\n2,0.27,0,0,-90°\n3,0,0,0.1,0\n", "nothing moves"),  # 0 among blanks
        ("i,a (mm),α (deg),d (mm),θ\n1,0,-90,1 070,q1\n2,270,0,0,q2\n", "is not a number"),
        ("i,a (mm),α (deg),d (mm),θ\n1,0,-90,300,0..170\n2,270,0,0,0..90\n", "is not a number"),
        ("i,a (mm),α (deg),d (mm),θ\n1,0,-90,72²,q1\n2,270,0,0,q2\n", "is not a number"),
        ("i,a (mm),α (deg),d (mm),θ\n1,0,-90,72.5(2),q1\n2,270,0,0,q2\n", "is not a number"),
        ("i,a (in),α (deg),d (in),θ\n1,0,-90,23½,q1\n2,27,0,0,q2\n", "is not a number"),
        ("L = [PrismaticDH(alpha=pi/2)]\nfor i in n:\n    L.append(RevoluteDH(d=d[i], a=a[i]))\n", r"d\[i\]"),
        ("L(1)=Link([0 0.3 0 0]);\nL(2)=Link([0 0 1 0]);\nr=SerialLink(L);\nr.offset([1 2])=[1 0];", "r.offset"),
        ("DH = [% theta d a alpha\n0 0 0 90;%平动关节\n0 0 100 0];\n", "types of joints"),
        ("% theta d a alpha\nDH = [0 290 0 -90\n0 0 270 0];\njoint_signs = [1 -1];\n", "directions"),
    ],
)
def test_what_has_two_readings_is_asked_back(tmp_path, text, names):
    with pytest.raises(InputError, match=names):
        read(tmp_path, text)


def test_columns_that_are_said_take_rows_below_other_headings(tmp_path):
    text = "link i, a alpha i d theta i\n1 0 -90 290 0\n2 270 0 0 -90\n"
    content, _ = read(tmp_path, text, columns=["joint", "a", "alpha", "d", "theta"])
    np.testing.assert_allclose(numbers(content), IRB120[:2])


def test_columns_without_names_are_read_as_they_are_said_to_be(tmp_path):
    text = "dh = [[0, 290, 0, -pi/2], [-pi/2, 0, 270, 0]]"
    content, _ = read(tmp_path, text, columns=["theta", "d", "a", "alpha"])
    np.testing.assert_allclose(numbers(content), [(0, -90, 290, 0), (270, 0, 0, -90)])
    with pytest.raises(InputError, match="--column names 2"):
        read(tmp_path, "i,a,alpha,d\n1,0,90,300\n", columns=["a", "d"])


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("25*10^-3", 0.025, ""),
        ("2·10⁻³ m", 0.002, "m"),
        ("-3pi/2", -1.5 * np.pi, "rad"),
        ("deg2rad(30)", np.pi / 6, "rad"),
        ("90*pi/180", np.pi / 2, "rad"),
        ("pi/2 rad", np.pi / 2, "rad"),
        ("0 - np.pi/2", -np.pi / 2, "rad"),
        ("（１＋２）／４", 0.75, ""),
        ("−90°", -90, "deg"),
        ("2^-1 cm", 0.5, "cm"),
    ],
)
def test_arithmetic_is_parsed(text, value, unit):
    found = amount_of(text)
    assert (found.number, found.unit) == (pytest.approx(value), unit)


@pytest.mark.parametrize("text", ["__import__('os')", "9**9**9**9", "(" * 50, "1" * 300, "a b", "1/0", "q1*q2", "1;2"])
def test_nothing_else_is(text):
    with pytest.raises(ValueError, match=r"is|multiplies|divides"):
        amount_of(text)


@pytest.mark.parametrize(("said", "longest"), [("in cm", 1100), ("in cm and m", 110), ("of 7; reach 80 cm", 110)])
def test_centimetres_that_the_text_says_are_no_millimetres(tmp_path, said, longest):
    table = "| a | alpha | d | theta |\n|---|---|---|---|\n| 0 | 90 | 40 | q1 |\n| 110 | 0 | 0 | q2 |\n"
    content, _ = read(tmp_path, f"D-H parameters, all lengths {said}:\n\n{table}")
    assert content.dh.rows[1].a_mm == pytest.approx(longest)


def test_a_flange_of_zeros_is_no_row_and_a_coupling_is_asked_back(tmp_path):
    text = "alpha0 = 0; a0 = 0; d1 = 290; offset1 = 0;\nalpha1 = -90; a1 = 50; d2 = 0; offset2 = -90;\n"
    content, _ = read(tmp_path, f"{text}alpha2 = 0; a2 = 0;\n")
    assert numbers(content) == [(0, 0, 290, 0), (50, -90, 0, -90)]
    lists = "a = [0, 0.27];\nalpha = [-pi/2, 0];\nd = [0.29, 0];\noffset = [0, -pi/2];\n"
    with pytest.raises(InputError, match="changes theta"):
        read(tmp_path, f"{lists}q(2) = q(2) - q(1);\n")
    with pytest.raises(InputError, match="different numbers"):
        read(tmp_path, f"{text}alpha2 = 0; a2 = 40;\n")


def test_aligned_equations_of_a_document_give_values(tmp_path):
    table = r"""\begin{tabular}{cccc} $a$ & $\alpha$ & $d$ & $\theta$ \\ 0 & -90 & $L_1$ & $q_1$ \\ $L_2$ & 0 & 0 &
$q_2-90$ \end{tabular} \begin{align*}
L_1 &= 290 \,\mathrm{mm} \\
L_2 &= 270 \,\mathrm{mm}
\end{align*}"""
    np.testing.assert_allclose(numbers(read(tmp_path, table)[0]), IRB120[:2], atol=1e-9)


@pytest.mark.parametrize(
    "table", ["DH = [0 0.29 0 \x96pi/2; 0 0 0.27 0];\n", "|theta|d|a|alpha|\n|--|--|--|--|\n|q1|290|0|\x9690|\n"]
)
@pytest.mark.filterwarnings("ignore::er3a.InputWarning")
def test_comments_in_another_encoding_are_left_out_and_cells_asked_back(tmp_path, table):
    (tmp_path / "arm.m").write_bytes(f"% theta d a alpha \xb1\xe0\n{table}".encode("latin-1"))
    with pytest.raises(InputError):
        er3a.read_table(tmp_path / "arm.m")
    (tmp_path / "arm.m").write_bytes(f"% \xb1\xe0 theta d a alpha\n{table}".replace("\x96", "-").encode("latin-1"))
    assert er3a.read_table(tmp_path / "arm.m").alpha[0] == pytest.approx(-np.pi / 2)


@pytest.mark.parametrize(
    "offset", ["R.offset = [0 -pi/2];", "R.offset = [0 -90]*pi/180;", "offset = deg2rad([0 -90]);\nR.offset = offset;"]
)
def test_the_offsets_of_a_toolbox_arm_are_added_to_its_matrix_and_its_theta_is_none(tmp_path, offset):
    text = f"DH = [0 0.29 0 -pi/2 0;\n pi 0 0.27 0 0];\nR = SerialLink(DH);\n{offset}\n"
    content, notes = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)
    assert any("joint 2 pi" in each for each in notes)


@pytest.mark.parametrize(
    "other",
    [
        "Q = [0 0 0 0 0; pi/4 -pi/2 0 0 0];",  # poses
        "M.I = [0.001 0 0; 0 0.0009 0; 0 0 0.0005];",
        "colours = [1 0 0; 0 1 0; 1 0 1];",
        "D = (r^2 - a2^2) / (2*a2);",
        "syms a2 d1 t1 t2 alpha1\n% theta d a alpha\nsymbols = [t1 d1 0 alpha1; t2 0 a2 0];",
    ],
)
def test_other_matrices_of_a_program_are_no_second_table(tmp_path, other):
    text = f"% [theta, d, a, alpha]\nDH = [0 0.29 0 -pi/2;\n 0 0 0.27 0];\n{other}\nR = SerialLink(DH);\n"
    np.testing.assert_allclose(numbers(read(tmp_path, text)[0]), [(0, -90, 290, 0), (270, 0, 0, 0)], atol=1e-9)


def test_four_columns_without_names_are_read_if_no_other_order_is_an_arm(tmp_path):
    arm = [(q, shown(d), shown(a), si(alpha, True)) for q, (a, alpha, d, _) in zip(("q1", "q2", "q3"), IRB120)]
    for order in permutations(range(4)):
        rows = "],\n [".join(", ".join(row[k] for k in order) for row in [*arm, ("q4", "302", "0", "pi/2")])
        content, notes = read(tmp_path, f"arm = Arm([[{rows}]])")
        np.testing.assert_allclose(np.array(numbers(content))[:, [0, 2]], [row[0:3:2] for row in IRB120[:4]])
        assert any("two joints" in each for each in notes)


def test_lists_named_as_books_name_the_parameters_are_columns_and_a_gripper_is_no_row(tmp_path):
    lists = "linkTwist = [-pi/2; 0];\nlinkLength = [0; 270];\nlinkOffset = [290; 0];\n"
    content, _ = read(tmp_path, f"% standard D-H\n{lists}h.link(k+1).Children = 1;\n")
    assert [(row.a_mm, row.d_mm) for row in content.dh.rows] == [(0, 290), (270, 0)]
    constants = ("A1 0", "A2 0.27", "D1 0.29", "D2 0", "ALPHA1 -PI/2", "ALPHA2 0")
    defines = "".join(f"#define DH_{each}\n" for each in constants)
    assert len(read(tmp_path, defines)[0].dh.rows) == 2
    with pytest.raises(InputError, match="DH_DG"):
        read(tmp_path, f"{defines}#define DH_DG 0.303\n")


def test_names_given_by_each_other_end():
    with pytest.raises(ValueError, match="deep"):
        amount_of("a", {"a": "b", "b": "a"})


def test_rows_without_a_variable_are_base_and_flange_and_sliding_joints_keep_their_sign(tmp_path):
    rows = "0 (base),0,180,0,0", "1,0,90,100,q1", "2,0,0,50-d2,90", "3 (to tool),0,0,60,0"
    content, _ = read(tmp_path, "\n".join(["i,a (mm),alpha (deg),d (mm),theta (deg)", *rows]))
    assert [row.type for row in content.dh.rows] == ["revolute", "prismatic"]
    assert [row.direction for row in content.zero.rows] == [1, -1]
    assert content.base.rpy_deg[0] == pytest.approx(180)
    assert (content.flange or content.tool).xyz_mm[2] == pytest.approx(60)


def test_the_offset_of_a_joint_that_slides_is_part_of_its_d(tmp_path):
    content, _ = read(tmp_path, "%Robot=[d v a alpha offset;\nR = [0 q1 .4 pi/2 pi/2;\n     .1+q2 0 0 0 .5];\n")
    assert [row.d_mm for row in content.dh.rows] == pytest.approx([0, 600])
    assert [zero.offset_deg for zero in content.zero.rows] == [pytest.approx(90), None]


def test_a_matrix_of_symbols_keeps_its_offsets(tmp_path):
    values = "d1 = 0.38; a1 = 0; alpha1 = 0;\nd2 = 0; a2 = 0.35; alpha2 = -pi/2;\n"
    content, _ = read(
        tmp_path, "% standard D-H\n" + values + "M = [theta1 d1 a1 alpha1;\n     theta2-pi/2 d2 a2 alpha2];\n"
    )
    np.testing.assert_allclose(numbers(content), [(0, 0, 380, 0), (350, -90, 0, -90)])


@pytest.mark.parametrize(
    "text",
    [
        "a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0.29, 0]\ntheta = [q1, q2 - pi/2]",
        "robot.DH.theta= '[q(1) q(2)-pi/2]';\nrobot.DH.d='[0.29 0]';\n"
        "robot.DH.a='[0 0.27]';\nrobot.DH.alpha='[-pi/2 0]';",
        "double DH_a1=0, DH_a2=0.27;\ndouble DH_d1=0.29, DH_d2=0;\ndouble DH_alpha1=-M_PI/2, DH_alpha2=0;\n"
        "double DH_q_offset1=0, DH_q_offset2=-M_PI/2;",
        "% a alpha d theta\ndh(1,:) = [0 -pi/2 0.29 0];\ndh(2,:) = [0.27 0 0 -pi/2];",
        "dh = [(0, -pi/2, 0.29, 0), (0.27, 0, 0, -pi/2)]\nfor i, (a, alpha, d, theta_offset) in enumerate(dh):",
        "// a alpha d theta\ndh << 0, -M_PI/2, 0.29, 0,\n 0.27, 0, 0, -M_PI/2;",
        "DH dh[] = {{.a = 0, .alpha = -M_PI/2, .d = 0.29, .theta = 0},\n"
        "{.a = 0.27, .alpha = 0, .d = 0, .theta = -M_PI/2}};",
        "θ (deg);a (mm);α (deg);d (mm);θ range\nq1;0;-90;290;±90\nq2-90;270;0;0;±90\n",
        "i | alpha | a | d | theta\n--|--|--|--|--\n1 | -pi/2 | 0 | 0.29 | \n2 | 0 | 0.27 | 0 | θ2-pi/2\n",
        "| theta | d | a | alpha\nJ0 | t0 | 290 | 0 | -90°\nJ1 | t1-90 | 0 | 270 | 0°\n",
        "| i | a [mm] | α [°] | d [mm] | θ |\n|1|0|-90|290[mm]|$q_1^*$|\n|2|270|0|0|`q2` - β (variable)|\n\n"
        "**Note:** `β = 90°`.",
        "L(1)=Link([0 0.29 0 -pi/2]);\nL(2)=Link([0 0 0.27 0]);\nr = SerialLink(L);\nr.offset(2)=-pi/2;",
        "L(1)=Link([0 0.29 0 -pi/2]);\nL(2)=Link([0 0 0.27 0]);\nr = SerialLink(L);\nr.links(2).offset=-pi/2;",
        "T = [(-pi/2, 0, d1, th1), (0, L2, 0, th2-pi/2)]\nd1 = 0.29\nL2 = 0.27",
        "<tr><th>i</th><th>θ</th><th>d</th><th>a</th><th>α</th></tr>\n{[[1, 'θ₁', 290, 0, -90],\n"
        "  [2, 'θ₂-90', 0, 270, 0]].map((row) => (<td>{row}</td>))}",
        "Kinematics theta [rad] a [m] d [m] alpha [rad] Dynamics Mass [kg] Center of Mass [m]\n"
        "Joint 1 0 0 0.29 -π/2 Link 1 3.7 [0, -0.02, 0.001]\nJoint 2 -π/2 0.27 0 0 Link 2 8.1 [0.2, 0, 0.1]\n",
        "# revolute: 1, prismatic: 2\ndh = [{'alpha': -pi/2, 'a': 0, 'd': 0.29, 'theta': 0, 'type': 1},\n"
        "      {'alpha': 0, 'a': 0.27, 'd': 0, 'theta': -pi/2, 'type': 1}]",
        "L = struct('name', 'Body', 'th', 0, 'dz', 0, 'dx', 0, 'alf', 0, 'az', UZ);\n"
        "L(1) = struct('name', 'Base', 'th', 0, 'dz', 0, 'dx', 0, 'alf', 0, 'az', UZ);\n"
        "L(2) = struct('name', 'J1', 'th', 0, 'dz', 290, 'dx', 0, 'alf', -pi/2, 'az', UZ);\n"
        "L(3) = struct('name', 'J2', 'th', -pi/2, 'dz', 0, 'dx', 270, 'alf', 0, 'az', UZ);",
        "arm.alpha(1) = -pi/2;\narm.alpha(2) = 0;\narm.a(1:2) = 0;\narm.a(2) = 270;\narm.d(1) = 290;\narm.d(2) = 0;\n"
        "arm.offset(1) = 0;\narm.offset(2) = -pi/2;",
        "# d, a, alpha\nROWS = [[0.29, 0, -pi/2],\n        [0, 0.27, 0]]\nTHETA_OFFSETS_LEFT = [0, -pi/2]",
        "a = [0 0.27];\nalpha = [-pi/2 0];\nd = [0.29 0];\nvar = [teta1 teta2-pi/2];\n",
        "a1 = 0\na2 = 0.27\nd1 = 0.29\nd2 = 0\nalfa1 = -pi/2\nalfa2 = 0\ntheta1 = angulo1\ntheta2 = angulo2 - pi/2\n"
        "angulo2 = 30\nA1 = row(d1, a1, alfa1, theta1)\nA2 = row(d2, a2, alfa2, theta2)\ndef row(d, a, alfa, theta):",
        "% DHM\nalpha = [-pi/2 0];\nd = [0 0.27];\nr = [0.29 0];\ntheta = [q(1) q(2)-pi/2];\n",
        "DH = [-pi/2,0,0.29,0;\n0,0.27,0,-pi/2];\nfor i = 1:1:2\nL(i) = Link([0, DH(i,3), DH(i,2), DH(i,1), 0]);\nend\n"
        "arm = SerialLink(L);\narm.offset = DH(:,4)';\n",
        "import DQ\nx_a = [0, 0.27]\nx_alpha = [-pi/2, 0]\nx_d = [0.29, 0]\nx_theta = [0, -pi/2]\n"
        "DQ_SerialManipulatorDH([x_theta, x_d, x_a, x_alpha])",
        '[Header("DH (alpha, a, d, theta0)")]\npublic float[] alpha = new float[2]\n{\n -Mathf.PI / 2f,\n 0f\n};\n'
        "public float[] a = new float[2]\n{\n0f,\n0.27f};\npublic float[] d = new float[2] {0.29f, 0f};\n"
        "public float[] theta0 = new float[2] {0f, -Mathf.PI / 2f};\n",
        "// each row = [a, alpha, d, theta]\n// Link 1: [0, -π/2, 0.29, th1]\n// Link 2: [0.27, 0, 0, th2 - π/2]\n"
        "Matrix T;\n",
        "| $\\mathbf i$ | $\\mathbf \\alpha$ | $\\mathbf a$ | $\\mathbf d$ | $\\mathbf \\theta$ |\n|--|--|--|--|--|\n"
        "| 1 | $-\\frac{\\pi}{2}$ | 0 | 0.29 | |\n| 2 | 0 | 0.27 | 0 | $\\theta_2 = \\theta_2 -\\frac{\\pi}{2}$ |\n",
        "| i | θ | d | a | α (rad) | α (deg) |\n|--|--|--|--|--|--|\n| 1 | q1 | d1 | 0 | -π/2 | -90 |\n"
        "| 2 | q2-90° | 0 | a2 | 0 | 0 |\n\nd1 = 290,0 mm, a2 = a3 = 270,0 mm\n",
        '{"links": [{"a": 0, "alpha_deg": -90, "d": 0.29, "offset_deg": 0, "notes": "x: a=0, d=0.29, alpha=90"},\n'
        '{"a": 0.27, "alpha_deg": 0, "d": 0, "offset_deg": -90, "notes": "x"}]}',
        "a1=0; d1=0.29; tw1=-pi/2; th1=q1;\na2=L2; d2=0; tw2=0; th2=q2-pi/2;\nL2=0.27;\n",
        'P = {\n"alpha": {\n"value": [-np.pi / 2, 0.0],\n"free": [True, True],\n},\n'
        '"a": {\n"value": [0.0, 0.27],\n"free": [True, True]},\n"d": {"value": [0.29, 0.0],\n"free": [True, True]},\n'
        '"theta_offset": {"value": [0.0, -np.pi / 2],\n"free": [True, True]}}\n',
        "R = [[0,0,1],\n[0,-1,0],\n[1,0,0]]\n"
        "# a, alpha, d, theta\nDH = [[0, -pi/2, 0.29, q1], \\\n[0.27, 0, 0, q2-pi/2]]\n",
    ],
)
def test_offsets_are_kept_in_the_programs_and_tables_of_people(tmp_path, text):
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


@pytest.mark.parametrize(("brace", "a2"), [("", "0.27"), ("\n", "lengths['upper']"), ("", "self.lengths['upper']")])
def test_no_row_of_named_rows_is_left_out(tmp_path, brace, a2):
    given = "import math\nself.lengths = {'base': 0.29, 'upper': 0.27}\nL = [0.29, 0.27]\n"
    rows = f"low = 0\narm = {{{brace}'s': [L[0], 0, low, -90],\n 'e': [low, -90, {a2}, 0]}}"
    content, _ = read(tmp_path, given + rows, columns=["d", "offset", "a", "alpha"])
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


ROWS_OF_TWO = "M = [0 -pi/2 0.29 0;\n     0.27 0 0 -pi/2];\n"
LISTS_OF_TWO = "a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0.29, 0]\noffset = [0, -pi/2]\n"
SUBSTITUTED = "d1, d2 = symbols('d1:3')\nT = row(alpha0, a0, d1, q1).subs(dh) * row(alpha1, a1, d2, q2).subs(dh)\n"
SUBSTITUTED += "dh = {alpha0: -pi/2, a0: 0, d1: 0.29, q1: q1,\n      alpha1: 0, a1: 0.27, d2: 0, q2: q2 - pi/2}\n"
SPACED = r"""
\begin{tabular}{cccc}
a & $\alpha$ & d & $\theta$ \\ [0.5ex]
\hline \\
0 & $-\pi/2$ & $L_1$ & $q_1$ \\ [1ex]
$L_2$ & 0 & 0 & $q_2 - \pi/2$ \\ [1ex]
\end{tabular}
$L_1 = 0.29$ m (base) y $L_2 = 0.27$ m
"""


@pytest.mark.parametrize(
    ("text", "convention"),
    [
        (
            "setFixedTransform(j1, [0 -pi/2 0.29 0], 'mdh');\nsetFixedTransform(j2, [0.27 0 0 -pi/2], 'mdh');",
            "modified",
        ),
        (ROWS_OF_TWO + "a = M(i,1); alpha = M(i,2); d = M(i,3); theta = M(i,4);", "standard"),
        ("% each row is [a alpha d theta]\n" + 9 * "x = 1;\n" + ROWS_OF_TWO, "standard"),
        (f"% Modified DH: [a alpha d theta]\n{ROWS_OF_TWO}T = [cos(theta), a*cos(theta)];", "standard"),
        (f"% [a alpha d theta]\n{ROWS_OF_TWO}T = rotX @ transX @ transZ @ rotZ", "modified"),
        (f"% [a alpha d theta]\n{ROWS_OF_TWO}T = SE3.Rz(q)*SE3.Tz(d)*SE3.Tx(a)*SE3.Rx(al)", "standard"),
        (f"% standard DH: [a alpha d theta]\n{ROWS_OF_TWO}T = [-sin(alpha), -sin(alpha)*d];", "modified"),
        (  # Craig's transform, of columns by their numbers
            f"% [a alpha d theta]\n{ROWS_OF_TWO}T = [sin(M(i,4))*cos(M(i,2)), cos(M(i,4))*cos(M(i,2)), -sin(M(i,2)),"
            " -sin(M(i,2))*M(i, 3)];",
            "modified",
        ),
        ("syms q1 q2\n% d v a alpha\nR = [0.29 q1 0 -pi/2;\n 0 q2-pi/2 0.27 0];", "standard"),
        (
            "r = sympybotics.RobotDef('x', [('-pi/2', 0, 0.29, 'q'), ('0', 0.27, 0, 'q-pi/2')])\n"
            "dh_convention='standard'",
            "standard",
        ),
        (
            f"{LISTS_OF_TWO}links = [RevoluteMDH(d=d[i], a=a[i], alpha=alpha[i], offset=offset[i]) for i in n]",
            "modified",
        ),
        (f"{LISTS_OF_TWO}arm = Arm(a=a, alpha=alpha, d=d, theta=offset)\nprint('d: [%g, %g]')", "standard"),
        (f"{LISTS_OF_TWO}r = [0, 0, 0; 1, 0, 2]", "standard"),
        (SUBSTITUTED, "modified"),
        (
            "rows = [{'a': 0, 'alpha': -pi/2, 'd': 0.29, 'theta': 0, 'color': (1, 0, 0)},\n"
            " {'a': 0.27, 'alpha': 0, 'd': 0, 'theta': -pi/2, 'color': (0, 1, 0)}]",
            "standard",
        ),
        (SPACED, "standard"),
        ("a = [-pi/2 0];\nl = [0 0.27];\nd = [0.29 0];\noffset = [0 -pi/2];", "standard"),  # a is an angle
        ("aList=[0 0.27];\nalphaList=[-pi/2 0];\ndList=[0.29 0];\ntList=[q1 q2-pi/2];", "standard"),
        ("L = [1, 2, 3]\n" + LISTS_OF_TWO.replace("offset = [0, ", "theta = [q[0], q[1]"), "standard"),
        (
            "a = array([[0], [0.27]])\nalpha = array([[-pi/2], [0]])\nd = array([[0.29], [0]])\n"
            "theta = array([[q[0]], [q[1]-pi/2]])",
            "standard",
        ),
        (
            "% each row is [a alpha d theta]\ndh_1 = [0, -pi/2, d1, q1];\ndh_2 = [0.27, 0, 0, q2-pi/2];\n"
            "dh = [dh_1; dh_2];\nhome_1 = [1, 2, 3, 4];\nd1 = 0.29;",
            "standard",
        ),
        (
            "def row(alpha, d, a, theta):\n  pass\nP = [(0, -pi/2, 0.29, 0), (0.27, 0, 0, -pi/2)]\n"
            "T = row(P[i][1], P[i][2], P[i][0], q[i] + P[i][3])",
            "standard",
        ),
        (
            "class Row:\n  def __init__(self, d, a, theta, alpha):\n    pass\n"
            "arm = [Row(0.29, 0, 0, -pi/2), Row(0, 0.27, -pi/2, 0)]",
            "standard",
        ),
        ("# a -> alpha -> d -> theta\nDH: [0, *NEG, 0.29, 0,\n     0.27, 0, 0, *NEG]\nNEG = -pi/2\n", "standard"),
        (
            '"""Rows of an arm.\n\nColumns: a alpha d theta\n"""\nM = [[0, -pi/2, 0.29, 0], [0.27, 0, 0, -pi/2]]',
            "standard",
        ),
        (
            "#define DH_0_THETA 0\n#define DH_0_ALPHA -90\n#define DH_0_D 0.29\n#define DH_0_R 0\n"
            "#define DH_1_THETA -90\n#define DH_1_ALPHA 0\n#define DH_1_D 0\n#define DH_1_R 0.27\n",
            "standard",
        ),
        (
            "// a alpha d theta\nconst double dh1[4] = {0, -M_PI/2, 0.29, 0};\n"
            "const double dh2[4] = {0.27, 0, 0, -M_PI/2};\nconst double home1[4] = {1, 2, 3, 4};\n",
            "standard",
        ),
        (
            "enum { A, ALPHA, D, THETA };\ndouble M[2][4] = {{0, -M_PI/2, 0.29, 0}, {0.27, 0, 0, -M_PI/2}};\n",
            "standard",
        ),
        ("// double d1 = 0.3;\nd1 = 0.29;\n# a alpha d theta\nM = [0 -pi/2 d1 0;\n 0.27 0 0 -pi/2];", "standard"),
        ("% [theta a alpha d]\nM = [0 0 -pi/2 0.29;\n -pi/2 0.27 0 0.0];\nN = [0 0 0 1];", "standard"),
        (SUBSTITUTED.replace("q1: q1,", ""), "modified"),  # a symbol that nothing replaces is a variable
        (
            'convention: "modified_dh"  # or "standard_dh"\nrows:\n - {a: 0, alpha: -pi/2, d: 0.29, offset: 0}\n'
            " - {a: 0.27, alpha: 0, d: 0, offset: -pi/2}\n",
            "modified",
        ),
        (
            "alpha(i-1) is the twist, a(i-1) the length.\n\n| twist angle | link length | link offset | joint angle |\n"
            "|---|---|---|---|\n| -pi/2 | 0 | 0.29 | q1 |\n| 0 | 0.27 | 0 | q2 - pi/2 |\n",
            "modified",
        ),
        ("i,a (m),alpha,d (m),theta\n1,0,-90°,0.29,q1\n2,0.27,0,0,q2 + 90° - pi\n", "standard"),
    ],
)
def test_programs_say_the_order_of_columns_and_the_convention(tmp_path, text, convention):
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)
    assert content.dh.convention == convention


MATLAB_FIELDS = "dh(1).a = 0; dh(1).alpha = -pi/2; dh(1).d = 0.29; dh(1).offset = 0;\n"
MATLAB_FIELDS += "dh(2).a = 0.27; dh(2).alpha = 0; dh(2).d = 0; dh(2).offset = -pi/2;\n"


@pytest.mark.parametrize(
    "text",
    [
        MATLAB_FIELDS,
        "L = [DHLink(α=-π/2, d=0.29, link_length=0, offset=0),\nDHLink(a=0.27, α=0, d=0, theta_offset=-π/2)]\n",
        "L = [OriginLink(), DHLink(d=0.29, a=0, alpha=-π/2, theta=0),\nDHLink(d=0, a=0.27, alpha=0, theta=-π/2)]\n",
        '<arm><joint id="1" a="0" alpha="-90" d="290" offset="0"/>\n'
        '<joint id="2" a="270" alpha="0" d="0" offset="-90"/></arm>\n',
        "Joint 1: a=0, alpha=-90, d=290, offset=0\nJoint 2: a=270, alpha=0, d=0, offset=-90\n",
        "dh <- data.frame(\n a = c(0, 270),\n alpha = c(-90, 0),\n d = c(290, 0),\n offset = c(0, -90))\n",
        '{"columns": ["a", "alpha", "d", "offset"], "dh": [[0, -90, 290, 0], [270, 0, 0, -90]]}',
        "A_D: tuple[float, ...] = (0.29, 0)\nA_A: tuple[float, ...] = (0, 0.27)\n"
        "A_ALPHA: tuple[float, ...] = (-math.pi / 2, 0)\nA_OFFSET = (0, -math.pi / 2)\n",
        "||Joint||a [mm]||α [°]||d [mm]||θ offset [°]||\n|1|0|-90|290|0|\n|2|270|0|0|-90|\n",
        "| Link | Frame | a (mm) | α (°) | d (mm) | θ (°) |\n|---|---|---|---|---|---|\n"
        "| 1 | base to J1 | 0 | -90 | 290 | q1 |\n| 2 | J1 to J2 | 270 | 0 | 0 | q2-90 |\n",
        "struct Row { a: f64, alpha: f64, d: f64, offset: f64 }\nconst ARM: [Row; 2] = [\n"
        " Row { a: 0.0, alpha: -FRAC_PI_2, d: 0.29, offset: 0.0 },\n"
        " Row { a: 0.27, alpha: 0.0, d: 0.0, offset: -FRAC_PI_2 },\n];\n",
        "(* {a, alpha, d, theta} *)\ndh = {{0, -Pi/2, 290, q1}, {270, 0, 0, q2 - Pi/2}};\n",
    ],
)
def test_rows_are_read_in_further_languages(tmp_path, text):
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (
            "arms = {'one': [{'a': 0, 'alpha': 0, 'd': 1}, {'a': 1, 'alpha': 0, 'd': 0}],\n"
            "'two': [{'a': 0, 'alpha': 0, 'd': 2}, {'a': 1, 'alpha': 0, 'd': 0}]}",
            "one of them",
        ),
        (
            "def mdh(a):\n  return [[ct, -st*ca, st*sa, a*ct]]\n# a alpha d theta\n"
            "M = [[0, 0, 0.3, 0], [0.2, 0, 0, 0]]",
            "standard and modified",
        ),
        (
            "one:\n - a: 0\n   alpha: 0\n   d: 1\n - a: 1\n   alpha: 0\n   d: 0\ntwo:\n - a: 0\n   alpha: 0\n   d: 2\n"
            " - a: 1\n   alpha: 0\n   d: 0\n",
            "one of them",
        ),
        ("i,a (m),α,d (m),θ\n1,0,0,0.7,q1\n2,0.3,0,0,0\n3,1,0,0,0\n4,0,0,1,0\n", "may be joints"),
    ],
)
def test_two_arms_two_conventions_and_joints_left_at_zero_are_asked_back(tmp_path, text, names):
    with pytest.raises(InputError, match=names):
        read(tmp_path, text)


def test_links_are_in_the_order_of_their_arm(tmp_path):
    made = [f"K{j} = Link('d', 0, 'a', {j / 10}, 'alpha', 0);" for j in (3, 1, 9, 2)]
    content, _ = read(tmp_path, "\n".join([*made, "r = SerialLink([K1 K2 K3], 'name', 'x');"]))
    assert [row.a_mm for row in content.dh.rows] == pytest.approx([100, 200, 300])


@pytest.mark.parametrize("said", ["modified", "standard"])
def test_the_convention_is_what_the_text_at_the_table_says(tmp_path, said):
    content, _ = read(tmp_path, f"{said.title()} D-H parameters:\n\n" + tabs(IRB120, list(NAMES), "q{}"))
    assert content.dh.convention == said


def test_joints_named_without_numbers_all_move(tmp_path):
    names = ("Base", "Shoulder", "Elbow", "Wrist 1", "Wrist 2", "Wrist 3")
    lines = [f"{name},{a},{alpha},{d},{offset}" for name, (a, alpha, d, offset) in zip(names, IRB120)]
    content, _ = read(tmp_path, "\n".join(["joint,a (mm),alpha (deg),d (mm),theta (deg)", *lines]))
    np.testing.assert_allclose(numbers(content), IRB120)


def test_a_table_comes_from_standard_input_and_from_a_text(monkeypatch, tmp_path):
    text = markdown(IRB120, list(NAMES), "q{}")
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text.encode("utf-16"))))
    content, _ = read_dh_table("-", "arm")
    np.testing.assert_allclose(numbers(content), IRB120)
    with pytest.warns(er3a.InputWarning):
        robot = er3a.read_table(text)
    np.testing.assert_allclose(robot.a, [row[0] / 1000 for row in IRB120])


def test_a_study_names_a_table_as_it_is_found(tmp_path):
    (tmp_path / "mine.md").write_text(markdown(IRB120, list(NAMES), "q{}"), encoding="utf-8")
    study = load_study("config/small.yaml")
    entry = study.entry("er3_600").model_copy(update={"file": str(tmp_path / "mine.md")})
    with pytest.warns(er3a.InputWarning):
        robot = study.model_copy(update={"robots": {"mine": entry}}).robot("mine")
    np.testing.assert_allclose(robot.a, [row[0] / 1000 for row in IRB120])


LINES = "a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0.29, 0]\n"
LISTS = LINES + "off = [0, -pi/2]\n"
RECORDS = "dh = [{'d': 0.29, 'a': 0, 'alpha': -pi/2, 'theta': 0}, {'d': 0, 'a': 0.27, 'alpha': 0, 'theta': -pi/2}]\n"
MATRIX = "DH = [[0, 0.29, 0, -pi/2], [-pi/2, 0, 0.27, 0]]\n"
ROWS_IN_A_STRUCT = "typedef struct {\nfloat a;\nfloat alpha;\nfloat d;\nfloat theta;\n} row_t;\n"
ROWS_IN_A_STRUCT += "typedef struct { row_t rows[2]; } arm_t;\n"
ROWS_IN_A_STRUCT += "arm_t arm = {{{0, -M_PI/2, 0.29, 0},\n {0.27, 0, 0, -M_PI/2}}};\n"
IN_MATLAB = "DH = [0 0.29 0 -pi/2 0 0;\n 0 0 0.27 0 0 -pi/2];\n"


@pytest.mark.parametrize(
    "text",
    [
        f"{LISTS}links = []\nfor i in range(2):\n    one = RevoluteDH(d=d[i], a=a[i], alpha=alpha[i],\n"
        "                     offset=off[i])\n    links.append(one)\n",
        f"{LISTS}L = [RevoluteDH(d=x, a=y, alpha=z, offset=w) for x, y, z, w in zip(d, a, alpha, off)]\n",
        f"{MATRIX}for (const auto& r : DH) {{\n    L.add(RevoluteDH(d=r[1], a=r[2], alpha=r[3], offset=r[0]));\n}}\n",
        f"{MATRIX}for (const r of DH) {{\n    L.push(RevoluteDH(d=r[1], a=r[2], alpha=r[3], offset=r[0]));\n}}\n",
        f"{RECORDS}for p in dh:\n    L.append(RevoluteDH(d=p['d'], a=p['a'], alpha=p['alpha'], offset=p['theta']))\n",
        f"{MATRIX}for i in range(len(DH)):\n    theta, d, a, alpha = DH[i]\n"
        "    L.append(RevoluteDH(d=d, a=a, alpha=alpha, offset=theta))\n",
        f"{MATRIX}L = [RevoluteDH(d=r[1], a=r[2], alpha=r[3], offset=r[0]) for i, r in enumerate(DH)]\n",
        f"{IN_MATLAB}for i = 1:size(DH, 1)\n  L(end+1) = Link([DH(i,:)], 'standard');\nend\n",
        f"{IN_MATLAB}L(1) = Link([DH(1,:)]);\nL(2) = Link([DH(2,:)]);\n",
        f"{IN_MATLAB}N = 2;\nfor k = 1:N\n  L(k) = Link([DH(k,:)]);\nend\n",
        f"{LISTS}L = [RevoluteDH(d=x, a=y, alpha=alpha[i], offset=off[i]) for i, (x, y) in enumerate(zip(d, a))]\n",
        "double a[2] = {0, 0.27}, b = 1;\ndouble al[2] = {-M_PI_2, 0};\ndouble d[2] = {0.29, 0};\n"
        "double th[2] = {0, -M_PI_2};\nfor (int i = 0; i < 2; i++) {\n"
        "  c.addSegment(Segment(Joint(Joint::RotZ), Frame::DH(a[i], al[i], d[i], th[i])));\n}\n",
        "# name, theta, d, a, alpha\ndh = [\n['shoulder', 0, 0.29, 0, -pi/2],\n['elbow', -pi/2, 0, 0.27, 0]]\n",
        "# | i | theta | d | a | alpha |\n# |---|---|---|---|---|\n# | 1 | q1 | 0.29 | 0 | -pi/2 |\n"
        "# | 2 | q2-pi/2 | 0 | 0.27 | 0 |\nimport x\n",
        "% DH: [a, d, alpha, theta]\nM = [0, 0.29, -pi/2, 0;\n 0.27, 0, 0, -pi/2];\nC = [0, 0.1, 0;\n 0.2, 0, 0];\n",
        "A = np.array([0, 0.27])\nD = np.array([0.29, 0])\nALPHA = np.array([-np.pi/2, 0])\n"
        "OFFSET = [0, -np.pi/2]\nQ_MIN = np.array([-2.9, -1.7])\nq_goal = [0.1, 0.2]\n",
        f"{LINES}L = [RevoluteDH(d=0.29, alpha=-pi/2)]\nfor i in range(1, 2):\n"
        "    L.append(RevoluteDH(d=d[i], a=a[i], alpha=alpha[i], offset=-pi / 2))\n",
        "d = [0.29, 0]\na = [0, 270]\nalpha = [-90, 0]\nback = [0, pi/2]\nL = [RevoluteDH(d=d[i], a=a[i] / 1000,"
        " alpha=np.radians(alpha[i]), offset=-back[i]) for i in range(2)]\n",
        f"{MATRIX}for i in range(1):\n    L.append(RevoluteDH(d=DH[i][1], a=DH[i][2], alpha=DH[i][3]))\n"
        "L.append(RevoluteDH(d=DH[1][1], a=DH[1][2], alpha=DH[1][3], offset=DH[1][0]))\n",
        "def row(theta, d, a, alpha):\n    return eye(4)\nx = [0.29, 0]\ny = [0, 0.27]\nz = [-pi/2, 0]\n"
        "for i in range(2):\n    T = T @ row(q[i] - i * pi / 2, x[i], y[i], z[i])\n",
        "l = [29, 27];\nDH = [0 l(1)/100 0 -pi/2;\n -pi/2 0 l(2)/100 0];\nfor i = 1:2\n"
        "  L(i) = Link('d', DH(i,2), 'a', DH(i,3), 'alpha', DH(i,4), 'offset', DH(i,1));\nend\n",
        f"{LISTS}for i in range(2):\n    one = RevoluteDH(\n"
        "        d=d[i], a=a[i], alpha=alpha[i], offset=off[i]\n    )\n",
        f"{LINES}theta = [0, -pi/2]\nq = theta + q\n",
        "a_value = [0 0.27];\nalpha_value = [-pi/2 0];\nd_value = [0.29 0];\ntheta_value = [q1 q2-pi/2];\n",
        "AValues: [...]float64{0, 0.27},\nAlphaValues: [...]float64{-math.Pi/2, 0},\nDValues: [...]float64{0.29, 0},\n"
        "ThetaOffsets: [...]float64{0, -math.Pi/2},\n",
        "struct Row\n{\n  double a = 0.0;\n  double alpha = 0.0;\n  double d = 0.0;\n  double thetaOffset = 0.0;\n};\n"
        "std::vector<Row> rows()\n{\n  return {{0, -M_PI / 2, 0.29, 0},\n          {0.27, 0, 0, -M_PI / 2}};\n}\n",
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_loops_over_the_rows_of_a_table_are_written_out(tmp_path, text, end):
    content, _ = read(tmp_path, text.replace("\n", end))
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)
    assert content.dh.convention == "standard"


@pytest.mark.parametrize(
    "put_in",
    [
        "DH(:,1) = DH(:,1) + q_deg(:);",
        "DH(i,1) = q(i);",
        "DH(2,1) += q(2);",
        "DH(:,1) = theta';",
        "H(1,4) = 1;",
        "x_d = [0 1]; x_d(1) = 0.5;",
    ],
)
def test_values_of_joints_may_be_put_into_a_matrix(tmp_path, put_in):
    content, _ = read(tmp_path, f"% theta d a alpha sigma offset\n{IN_MATLAB}{put_in}\n")
    assert len(content.dh.rows) == 2


ROW = "def dh(theta, d, a, alpha):\n  pass\n"


@pytest.mark.parametrize(
    "text",
    [
        "theta1 = q1\ntheta2 = q2 - pi/2\nT1 = dh(theta1, 0.29, 0, -pi/2)\nT2 = dh(theta2, 0, 0.27, 0)\n",
        "theta2 = q[1] - pi/2\nT1 = dh(q[0], 0.29, 0, -pi/2)\nT2 = dh(theta2, 0, 0.27, 0)\n",
        f"{MATRIX}for i in range(2):\n  theta = q[i] + DH[i][0]\n  T = T @ dh(theta, DH[i][1], DH[i][2], DH[i][3])\n",
        f"{MATRIX}for row in DH:\n  off, d, a, alpha = row\n  T = T @ dh(q + off, d, a, alpha)\n",
    ],
)
def test_what_a_program_adds_to_a_joints_variable_is_its_offset(tmp_path, text):
    content, _ = read(tmp_path, ROW + text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "theta2 = theta2 - pi/2\nT1 = dh(theta1, 0.29, 0, -pi/2)\nT2 = dh(theta2, 0, 0.27, 0)\n",
        "theta = q + np.array([0, -pi/2])\nT1 = dh(theta[0], 0.29, 0, -pi/2)\nT2 = dh(theta[1], 0, 0.27, 0)\n",
        "q[1] = q[1] - pi/2\nT1 = dh(q[0], 0.29, 0, -pi/2)\nT2 = dh(q[1], 0, 0.27, 0)\n",
    ],
)
def test_a_program_that_turns_its_joints_itself_is_asked_back(tmp_path, text):
    with pytest.raises(InputError, match="changes theta"):
        read(tmp_path, ROW + text)


def test_theta_of_kdl_is_a_constant_whatever_its_name(tmp_path):
    text = KDL.replace("-M_PI_2", "theta2")
    content, _ = read(tmp_path, "double theta2 = -pi/2;\n" + text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)
    with pytest.raises(InputError, match="theta2 = "):
        read(tmp_path, text)


def test_joints_of_kdl_slide_or_are_fixed_as_their_segments_say(tmp_path):
    text = (
        "KDL::Joint slide(KDL::Joint::TransZ);\nc.addSegment(Segment(Joint(Joint::None), Frame::DH(0, 0, 0.1, 0)));\n"
    )
    text += "c.addSegment(Segment(Joint(Joint::RotZ), Frame::DH(0.3, M_PI, 0, 0)));\n"
    content, _ = read(tmp_path, text + "c.addSegment(Segment(slide, Frame::DH(0, 0, 0.05, 0)));\n")
    assert [(row.type, row.a_mm, row.d_mm) for row in content.dh.rows] == [("revolute", 300, 0), ("prismatic", 0, 50)]
    assert content.base.xyz_mm[2] == pytest.approx(100)


def test_a_segment_of_kdl_has_the_next_joints_row_of_craig(tmp_path):
    segment = "c.addSegment(\n  Segment(Joint(Joint::{}), Frame::DH_Craig1989({})));\n"
    other = "c.addSegment(Segment(Joint(Joint::None), H));\n"
    joints = segment.format("RotZ", "0.1, M_PI_2, 0, 0") + segment.format("TransZ", "0, 0, 0.2, M_PI_2")
    content, _ = read(tmp_path, joints)
    rows = [(row.type, row.a_mm, round(row.alpha_deg), row.d_mm) for row in content.dh.rows]
    assert (content.dh.convention, rows) == ("modified", [("revolute", 0, 0, 0), ("prismatic", 100, 90, 0)])
    np.testing.assert_allclose([content.flange.xyz_mm, content.flange.rpy_deg], [(0, 0, 200), (0, 0, 90)], atol=1e-9)
    content, notes = read(tmp_path, segment.format("None", "0, 0, 0.3, 0") + joints + other)
    assert [row.d_mm for row in content.dh.rows] == [300, 0]
    assert any("last frame" in note for note in notes)
    with pytest.raises(InputError, match="no row of a table"):
        read(
            tmp_path,
            segment.format("RotZ", "0, 0, 0.3, 0") + other + joints,
        )


def test_records_leave_out_what_is_zero(tmp_path):
    rows = "{ alpha: 1.5708, d: 290 }, { a: 270 }, { d: 72, alpha: 0 }"
    content, _ = read(tmp_path, f"const arm = {{ colour: {{ a: 1 }}, dh: [{rows}] }};\n")
    found = [(row.a_mm, row.alpha_deg, row.d_mm) for row in content.dh.rows]
    np.testing.assert_allclose(found, [(0, 90, 290), (270, 0, 0), (0, 0, 72)], atol=1e-3)


def test_a_notebook_is_the_text_of_its_cells(tmp_path):
    matrix = "# theta, d, a, alpha\nT = [[q1, 290, 0, -pi/2],\n [q2 - pi/2, 0, 270, 0]]\n"
    cells = [{"cell_type": "code", "source": matrix.splitlines(keepends=True), "outputs": [[1, 2, 3, 4], [5, 6, 7, 8]]}]
    content, _ = read(tmp_path, json.dumps({"cells": cells}))
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


def test_a_call_that_takes_lists_is_no_row(tmp_path):
    lists = "a = np.array([0, 270.0])\nalpha = np.array(\n [-pi/2, 0])\nd = [290, 0]\noffset = [0, -pi/2]\n"
    content, _ = read(tmp_path, lists + "arm = Arm(a=a, alpha=alpha, d=d, offset=offset)\n")
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)
    columns = "".join(f"a({k},1) = {a};\nd({k},1) = {d};\nalpha({k},1) = {alpha};\n" for k, a, d, alpha in COLUMN)
    content, _ = read(tmp_path, columns + "theta(1,1) = q(1);\ntheta(2,1) = q(2)-pi/2;\n")
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-9)


COLUMN = (1, 0, 290, "-pi/2"), (2, 270, 0, "0")


LINK = "RevoluteDH(d=d[i], a=a[i], alpha=alpha[i])"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (f"{LINES}L = []\nfor i in range(1):\n    L.append({LINK})\n", "of a loop"),
        (f"{LINES}for i = 1:2:2\n  L(i) = Revolute('d', d(i), 'a', a(i), 'alpha', alpha(i));\nend\n", "of a loop"),
        (f"{LINES}for (int i = 0; i < 2; i += 2) {{\n  L.add({LINK});\n}}\n", "of a loop"),
        (f"{LINES}L = [{LINK} for i in reversed(range(2))]\n", "of a loop"),
        (f"{LINES}L = []\nfor i in range(2):\n    if i:\n        L.append({LINK})\n", "of a loop"),
        (f"{LINES}L = []\n{2 * f'for i in range(2):{chr(10)}    L.append({LINK}){chr(10)}'}", "of a loop"),
        (f"{LINES}offset = [0, -pi/2]\nL = [{LINK} for i in range(2)]\n", "'offset' may be offsets"),
        (
            f"{MATRIX}DH[1][2] = 0.5\nL = [RevoluteDH(d=r[1], a=r[2], alpha=r[3], offset=r[0]) for r in DH]\n",
            "changes 'DH'",
        ),
        (f"{MATRIX}L = [RevoluteDH(d=r[1], a=r[2], alpha=r[3]) for r in DH[:1]]\n", "of a loop"),
        (f"{IN_MATLAB}DH(:,4) = DH(:,4)*pi/180;\nfor i=1:2\nL(i) = Link([DH(i,:)]);\nend\n", "changes 'DH'"),
        (
            "N = 1;\nd=[0.29 0];\na=[0 0.27];\nal=[0 1];\nfor j=1:N\n L(j)=Link('d', d(j), 'a', a(j),"
            " 'alpha', al(j));\nend",
            "loop",
        ),
        ("% theta d a alpha\nDH=[0 0.29 0 -90;\n 0 0 0.27 0] .* [1 1 1 pi/180];\n", "row 2|line"),
        (f"# theta d a alpha\n{MATRIX}DH[1][2] = -0.5\n", "DH"),
        (f"# theta d a alpha\n{MATRIX}DH = np.vstack([DH, [0, 0, 0.1, 0]])\n", "changes 'DH'"),
        (f"# theta d a alpha\n{MATRIX}DH = DH.T\n", "changes 'DH'"),
        (f"% theta d a alpha sigma offset\n{IN_MATLAB}DH(:,4) = -DH(:,4);\n", "changes 'DH'"),
        ("d={0.29,0};\na={0,0.27};\nalfa={-pi/2,0};\n\nd{1}=0.29+0.061;\n", "line 5: .* changes 'd'"),
        ("a = [0, 0.27]\nalpha = np.flip([0, -pi/2])\nd = [0.29, 0]\n", "changes 'alpha'"),
        ("a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0.29, 0]\na.append(0.1)\n", "changes 'a'"),
        ("a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0, 0]\nd[0] = L1\n", "changes 'd'"),
        ("a = [0 270];\nalpha = [-pi/2 0];\nd = [290 0];\na = a/1000, d = d/1000\n", "changes 'a'"),
        (f"# theta d a alpha\n{MATRIX}DH[0][1] = L1\n", "changes 'DH'"),
        (f"# theta d a alpha\n{MATRIX}DH[0][0] = q[0]\nDH[1][0] = q[1]\n", "changes 'DH'"),
        (f"# theta d a alpha\n{MATRIX}DH[1][0] -= q[1]\n", "changes 'DH'"),
        (f"{ROWS_IN_A_STRUCT}arm.rows[0].theta = q[0];\n", "changes 'arm'"),
        ("a = [0, 0.27]\nalpha = [-pi/2, 0]\nd = [0.29, 0]\nq[1] = q_s[1] - pi/2\n", "line 4: .* changes theta"),
        ("L(1)=Link('d',0.29,'a',0,'alpha',0);\nL(2)=L(1);\nL(3)=Link('d',0,'a',1,'alpha',0);", "of a loop"),
        ("L = [RevoluteDH(d=0.29, alpha=pi/2)] * 2 + [RevoluteDH(a=0.3)]\n", "of a loop"),
        (
            "L1 = Link('d',1,'a',0,'alpha',0);\nL2 = Link('d',0,'a',2,'alpha',0);\nSerialLink([L1 L2]);\n"
            "E(1) = Revolute('d',3,'a',0,'alpha',0);\nE(2) = Revolute('d',0,'a',4,'alpha',0);\n",
            "2 D-H tables",
        ),
        ("c.addSegment(Segment(Joint(Joint::RotX), Frame::DH(0, 0, 0.29, 0)));\n", "RotX.*RotZ, TransZ or None"),
        (
            "c.addSegment(Segment(Joint(Joint::RotZ), Frame::DH(0, 0, 1, 0)));\nc.addSegment(Segment(fixed, H));",
            "fixed, H",
        ),
    ],
)
def test_a_loop_that_may_leave_rows_out_is_asked_back(tmp_path, text, names):
    with pytest.raises(InputError, match=names):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("dh:\n  - [0.0, 0.29, 0.0, -1.5708]\n  - [-1.5708, 0.0, 0.27, 0.0]\n", "theta d a alpha"),
        (
            "i,theta (rad),d (m),a (m),alpha (rad),t\n1,0,0.29,0,-1.5708,1\n2,-1.5708,0,0.27,0,0\n",
            "- theta d a alpha -",
        ),
    ],
)
def test_the_remedy_of_a_refusal_works(tmp_path, text, columns):
    with pytest.raises(InputError, match="--column"):
        read(tmp_path, text)
    content, _ = read(tmp_path, text, columns=columns.split(), length_unit="m", angle_unit="rad")
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-2)


@pytest.mark.parametrize(
    "text",
    [
        "var Arm = Params{\n\tThetaOffsets: []float64{0, -math.Pi / 2},\n\tAlphaValues: []float64{-math.Pi / 2, 0},\n"
        "\tAValues: []float64{0, 270},\n\tDValues: []float64{290, 0},\n}\n",
        "alphas = [-np.pi/2, 0]\na_vals = [0, 270]\nd_values = [290, 0]\ntheta_offsets = [0, -np.pi/2]\n",
        "ar_alpha_vals = [-np.pi/2, 0]\nar_a_vals = [0, 270]\nar_d_vals = [290, 0]\nar_theta_offsets = [0, -np.pi/2]\n",
        "double a1=0,alpha1=-std::numbers::pi/2,d1=290,offset1=0;\n"
        "double a2=270,alpha2=0,d2=0,offset2=-std::numbers::pi/2;\n",
        '"""Matrices (rx, tx, rz, tz) aka (alpha, a, theta, d)"""\n\n\n\n\n\n\ndef arm():\n    return np.array([\n'
        "        [-np.pi/2, 0, 0, 290],\n        [0, 270, -np.pi/2, 0]\n    ])\n",
        r"| i | $\alpha_i$ | $a_i$ | $d_i$ | $\phi_i$ |"
        "\n|--|--|--|--|--|\n"
        r"| 1 | $-\frac{\pi}{2}$ | 0 | 290 | $\theta_1$ |"
        "\n"
        r"| 2 | 0 | 270 | 0 | $\theta_2 - \frac{\pi}{2}$ |",
        "| i | a (mm) | alpha (deg) | d (mm) | offset (deg) | note |\n|--|--|--|--|--|--|\n"
        "| 1 | 0 | -90 | 290 | 0 | As given: theta=0, alpha=-90deg, d=L1, a=0. |\n"
        "| 2 | 270 | 0 | 0 | -90 | As given: theta=-90deg, alpha=0, d=0, a=L2. |\n",
        "% L(1) = Link('d', 290, 'a', 0, 'alpha', -pi/2);\n"
        "% L(2) = Link('d', 0, 'a', 270, 'alpha', 0, 'offset', -pi/2);\n",
        "part{1}.a = 0; part{1}.alpha = -pi/2; part{1}.d = 290;\npart{2}.a = 270; part{2}.alpha = 0; part{2}.d = 0;\n"
        "L = [Revolute('d', part{1}.d, 'a', part{1}.a, 'alpha', part{1}.alpha)\n"
        "Revolute('d', part{2}.d, 'a', part{2}.a, 'alpha', part{2}.alpha, 'offset', -pi/2)];\n",
        "i | a | alpha | d | theta\n--|--|--|--|--\n1 | 0|-pi/2|290|q1|\n2 | 270|0|0|q2 - pi/2|\n",
        "| i | a | alpha | d | theta |\n|--|--|--|--|--|\n| 1 | 0 | -pi/2 | d1 | q1 |\n"
        "| 2 | a2 | 0 | 0 | q2 - pi/2 |\n\n"
        "- d1 = 290: from the drawing\n- a2 = 270: from the drawing\n",
        "a = [0; 270];\nd = [290; 0];\nalpha = [-pi/2; 0];\ntheta = [q1; q2 - (90 + 90)*pi/360];\n",
        "% alpha, a, d, and theta\nDH = [-pi/2 0, 290 0;\n      0, 270 0, -pi/2];\n",
        "def row(d, a, alpha, theta):\n    return np.eye(4)\ndh = [(290, 0, -pi/2, q1), (0, 270, 0, q2 - pi/2)]\n"
        "for each in dh:\n    T = T @ row(*each)\n",
        "float a_[2] = {0, 270};\nfloat alpha_[2] = {-90, 0};\nfloat d_[2] = {290, 0};\nfloat th0_[2] = {0, -90};\n",
        "| i | α (°) | a (mm) | d (mm) | θ | θ 零位偏移 (°) |\n|--|--|--|--|--|--|\n"
        "| 1 | -90 | 0 | 290 | θ1 | 0 (朝前) |\n| 2 | 0 | 270 | 0 | θ2 | -90 (竖直) |\n",
        "alpha(1)=-pi/2; a(1)=0; d(1)=290; offset(1)=0;\nalpha(2)=0; a(2)=270; d(2)=0; offset(2)=-pi/2;\n"
        "q1=[-9, 9]/2;\n",
        "q1, q2, q3 = symbols('q1:4')\nDH = {'alpha1': -pi/2, 'a1': 0, 'd1': 290,\n"
        "      'alpha2': 0, 'a2': 270, 'd2': 0, q2: -pi/2 + q2}\n",
        "numLinks 2\nlink_0 (offset 0.0) (D 290) (A 0.0) (alpha -90.0) (mass 1) (cog 0 0 0)\n"
        "link_1 (offset -90.0) (D 0.0) (A 270) (alpha 0.0) (mass 2) (cog 0 0 0)\n",
        "# theta, d, a, alpha\nT1 = dh(q[0], 290, 0, -pi/2)\nT2 = dh(q[1] - pi/2, 0, 270, 0)\nplot(-1, 1, -1, 1)\n",
        "rows = np.array([\n  # alpha i - 1, a i - 1, d i, theta i\n  # [0.0, 0.0, 0.0, q1],\n"
        "  [-pi / 2, 0.0, 290, q1],\n  [0.0, 270, 0.0, q2 - pi/2]])\n",
        "% alpha, a, d\nM = [-pi/2 0 290;\n 0 270 0];\ntheta_offset = [0 -pi/2];\nq = [1 2];\n",
        "| i | alpha | a | d | offset |\n|--|--|--|--|--|\n| 1 | -pi/2 | 0 | 290 | 0 |\n| 2 | 0 | a2 | 0 | "
        "T2\\_offset |\n\n"
        "a2 = sqrt(162^2 + 216^2) = 270;\n\nT2\\_offset = -atan(1e9) = -1.5707963 (-90°);\n",
        "alpha(1:2) = [-pi/2, 0];\na(1:2) = [0, 270];\nd(1:2) = [290, 0];\noffset(1:2) = [0, -pi/2];\n",
        "const d2 = parseFloat(input.value);\nrows = [{theta: q1, d: 290, a: 0, alpha: -PI / 2},\n"
        "{theta: q2 - PI / 2, d: 0, a: 270, alpha: 0}]\n",
        "d = [290, 0];\na = [0, 270];\nalpha = [-pi/2, 0];\noffset = [0, -pi/2];\n"
        "L1 = Link('revolute', 'd', d(1), 'a', a(1), 'alpha', alpha(1), 'offset', offset(1));\n"
        "L2 = Link('revolute', 'd', d(2), 'a', a(2), 'alpha', alpha(2), 'offset', offset(2));\n",
        "D1 = 290;\nD2 = 270;\nd(1) = D1; a(1) = 0; alpha(1) = -pi/2; theta(1) = q(1);\n"
        "d(2) = 0; a(2) = D2; alpha(2) = 0; theta(2) = q(2) - pi/2;\n",
        "#define DH_A1 0\n#define DH_A2 270\n#define DH_ALPHA1 -PI / 2\n#define DH_ALPHA2 0\n#define DH_D1 290\n"
        "#define DH_D2 0\n#define DH_THETA1(Q) ((Q))\n#define DH_THETA2(Q) ((Q) - PI / 2)\n",
        "pub const DH_A: [f64; 2] = [0.0, 270.0];\npub const DH_D: [f64; 2] = [290.0, 0.0];\n"
        "pub const DH_ALPHA: [f64; 2] = [-std::f64::consts::FRAC_PI_2, 0.0];\n"
        "const DH_OFFSET: [f64; 2] = [0.0, -90.0];\n",
        "def f(x, y, z, w):\n  u, v = np.cos(x), np.sin(x)\n  return np.array([[u, -v*np.cos(w), v*np.sin(w), z*u],\n"
        "    [v, u*np.cos(w), -u*np.sin(w), z*v],\n    [0, np.sin(w), np.cos(w), y],\n    [0, 0, 0, 1]])\n"
        "T = f(q1, 290, 0, -pi/2) @ f(q2 - pi/2, 0, 270, 0)\n",
        "M = [[q1*pi/180, -90*pi/180, 0, 290], [(q2 - 90)*pi/180, 0, 270, 0]]\nfor i in range(2):\n"
        "  T = [[cos(M[i][0]), -sin(M[i][0])*cos(M[i][1]), sin(M[i][0])*sin(M[i][1]), M[i][2]*cos(M[i][0])],\n"
        "    [sin(M[i][0]), cos(M[i][0])*cos(M[i][1]), -cos(M[i][0])*sin(M[i][1]), M[i][2]*sin(M[i][0])],\n"
        "    [0, sin(M[i][1]), cos(M[i][1]), M[i][3]],\n    [0, 0, 0, 1]]\n",
        "dh(1).a = 0; dh(1).alpha = -pi/2; dh(1).d = 290; dh(1).offset = 0;\n"
        "dh(2).a = 270; dh(2).alpha = 0; dh(2).d = 0; dh(2).offset = -pi/2;\nfor i = 1:2\n"
        "  L(i) = Link('d', dh(i).d, 'a', dh(i).a, 'alpha', dh(i).alpha, 'offset', dh(i).offset);\nend\n",
        "a, d = [0, 270], [290, 0]\nalpha = [-pi/2, 0]\ntheta = [0, -pi/2]\n"
        "for i in range(2):\n  T = T @ f(theta[i] + q[i])\n",
        "% theta d a alpha\nL = [290, 270];\nDH = {[0, L(1), 0, -pi/2], [-pi/2, 0, L(2), 0]};\n",
        "dh = lambda t1, t2: [[theta1, d1, 0, -pi/2], [theta2 - pi/2, 0, a2, 0]]\nd1 = 290\na2 = 270\n",
        "def link(a, d, alpha, theta):\n  pass\nrows = [(0, 290, -pi/2), (270, 0, 0)]\ntheta_offset = [0, -pi/2]\n",
        "| i | α (rad) | a (mm) | d (mm) | θ (deg) |\n|--|--|--|--|--|\n| 1 | -π/2 | 0 | 290 | 0 |\n"
        "| 2 | 0 | 270 | 0 | β - 120 |\n\nβ = 30°\n",
        "# Units: lengths in cm\n# a alpha d theta\nM = [[0, -pi/2, 29, 0], [27, 0, 0, -pi/2]]\ntypes = ['R', 'R']\n",
        "DH: np.ndarray = np.array([\n  # a, alpha, d, theta\n  [0, -np.pi/2, 290, 0],\n  [270, 0, 0, -np.pi/2]])\n",
        "DH_A = [0, 270]\nDH_ALPHA = [-pi/2, 0]\nDH_D = [290, 0]\nDH_THETA = [0, -pi/2]\n",
        "M = [290 0 -pi/2; 0 270 0];\nd = M(:,1); a = M(:,2); alpha = M(:,3);\n"
        "L(1) = Link([0 d(1) a(1) alpha(1) 0 0]);\n"
        "L(2) = Link([0 d(2) a(2) alpha(2) 0 -pi/2]);\n",
        "+---+-------------+----------------------+------------+-------------------------+\n"
        "| j | :math:`a_i` | :math:`\\alpha_i`     | :math:`d`  | :math:`\\theta`         |\n"
        "+===+=============+======================+============+=========================+\n"
        "| 1 | 0           | :math:`-90^\\circ`    | 290        | :math:`q_1`             |\n"
        "| 2 | 270         | 0                    | 0          | :math:`q_2 - 90^\\circ` |\n",
        "float dh[2][4] = { // d, a, alpha, theta\n  {290.0, 0.0, -(float)M_PI/2, 0.0},\n"
        "  {0.0, 270.0, 0.0, (float)-M_PI/2}};\n",
    ],
)
def test_names_and_places_that_programs_give_a_table_are_read(tmp_path, text):
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content), IRB120[:2], atol=1e-6)


CRAIG = "joint,a,alpha,d,theta\n1,0,0,333,q1\n2,0,-90,0,q2\n3,82,90,316,q3\n4,-82,90,0,q4\n"


def test_of_two_conventions_that_is_read_in_which_no_joints_turn_about_one_line(tmp_path):
    content, notes = read(tmp_path, CRAIG)
    assert content.dh.convention == "modified"
    assert "joints 1 and 2" in notes[-1]
    path = tmp_path / "table.txt"
    assert read_dh_table(path, "arm", "standard")[0].dh.convention == "standard"  # said, so it is meant
    assert read(tmp_path, "Modified DH\n" + CRAIG)[0].dh.convention == "modified"
    # As modified rows joints 3 and 4 would turn about one line, too: nothing to choose between.
    assert read(tmp_path, CRAIG.replace("4,-82,90", "4,0,0"))[0].dh.convention == "standard"
    with pytest.raises(InputError, match="joints 1 and 2 turn about one line"):  # all axes are parallel
        read(tmp_path, "joint,a,alpha,d,theta\n1,0,0,333,q1\n2,250,0,0,q2\n3,210,0,0,q3\n")


@pytest.mark.parametrize("modified", [False, True])
def test_a_known_arm_settles_the_convention_that_its_table_does_not_say(tmp_path, modified):
    """An arm of the catalogue in either convention, with one length that its source has otherwise."""
    robot = er3a.load_robot("panda")
    table = er3a.to_modified(robot) if modified else robot
    columns = 1000 * table.a, np.degrees(table.alpha), 1000 * table.d + [5, 0, 0, 0, 0, 0, 0]
    rows = [",".join(map(str, (k, *row, f"q{k}"))) for k, row in enumerate(zip(*columns), 1)]
    content, _ = read(tmp_path, "joint,a,alpha,d,theta\n" + "\n".join(rows), name="arm.csv")
    assert content.dh.convention == ("modified" if modified else "standard")


@pytest.mark.parametrize(
    ("text", "quantity", "values"),
    [
        ("a = [0, 150, 825]\nalpha = [0, pi/2, 0]\nr = [550, 0, 0]\n# modified D-H\n", "d", [550, 0, 0]),  # Khalil's
        ("double a_m[N] = {0.2, -0.8};\ndouble d_m[N] = {0.1, 0};\ndouble alpha[N] = {0, M_PI/2};", "a", [200, -800]),
        (
            "% standard D-H\na1 = 75; alpha1 = pi/2; d1 = 0; a2 = 650; alpha2 = 0; d2 = 0; a3 = 250;\n"
            "T = A(a1, alpha1, d1, q(1)) * A(a2, alpha2, d2, q(2));",
            "a",
            [75, 650],
        ),
        (
            "l1 = 300 # in the drawing\n# standard D-H: theta d a alpha\nM = [[q1, 0, l1, 90], [q2, 0, l1, 0]]\n",
            "a",
            [300] * 2,
        ),
        (
            "% standard D-H\nDH = [0 -90 290 0; 270 0 0 -90];\na = DH(i,1);\nalpha = deg2rad(DH(i,2));\nd = DH(i,3);\n"
            "theta = deg2rad(DH(i,4));\n",
            "a",
            [0, 270],
        ),
    ],
)
def test_lists_and_matrices_are_read_as_their_program_takes_them(tmp_path, text, quantity, values):
    content, _ = read(tmp_path, text)
    assert [getattr(row, f"{quantity}_mm") for row in content.dh.rows] == pytest.approx(values)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (  # a program beside the table of another arm
            "L1=Link([0 0.29 0 -pi/2]);\nL2=Link([0 0 0.27 0]);\n\n|i|θ|d|a|α|\n|--|--|--|--|--|\n|1|θ1|0|0|-90|\n"
            "|2|θ2|149mm|-20mm|90|\n",
            "2 D-H tables, at lines 1 and 4",
        ),
        (  # of a planar arm and another one
            "|i|θ|d|a|α|\n|--|--|--|--|--|\n|1|θ1|0|300|0|\n|2|θ2|0|200|0|\n\n"
            "|i|θ|d|a|α|\n|--|--|--|--|--|\n|1|θ1|290|0|-90|\n|2|θ2|0|270|0|\n",
            "2 D-H tables",
        ),
        (
            "M = [0 0 0.3 0;\n 0.2 0 0 0;\n 0.1 0 0 0];\nsetFixedTransform(j1, M(1,:), 'dh');\n"
            "setFixedTransform(j2, M(2,:), 'dh');\n",
            "rows that the program does not use",
        ),
        (
            "a1 = 0; alpha1 = -pi/2; d1 = 1;\na2 = 1; alpha2 = 0; d2 = 0;\nT = f(a1, alpha1, d1, q1-pi/2);",
            "is no column",
        ),
        ("# alpha, a, d\nM = [[1, 0, 1], [0, 1, 0]]\ntheta_offset = [0, 1]\nq = q - theta_offset\n", "may be offsets"),
        ("a = [0, 0, 1]\nalpha = [0, 1.57, 0]\nd = [1, 0, 0]\nT = A(q[0]) @ A(q[1])\n", "d 3, values of joints 2"),
        (f"{LINES}theta = [0, -pi/2]\ntheta = theta + dtheta\n", "may be offsets of the joints' angles, or a pose"),
        (
            "SDH (its numbers are those of the MDH)\n\ni,a,alpha,d,theta\n1,0,0,290,q1\n2,270,90,0,q2\n",
            "says standard and",
        ),
        (
            "t = [0 1];\nd = [2 0];\na = [0 3];\nalpha = [1 0];\ndh = [t' d' a' alpha'];\nfor i = 1:2\n"
            "  L(i) = Link('d', dh(i,2), 'a', dh(i,3), 'alpha', dh(i,4), 'offset', dh(i,1));\nend\n",
            "row 7, column d",
        ),
        ("d1 = 290000\nd1 = d1 / 1000\n# a alpha d theta\nM = [[0, -pi/2, d1, 0], [270, 0, 0, 0]]\n", "two values"),
        (
            "| i | α (rad) | α (deg) | a | d | θ |\n|--|--|--|--|--|--|\n| 1 | 1 | 57 | 0 | 290 | 0 |\n",
            "both mean alpha",
        ),
    ],
)
def test_what_a_program_leaves_out_or_a_document_says_twice_is_asked_back(tmp_path, text, names):
    with pytest.raises(InputError, match=names):
        read(tmp_path, text)


def test_a_table_said_twice_alike_is_read(tmp_path):
    text = "L1=Link([0 0.29 0 -pi/2]);\nL2=Link([0 0 0.27 0]);\n\n|i|θ|d|a|α|\n|--|--|--|--|--|\n|1|θ1|290|0|-90|\n"
    content, _ = read(tmp_path, text + "|2|θ2|0|270|0|\n")
    assert [row.d_mm for row in content.dh.rows] == pytest.approx([290, 0])


@pytest.mark.parametrize("said", ["joint_types = ['R', 'P']", "Joint('a', 'revolute')\nJoint('b', 'prismatic')"])
def test_types_of_joints_may_be_a_list_of_their_own(tmp_path, said):
    content, _ = read(tmp_path, f"# a alpha d theta\nM = [[0, 0, 0.3, 0], [0.2, 0, 0, 0]]\n{said}\n")
    assert [row.type for row in content.dh.rows] == ["revolute", "prismatic"]


def test_a_row_whose_joint_slides_is_none_to_leave_out(tmp_path):
    content, _ = read(tmp_path, "def dh(d, theta, a, alpha):\n  pass\nT = dh(0.2, q[0], 0.3, 0) * dh(q[1], 0, 0, 0)\n")
    assert [(row.type, row.a_mm) for row in content.dh.rows] == [("revolute", 300), ("prismatic", 0)]


def test_a_list_may_be_one_number_as_often_as_there_are_joints(tmp_path):
    content, _ = read(tmp_path, "d = [0.29, 0, 0.1]\na = [0.2] * 3\nalpha = [-pi/2, pi/2, 0]\n")
    assert [row.a_mm for row in content.dh.rows] == [200, 200, 200]


def test_whole_numbers_say_nothing_of_inches(tmp_path):
    content, _ = read(
        tmp_path, "% standard D-H: theta d a alpha\nM = [0 130 0 0;\n 0 0 sqrt(144^2 + 58^2) 0;\n 0 0 144 0];\n"
    )
    assert content.dh.rows[0].d_mm == pytest.approx(130)


def test_a_joint_of_a_toolbox_that_slides_has_no_d_of_its_own(tmp_path):
    content, _ = read(tmp_path, "L(1) = Link([0, 0, 0.3, 0, 0]);\nL(2) = Link([0, 0.7, 0, pi/2, 1]);\n")
    assert [(row.type, row.d_mm) for row in content.dh.rows] == [("revolute", 0), ("prismatic", 0)]


def test_lists_d_and_r_as_khalil_names_them_are_asked_back(tmp_path):
    with pytest.raises(InputError, match="either can be the link's length"):
        read(tmp_path, "alpha = [0 -pi/2 0];\nd = [0 0 265];\nr = [159 0 0];\n")


def test_base_and_tool_below_a_printed_table_are_named(tmp_path):
    rows = [(0.0, -90.0, 290.0, 0.0), (270.0, 0.0, 0.0, -90.0)]
    printed = box(rows, list(NAMES), "")
    _, notes = read(tmp_path, printed + "\n│base │ t = 0, 0, 0; rpy/xyz = 0°, 90°, 0° │")
    assert [note for note in notes if "base" in note] != []
    assert [note for note in read(tmp_path, printed)[1] if "base" in note] == []


def test_a_list_of_turns_about_y_is_no_list_to_leave_out(tmp_path):
    lists = "a = [0, 270]\nalpha = [-90, 0]\nd = [290, 0]\nbeta = [0, 0.5]\n"
    assert [row.beta_deg for row in read(tmp_path, lists)[0].dh.rows] == [0, 0.5]


@pytest.mark.parametrize("changed", ["", "0.02 | q2", "0 | q2+90"])
def test_an_arm_in_both_conventions_is_one(tmp_path, changed):
    own = "| 1 | q1 | 0.3 | 0 | -π/2 |\n| 2 | q2 | 0 | 0.27 | 0 |\n| 3 | q3 | 0.1 | 0 | 0 |\n"
    standard = f"| i | θ | d | a | α |\n|-|-|-|-|-|\n{own}"
    rows = "| 1 | 0 | 0 | 0.3 | q1 |\n| 2 | -π/2 | 0 | 0 | q2 |\n| 3 | 0 | 0.27 | 0 | q3 |\n"
    modified = f"| i | α(i-1) | a(i-1) | d | θ |\n|-|-|-|-|-|\n{rows}"
    if changed:
        modified = modified.replace("0 | q2", changed)
    for text in (f"Standard\n\n{standard}\n\nModified\n\n{modified}", f"{modified}\n\nand\n\n{standard}"):
        if changed:
            with pytest.raises(InputError, match="2 D-H tables"):
                read(tmp_path, text)
        else:
            table = read(tmp_path, text)[0].dh
            assert [row.a_mm for row in table.rows] == pytest.approx([0, 270, 0])
            assert table.convention == "standard"


def test_a_matrix_may_have_a_row_for_each_quantity(tmp_path):
    text = "DH << 0.29, 0, 0.1, // d\n -M_PI_2, 0, 0, // alpha\n 0, 0.27, 0, // a\n q1, q2 - M_PI_2, q3; // joints\n"
    content, _ = read(tmp_path, text)
    np.testing.assert_allclose(numbers(content)[:2], IRB120[:2], atol=1e-6)


def test_theta_of_a_slide_that_a_pose_may_hold_is_asked_back(tmp_path):
    links = "L = [RevoluteDH(d=0.3, alpha=pi/2), PrismaticDH(theta=theta[1], a=0.1, alpha=0)]"
    with pytest.raises(InputError, match="slides has no value"):
        read(tmp_path, f"theta = [0, pi/2]\n{links}\n")
