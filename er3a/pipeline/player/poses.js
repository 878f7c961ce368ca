/** Poses and joint values that a page carries: unpacked, and between two of them. */

const PARTS = 7; // x, y, z in m, then the quaternion w, x, y, z

/** Positions and quaternions of `frames` frames at each of `count` times, from base64 of float32. */
export function decodePoses(text, count, frames) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const values = new Float32Array(bytes.buffer);
  return Array.from({ length: count }, (_, i) => values.subarray(i * frames * PARTS, (i + 1) * frames * PARTS));
}

/** Joint values at each of `count` times, from base64 of int16: numbers of `step`. */
export function decodeValues(text, count, step) {
  const values = new Int16Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const joints = values.length / count;
  return Array.from({ length: count }, (_, i) => Array.from(values.subarray(i * joints, (i + 1) * joints), (n) => n * step));
}

/** The times before and after `t`, by number, and the share of the way from one to the other. */
function between(times, t) {
  const after = times.findIndex((time) => time >= t);
  const j = after < 0 ? times.length - 1 : after;
  const i = Math.max(0, j - 1);
  return { i, j, share: times[j] > times[i] ? (t - times[i]) / (times[j] - times[i]) : 1 };
}

/** Joint values at time `t`, on a line between two. */
export function valuesBetween(times, values, t) {
  const { i, j, share } = between(times, t);
  return values[j].map((value, k) => values[i][k] + share * (value - values[i][k]));
}

/** Transforms of all frames at time `t`: between two poses positions on a line, turns on the shortest arc. */
export function poseBetween(times, poses, t) {
  const { i, j, share } = between(times, t);
  return Array.from({ length: poses[j].length / PARTS }, (_, k) => {
    const [a, b] = [poses[i], poses[j]].map((row) => row.subarray(k * PARTS, (k + 1) * PARTS));
    const sign = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
    const mixed = Array.from(a, (value, m) => value + share * ((m < 3 ? 1 : sign) * b[m] - value));
    return transform(mixed.slice(0, 3), mixed.slice(3));
  });
}

/** From a position and a quaternion of any length (M. D. Shuster, "A survey of attitude representations", 1993). */
function transform([x, y, z], quaternion) {
  const size = Math.hypot(...quaternion);
  const [w, i, j, k] = quaternion.map((value) => value / size);
  return [
    [1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j), x],
    [2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i), y],
    [2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j), z],
    [0, 0, 0, 1],
  ];
}
