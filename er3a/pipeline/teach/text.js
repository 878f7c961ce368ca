/** Words and numbers as people read them. */

const THIN_SPACE = "\u202f";
const NOTHING = 1e-12; // what rounding leaves of 0
const DEGREES = 180 / Math.PI;

/** A sentence with its `{names}` filled in. */
export const fill = (text, values) => text.replace(/\{(\w+)\}/g, (_, name) => values[name]);

/** A number with fixed decimals and a typographic minus; no negative zero. */
export function fixed(value, decimals = 1) {
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** A number with significant digits; powers of ten where it is very small or great. */
export function significant(value, digits = 3) {
  if (value === Infinity) return "∞";
  if (Math.abs(value) < NOTHING) return "0";
  if ( Math.abs(value) >= 1e-3 && Math.abs(value) < 1e6) return value.toPrecision(digits).replace("-", "−");
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const raised = String(Number(power)).replace(/[-\d]/g, (sign) => (sign === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign]));
  return `${mantissa}·10${raised}`.replace("-", "−");
}

export const toDegrees = (angle) => angle * DEGREES;
export const toRadians = (degrees) => degrees / DEGREES;

/** An angle (rad) in degrees with its sign. */
export const inDegrees = (angle, decimals = 1) => `${fixed(toDegrees(angle), decimals)}°`;

/** A length (m) in millimetres with its unit. */
export const inMillimetres = (length, decimals = 1) => `${fixed(1000 * length, decimals)}${THIN_SPACE}mm`;

/** A joint's value (rad, m) in its unit, degrees or mm: as a number, with its unit, and back. */
export const shown = (table, k, value) => (table.slides[k] ? 1000 * value : toDegrees(value));
export const inUnit = (table, k, value, decimals = 1) => (table.slides[k] ? inMillimetres : inDegrees)(value, decimals);
export const meant = (table, k, number) => (table.slides[k] ? number / 1000 : toRadians(number));

/** Joint values in degrees and mm as plain numbers that a file or a link can take, exact to 1e-9. */
export const plain = (table, q) => q.map((value, k) => String(Number(shown(table, k, value).toFixed(9)) + 0)).join(", ");

/** What leaves its limits (one of `excesses`) by name: a joint or a sum of joints; and how its values are written. */
export function limited({ table, joint_names: names }, { joint, sum }) {
  if (sum === undefined) return { name: names[joint], text: (value, decimals) => inUnit(table, joint, value, decimals) };
  const { factors } = table.combined[sum];
  const parts = factors.map((factor, k) => [factor, k]).filter(([factor]) => factor !== 0);
  const words = parts.map(([factor, k], i) => {
    const sign = factor < 0 ? (i ? " − " : "−") : i ? " + " : "";
    return `${sign}${Math.abs(factor) === 1 ? "" : `${Math.abs(factor)}\u00a0`}${names[k]}`;
  });
  const slide = parts.every(([, k]) => table.slides[k]);
  return { name: words.join(""), text: slide ? inMillimetres : inDegrees };
}
