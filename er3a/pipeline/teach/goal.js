/** Joint values for a pose that a person asks for: in closed form where the arm has one here, else by iteration. */

import { column, cross, dot, norm, scaled, subtract, turnedBack } from "er3a/algebra";
import { excesses, inverse } from "er3a/inverse";
import { frames, POSE, scaledJacobian } from "er3a/kinematics";

const MAX_ITERATIONS = 60;
const CLOSE = 1e-10; // m in parts of the arm's length, and rad
const MET = 1e-6; // m
const PLACE_FIRST = 1e3; // weight of the position where the arm can't follow a whole pose
const DAMPING = 0.1; // of the squared error
const MIN_DAMPING = 1e-13; // of the normal matrix, which is singular where the arm is
const LONGEST_STEP = 0.5; // rad
const [STALLED, PATIENCE] = [0.9, 6]; // the squared error must fall by this factor within so many iterations
const TYPED_STARTS = 60;
const SAME_ARM = 1e-5; // rad
const SOME = 6; // solutions that are listed where there are infinitely many

const farthest = (a, b) => Math.max(...a.map((value, k) => Math.abs(value - b[k])));
const inner = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

/** What the iteration takes: the table, its links, a length (m), and in how many ways the joints can move the tool. */
export const goalOf = ({ table, characteristic_length: length }, links) => ({ table, links, length, rank: table.rank });

/** The `i`-th of evenly spread joint vectors within the limits (multiples of square roots of primes). */
function spread(table, i) {
  const primes = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29];
  return table.lower.map((low, k) => low + (table.upper[k] - low) * ((i * Math.sqrt(primes[k])) % 1));
}

/**
 * Joints (rad, m) at which the tool is at `T`, the nearest to `q` that the limits allow, as `{q, left}`. Arms whose
 * joints can't follow a whole pose take its position, and turn the tool as near to it as they can; `left` is what is
 * missing, `{length, angle}` (m, rad). Where there are none: `{row}` with joints that reach it but leave the limits,
 * `{branch}` with the fault of the branch that fails least, or `{miss}`, how far the iteration stayed away, which proves
 * nothing. `starts` more than one looks beyond where iteration from `q` leads.
 */
export function jointsFor(goal, arm, T, q, starts = TYPED_STARTS) {
  if (!arm) return byIteration(goal, T, q, starts);
  const { table } = goal;
  const { rows, unsolved } = inverse(table, arm, T, q);
  const nearest = (found) => found.reduce((best, row) => (!best || farthest(row.q, q) < farthest(best.q, q) ? row : best), null);
  const within = nearest(rows.filter((row) => row.withinLimits));
  if (within) return { q: within.q, left: { length: 0, angle: 0 } };
  const beyond = (row) => excesses(table, row.q).reduce((sum, { excess }) => sum + excess, 0);
  if (rows.length) return { row: rows.reduce((best, row) => (beyond(row) < beyond(best) ? row : best)) };
  return { branch: unsolved.reduce((best, branch) => (branch.gap < best.gap ? branch : best)) };
}

function byIteration(goal, T, q, starts) {
  let [best, outside] = [null, null];
  for (let i = 0; i < starts && !best?.solved; i++) {
    const found = descend(goal, T, i === 0 ? q : spread(goal.table, i));
    if (excesses(goal.table, found.q).length) outside ??= found.solved ? found : null;
    else if (!best || found.size < best.size) best = found;
  }
  if (!best?.solved && outside) return { row: { q: outside.q } };
  const left = missOf(goal, T, (best ?? outside).q);
  return best.solved || (goal.rank < 6 && left.length < MET) ? { q: best.q, left } : { miss: left };
}

/** Solutions within the limits from evenly spread starts, one start at each step; yields all that are known. */
export function* solutionsByIteration(goal, T, q, starts) {
  const { table, rank } = goal;
  const found = [[...q]];
  const endless = table.lower.length > rank;
  for (let i = 1; i <= starts && !(endless && found.length >= SOME); i++) {
    const { q: other, solved } = descend(goal, T, spread(table, i));
    const apart = (row) => farthest(row, other) > (endless ? 0.2 : SAME_ARM);
    if (solved && excesses(table, other).length === 0 && found.every(apart)) found.push(other);
    yield found;
  }
  return found;
}

/**
 * Levenberg and Marquardt's iteration within the limits, as er3a/kinematics/numerical.py has it: `{q, size, solved}`,
 * the size of the error that is left, in which the position may weigh more.
 */
function descend(goal, T, start) {
  const { table, links, length, rank } = goal;
  const weights = POSE.map((r) => (rank < 6 && r < 3 ? PLACE_FIRST : 1));
  const clamped = (value, k) => (table.continuous[k] ? value : Math.min(table.upper[k], Math.max(table.lower[k], value)));
  let q = start.map(clamped);
  let [mark, since, best] = [Infinity, 0, { size: Infinity }];
  for (let round = 0; round < MAX_ITERATIONS; round++) {
    const now = frames(table, links, q);
    const error = errorOf(T, now.at(-1)).map((value, r) => (weights[r] * value) / (r < 3 ? length : 1));
    const square = inner(error, error);
    const size = Math.sqrt(square);
    if (size < best.size) best = { q, size, solved: size < CLOSE };
    if (best.solved) break;
    if (square < STALLED * mark) [mark, since] = [square, 0];
    else if (++since > PATIENCE) break;
    const J = scaledJacobian(table, now, length).map((entries) =>
      [...entries.slice(0, 3), ...turnedBack(now.at(-1), entries.slice(3))].map((value, r) => weights[r] * value));
    const gradient = J.map((entries) => inner(entries, error));
    const held = q.map((value, k) => !table.continuous[k] && ((value <= table.lower[k] && gradient[k] < 0) || (value >= table.upper[k] && gradient[k] > 0)));
    const trace = J.reduce((sum, entries) => sum + inner(entries, entries), 0);
    const damping = DAMPING * Math.min(square, 1) + MIN_DAMPING * trace;
    const matrix = J.map((a, i) => J.map((b, j) => (i === j ? inner(a, a) + damping + (held[i] ? 1 : 0) : held[i] || held[j] ? 0 : inner(a, b))));
    const move = solved(matrix, gradient.map((value, k) => (held[k] ? 0 : value)));
    const most = Math.max(LONGEST_STEP, ...move.map(Math.abs)) / LONGEST_STEP;
    q = q.map((value, k) => clamped(value + (move[k] / most) * (table.slides[k] ? length : 1), k));
  }
  return best;
}

/** How far the tool is from `T`: `{length, angle}`, m and rad. */
function missOf({ table, links }, T, q) {
  const error = errorOf(T, frames(table, links, q).at(-1));
  return { length: norm(error.slice(0, 3)), angle: norm(error.slice(3)) };
}

/** Position (m, base frame) and turn (rad, about the axes of `from`) from one pose to another. */
function errorOf(to, from) {
  const columns = [0, 1, 2].map((c) => [column(from, c), column(to, c)]);
  const axis = scaled(columns.map(([a, b]) => cross(a, b)).reduce((sum, v) => sum.map((value, i) => value + v[i])), 0.5);
  const sine = norm(axis);
  const cosine = (columns.reduce((sum, [a, b]) => sum + dot(a, b), 0) - 1) / 2;
  const turn = sine > 1e-12 ? scaled(axis, Math.atan2(sine, cosine) / sine) : cosine > 0 ? axis : scaled(halfTurnAxis(columns), Math.PI);
  return [...subtract(column(to, 3), column(from, 3)), ...turnedBack(from, turn)];
}

/** The axis of half a turn: what it leaves of the vector that it moves least. */
function halfTurnAxis(columns) {
  const [a, b] = columns.reduce((best, pair) => (dot(...pair) > dot(...best) ? pair : best));
  const sum = a.map((value, i) => value + b[i]);
  return scaled(sum, 1 / norm(sum));
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
