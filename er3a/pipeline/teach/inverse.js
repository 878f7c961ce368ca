/**
 * All joint solutions of a pose, for arms with a spherical wrist and parallel axes 2 and 3, in closed form.
 *
 * With w the axis directions and W the wrist centre [1]:
 * 1. turning about axes 2 and 3 leaves the component of W along w2 alone, which gives two roots for joint 1 (shoulder);
 * 2. upper arm, forearm and the distance of W from axis 2 form a triangle: two roots for joint 3 (elbow), then joint 2;
 * 3. axes 4, 5 and 6 form a spherical triangle: two roots for joint 5 (wrist), then joints 4 and 6.
 * Angles of the triangles come from half-angle tangents, which keep all digits where a cosine loses half of them [2].
 * The slot of a branch is `4 * shoulder + 2 * elbow + wrist`. The same in Python: er3a/kinematics/closed_form.py.
 *
 * References
 * [1] D. L. Pieper, "The kinematics of manipulators under computer control", PhD thesis, Stanford, 1968.
 * [2] W. Kahan, "Miscalculating area and angles of a needle-like triangle", 2014.
 */

import {
  across, add, beside, column, cross, dot, multiply, norm, wrapToPi, rotated, scaled, signedAngle, subtract, turned,
  turnedBack, unsignedAngle,
} from "er3a/algebra";

const BOUNDARY = 1e-9; // m or rad by which a triangle may fail to close
const FREE = 1e-13; // m or rad: so near to its axis, a joint can have any angle
const AT_FOLD = 1e-15; // m or rad: so near, the two roots that meet are one
const APART = 0.9e-9; // rad by which such roots are kept two
const SAME_JOINTS = 1e-9; // rad
const LIMIT_TOLERANCE = 1e-9; // rad
const TURN = 2 * Math.PI;
const JOINTS = [0, 1, 2, 3, 4, 5];

/** What the solution takes of an arm: its axis lines with all table angles at 0, in the base frame. */
export function closedForm(table, links) {
  const axes = [];
  const points = [];
  let T = links[0];
  for (const k of JOINTS) {
    axes.push(column(T, 2));
    points.push(column(T, 3));
    T = multiply(T, links[k + 1]);
  }
  const wrist = meetingPoint(axes.slice(3), points.slice(3));
  const upperArm = across(subtract(points[2], points[1]), axes[1]);
  const forearm = across(subtract(wrist, points[2]), axes[1]);
  const beside6 = beside(axes[5]);
  const angle45 = unsignedAngle(axes[3], axes[4]);
  const angle56 = unsignedAngle(axes[4], axes[5]);
  const least = Math.abs(norm(upperArm) - norm(forearm));
  return {
    axes, points, upperArm, forearm, beside6, angle45, angle56, least,
    wristInTool: turnedBack(T, subtract(wrist, column(T, 3))),
    axis6InTool: turnedBack(T, axes[5]),
    beside6InTool: turnedBack(T, beside6),
    reach: norm(upperArm) + norm(forearm),
    cos12: dot(axes[0], axes[1]),
    sin12: norm(cross(axes[0], axes[1])),
    shoulderOffset: dot(axes[1], subtract(wrist, points[0])),
    elbowSign: Math.sign(dot(axes[1], axes[2])),
    elbowAngle: signedAngle(upperArm, forearm, axes[1]),
    wristAngle: signedAngle(axes[3], axes[5], axes[4]),
    foldedApart: least > BOUNDARY ? APART * Math.min(1, least / norm(forearm)) : 0,
    leastTiltApart: Math.abs(angle45 - angle56) > BOUNDARY ? APART : 0,
    mostTiltApart: Math.abs(angle45 + angle56 - Math.PI) > BOUNDARY ? APART : 0,
  };
}

/** The point nearest to all lines, by least squares. */
function meetingPoint(axes, points) {
  const rows = [0, 1, 2].map((i) => {
    const e = [0, 1, 2].map((j) => (i === j ? 1 : 0));
    return axes.reduce((sum, axis) => add(sum, across(e, axis)), [0, 0, 0]);
  });
  const right = axes.reduce((sum, axis, k) => add(sum, across(points[k], axis)), [0, 0, 0]);
  const determinant = dot(rows[0], cross(rows[1], rows[2]));
  const sum = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])]
    .map((vector, i) => scaled(vector, right[i]))
    .reduce(add);
  return scaled(sum, 1 / determinant);
}

/** An angle in 0..pi, put beside that end whose distance from the fold is nothing but rounding. */
function offFolds(angle, toLow, toHigh, apartLow, apartHigh) {
  if (toLow < AT_FOLD && apartLow > 0) return apartLow;
  if (toHigh < AT_FOLD && apartHigh > 0) return Math.PI - apartHigh;
  return angle;
}

/**
 * The eight branches of a pose: per slot either `q` (rad, in (-pi, pi]) or a `fault` ("too_far", "too_near", "off_axis",
 * "orientation") with the `gap` (m; rad for orientation) by which it fails. Where a joint is free it is taken from
 * `near` (rad), for the branch that meets there half a turn further, and `free` names it: "shoulder", "elbow", "wrist".
 */
function solveSlots(table, arm, T, near) {
  const slots = Array.from({ length: 8 }, () => ({ q: null, fault: null, gap: 0, free: [] }));
  const [w1, w2] = arm.axes;
  const nearTheta = (k) => table.direction[k] * near[k] + table.offset[k];
  const v = subtract(add(column(T, 3), turned(T, arm.wristInTool)), arm.points[0]);
  const axis6 = turned(T, arm.axis6InTool);
  const beside6 = turned(T, arm.beside6InTool);

  const along = dot(w1, v);
  const A = dot(w2, v) - along * arm.cos12;
  const B = -dot(w2, cross(w1, v));
  const C = arm.shoulderOffset - along * arm.cos12;
  const H = Math.hypot(A, B);
  const missing = Math.abs(C) - H;
  if (missing > BOUNDARY * arm.sin12) {
    return slots.map((slot) => ({ ...slot, fault: "off_axis", gap: missing / arm.sin12 }));
  }
  const phi = Math.atan2(B, A);
  const delta = offFolds(Math.atan2(Math.sqrt(Math.max((H - C) * (H + C), 0)), C), H - C, H + C, APART, APART);
  for (const shoulder of [0, 1]) {
    const free1 = H < FREE;
    const theta1 = free1 ? nearTheta(0) + shoulder * Math.PI : phi + (shoulder === 0 ? delta : -delta);
    const back1 = (vector) => rotated(vector, w1, Math.cos(theta1), -Math.sin(theta1));
    const x = across(subtract(add(back1(v), arm.points[0]), arm.points[1]), w2);
    const D = norm(x);
    const far = D - arm.reach;
    const close = arm.least - D;
    if (Math.max(far, close) > BOUNDARY) {
      const fault = far > 0 ? "too_far" : "too_near";
      for (let slot = 4 * shoulder; slot < 4 * shoulder + 4; slot++) {
        Object.assign(slots[slot], { fault, gap: Math.max(far, close) });
      }
      continue;
    }
    const bend = offFolds(
      2 * Math.atan2(Math.sqrt(Math.max(-far, 0) * (arm.reach + D)), Math.sqrt(Math.max(-close, 0) * (D + arm.least))),
      -far, -close, APART, arm.foldedApart,
    );
    for (const elbow of [0, 1]) {
      const free2 = D < FREE;
      const turn = (elbow === 0 ? bend : -bend) - arm.elbowAngle;
      const y = add(arm.upperArm, rotated(arm.forearm, w2, Math.cos(turn), Math.sin(turn)));
      const theta2 = free2 ? nearTheta(1) + elbow * Math.PI : signedAngle(y, x, w2);
      // Axes 2 and 3 are parallel, so one rotation undoes both joints.
      const back = (vector) => rotated(back1(vector), w2, Math.cos(theta2 + turn), -Math.sin(theta2 + turn));
      const wrists = solveWrist(arm, back(axis6), back(beside6), nearTheta(3));
      for (const wrist of [0, 1]) {
        const slot = slots[4 * shoulder + 2 * elbow + wrist];
        if (wrists.beyond > BOUNDARY) {
          Object.assign(slot, { fault: "orientation", gap: wrists.beyond });
          continue;
        }
        const theta = [theta1, theta2, arm.elbowSign * turn, ...wrists.theta[wrist]];
        slot.q = JOINTS.map((k) => wrapToPi(table.direction[k] * (theta[k] - table.offset[k])));
        slot.free = ["shoulder", "elbow", "wrist"].filter((_, i) => [free1, free2, wrists.free][i]);
      }
    }
  }
  return slots;
}

/** Both roots of the last three angles, from where axis 6 and the vector beside it must turn to. */
function solveWrist(arm, axis6, beside6, freeTheta4) {
  const [, , , w4, w5, w6] = arm.axes;
  const [b, c] = [arm.angle45, arm.angle56];
  const gamma = unsignedAngle(w4, axis6);
  const beyond = Math.max(gamma - (b + c), Math.abs(b - c) - gamma, gamma + b + c - TURN);
  if (beyond > BOUNDARY) return { beyond };
  const upper = Math.sin((gamma + b - c) / 2) * Math.sin((gamma - b + c) / 2);
  const lower = Math.sin((b + c + gamma) / 2) * Math.sin((b + c - gamma) / 2);
  const bend = offFolds(
    2 * Math.atan2(Math.sqrt(Math.max(upper, 0)), Math.sqrt(Math.max(lower, 0))),
    gamma - Math.abs(b - c), Math.min(b + c, TURN - b - c) - gamma, arm.leastTiltApart, arm.mostTiltApart,
  );
  const free = gamma < FREE || Math.PI - gamma < FREE;
  const theta = [0, 1].map((wrist) => {
    const theta5 = (wrist === 0 ? bend : -bend) - arm.wristAngle;
    const [c5, s5] = [Math.cos(theta5), Math.sin(theta5)];
    const theta4 = free ? freeTheta4 + wrist * Math.PI : signedAngle(rotated(w6, w5, c5, s5), axis6, w4);
    const rest = rotated(rotated(beside6, w4, Math.cos(theta4), -Math.sin(theta4)), w5, c5, -s5);
    return [theta4, theta5, signedAngle(arm.beside6, rest, w6)];
  });
  return { beyond, theta, free };
}

/**
 * All solutions of a pose: `rows` of `{slot, q, withinLimits}`, each branch once per turn that the limits allow
 * (nearest to `near` first), or once if it leaves them; `unsolved` slots with their fault; joints that are `free`.
 */
export function inverse(table, arm, T, near) {
  const slots = solveSlots(table, arm, T, near).map((slot, number) => ({ slot: number, ...slot }));
  const kept = [];
  for (const found of slots.filter((slot) => slot.q)) {
    const same = (other) => JOINTS.every((k) => Math.abs(wrapToPi(found.q[k] - other.q[k])) < SAME_JOINTS);
    if (!kept.some(same)) kept.push(found);
  }
  return {
    rows: kept.flatMap(({ slot, q }) =>
      turnsOf(table, q, near).map((row) => ({ slot, q: row, withinLimits: excesses(table, row).length === 0 })),
    ),
    unsolved: slots.filter((slot) => slot.fault),
    free: [...new Set(kept.flatMap((slot) => slot.free))],
  };
}

/**
 * What of a joint vector leaves its limits: `{joint, angle, excess, above, limit}`, rad (m of joints that slide), or
 * `{sum, ...}` for the number of a limited sum of joints. A continuous joint has no limits.
 */
export function excesses(table, q) {
  const beyond = (about, angle, lower, upper) => {
    if (angle - upper > LIMIT_TOLERANCE) return [{ ...about, angle, excess: angle - upper, above: true, limit: upper }];
    if (lower - angle > LIMIT_TOLERANCE) return [{ ...about, angle, excess: lower - angle, above: false, limit: lower }];
    return [];
  };
  return [
    ...q.flatMap((angle, joint) => (table.continuous[joint] ? [] : beyond({ joint }, angle, table.lower[joint], table.upper[joint]))),
    ...table.combined.flatMap(({ factors, lower, upper }, sum) =>
      beyond({ sum }, factors.reduce((total, factor, k) => total + factor * q[k], 0), lower, upper)),
  ];
}

function turnsOf(table, q, near) {
  const bounds = (angle, k) => [
    Math.ceil((table.lower[k] - LIMIT_TOLERANCE - angle) / TURN),
    Math.floor((table.upper[k] + LIMIT_TOLERANCE - angle) / TURN),
  ];
  const limits = q.map(bounds);
  if (limits.some(([low, high]) => low > high)) return [nearestTurns(table, q, near, bounds)];
  let rows = [[]];
  limits.forEach(([low, high], k) => {
    const turns = Array.from({ length: high - low + 1 }, (_, i) => q[k] + TURN * (low + i));
    rows = rows.flatMap((row) => turns.map((angle) => [...row, angle]));
  });
  const farthest = (row) => Math.max(...JOINTS.map((k) => Math.abs(row[k] - near[k])));
  return rows.sort((a, b) => farthest(a) - farthest(b));
}

/** Per joint the turn nearest to `near` within the limits, else the one nearest to the limits. */
function nearestTurns(table, q, near, bounds) {
  return q.map((angle, k) => {
    const start = angle + TURN * Math.round((near[k] - angle) / TURN);
    const [low, high] = bounds(start, k);
    if (low <= high) return start + TURN * Math.min(Math.max(0, low), high);
    const [below, above] = [start + TURN * (low - 1), start + TURN * low];
    return table.lower[k] - below < above - table.upper[k] ? below : above;
  });
}
