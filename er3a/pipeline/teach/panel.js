/** The page's controls: sliders, fields and buttons move the arm; what follows from its joints is shown once a frame. */

import { closedForm } from "er3a/inverse";
import { constantLinks, frames, JOINTS } from "er3a/kinematics";
import { showMeasures, showPose, write } from "er3a/readouts";
import { SolutionList, whyNot } from "er3a/solutions";
import { fill, fixed, inDegrees, plainDegrees, toDegrees, toRadians } from "er3a/text";
import { addTasks } from "er3a/tasks";
import { ArmView } from "er3a/view";

const LIST_PAUSE = 120; // ms between two lists of solutions while the arm moves
const LINK_PAUSE = 300; // ms at rest before the page's address follows
const SLACK = 1e-9; // rad by which the limits may be passed, for rounding

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("panel-data").textContent);
const { table, words, joint_names: names } = data;
const links = constantLinks(table);
const arm = data.no_closed_form ? null : closedForm(table, links);
const rows = names.map((name) => byId(`joint-${name}`));
const sliders = rows.map((row) => row.querySelector("input[type=range]"));
const fields = rows.map((row) => row.querySelector("input[type=number]"));

let q = startJoints();
let ghost = null;
let listed = arm === null;
let lastListed = -Infinity;
let awaited = false;
let linkTimer = 0;

const view = new ArmView(byId("arm"), data, links, refresh);
const list = arm && new SolutionList(data, arm, goTo, (other) => {
  ghost = other;
  refresh();
});

/** The joint angles (rad) that the arm stands at. */
export const joints = () => [...q];

/** Moves the arm; `angles` (rad) must be within the limits. */
export function moveTo(angles) {
  q = [...angles];
  listed = arm === null;
  follow();
}

/** Goes to another solution of the same pose: the list stays. */
function goTo(angles) {
  q = [...angles];
  list.mark(q);
  follow();
}

/** Lets the controls and the address follow the joints; the picture comes with the next frame. */
function follow() {
  refresh();
  for (const k of JOINTS) showJoint(k);
  write(byId("message"), "");
  clearTimeout(linkTimer);
  linkTimer = setTimeout(() => history.replaceState(null, "", fragment()), LINK_PAUSE);
}

/** The zero pose, or what the limits leave of it. */
function startJoints() {
  return JOINTS.map((k) => Math.min(table.upper[k], Math.max(table.lower[k], 0)));
}

function showJoint(k) {
  const degrees = toDegrees(q[k]);
  sliders[k].value = degrees;
  sliders[k].setAttribute("aria-valuetext", fill(words.angle, { degrees: fixed(degrees, 1) }));
  if (document.activeElement !== fields[k]) fields[k].value = Number(degrees.toFixed(3)) + 0;
  const room = Math.min(q[k] - table.lower[k], table.upper[k] - q[k]);
  const share = room / ((table.upper[k] - table.lower[k]) / 2);
  rows[k].dataset.state = room <= SLACK ? "at" : room < data.near.limit ? "near" : "clear";
  rows[k].querySelector(".fill").style.width = `${100 * Math.max(0, share)}%`;
  write(rows[k].querySelector(".room"), room <= SLACK ? words.at_limit : fill(words.room, { room: inDegrees(room) }));
}

/** Why joint `k` can't go to an angle (rad); empty if it can. */
function refusal(k, angle) {
  if (!Number.isFinite(angle)) return fill(words.no_number, { joint: names[k] });
  if (angle >= table.lower[k] - SLACK && angle <= table.upper[k] + SLACK) return "";
  const limits = { lower: inDegrees(table.lower[k]), upper: inDegrees(table.upper[k]) };
  return fill(words.outside, { joint: names[k], ...limits });
}

function moveJoint(k, angle) {
  moveTo(q.map((old, j) => (j === k ? Math.min(table.upper[k], Math.max(table.lower[k], angle)) : old)));
}

const KEYS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };

let before = 0; // angle of the joint whose field has the focus, when it got that or last took Enter

for (const k of JOINTS) {
  sliders[k].addEventListener("input", () => moveJoint(k, toRadians(Number(sliders[k].value))));
  sliders[k].addEventListener("keydown", (event) => {
    const ends = { Home: table.lower[k], End: table.upper[k] };
    const step = KEYS[event.key] * (event.shiftKey ? 0.1 : 1);
    if (!(event.key in KEYS) && !(event.key in ends)) return;
    event.preventDefault();
    moveJoint(k, event.key in ends ? ends[event.key] : toRadians(Number((toDegrees(q[k]) + step).toFixed(6))));
  });
  fields[k].addEventListener("input", () => {
    const angle = toRadians(fields[k].valueAsNumber);
    const reason = refusal(k, angle);
    fields[k].setAttribute("aria-invalid", String(reason !== ""));
    moveJoint(k, reason === "" ? angle : before); // what is refused leaves no trace of its first digits
    if (reason !== "") write(byId("message"), reason);
  });
  for (const event of ["focus", "change"]) fields[k].addEventListener(event, () => (before = q[k]));
  fields[k].addEventListener("blur", () => {
    fields[k].setAttribute("aria-invalid", "false");
    showJoint(k);
  });
}

byId("zero").addEventListener("click", () => moveTo(startJoints()));
byId("copy").addEventListener("click", () => copy(`[${plainDegrees(q)}]`, words.copied));
byId("link").addEventListener("click", () => copy(location.href.split("#")[0] + fragment(), words.link_copied));
for (const button of document.querySelectorAll("[data-view]")) {
  button.addEventListener("click", () => view.look(button.dataset.view));
}
byId("zoom-in").addEventListener("click", () => view.zoom(1 / 1.25));
byId("zoom-out").addEventListener("click", () => view.zoom(1.25));
byId("frames").addEventListener("change", refresh);
for (const choice of document.querySelectorAll("input[name=orientation]")) {
  choice.addEventListener("change", refresh);
}

async function copy(text, told) {
  let message = words.not_copied;
  try {
    await navigator.clipboard.writeText(text);
    message = told;
  } catch {
    // The page says so and shows the text instead.
  }
  write(byId("message"), fill(message, { text }));
}

const fragment = () => `#q=${plainDegrees(q).replaceAll(" ", "")}`;

/** Takes the joints of the page's address, or says why not. */
function takeLink() {
  if (!location.hash.startsWith("#q=") || location.hash === fragment()) return;
  const angles = location.hash.slice(3).split(",").map((word) => toRadians(word === "" ? NaN : Number(word)));
  const counted = angles.length === 6 ? "" : fill(words.bad_count, { count: angles.length });
  const reason = counted || JOINTS.map((k) => refusal(k, angles[k])).find(Boolean);
  if (reason) write(byId("message"), fill(words.bad_link, { reason }));
  else moveTo(angles);
}

/** Numbers of the table's frames that are asked for; writes the row between two of them. */
function showRow() {
  const chosen = byId("frames").value;
  const k = Number(chosen) - 1;
  if (chosen === "" || chosen === "all") {
    write(byId("row"), "");
    return chosen === "" ? [] : [0, 1, 2, 3, 4, 5, 6];
  }
  const theta = inDegrees(table.direction[k] * q[k] + table.offset[k]);
  const values = { row: k + 1, theta, d: fixed(1000 * table.d[k], 2), a: fixed(1000 * table.a[k], 2), alpha: inDegrees(table.alpha[k], 2) };
  write(byId("row"), fill(words.row[table.convention], values));
  return [k, k + 1];
}

/** Has the next frame show the arm as it then is. */
function refresh() {
  if (!awaited) requestAnimationFrame(frame);
  awaited = true;
}

function frame(now) {
  awaited = false;
  const T = frames(table, links, q);
  view.show(q, ghost, showRow());
  showPose(T[6]);
  showMeasures(data, arm, T);
  if (listed) return;
  if (now - lastListed > LIST_PAUSE) {
    listed = true;
    lastListed = now;
    list.list(T[6], q);
  } else {
    refresh();
  }
}

export const points = addTasks(data, links, arm, {
  joints, moveTo, refusal, tool: () => frames(table, links, q)[6], why: (found) => whyNot(data, found),
});

for (const k of JOINTS) showJoint(k);
takeLink();
addEventListener("hashchange", takeLink);
frame(performance.now());
performance.mark("usable");
