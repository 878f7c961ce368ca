/** The page's controls: sliders, fields and buttons move the arm; what follows from its joints is shown once a frame. */

import { Clearance } from "er3a/clearance";
import { goalOf, solutionsByIteration } from "er3a/goal";
import { closedForm, excesses } from "er3a/inverse";
import { constantLinks, frames, rowValues } from "er3a/kinematics";
import { showMeasures, showPose, write } from "er3a/readouts";
import { beyondLimits, SolutionList, whyNot } from "er3a/solutions";
import { fill, fixed, inDegrees, inUnit, meant, plain, shown } from "er3a/text";
import { addTasks } from "er3a/tasks";
import { ArmView } from "er3a/view";

const LIST_PAUSE = 120; // ms between two lists of solutions while the arm moves
const REST = 300; // ms at rest before solutions are looked for by iteration
const SLICE = 8; // ms of each frame that this may take
const STARTS = 80;
const LINK_PAUSE = 300; // ms at rest before the page's address follows
const SLACK = 1e-9; // rad or m by which the limits may be passed, for rounding

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("panel-data").textContent);
const { table, words, joint_names: names } = data;
const links = constantLinks(table);
const arm = data.no_closed_form ? null : closedForm(table, links);
const goal = goalOf(data, links);
const JOINTS = [...table.lower.keys()];
const rows = names.map((name) => byId(`joint-${name}`));
const sliders = rows.map((row) => row.querySelector("input[type=range]"));
const fields = rows.map((row) => row.querySelector("input[type=number]"));

let q = data.home;
let ghost = null;
let listed = false;
let lastListed = -Infinity;
let lastMoved = -Infinity;
let search = null; // for solutions, by iteration
let awaited = 0; // the next frame
let linkTimer = 0;

const view = new ArmView(byId("arm"), data, links, refresh);
const clearance = new Clearance(data);
const list = new SolutionList(data, arm, goTo, (other) => {
  ghost = other;
  refresh();
}, (other) => (data.wrong ? "" : clearance.overlap(frames(table, links, other))));

/** The joint values (rad, m) that the arm stands at. */
export const joints = () => [...q];

/** Moves the arm; `angles` (rad, m) must be within the limits. */
export function moveTo(angles) {
  q = [...angles];
  listed = false;
  search = null;
  lastMoved = performance.now();
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
  document.querySelectorAll(".message").forEach((each) => write(each, "")); // what was said before the arm moved
  clearTimeout(linkTimer);
  linkTimer = setTimeout(() => history.replaceState(null, "", fragment()), LINK_PAUSE);
}

/** The zero pose, or what the limits leave of it. */
const startJoints = () => JOINTS.map((k) => Math.min(table.upper[k], Math.max(table.lower[k], 0)));

function showJoint(k) {
  const value = shown(table, k, q[k]);
  sliders[k].value = value;
  sliders[k].setAttribute("aria-valuetext", fill(words[table.slides[k] ? "way" : "angle"], { degrees: fixed(value, 1) }));
  if (document.activeElement !== fields[k]) fields[k].value = Number(value.toFixed(3)) + 0;
  if (table.continuous[k]) return write(rows[k].querySelector(".room"), words.endless_joint);
  const room = Math.min(q[k] - table.lower[k], table.upper[k] - q[k]);
  rows[k].dataset.state = room <= SLACK ? "at" : room < (table.slides[k] ? data.near.slide : data.near.limit) ? "near" : "clear";
  write(rows[k].querySelector(".room"), room <= SLACK ? words.at_limit : fill(words.room, { room: inUnit(table, k, room) }));
}

/** Why joint `k` can't go to a value (rad, m) while the others stay; empty if it can. */
function refusal(k, value) {
  if (!Number.isFinite(value)) return fill(words[table.slides[k] ? "no_length" : "no_number"], { joint: names[k] });
  const beyond = excesses(table, q.map((old, j) => (j === k ? value : old))).filter(({ joint }) => joint === undefined || joint === k);
  const own = beyond.find(({ joint }) => joint === k);
  if (own) {
    const limits = { lower: inUnit(table, k, table.lower[k]), upper: inUnit(table, k, table.upper[k]) };
    return fill(words.outside, { joint: names[k], ...limits });
  }
  return beyond.length ? fill(words.not_moved, { reasons: beyondLimits(data, q.map((old, j) => (j === k ? value : old))).join(words.separator) }) : "";
}

/** Moves one joint (rad, m) as far as its limits let it; where those of a sum of joints don't, it stays. */
function moveJoint(k, value) {
  const within = table.continuous[k] ? value : Math.min(table.upper[k], Math.max(table.lower[k], value));
  const reason = refusal(k, within);
  if (!reason) moveTo(q.map((old, j) => (j === k ? within : old)));
  else showJoint(k);
  write(byId("message"), reason);
}

const KEYS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };

let before = 0; // angle of the joint whose field has the focus, when it got that or last took Enter

for (const k of JOINTS) {
  sliders[k].addEventListener("input", () => moveJoint(k, meant(table, k, Number(sliders[k].value))));
  sliders[k].addEventListener("keydown", (event) => {
    const ends = { Home: table.lower[k], End: table.upper[k] };
    const step = KEYS[event.key] * (event.shiftKey ? 0.1 : 1);
    if (!(event.key in KEYS) && !(event.key in ends)) return;
    event.preventDefault();
    moveJoint(k, event.key in ends ? ends[event.key] : meant(table, k, Number((shown(table, k, q[k]) + step).toFixed(6))));
  });
  fields[k].addEventListener("input", () => {
    const value = meant(table, k, fields[k].valueAsNumber);
    const reason = refusal(k, value);
    fields[k].setAttribute("aria-invalid", String(reason !== ""));
    moveJoint(k, reason === "" ? value : before); // what is refused leaves no trace of its first digits
    if (reason !== "") write(byId("message"), reason);
  });
  for (const event of ["focus", "change"]) fields[k].addEventListener(event, () => (before = q[k]));
  fields[k].addEventListener("blur", () => {
    fields[k].setAttribute("aria-invalid", "false");
    showJoint(k);
  });
}

byId("zero").addEventListener("click", () => moveTo(startJoints()));
byId("copy").addEventListener("click", () => copy(`[${plain(table, q)}]`, words.copied));
byId("link").addEventListener("click", () => copy(location.href.split("#")[0] + fragment(), words.link_copied));
for (const button of document.querySelectorAll("[data-view]")) {
  button.addEventListener("click", () => view.look(button.dataset.view));
}
byId("zoom-in").addEventListener("click", () => view.zoom(1 / 1.25));
byId("zoom-out").addEventListener("click", () => view.zoom(1.25));
byId("frames").addEventListener("change", refresh);
byId("pose-form").addEventListener("focusout", refresh);

async function copy(text, copied) {
  let message = words.not_copied;
  try {
    await navigator.clipboard.writeText(text);
    message = copied;
  } catch {
    // The page says so and shows the text instead.
  }
  write(byId("message"), fill(message, { text }));
}

const fragment = () => `#q=${plain(table, q).replaceAll(" ", "")}`;

/** Takes the joints of the page's address, or says why not. */
function takeLink() {
  if (!location.hash.startsWith("#q=") || location.hash === fragment()) return;
  const given = location.hash.slice(3).split(",").map((word, k) => meant(table, k, word === "" ? NaN : Number(word)));
  const counted = given.length === q.length ? "" : fill(words.bad_count, { count: given.length, joints: q.length });
  const reason = counted || JOINTS.map((k) => refusal(k, given[k])).find(Boolean) || beyondLimits(data, given).join(words.separator);
  if (reason) write(byId("message"), fill(words.bad_link, { reason }));
  else moveTo(given);
}

/** Numbers of the table's frames that are asked for; writes the row between two of them. */
function showRow() {
  const chosen = byId("frames").value;
  const k = Number(chosen) - 1;
  if (chosen === "" || chosen === "all") {
    write(byId("row"), "");
    return chosen === "" ? [] : [0, ...table.a.map((_, row) => row + 1)];
  }
  const x = rowValues(table, q)[k];
  const theta = inDegrees(table.offset[k] + (table.sliding[k] ? 0 : x));
  const values = { row: k + 1, theta, d: fixed(1000 * (table.d[k] + (table.sliding[k] ? x : 0)), 2), a: fixed(1000 * table.a[k], 2), alpha: inDegrees(table.alpha[k], 2) };
  write(byId("row"), fill(words.row[table.convention], values));
  return [k, k + 1];
}

/** Has the next frame show the arm as it then is. */
function refresh() {
  cancelAnimationFrame(awaited);
  awaited = requestAnimationFrame(frame);
}

function frame(now) {
  const T = frames(table, links, q);
  view.show(q, ghost, showRow(), data.wrong ? null : clearance.show(T), byId("looks")?.value);
  showPose(T.at(-1));
  showMeasures(data, T, names.filter((_, k) => rows[k].dataset.state === "at").map((joint) => fill(words.joint_at_limit, { joint })));
  if (!listed) findSolutions(T.at(-1), now);
}

/** Lists the solutions of pose `T`: in closed form now and then, by iteration bit by bit once the arm is at rest. */
function findSolutions(T, now) {
  if (now - (arm ? lastListed : lastMoved) <= (arm ? LIST_PAUSE : REST)) return refresh();
  lastListed = now;
  if (arm) {
    listed = true;
    return list.list(T, q);
  }
  search ??= solutionsByIteration(goal, T, q, STARTS);
  const until = performance.now() + SLICE;
  let found = [q];
  do {
    const step = search.next();
    listed = step.done;
    found = step.value ?? found;
  } while (!listed && performance.now() < until);
  if (listed) list.listFound(found, fill(words.iterated, { count: found.length }));
  else refresh();
}

export const points = addTasks(data, goal, arm, {
  joints, moveTo, refusal, tool: () => frames(table, links, q).at(-1), why: (found) => whyNot(data, found),
});

byId("looks")?.addEventListener("change", refresh);
for (const k of JOINTS) showJoint(k);
takeLink();
addEventListener("hashchange", takeLink);
frame(performance.now());
performance.mark("usable");
