/** What a person has the arm do beyond single joints: go to a typed pose, jog, and keep way points. */

import { multiply, rotX, rotY, rotZ, translation } from "er3a/algebra";
import { jointsFor } from "er3a/goal";
import { write } from "er3a/readouts";
import { fill, fixed, inDegrees, inMillimetres, meant, plain, shown, toDegrees, toRadians } from "er3a/text";

const SPEED = 30; // deg/s on the mean of a move, of the joint that takes longest
const SLIDE_SPEED = 150; // mm/s
const STILL = 1e-9; // rad or m
const AS_METRES = 5; // mm from the base's origin: who types less means metres
const FOLLOWED = 1e-6; // m and rad

const byId = (id) => document.getElementById(id);

/** Brings the sections to life; `arm` tells and moves: `joints()`, `tool()`, `moveTo(q)`, `refusal(k, value)`. */
export function addTasks(data, goal, closed, arm) {
  const { table, words } = data;

  /** Moves the tool to `T`, or says in `message` why not (`still` where joints can't move it so), or what the arm can't follow. */
  function reach(T, message, starts, still = words.no_such_motion) {
    const found = jointsFor(goal, closed, T, arm.joints(), starts);
    if (!found.q) return write(message, fill(words.not_reached, { reason: arm.why(found) }));
    const { length, angle } = found.left;
    const whole = length < FOLLOWED && angle < FOLLOWED;
    const rests = arm.joints().every((value, k) => Math.abs(value - found.q[k]) < STILL);
    if (rests && !whole) return write(message, still);
    arm.moveTo(found.q);
    const left = { joints: table.lower.length, length: inMillimetres(length), angle: inDegrees(angle) };
    return write(message, whole ? "" : fill(words.left_over, left));
  }

  typePose(reach, arm, words);
  jog((T, message, still) => reach(T, message, 1, still), arm, data);
  return wayPoints(data, arm);
}

function typePose(reach, arm, words) {
  const form = byId("pose-form");
  const fields = [...form.querySelectorAll("input")];
  const message = byId("pose-message");
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const values = fields.map((field) => field.valueAsNumber);
    const bad = fields.find((field) => !Number.isFinite(field.valueAsNumber));
    for (const field of fields) field.setAttribute("aria-invalid", String(field === bad));
    if (bad) return write(message, fill(words.pose_number, { field: bad.ariaLabel }));
    const [roll, pitch, yaw] = values.slice(3).map(toRadians);
    const turn = multiply(rotZ(yaw), multiply(rotY(pitch), rotX(roll)));
    const place = values.slice(0, 3);
    reach(multiply(translation(...place.map((value) => value / 1000)), turn), message);
    const far = Math.hypot(...place);
    if (far === 0 || far >= AS_METRES) return;
    const typed = place.map((value) => Number((1000 * value).toFixed(3))).join(", ");
    write(message, `${message.textContent} ${fill(words.in_metres, { place: typed })}`.trim());
  });
}

function jog(reach, arm, { words, table, joint_names: names }) {
  const message = byId("jog-message");
  const frame = () => document.querySelector("input[name=jog-frame]:checked").value;
  const buttons = [...document.querySelectorAll("[data-jog]")];
  /** What is said of a jog of the tool: about or along which axis of which frame. */
  const told = (axis, start) => {
    const manner = axis < 3 ? "along" : "about";
    return fill(words[`${start}_${manner}`], { axis: words.jog_axes[axis % 3], frame: words.jog_frames[frame()] });
  };
  const label = () => {
    const labels = frame() === "joints" ? names : words.jog_axes;
    for (const button of buttons) {
      const label = labels[Number(button.dataset.jog)];
      button.hidden = label === undefined;
      write(button, `${label} ${button.dataset.sign}`);
      button.title = frame() === "joints" || button.hidden ? "" : told(Number(button.dataset.jog), "jog");
    }
  };
  const step = (axis, sign) => {
    const along = frame() === "joints" ? table.slides[axis] : axis < 3;
    const size = byId(along ? "jog-mm" : "jog-deg").valueAsNumber;
    if (!(size > 0)) return write(message, words.jog_step);
    if (frame() === "joints") {
      const value = arm.joints()[axis] + sign * meant(table, axis, size);
      const reason = arm.refusal(axis, value);
      if (!reason) arm.moveTo(arm.joints().map((old, k) => (k === axis ? value : old)));
      return write(message, reason);
    }
    const shift = [0, 1, 2].map((i) => (i === axis ? (sign * size) / 1000 : 0));
    const turn = [rotX, rotY, rotZ][axis - 3]?.(sign * toRadians(size)) ?? translation(0, 0, 0);
    const T = arm.tool();
    const still = told(axis, "no_jog");
    if (frame() === "tool") return reach(multiply(T, multiply(translation(...shift), turn)), message, still);
    const turned = multiply(turn, T); // about the base's axes, the tool point at rest
    return reach(turned.map((row, i) => (i < 3 ? [...row.slice(0, 3), T[i][3] + shift[i]] : row)), message, still);
  };
  for (const button of buttons) {
    button.addEventListener("click", () => step(Number(button.dataset.jog), button.dataset.sign === "+" ? 1 : -1));
  }
  for (const choice of document.querySelectorAll("input[name=jog-frame]")) choice.addEventListener("change", label);
  label();
}

/** Way points in joint space; the browser keeps them where it keeps anything for pages on a disk. */
function wayPoints(data, arm) {
  const { words, name, table } = data;
  const place = `er3a-points-${name}`;
  const points = kept();
  const list = byId("points");

  function kept() {
    try {
      return (JSON.parse(localStorage.getItem(place)) ?? []).filter((q) => q.length === table.lower.length);
    } catch {
      return [];
    }
  }

  function changed() {
    try {
      localStorage.setItem(place, JSON.stringify(points));
    } catch {
      // They last as long as the page.
    }
    list.replaceChildren(...points.map(item));
    for (const id of ["export-path", "export-program"]) if (byId(id)) byId(id).disabled = points.length < 2;
    byId("clear-points").disabled = points.length === 0;
  }

  function item(q, i) {
    const made = document.createElement("li");
    made.append(
      button(q.map((value, k) => fixed(shown(table, k, value))).join(", "), fill(words.go_to_point, { number: i + 1 }), () => arm.moveTo(q)),
      " ",
      button("×", fill(words.remove_point, { number: i + 1 }), () => {
        points.splice(i, 1);
        changed();
      }),
    );
    return made;
  }

  function button(text, label, action) {
    const made = document.createElement("button");
    Object.assign(made, { type: "button", textContent: text, ariaLabel: label, title: label });
    made.addEventListener("click", action);
    return made;
  }

  byId("save-point").addEventListener("click", () => {
    points.push(arm.joints());
    changed();
  });
  byId("clear-points").addEventListener("click", () => {
    points.length = 0;
    changed();
  });
  byId("export-path").addEventListener("click", () => save(`${name}_taught.yaml`, pathFile(data, points)));
  byId("export-program")?.addEventListener("click", () => save(`${name}_taught.pgm`, rplProgram(data, points)));
  changed();
  return { pathFile: () => pathFile(data, points), program: () => rplProgram(data, points) };
}

function save(file, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  link.download = file;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** A path file of er3a: joint moves through the points, which stop at each. */
function pathFile({ head, table }, points) {
  const rows = points.map((q) => `      - [${plain(table, q)}]\n`);
  const time = (k, value) => Math.abs(shown(table, k, value)) / (table.slides[k] ? SLIDE_SPEED : SPEED);
  const moves = points.slice(1).map((q, i) => Math.max(1, ...q.map((value, k) => time(k, value - points[i][k]))));
  const duration = Math.ceil(moves.reduce((sum, time) => sum + time, 0));
  return `${head.map((line) => `# er3a: ${line}\n`).join("")}kind: paths\npaths:\n  - name: taught\n    title: Points taught in the teach panel\n    kind: joint_sequence\n    points_deg:\n${rows.join("")}    duration_s: ${duration}\n    samples: ${25 * duration}\n`;
}

/** A program in RPL: a joint move to each point, at a tenth of full speed. */
function rplProgram({ head, name }, points) {
  const moves = points.map((q) => `MJOINT(POINTJ(${q.map((angle) => toDegrees(angle).toFixed(6)).join(",")}), v10perc, fine, tool0);\n`);
  const said = [`taught on ${name}; not checked`, ...head].map((line) => `(* er3a: ${line} *)\n`);
  return said.join("") + moves.join("");
}
