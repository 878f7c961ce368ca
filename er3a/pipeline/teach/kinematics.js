/**
 * Forward kinematics, Jacobian and nearness to singularities of an arm of any joints, from its Denavit-Hartenberg table.
 *
 * The table is the JSON form of er3a's Robot: `convention` ("standard" or "modified"), per row `a`, `d` (m), `alpha`,
 * `beta`, `offset` (rad), `direction` (+1 or -1) and `sliding`, per joint `lower`, `upper` (rad, m) and `slides`, the
 * `coupling` (rows by joints; null where each joint moves its own row), `base`, and `tool` from the last frame of the table
 * (4x4 each; what stands between that frame and the flange is part of it). Joint values `q` are the
 * manufacturer's (rad; m of joints that slide). Row k moves by `x = direction * u`, `u = coupling q`: it turns by
 * `x + offset` about z, or shifts by x along z. Both conventions are the product
 * `links[0] J(x_1) links[1] ... J(x_m) links[m]` with constant links, the base in the first and the tool in the last.
 * The same formulas in Python: er3a/kinematics/chain.py, forward.py and singularity.py.
 *
 * References
 * [1] J. J. Craig, Introduction to Robotics, 3rd ed., section 3.4.
 * [2] B. Siciliano et al., Robotics: Modelling, Planning and Control, sections 3.1 (equation 3.30) and 3.3.
 * [3] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
 */

import {
  IDENTITY, add, column, cross, dot, multiply, rotX, rotY, rotZ, scaled, singularValues, subtract, translation, turned, unit,
} from "er3a/algebra";

export const POSE = [0, 1, 2, 3, 4, 5]; // rows of a Jacobian: along and about x, y, z

/**
 * Each link's constant transform in two steps: along its joint's axis, then across to the next axis. Entry 0 is what
 * precedes joint 1 (base not included), entry k what follows the motion of row k.
 */
export function linkParts(table) {
  const parts = Array.from({ length: table.a.length + 1 }, () => ({ along: IDENTITY, across: IDENTITY }));
  for (const k of table.a.keys()) {
    const turn = multiply(rotX(table.alpha[k]), rotY(table.beta[k]));
    const along = translation(0, 0, table.d[k]);
    parts[k + 1].along = table.sliding[k] ? multiply(along, rotZ(table.offset[k])) : along;
    parts[table.convention === "standard" ? k + 1 : k].across = multiply(translation(table.a[k], 0, 0), turn);
  }
  return parts;
}

/** The constant transforms between the joints' motions, base and tool included. */
export function constantLinks(table) {
  const links = linkParts(table).map((part) => multiply(part.along, part.across));
  links[0] = multiply(table.base, links[0]);
  links.push(multiply(links.pop(), table.tool));
  return links;
}

/** What each row moves by (rad or m) in its own direction, for joint values `q`. */
export const rowValues = (table, q) =>
  table.direction.map((sign, k) => sign * (table.coupling ? table.coupling[k].reduce((sum, share, j) => sum + share * q[j], 0) : q[k]));

/** Entry k < m: the frame with its z axis on the axis of row k + 1, which moves with it. The last entry: the tool frame. */
export function frames(table, links, q) {
  const found = [];
  let T = links[0];
  rowValues(table, q).forEach((x, k) => {
    T = multiply(T, table.sliding[k] ? translation(0, 0, x) : rotZ(x + table.offset[k]));
    found.push(T);
    T = multiply(T, links[k + 1]);
  });
  return [...found, T];
}

/** Columns of the geometric Jacobian at the tool point, base frame: linear part, then angular, per rad or m of a joint [2]. */
export function jacobian(table, T) {
  const tool = column(T.at(-1), 3);
  const rows = table.direction.map((sign, k) => {
    const axis = scaled(column(T[k], 2), sign);
    return table.sliding[k] ? [...axis, 0, 0, 0] : [...cross(axis, subtract(tool, column(T[k], 3))), ...axis];
  });
  if (!table.coupling) return rows;
  return table.lower.map((_, j) => POSE.map((r) => rows.reduce((sum, row, k) => sum + row[r] * table.coupling[k][j], 0)));
}

/** Measures of the Jacobian with its linear rows divided by a characteristic length (m), columns of slides times it [3]. */
export function conditioning(table, T, length) {
  const columns = scaledJacobian(table, T, length);
  const rows = columns.length > 6 ? POSE.map((r) => columns.map((entries) => entries[r])) : columns;
  const values = singularValues(rows).slice(0, table.rank);
  const singular = values.at(-1) <= 6 * Number.EPSILON * values[0];
  return {
    manipulability: values.reduce((product, value) => product * value, 1),
    smallestSingularValue: values.at(-1),
    conditionNumber: singular ? Infinity : values[0] / values.at(-1),
  };
}

/** The Jacobian's columns in parts of a length (m): linear rows are divided by it, columns of joints that slide times it. */
export const scaledJacobian = (table, T, length) =>
  jacobian(table, T).map((entries, j) => entries.map((value, r) => value * (table.slides[j] ? length : 1) / (r < 3 ? length : 1)));

/**
 * Signed distances from the three singular sets [2], given an arm's `singular_sets`: `wrist` (rad, axes 4 and 6
 * parallel), `elbow` (rad, arm stretched or folded), `shoulder` (m, wrist centre in the plane of axes 1 and 2).
 */
export function determinantFactors(T, { wrist_in_tool: wristInTool, to_axis_4: toAxis4 }) {
  const axis = (k) => column(T[k - 1], 2);
  const point = (k) => column(T[k - 1], 3);
  const wrist = add(column(T[6], 3), turned(T[6], wristInTool));
  const sideways = unit(cross(axis(1), axis(2)));
  return {
    wrist: angleShortOfLine(axis(4), axis(6), axis(5)),
    elbow: angleShortOfLine(subtract(point(3), point(2)), subtract(toAxis4 ? point(4) : wrist, point(3)), axis(2)),
    shoulder: dot(sideways, subtract(wrist, point(1))),
  };
}

const angleShortOfLine = (a, b, axis) => Math.atan2(dot(axis, cross(a, b)), Math.abs(dot(a, b) - dot(a, axis) * dot(b, axis)));

/** The table's own frames, 0 (base) to m: those in which its rows are written; `T` are the joints' frames of `frames`. */
export function tableFrames(table, T) {
  const parts = linkParts(table).slice(1);
  const rows = parts.map(({ along, across }, k) => {
    const moved = multiply(T[k], along);
    return table.convention === "standard" ? multiply(moved, across) : moved;
  });
  return [table.base, ...rows];
}
