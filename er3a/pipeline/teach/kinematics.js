/**
 * Forward kinematics, Jacobian and nearness to singularities of a six-axis arm, from its Denavit-Hartenberg table.
 *
 * The table is the JSON form of er3a's Robot: `convention` ("standard" or "modified"), `a`, `d` (m), `alpha`, `beta`,
 * `offset`, `lower`, `upper` (rad), `direction` (+1 or -1), `base` and `tool` (4x4). Joint angles `q` are the manufacturer's
 * (rad); the table's own angle is `direction * q + offset`. Both conventions are the product
 * `links[0] Rz(theta_1) links[1] ... Rz(theta_6) links[6]` with constant links, the base in the first and the tool in
 * the last. The same formulas in Python: er3a/kinematics/chain.py, forward.py and singularity.py.
 *
 * References
 * [1] J. J. Craig, Introduction to Robotics, 3rd ed., section 3.4.
 * [2] B. Siciliano et al., Robotics: Modelling, Planning and Control, sections 3.1 (equation 3.30) and 3.3.
 * [3] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
 */

import {
  add, column, cross, dot, multiply, norm, rotX, rotY, rotZ, scaled, singularValues, subtract, translation, turned, unit,
} from "er3a/algebra";

export const JOINTS = [0, 1, 2, 3, 4, 5];
const IDENTITY = translation(0, 0, 0);

/**
 * Each link's constant transform in two steps: along its joint's axis, then across to the next axis. Entry 0 is what
 * precedes joint 1 (base not included), entry k what follows the rotation of joint k.
 */
export function linkParts(table) {
  const parts = Array.from({ length: table.a.length + 1 }, () => ({ along: IDENTITY, across: IDENTITY }));
  for (const k of table.a.keys()) {
    const turn = multiply(rotX(table.alpha[k]), rotY(table.beta[k]));
    parts[k + 1].along = translation(0, 0, table.d[k]);
    parts[table.convention === "standard" ? k + 1 : k].across = multiply(translation(table.a[k], 0, 0), turn);
  }
  return parts;
}

/** The constant transforms between the joint rotations, base and tool included. */
export function constantLinks(table) {
  const links = linkParts(table).map((part) => multiply(part.along, part.across));
  links[0] = multiply(table.base, links[0]);
  links[6] = multiply(links[6], table.tool);
  return links;
}

/** Entry k < 6: the frame with its z axis on the axis of joint k + 1, which turns with it. Entry 6: the tool frame. */
export function frames(table, links, q) {
  const found = [];
  let T = links[0];
  for (const k of JOINTS) {
    T = multiply(T, rotZ(table.direction[k] * q[k] + table.offset[k]));
    found.push(T);
    T = multiply(T, links[k + 1]);
  }
  return [...found, T];
}

/** Columns of the geometric Jacobian at the tool point, base frame: linear part (m/rad), then angular (rad/rad) [2]. */
export function jacobian(table, T) {
  const tool = column(T[6], 3);
  return JOINTS.map((k) => {
    const axis = scaled(column(T[k], 2), table.direction[k]);
    return [...cross(axis, subtract(tool, column(T[k], 3))), ...axis];
  });
}

/** Measures of the Jacobian with its linear rows divided by a characteristic length (m) [3]. */
export function conditioning(table, T, length) {
  const columns = jacobian(table, T).map((entries) => entries.map((value, row) => (row < 3 ? value / length : value)));
  const values = singularValues(columns);
  const singular = values[5] <= 6 * Number.EPSILON * values[0];
  return {
    manipulability: values.reduce((product, value) => product * value, 1),
    smallestSingularValue: values[5],
    conditionNumber: singular ? Infinity : values[0] / values[5],
  };
}

/**
 * Signed distances from the three singular sets of a wrist-partitioned arm [2]: `wrist` (rad, axes 4 and 6 in line),
 * `elbow` (rad, arm stretched or folded), `shoulder` (m, wrist centre in the plane of axes 1 and 2).
 */
export function determinantFactors(T, wristInTool) {
  const axis = (k) => column(T[k - 1], 2);
  const point = (k) => column(T[k - 1], 3);
  const wrist = add(column(T[6], 3), turned(T[6], wristInTool));
  const sideways = unit(cross(axis(1), axis(2)));
  return {
    wrist: angleShortOfLine(axis(4), axis(6), axis(5)),
    elbow: angleShortOfLine(subtract(point(3), point(2)), subtract(wrist, point(3)), axis(2)),
    shoulder: dot(sideways, subtract(wrist, point(1))),
  };
}

function angleShortOfLine(a, b, axis) {
  return Math.atan2(dot(axis, cross(a, b)), Math.abs(dot(a, b) - dot(a, axis) * dot(b, axis)));
}

/** The table's own frames, 0 (base) to 6: those in which its rows are written; `T` are the joints' frames of `frames`. */
export function tableFrames(table, T) {
  const parts = linkParts(table);
  const rows = JOINTS.map((k) => {
    const moved = multiply(T[k], parts[k + 1].along);
    return table.convention === "standard" ? multiply(moved, parts[k + 1].across) : moved;
  });
  return [table.base, ...rows];
}

/** A length (m) to scale drawings with: the sum of all link lengths and the tool's. */
export function sizeOf(table) {
  return [...table.a, ...table.d].reduce((sum, value) => sum + Math.abs(value), 0) + norm(column(table.tool, 3));
}
