/** Words and numbers as people read them. */

const THIN_SPACE = "\u202f";
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
  if (value === 0) return "0";
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

/** Joint angles (rad) in degrees as plain numbers that a file or a link can take, exact to 1e-9 deg. */
export const plainDegrees = (q) => q.map((angle) => String(Number(toDegrees(angle).toFixed(9)) + 0)).join(", ");
