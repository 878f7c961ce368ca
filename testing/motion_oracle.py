"""What happens along random paths, computed without er3a: dense points, and roots refined on the same formulas.

Paths come as plain numbers in degrees, millimetres and seconds, arms as their tables. Laws of time, rounded corners and
rotations are implemented a second time; joints of paths of the tool follow from plane trigonometry, for arms with a
vertical first axis, parallel axes 2 and 3 in the plane of axis 1, and a spherical wrist. Speeds, accelerations
and jerks are differences of their angles; an acceleration that steps shows as a jerk beyond any limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

POINTS = 500_001
GRAZING = 1e-5  # relative, of limits of rates
GRAZING_RAD = 1e-7  # of joint limits
GRAZING_JERK = 1e-3  # relative, of limits of jerk
SPAN_S = 2e-4  # of one difference of accelerations; jerks are means over three of them
TOUCH = 1e-7  # rad or m, between two crossings next to one another
WIDER = 20  # points; an acceleration of a path of the tool that exceeds its limit for fewer has to do so on their mean
NOISE = (0, 8, 32, 128)  # roundings of an angle in a difference of each order


# ---------------------------------------------------------------- paths in joint space


def quintic_law(u):
    """Path parameter of a quintic law from rest to rest, at normalised times (n,)."""
    return u**3 * (10 - 15 * u + 6 * u**2)


def trapezoid_law(u, ramp):
    """Path parameter of a trapezoidal law with equal ramps, at normalised times (n,)."""
    top = 1 / (1 - ramp)
    up, down = top * u**2 / (2 * ramp), 1 - top * (1 - u) ** 2 / (2 * ramp)
    return np.where(u < ramp, up, np.where(u > 1 - ramp, down, top * (u - ramp / 2)))


def halting_law(corners, halts, duration, ramp):
    """Share of the way at times, at rest at the corners that are halts, the time shared by the way."""
    stops = corners[halts]

    def law(t):
        times = stops * duration
        i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(stops) - 2)
        u = np.clip((t - times[i]) / (times[i + 1] - times[i]), 0, 1)
        done = quintic_law(u) if ramp is None else trapezoid_law(u, ramp)
        return stops[i] + (stops[i + 1] - stops[i]) * done

    return law


def timed_law(corners, halts, times):
    """Law through corners at given times: monotone cubics, at rest where they halt."""
    slopes = PchipInterpolator(times, corners).derivative()(times)
    slopes[halts] = 0.0

    def law(t):
        i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        h = times[i + 1] - times[i]
        u = (t - times[i]) / h
        rest = (1 + 2 * u) * (1 - u) ** 2 * corners[i] + u**2 * (3 - 2 * u) * corners[i + 1]
        return rest + h * u * (1 - u) * ((1 - u) * slopes[i] - u * slopes[i + 1])

    return law


def hermite(ends, starts, length):
    """The quintic (as powers of 0..length) with value, slope and second derivative (3, k) at either end."""
    rows = np.zeros((6, 6))
    for order in range(3):
        for power in range(order, 6):
            falling = np.prod([power - i for i in range(order)]) if order else 1.0
            rows[order, power] = falling * (0.0 if power > order else 1.0)
            rows[3 + order, power] = falling * length ** (power - order)
    return np.linalg.solve(rows, np.concatenate([ends, starts]))


def rounded(corners, sides, blends):
    """A curve over its way: value at ways (n,), straight sides with rounded corners.

    corners : values (m + 1, k), or per side the values at its beginning and end; sides : (m,) lengths of way
    """
    starts = np.concatenate([[0.0], np.cumsum(sides)])
    begin, end = corners
    rates = (end - begin) / sides[:, None]
    pieces = np.zeros((len(blends), 6, begin.shape[1]))
    for k in np.flatnonzero(blends > 0):
        before = np.stack([end[k] - blends[k] * rates[k], rates[k], 0 * rates[k]])
        after = np.stack([begin[k + 1] + blends[k] * rates[k + 1], rates[k + 1], 0 * rates[k]])
        before[0] -= end[k] - begin[k + 1]  # another frame behind the corner
        pieces[k] = hermite(before, after, 2 * blends[k])

    def value(way):
        side = np.clip(np.searchsorted(starts, way, side="right") - 1, 0, len(sides) - 1)
        found = np.empty((len(way), begin.shape[1]))
        _rounded(way, side, (starts, begin, rates), (np.asarray(blends, float), pieces), found)
        return found, side

    return value


@numba.njit(cache=True, error_model="numpy")
def _rounded(way, side, straight, corners, found):
    """Values (n, k) at ways (n,) on sides (n,), which become those behind a corner where that is rounded."""
    (starts, begin, rates), (blends, pieces) = straight, corners
    for n in range(len(way)):
        i, corner = side[n], -1
        if i < len(blends) and way[n] > starts[i + 1] - blends[i]:
            corner = i
        elif i > 0 and way[n] < starts[i] + blends[i - 1]:
            corner = i - 1
        x = way[n] - (starts[i] if corner < 0 else starts[corner + 1] - blends[corner])
        for j in range(found.shape[1]):
            if corner < 0:
                found[n, j] = begin[i, j] + x * rates[i, j]
                continue
            total = 0.0
            for power in range(5, -1, -1):
                total = total * x + pieces[corner, power, j]
            found[n, j] = total
        if corner >= 0:
            side[n] = corner + 1


@numba.njit(cache=True, error_model="numpy")
def _polynomials(t, c, found):
    """Values (n, k) at times (n,) of polynomials with coefficients (6, k), the lowest power first."""
    for n in range(len(t)):
        for j in range(c.shape[1]):
            total = 0.0
            for power in range(5, -1, -1):
                total = total * t[n] + c[power, j]
            found[n, j] = total
    return found


def joint_path(spec) -> tuple[Callable, np.ndarray]:
    """Angles (n, 6) in rad at times (n,), and the times at which pieces meet."""
    if spec["kind"] == "joint":
        T = spec["duration_s"]
        ends = [np.radians([spec["start_deg"], spec["start_velocity_deg_s"], spec["start_acceleration_deg_s2"]])]
        ends.append(np.radians([spec["end_deg"], spec["end_velocity_deg_s"], spec["end_acceleration_deg_s2"]]))
        c = hermite(*ends, T)
        return (lambda t: _polynomials(t, c, np.empty((len(t), 6)))), np.array([0.0, T])
    points = np.radians(spec["points_deg"])
    sides = np.abs(np.diff(points, axis=0)).max(axis=1)
    most = np.minimum(sides[:-1], sides[1:]) / 2
    blends = np.full(len(sides) - 1, np.radians(spec["blend_deg"])) if spec["kind"] != "table" else None
    blends = np.minimum(most, np.radians(spec["blend_deg"])) if blends is None else blends
    corners = np.concatenate([[0.0], np.cumsum(sides)])
    halts = np.concatenate([[True], blends == 0, [True]])
    if spec["kind"] == "table":
        law, T = timed_law(corners, halts, np.array(spec["times_s"])), spec["times_s"][-1]
    else:
        T = spec["duration_s"]
        share = halting_law(corners / corners[-1], halts, T, spec.get("ramp_share"))

        def law(t):
            return share(t) * corners[-1]

    curve = rounded((points[:-1], points[1:]), sides, blends)
    return (lambda t: curve(law(t))[0]), np.array([0.0, T])


# ---------------------------------------------------------------- arms


@dataclass(frozen=True)
class Arm:
    """Lengths and offsets that plane trigonometry needs, read off the chain with all joints at 0."""

    links: np.ndarray
    direction: np.ndarray
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    wrist_in_tool: np.ndarray
    base: np.ndarray  # (3,), where axis 1 stands
    plane: np.ndarray  # (4,): r and z of joint 2, lengths of upper arm and forearm
    zero: np.ndarray  # (3,): azimuth, and angles of upper arm and forearm, at q = 0
    sense: np.ndarray  # (3,), by which q1..q3 turn them


def about_z(angle):
    T = np.zeros((*np.shape(angle), 4, 4))
    T[..., 0, 0] = T[..., 1, 1] = np.cos(angle)
    T[..., 1, 0], T[..., 0, 1] = np.sin(angle), -np.sin(angle)
    T[..., 2, 2] = T[..., 3, 3] = 1.0
    return T


def _fixed(axis, angle, along):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()
    T[:3, 3] = along
    return T


def arm_of(table) -> Arm:
    """From a table: dict of convention, a, alpha, d, offset, direction, lower, upper, base, tool (SI)."""
    links = [np.array(table["base"])]
    for a, alpha, d in zip(table["a"], table["alpha"], table["d"]):
        across = _fixed(0, alpha, [a, 0, 0])
        rise = _fixed(2, 0.0, [0, 0, d])
        if table["convention"] == "standard":
            links.append(rise @ across)
        else:
            links[-1] = links[-1] @ across
            links.append(rise)
    links[-1] = links[-1] @ np.array(table["tool"])
    links = np.array(links)
    direction, offset = np.array(table["direction"], float), np.array(table["offset"], float)

    def frames(q):
        T, found = links[0], []
        for k in range(6):
            found.append(T)
            T = T @ about_z(direction[k] * q[k] + offset[k]) @ links[k + 1]
        return [*found, T]

    def planar(q):
        F = frames(q)
        centre = _meeting(F[3:6])
        top = F[0][:3, 3]
        azimuth = np.arctan2(*(centre - top)[1::-1])
        out = np.array([np.cos(azimuth), np.sin(azimuth), 0])
        joints = [((p - top) @ out, (p - top)[2]) for p in (F[1][:3, 3], F[2][:3, 3], centre)]
        (x2, z2), (x3, z3), (xw, zw) = joints
        return azimuth, np.arctan2(z3 - z2, x3 - x2), np.arctan2(zw - z3, xw - x3), (x2, z2), F, centre

    spread = np.array([0.0, 0.3, -0.2, 0, 0, 0])  # away from a wrist centre above axis 1
    base_pose = planar(spread)
    step, sense, zero = 1e-4, [], []
    for k in range(3):
        moved = planar(spread + step * np.eye(6)[k])
        turned = moved[k] - base_pose[k]
        sense.append(np.sign(np.angle(np.exp(1j * turned))))
    F, centre = base_pose[4], base_pose[5]
    zero.append(base_pose[0])
    zero += [base_pose[1] - sense[1] * spread[1]]
    zero += [base_pose[2] - sense[1] * spread[1] - sense[2] * spread[2]]
    upper = np.linalg.norm(F[2][:3, 3] - F[1][:3, 3])
    fore = np.linalg.norm(centre - F[2][:3, 3])
    return Arm(
        links, direction, offset, np.array(table["lower"]), np.array(table["upper"]),
        (np.linalg.inv(F[6]) @ np.append(centre, 1.0))[:3], F[0][:3, 3],
        np.array([*base_pose[3], upper, fore]), np.array(zero), np.array(sense),
    )  # fmt: skip


def _meeting(frames):
    """The point nearest to the z axes of frames, by least squares."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for T in frames:
        across = np.eye(3) - np.outer(T[:3, 2], T[:3, 2])
        A += across
        b += across @ T[:3, 3]
    return np.linalg.solve(A, b)


def factors(arm: Arm, q):
    """Signed distances (n, 3) from the wrist (sine), elbow (sine) and shoulder (m) sets."""
    wrist = np.array([arm.direction[4], arm.offset[4]], float)
    found = np.empty((len(q), 3))
    _factors(np.ascontiguousarray(q), arm.plane, arm.zero, arm.sense, wrist, found)
    return found


@numba.njit(cache=True, error_model="numpy")
def _factors(q, plane, zero, sense, wrist, found):
    for n in range(len(q)):
        upper = zero[1] + sense[1] * q[n, 1]
        fore = zero[2] + sense[1] * q[n, 1] + sense[2] * q[n, 2]
        found[n, 0] = np.sin(wrist[0] * q[n, 4] + wrist[1])
        found[n, 1] = np.sin(fore - upper)
        found[n, 2] = plane[0] + plane[2] * np.cos(upper) + plane[3] * np.cos(fore)


# ---------------------------------------------------------------- paths of the tool


def tool_path(spec) -> tuple[Callable, float]:
    """Poses (n, 4, 4) of the tool at times (n,), and the duration."""
    poses = [_pose(p) for p in spec["poses"]]
    T = spec["duration_s"]
    turns = [Rotation.from_matrix(b[:3, :3] @ a[:3, :3].T).as_rotvec() for a, b in pairwise(poses)]
    if spec["kind"] == "arc":
        start, via, end = poses[0][:3, 3], np.array(spec["via_mm"]) / 1000, poses[1][:3, 3]
        centre, normal, angle = _circle(start, via, end)

        def arc(t):
            s = quintic_law(t / T) if spec.get("ramp_share") is None else trapezoid_law(t / T, spec["ramp_share"])
            spin = Rotation.from_rotvec(np.outer(s * angle, normal))
            return _stack(centre + spin.apply(start - centre), Rotation.from_rotvec(s[:, None] * turns[0]), poses[:1])

        return arc, T
    steps = zip(poses, poses[1:], turns)
    sides = np.array([max(np.linalg.norm(b[:3, 3] - a[:3, 3]), 0.1 * np.linalg.norm(w)) for a, b, w in steps])
    turns = np.array(turns)
    blends = np.array(spec.get("blends_mm", [])) / 1000
    points = np.array([pose[:3, 3] for pose in poses])
    begin = np.concatenate([points[:-1], 0 * turns], axis=1)
    end = np.concatenate([points[1:], turns], axis=1)
    corners = np.concatenate([[0.0], np.cumsum(sides)])
    halts = np.concatenate([[True], blends == 0, [True]])
    share = halting_law(corners / corners[-1], halts, T, spec.get("ramp_share"))
    # The position goes on behind a corner; only the rotation vector starts anew from the corner's orientation.
    curve = rounded((begin, end), sides, blends)

    def sequence(t):
        x, frame = curve(share(t) * corners[-1])
        return _stack(x[:, :3], Rotation.from_rotvec(x[:, 3:]), [poses[k] for k in range(len(sides))], frame)

    return sequence, T


def _pose(values):
    """4x4 of x, y, z in mm and roll, pitch, yaw in deg."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("ZYX", values[:2:-1], degrees=True).as_matrix()
    T[:3, 3] = np.array(values[:3]) / 1000
    return T


def _circle(a, b, c):
    u, v = b - a, c - a
    w = np.cross(u, v)
    centre = a + (np.cross(w, u) * (v @ v) + np.cross(v, w) * (u @ u)) / (2 * w @ w)
    normal = w / np.linalg.norm(w)
    x = (a - centre) / np.linalg.norm(a - centre)
    angle = np.arctan2((c - centre) @ np.cross(normal, x), (c - centre) @ x) % (2 * np.pi)
    return centre, normal, angle


def _stack(points, spin, starts, frame=None):
    T = np.zeros((len(points), 4, 4))
    first = np.array([pose[:3, :3] for pose in starts])
    _turned(spin.as_matrix(), first, np.zeros(len(points), int) if frame is None else frame, T)
    T[:, :3, 3], T[:, 3, 3] = points, 1.0
    return T


@numba.njit(cache=True, error_model="numpy")
def _turned(spin, first, frame, T):
    """Rotations of frames (n,) by spins (n, 3, 3)."""
    for n in range(len(T)):
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    T[n, i, j] += spin[n, i, k] * first[frame[n], k, j]


def joints_of(arm: Arm, T, q_start):
    """Angles (n, 6) along poses (n, 4, 4) on the branch of the start, made continuous; NaN where out of reach."""
    at_start = factors(arm, q_start[None])[0]
    L4, L5 = arm.links[4][:3, :3], arm.links[5][:3, :3]
    # The wrist turns by Rz L4 Rz L5 Rz: the last entry is p cos + s sin + c of the middle angle.
    p, s = L4[2, 0] * L5[0, 2] + L4[2, 1] * L5[1, 2], L4[2, 1] * L5[0, 2] - L4[2, 0] * L5[1, 2]
    middle = np.arctan2(s, p)
    side = np.sign(np.sin(arm.direction[4] * q_start[4] + arm.offset[4] - middle))
    signs = np.array([np.sign(at_start[2]), np.sign(at_start[1]), side, middle])
    turns = np.array([link[:3, :3] for link in arm.links])
    fixed = (arm.base, arm.plane, arm.zero, arm.sense, arm.direction, arm.offset, arm.wrist_in_tool)
    q = np.empty((len(T), 6))
    _solved(np.ascontiguousarray(T), turns, fixed, signs, np.asarray(q_start, float), q)
    return q


@numba.njit(cache=True, error_model="numpy")
def _product(A, B, out):
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@numba.njit(cache=True, error_model="numpy")
def _solved(T, turns, fixed, signs, q_start, q):
    """Pose by pose: the arm in its plane, then what is left for the wrist; angles made continuous."""
    base, plane, zero, sense, direction, offset, wrist = fixed
    front, bent, side, middle = signs
    Z, R, A, M = np.zeros((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    last = q_start.copy()
    Z[2, 2] = 1.0
    for n in range(len(T)):
        x, y, z = base * -1.0
        for k in range(4):
            part = 1.0 if k == 3 else wrist[k]
            x, y, z = x + T[n, 0, k] * part, y + T[n, 1, k] * part, z + T[n, 2, k] * part
        ahead, up = front * np.hypot(x, y) - plane[0], z - plane[1]
        far = np.hypot(ahead, up)
        inner = np.arccos((far**2 + plane[2] ** 2 - plane[3] ** 2) / (2 * far * plane[2]))
        if np.isnan(inner):
            q[n] = np.nan
            continue
        lean = np.arctan2(up, ahead) - bent * inner
        pitch = np.arctan2(up - plane[2] * np.sin(lean), ahead - plane[2] * np.cos(lean))
        q[n, 0] = sense[0] * (np.arctan2(y, x) + (np.pi if front < 0 else 0.0) - zero[0])
        q[n, 1] = sense[1] * (lean - zero[1])
        q[n, 2] = sense[2] * (pitch - zero[2] - (lean - zero[1]))
        R[:] = turns[0]
        for k in range(3):
            angle = direction[k] * q[n, k] + offset[k]
            Z[0, 0] = Z[1, 1] = np.cos(angle)
            Z[1, 0] = np.sin(angle)
            Z[0, 1] = -Z[1, 0]
            _product(R, Z, A)
            _product(A, turns[k + 1], R)
        _product(R.T, T[n, :3, :3], A)
        _product(A, turns[6].T, M)
        theta5 = middle + side * np.arctan2(np.hypot(M[0, 2], M[1, 2]), min(1.0, max(-1.0, M[2, 2])))
        Z[0, 0] = Z[1, 1] = np.cos(theta5)
        Z[1, 0] = np.sin(theta5)
        Z[0, 1] = -Z[1, 0]
        _product(turns[4], Z, A)
        _product(A, turns[5], R)
        angles = (
            np.arctan2(M[1, 2], M[0, 2]) - np.arctan2(R[1, 2], R[0, 2]),
            theta5,
            np.arctan2(-M[2, 1], M[2, 0]) - np.arctan2(-R[2, 1], R[2, 0]),
        )
        for k in range(3):
            q[n, 3 + k] = direction[3 + k] * (angles[k] - offset[3 + k])
        for j in range(6):
            q[n, j] -= 2 * np.pi * np.round((q[n, j] - last[j]) / (2 * np.pi))
            last[j] = q[n, j]


# ---------------------------------------------------------------- comparison


@dataclass(frozen=True)
class Truth:
    """What dense points show: times, crossings (type number, time), and stretches (order, joint, start, end).

    ``jerk`` (N, 6) are means over ``jerk_span`` seconds from each time on, where a limit of jerk is given. ``blur``: by
    order (0 to 3), how far beyond a limit a rate must be to differ from the rounding of differences.
    """

    t: np.ndarray
    crossings: list[tuple[int, float]]
    stretches: list[tuple[int, int, float, float]]
    out_of_reach: bool
    jerk: np.ndarray | None = None
    jerk_span: float = 0.0
    blur: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


def truth(spec, arm: Arm, limits, q_start=None, points=POINTS) -> Truth:
    """Sample a path densely; limits: (speed, acceleration) or (speed, acceleration, jerk), each (6,), rad and s."""
    if q_start is None:
        joints, ends = joint_path(spec)
        duration = ends[-1]
    else:
        path, duration = tool_path(spec)

        def joints(t):
            return joints_of(arm, path(t), q_start)

    t = np.linspace(0, duration, points)
    q = joints(t)
    missing = np.isnan(q).any(axis=1)
    h = t[1] - t[0]
    eps = np.finfo(float).eps * np.pi * 4
    stride = max(1, round(SPAN_S / h))  # of jerks
    blur = (0.0, *(NOISE[order] * eps / (h * (stride if order == 3 else 1)) ** order for order in (1, 2, 3)))
    found: list[tuple[int, int, float, float]] = []
    for j in range(6):
        outside = (q[:, j] > arm.upper[j] + GRAZING_RAD) | (q[:, j] < arm.lower[j] - GRAZING_RAD)
        found += [(0, j, t[a], t[b]) for a, b in _runs(outside)]
        angles = np.ascontiguousarray(q[:, j])
        for order, most in enumerate((each[j] for each in limits), 1):
            step = h * (stride if order == 3 else 1)
            bound = most * (1 + (GRAZING_JERK if order == 3 else GRAZING)) + blur[order]
            above = np.zeros(points, np.bool_)
            _faster(angles, order, stride, bound * step**order, above)
            if order == 2 and q_start is not None:
                _without_flicker(angles, most * (1 + GRAZING) * (WIDER * h) ** 2, above)
            found += [(order, j, t[a], t[b] + (3 * step if order == 3 else 0.0)) for a, b in _runs(above)]
    jerk, span = None, 0.0
    if len(limits) == 3:
        span = 3 * stride * h
        thirds = q[3 * stride :] - 3 * q[2 * stride : -stride] + 3 * q[stride : -2 * stride] - q[: -3 * stride]
        jerk = thirds / (stride * h) ** 3
    crossings = []
    if q_start is None:
        f = factors(arm, q)
        for kind in range(3):
            low = np.flatnonzero(f[:-1, kind] * f[1:, kind] < 0)
            roots = _polished(lambda x, kind=kind: factors(arm, joints(x))[:, kind], t[low], t[low + 1])
            crossings += [(kind, root) for root in roots]
    return Truth(t, crossings, found, bool(missing.any()), jerk, span, blur)


@numba.njit(cache=True, error_model="numpy")
def _faster(q, order, stride, most, above):
    """Where differences of angles (n,) exceed ``most``: first or second about a point, third behind it."""
    n = len(q)
    if order == 1:
        above[0] = abs(2 * q[1] - 1.5 * q[0] - 0.5 * q[2]) > most
        above[n - 1] = abs(2 * q[n - 2] - 1.5 * q[n - 1] - 0.5 * q[n - 3]) > most
        for i in range(1, n - 1):
            above[i] = abs(q[i + 1] - q[i - 1]) > 2 * most
    elif order == 2:
        for i in range(1, n - 1):
            above[i] = abs(q[i + 1] - 2 * q[i] + q[i - 1]) > most
    else:
        for i in range(n - 3 * stride):
            above[i] = abs(q[i + 3 * stride] - 3 * (q[i + 2 * stride] - q[i + stride]) - q[i]) > most


def _without_flicker(q, most, above):
    """Leave out stretches (n,) of a few points at which second differences, taken wider, stay below ``most``.

    Beside a straight elbow or an aligned wrist rounding of the angles is greater than their own.
    """
    for first, last in _runs(above):
        middle = (first + last) // 2
        if last - first < WIDER <= middle < len(q) - WIDER:
            above[first : last + 1] = abs(q[middle + WIDER] - 2 * q[middle] + q[middle - WIDER]) > most


def _polished(f, low, high):
    """The roots (k,) between times, by halving."""
    if not low.size:
        return low
    rising = f(high) > 0
    for _ in range(60):
        middle = (low + high) / 2
        behind = (f(middle) > 0) == rising
        low, high = np.where(behind, low, middle), np.where(behind, middle, high)
    return (low + high) / 2


def _runs(flags):
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int))).reshape(-1, 2)
    return [(a, b - 1) for a, b in edges]
