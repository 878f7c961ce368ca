/** Joint angles for a pose that a person asks for: in closed form where the arm has one, else by iteration. */

import { column, cross, dot, scaled, subtract } from "er3a/algebra";
import { excesses, inverse } from "er3a/inverse";
import { frames, jacobian, JOINTS } from "er3a/kinematics";

const STEPS = 300;
const CLOSE = 1e-9; // m and rad
const DAMPING = [1e-1, 1e-2, 1e-3]; // of least squares, while the error is great

const farthest = (a, b) => Math.max(...JOINTS.map((k) => Math.abs(a[k] - b[k])));

/**
 * Joints (rad) at which the tool is at `T`, the nearest to `q` that the limits allow, as `{q}`. Where there are none:
 * `{row}` with joints that reach it but leave the limits, `{branch}` with the fault of the branch that fails least, or
 * `{}` if iteration from `q` found none, which proves nothing.
 */
export function jointsFor(table, links, arm, T, q) {
  if (!arm) return iterated(table, links, T, q);
  const { rows, unsolved } = inverse(table, arm, T, q);
  const nearest = (found) => found.reduce((best, row) => (!best || farthest(row.q, q) < farthest(best.q, q) ? row : best), null);
  const within = nearest(rows.filter((row) => row.withinLimits));
  if (within) return { q: within.q };
  const beyond = (row) => excesses(table, row.q).reduce((sum, { excess }) => sum + excess, 0);
  if (rows.length) return { row: rows.reduce((best, row) => (beyond(row) < beyond(best) ? row : best)) };
  return { branch: unsolved.reduce((best, branch) => (branch.gap < best.gap ? branch : best)) };
}

/** Damped least squares within the limits: S. R. Buss, "Introduction to inverse kinematics", 2004, section 6. */
function iterated(table, links, T, start) {
  let q = [...start];
  for (let step = 0; step < STEPS; step++) {
    const now = frames(table, links, q);
    const error = errorOf(T, now[6]);
    const size = Math.hypot(...error);
    if (size < CLOSE) return { q };
    const J = jacobian(table, now);
    const damping = size < 1e-3 ? 1e-6 : DAMPING[Math.min(DAMPING.length - 1, Math.floor(step / 20))];
    const square = JOINTS.map((r) => JOINTS.map((c) => JOINTS.reduce((sum, k) => sum + J[k][r] * J[k][c], r === c ? damping ** 2 : 0)));
    const y = solved(square, error);
    const move = JOINTS.map((k) => J[k].reduce((sum, value, r) => sum + value * y[r], 0));
    q = q.map((angle, k) => Math.min(table.upper[k], Math.max(table.lower[k], angle + Math.max(-0.3, Math.min(0.3, move[k])))));
  }
  return {};
}

/** Position (m) and turn (rad, base frame) from one pose to another. */
function errorOf(to, from) {
  const columns = [0, 1, 2].map((c) => [column(from, c), column(to, c)]);
  const axis = scaled(columns.map(([a, b]) => cross(a, b)).reduce((sum, v) => sum.map((value, i) => value + v[i])), 0.5);
  const sine = Math.sqrt(dot(axis, axis));
  const cosine = (columns.reduce((sum, [a, b]) => sum + dot(a, b), 0) - 1) / 2;
  const turn = sine < 1e-12 ? axis : scaled(axis, Math.atan2(sine, cosine) / sine);
  return [...subtract(column(to, 3), column(from, 3)), ...turn];
}

/** The solution of a linear system, by elimination with pivots. */
function solved(matrix, right) {
  const rows = matrix.map((row, i) => [...row, right[i]]);
  for (let k = 0; k < rows.length; k++) {
    const pivot = rows.reduce((best, row, i) => (i >= k && Math.abs(row[k]) > Math.abs(rows[best][k]) ? i : best), k);
    [rows[k], rows[pivot]] = [rows[pivot], rows[k]];
    for (let i = k + 1; i < rows.length; i++) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= rows.length; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  const x = [];
  for (let k = rows.length - 1; k >= 0; k--) {
    x[k] = (rows[k].at(-1) - rows[k].slice(k + 1, -1).reduce((sum, value, j) => sum + value * x[k + 1 + j], 0)) / rows[k][k];
  }
  return x;
}
