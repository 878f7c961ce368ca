/**
 * Vectors, rigid transforms and orientations.
 *
 * A vector is an array of three numbers. A transform is an array of four rows; `T_base_tool` maps coordinates of the
 * tool frame to the base frame. Lengths are in metres, angles in radians.
 *
 * References
 * [1] R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994, equation 2.14.
 * [2] B. Siciliano et al., Robotics: Modelling, Planning and Control, sections 2.4 and 2.6.
 * [3] S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1(3), 1978.
 * [4] M. R. Hestenes, "Inversion of matrices by biorthogonalization and related results", J. SIAM 6(1), 1958.
 */

const RIGHT_ANGLE = 1e-15; // cosines and sines below this are 0: cos(pi / 2) would be 6e-17
const LOCKED = 1e-9; // below this the outer two of three Euler angles turn about one axis

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
export const norm = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => scaled(a, 1 / norm(a));

/** The part of `v` across the unit vector `axis`. */
export const across = (v, axis) => subtract(v, scaled(axis, dot(axis, v)));

/** Some unit vector across the unit vector `axis`. */
export function beside(axis) {
  const sizes = axis.map(Math.abs);
  const least = sizes.indexOf(Math.min(...sizes));
  return unit(cross(axis, [0, 1, 2].map((i) => (i === least ? 1 : 0))));
}

/** `v` turned about a unit axis by the angle with cosine `c` and sine `s`: Rodrigues' formula [1]. */
export const rotated = (v, axis, c, s) => add(add(scaled(v, c), scaled(cross(axis, v), s)), scaled(axis, dot(axis, v) * (1 - c)));

/** Angle that turns `start` to `end` about the unit axis, both projected across it. */
export function signedAngle(start, end, axis) {
  const from = cross(axis, start);
  const to = cross(axis, end);
  return Math.atan2(dot(axis, cross(from, to)), dot(from, to));
}

/** Angle between two vectors, 0 to pi. */
export const unsignedAngle = (a, b) => Math.atan2(norm(cross(a, b)), dot(a, b));

/** The same angle in (-pi, pi]. */
export const wrapToPi = (angle) => angle - 2 * Math.PI * Math.ceil((angle - Math.PI) / (2 * Math.PI));

export const multiply = (A, B) =>
  A.map((row) => [0, 1, 2, 3].map((c) => row[0] * B[0][c] + row[1] * B[1][c] + row[2] * B[2][c] + row[3] * B[3][c]));

export const column = (T, c) => [T[0][c], T[1][c], T[2][c]];

/** A vector given in the frame, in base coordinates. */
export const turned = (T, v) => [dot(T[0], v), dot(T[1], v), dot(T[2], v)];

/** A vector given in base coordinates, in the frame. */
export const turnedBack = (T, v) => [dot(column(T, 0), v), dot(column(T, 1), v), dot(column(T, 2), v)];

/** A point given in the frame, in base coordinates. */
export const moved = (T, p) => add(turned(T, p), column(T, 3));

function cosSin(angle) {
  const exact = (value) => (Math.abs(value) < RIGHT_ANGLE ? 0 : value);
  return [exact(Math.cos(angle)), exact(Math.sin(angle))];
}

export function rotX(angle) {
  const [c, s] = cosSin(angle);
  return [[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]];
}

export function rotY(angle) {
  const [c, s] = cosSin(angle);
  return [[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]];
}

export function rotZ(angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
}

export const translation = (x, y, z) => [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]];
export const IDENTITY = translation(0, 0, 0);

/** [roll, pitch, yaw] of R = Rz(yaw) Ry(pitch) Rx(roll) [2]; at pitch +-90 deg the roll is set to 0. */
export function rollPitchYaw(T) {
  const level = Math.hypot(T[0][0], T[1][0]);
  const pitch = Math.atan2(-T[2][0], level);
  if (level < LOCKED) return [0, pitch, Math.atan2(-T[0][1], T[1][1])];
  return [Math.atan2(T[2][1], T[2][2]), pitch, Math.atan2(T[1][0], T[0][0])];
}

/** [phi, theta, psi] of R = Rz(phi) Ry(theta) Rz(psi), theta in 0..pi [2]; at theta 0 or 180 deg psi is set to 0. */
export function eulerZYZ(T) {
  const tilt = Math.hypot(T[0][2], T[1][2]);
  const theta = Math.atan2(tilt, T[2][2]);
  if (tilt < LOCKED) return [Math.atan2(-T[0][1], T[1][1]), theta, 0];
  return [Math.atan2(T[1][2], T[0][2]), theta, Math.atan2(T[2][1], -T[2][0])];
}

/** Unit quaternion [w, x, y, z] with w >= 0, from its largest part [3]. */
export function quaternion(T) {
  const [xx, yy, zz] = [T[0][0], T[1][1], T[2][2]];
  const squares = [1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz]; // 4 w^2, 4 x^2, ...
  const [wx, wy, wz] = [T[2][1] - T[1][2], T[0][2] - T[2][0], T[1][0] - T[0][1]]; // 4 w x, ...
  const [xy, xz, yz] = [T[0][1] + T[1][0], T[0][2] + T[2][0], T[1][2] + T[2][1]];
  const largest = squares.indexOf(Math.max(...squares));
  const products = [[squares[0], wx, wy, wz], [wx, squares[1], xy, xz], [wy, xy, squares[2], yz], [wz, xz, yz, squares[3]]];
  const sign = products[largest][0] < 0 ? -1 : 1;
  return products[largest].map((part) => (sign * part) / (2 * Math.sqrt(squares[largest])));
}

/**
 * Singular values, greatest first, of a matrix given by its columns: they are rotated in pairs until all are at right
 * angles (one-sided Jacobi [4]), which keeps small values accurate.
 */
export function singularValues(columns) {
  const A = columns.map((entries) => [...entries]);
  const inner = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
  for (let sweep = 0, clean = false; sweep < 30 && !clean; sweep++) {
    clean = true;
    for (let i = 0; i < A.length; i++) {
      for (let j = i + 1; j < A.length; j++) {
        const [aa, bb, ab] = [inner(A[i], A[i]), inner(A[j], A[j]), inner(A[i], A[j])];
        if (Math.abs(ab) <= Number.EPSILON * Math.sqrt(aa * bb)) continue;
        clean = false;
        const zeta = (bb - aa) / (2 * ab);
        const t = (zeta < 0 ? -1 : 1) / (Math.abs(zeta) + Math.hypot(1, zeta));
        const c = 1 / Math.hypot(1, t);
        for (let r = 0; r < A[i].length; r++) {
          const [x, y] = [A[i][r], A[j][r]];
          A[i][r] = c * (x - t * y);
          A[j][r] = c * (y + t * x);
        }
      }
    }
  }
  return A.map((entries) => Math.sqrt(inner(entries, entries))).sort((a, b) => b - a);
}
