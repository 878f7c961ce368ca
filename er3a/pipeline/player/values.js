/** Joint values that a page carries: unpacked, and between two times. */

import { frames } from "er3a/kinematics";

/** Joint values (rad, m) at each of `count` times, from base64 of float32. */
export function decodeValues(text, count) {
  const values = new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const joints = values.length / count;
  return Array.from({ length: count }, (_, i) => Array.from(values.subarray(i * joints, (i + 1) * joints)));
}

/** Joint values at time `t`, on a line between two. */
export function valuesAt(times, values, t) {
  const after = times.findIndex((time) => time >= t);
  const j = after < 0 ? times.length - 1 : after;
  const i = Math.max(0, j - 1);
  const share = times[j] > times[i] ? (t - times[i]) / (times[j] - times[i]) : 1;
  return values[j].map((value, k) => values[i][k] + share * (value - values[i][k]));
}

/** Poses of an arm's base, of the frames that its rows move, and of its tool, at joint values (rad, m). */
export const posesOf = ({ table, links }, q) => [table.base, ...frames(table, links, q)];
