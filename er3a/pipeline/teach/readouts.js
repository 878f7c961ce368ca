/** The tool's pose and the measures of the Jacobian, written into the page. */

import { column, eulerZYZ, quaternion, rollPitchYaw } from "er3a/algebra";
import { conditioning, determinantFactors } from "er3a/kinematics";
import { fill, fixed, inDegrees, inMillimetres, significant, toDegrees } from "er3a/text";

const MET = { wrist: 1e-6, elbow: 1e-6, shoulder: 1e-6 }; // rad, rad, m: so near counts as singular
const SHOWN = { wrist: inDegrees, elbow: inDegrees, shoulder: inMillimetres };

const byId = (id) => document.getElementById(id);

/** Sets a text only where it changed, so that screen readers speak it once. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Writes a pose in all its forms; into the fields where nobody types another. */
export function showPose(T) {
  const form = byId("pose-form");
  const numbers = [...column(T, 3).map((value) => 1000 * value), ...rollPitchYaw(T).map(toDegrees)];
  if (!form.matches(":focus-within")) form.querySelectorAll("input").forEach((field, i) => (field.value = String(Number(numbers[i].toFixed(3)) + 0)));
  const forms = {
    zyz: eulerZYZ(T).map((angle) => inDegrees(angle, 3)),
    quaternion: quaternion(T).map((value) => fixed(value, 6)),
    matrix: T.flatMap((row, r) => row.map((value, c) => (c < 3 || r === 3 ? fixed(value, 6) : fixed(1000 * value, 2)))),
  };
  for (const [kind, texts] of Object.entries(forms)) byId(`orientation-${kind}`).querySelectorAll(".value").forEach((cell, i) => write(cell, texts[i]));
}

/** Writes the measures at frames `T`, and the warning that names what is near; `tight` says which joints are at a limit. */
export function showMeasures(data, T, tight) {
  const { words, near } = data;
  const measures = conditioning(data.table, T, data.characteristic_length);
  const singular = measures.conditionNumber === Infinity; // what is left of the values then is rounding
  write(byId("manipulability"), significant(singular ? 0 : measures.manipulability));
  write(byId("smallest"), significant(singular ? 0 : measures.smallestSingularValue));
  write(byId("condition"), significant(measures.conditionNumber));
  const factors = data.singular_sets ? determinantFactors(T, data.singular_sets) : {};
  const full = { wrist: Math.PI / 2, elbow: Math.PI / 2, shoulder: data.characteristic_length };
  const value = measures.smallestSingularValue;
  const texts = { at: [], near: data.singular_sets || value >= near.value ? [] : [fill(words.near_unnamed, { value: significant(value) })] };
  for (const kind of Object.keys(factors)) {
    const distance = Math.abs(factors[kind]);
    const shown = SHOWN[kind](distance);
    const state = distance < MET[kind] ? "at" : distance < near[kind] ? "near" : "clear";
    texts[state]?.push(fill(words[state][kind], { distance: shown }));
    const row = byId(`factor-${kind}`);
    row.dataset.state = state;
    write(row.querySelector(".value"), shown);
    row.querySelector(".fill").style.width = `${Math.min(100, (100 * distance) / full[kind])}%`;
    row.querySelector(".mark").style.left = `${(100 * near[kind]) / full[kind]}%`;
  }
  const { state: touch } = byId("clearance").dataset; // written before
  texts[touch]?.push(words.touch[touch]);
  texts.near.push(...tight);
  const warning = byId("warning");
  warning.dataset.state = ["at", "near"].find((word) => texts[word].length) ?? "clear";
  write(warning, [...texts.at, ...texts.near].join(" ") || words.clear);
}
