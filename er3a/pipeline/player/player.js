/**
 * Plays motions of an arm on a page: a time bar, play and step, events, and a cursor in every plot over time.
 *
 * Joint values come with the page; what lies between two of them is on a line. Any element of the page may have `data-play="MOTION"` and `data-t="SECONDS"`: it then leads to that moment, and is marked as `now` from
 * `data-from` to it; `?play=MOTION&t=SECONDS` in the page's address does the same, and playing ends there with `&until=SECONDS`. A plot is a figure with `data-panels`, a list of `[left, bottom, right, top, t0, t1, MOTION]` in
 * parts of its picture; without a motion of its own a panel shows that of the figure's `data-play`.
 */

import { add, column, moved, scaled, subtract } from "er3a/algebra";
import { constantLinks } from "er3a/kinematics";
import { alongArm, Arm, ARM, Space, WORLD } from "er3a/space";
import { decodeValues, posesOf, valuesAt } from "er3a/values";

const [FAINT, SEEN_THROUGH] = [0.15, 0.5]; // of a body that hides the arm or is larger, and of one that it is in
const DOT = 0.012; // of the arm's size
const GRAVEST = ["fail", "caution", "plain"];
const SLOW = 60; // ms between two frames: the next ones have fewer pixels
const SHORT = 16; // px: a shorter gap is shown larger as well
const CLOSED = 0.02; // of the arm's size: a motion ends where it starts
const ROUNDED = 1e-4; // s, of the times that a motion has

const place = document.getElementById("player");
const data = JSON.parse(document.getElementById("player-data").textContent);
const { words, table } = data;
const part = (name) => place.querySelector(`.${name}`);
const [canvas, chooser, bar, clock, nowShown] = ["arm", "motion", "time", "clock", "now-shown"].map(part);
const unjudged = document.querySelector(".answer .no_verdict") && { events: [], ...(data.others.length ? {} : { marks: [], text: words.not_judged }) }; // of a wrong table
const motions = new Map(data.motions.map((motion) => [motion.name, prepared(motion)]));
const floor = data.floor ?? column(table.base, 3)[2];

let [motion, t, playing, last, awaited] = [motions.values().next().value, 0, false, 0, 0];
let apart = ""; // how far the tool of a wrong table is from that of the other, now

const space = new Space(canvas, data.target, data.length, refresh);
const arms = [data, ...data.others].map((arm, k) => ({
  table: arm.table, links: constantLinks(arm.table), shown: new Arm(space, arm, k === 0 ? data.carried : []),
}));
const surroundings = space.add(data.scene);
const plots = [...document.querySelectorAll("figure[data-panels]")].map(withCursors);
const cells = [...part("joints").querySelectorAll("dl > div")].map((place) => {
  return { place, value: place.querySelector(".value"), room: place.querySelector(".room") };
});
const ranges = [...part("joints").querySelectorAll("summary i")];
const stretches = [...document.querySelectorAll("[data-from]")];

/** An arrow with a flat head, seen from the eye. */
function drawArrow(from, to, css) {
  const [size, back] = [0.02 * data.size, subtract(from, to)];
  const shaft = scaled(back, size / Math.hypot(...back));
  const barbs = [-0.4, 0.4].map((side) => add(to, add(shaft, scaled(space.eye.right, side * size))));
  space.line([from, to], css, 4);
  space.line([barbs[0], to, barbs[1]], css, 4);
}

function prepared(motion) {
  const count = motion.times.length;
  const loads = motion.loads && decodeValues(motion.loads, count);
  return { ...motion, ...unjudged, loads, values: motion.values.map((text) => decodeValues(text, count)), trails: null };
}

const start = () => motion.times[0];
const end = () => motion.times.at(-1);
const whole = () => Math.max(end(), motion.whole); // the arm may not get there
let asked = new URLSearchParams(location.search);
/** Where playing ends: where the page's address says so, unless the reader is beyond that. */
function playedUntil() {
  const until = motion.name === asked.get("play") ? Number(asked.get("until") ?? NaN) : NaN;
  return t <= until ? until : end();
}
const fixed = (value, digits = 3) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");

/** Shows a moment of a motion; `name` is that of the motion, null for the one that is shown. */
export function goTo(name, time) {
  if (name !== null && motions.has(name)) motion = motions.get(name);
  t = Math.min(end(), Math.max(start(), time));
  refresh();
}

function play(on) {
  if (on && t >= playedUntil()) t = start();
  playing = on;
  space.fineness = 1;
  place.toggleAttribute("data-playing", on);
  if (!on) dispatchEvent(new Event("player-rests"));
  part("play").textContent = on ? words.pause : words.play;
  last = performance.now();
  refresh();
}

function refresh() {
  cancelAnimationFrame(awaited);
  awaited = requestAnimationFrame(frame);
}

function frame(now) {
  if (playing) {
    const until = playedUntil();
    if (now - last > SLOW) space.fineness = 0.5;
    t += ((now - last) / 1000) * Number(part("speed").value);
    last = now;
    if (t >= until) {
      t = until;
      play(false);
    }
  }
  draw();
  tell();
  if (playing) refresh();
}

const isNow = ({ t: from, until }) => t >= from - ROUNDED && t <= until + ROUNDED;

function draw() {
  if (bar.dataset.motion !== motion.name) newMotion();
  const now = motion.events.filter(isNow);
  const colours = new Map();
  for (const grave of [false, true]) {
    const css = grave ? data.colours.touching : data.colours.caution;
    for (const event of now) if ((event.status !== "caution") === grave) for (const name of event.bodies) colours.set(name, css);
  }
  const touching = new Set([...colours.keys()].filter((name) => colours.get(name) === data.colours.touching));
  for (const [j, { status }] of failing()) colours.set(j, data.colours[status]);
  const poses = arms.map((arm, k) => posesOf(arm, valuesAt(motion.times, motion.values[k], t)));
  const { page } = space;
  if (space.target !== motion.target) Object.assign(space, { target: motion.target, distance: (space.distance * motion.length) / space.length, length: motion.length });
  if (space.turned !== motion.turned) Object.assign(space, { azimuth: space.azimuth + motion.turned - (space.turned ?? 0), elevation: motion.elevation, turned: motion.turned });
  space.begin();
  const { offsetLeft, offsetTop, offsetWidth, offsetHeight } = nowShown; // words keep off what is said there
  space.taken.push([offsetLeft + offsetWidth / 2, offsetTop + offsetHeight / 2, offsetWidth, offsetHeight]);
  const wrong = unjudged && arms.length > 1 && new Map(poses[0].map((_, j) => [j ? `link_${j}` : "base", data.colours.touching]));
  space.floor(column(table.base, 3), data.size / 10, floor, Boolean(wrong));
  arms.forEach(({ shown }, k) => shown.show(poses[k], (k === 0 && wrong) || colours, part("looks")?.value, Boolean(wrong && k === 0)));
  space.keepClear(poses.flatMap(alongArm), ARM * data.size);
  const others = wrong ? [] : motion.ghosts.map((q) => posesOf(arms[0], q));
  const shades = motion.events.map(({ status }) => data.colours[status] ?? page.muted);
  const numbered = others.map((own, k) => sticks(own, shades[k], poses[0]));
  const keys = numbered.map((at) => at.map((value) => value.toFixed(2)).join());
  for (const key of others.length > 1 ? new Set(keys) : []) {
    const those = keys.flatMap((own, k) => (own === key ? [k + 1] : []));
    if (key) space.word(those.join(", "), numbered[those[0] - 1], shades[those[0] - 1], false);
  }
  const hiding = space.hiding(surroundings, poses.flat());
  space.place(surroundings, [WORLD], colours, (mesh) => (hiding.has(mesh) || mesh.shape.large) && (touching.has(mesh.shape.name) ? SEEN_THROUGH : FAINT));
  const moves = motion.trails[0].some((point) => Math.hypot(...subtract(point, motion.trails[0][0])) >= CLOSED * data.size);
  for (const trail of moves ? motion.trails : []) space.line(trail, wrong ? (trail === motion.trails[0] ? page.touching : page.accent) : page.ink, wrong ? 4 : 2);
  for (const { t: from, until, status } of motion.events) {
    if (status === "plain" || from >= Math.min(until, end())) continue;
    const times = [from, ...motion.times.filter((time) => time > from && time < until), Math.min(until, end())];
    space.line(times.map((time) => column(posesOf(arms[0], valuesAt(motion.times, motion.values[0], time)).at(-1), 3)), data.colours[status], 5);
  }
  const axes = (wrong ? [] : poses).flatMap((own) => [0, 1, 2].map((c) => [column(own.at(-1), 3), add(column(own.at(-1), 3), scaled(column(own.at(-1), c), 0.09 * data.size))]));
  axes.forEach((axis, i) => space.line(axis, data.axes[i % 3], 3));
  const worst = GRAVEST.find((status) => now.some((event) => event.status === status)); // what comes with it is not named
  for (const j of new Set(now.flatMap(({ axes, status }) => (status === worst ? axes : [])))) singularAxis(j, poses[0][j], failing().has(j));
  const marks = motion.marks.filter(({ t0, t1 }) => t >= t0 && t <= t1 && !(t === t1 && t0 < t1 && t1 < end())); // where two meet, the later one
  const [from, to] = poses.map((own) => column(own.at(-1), 3));
  if (wrong) marks.push({ from, to, text: (apart = `${fixed(1000 * Math.hypot(...subtract(from, to)), 0)} mm`) });
  if (wrong && from[2] < floor) space.word(words.through, from, page.touching);
  for (const { T, radius, length = 0 } of data.scene.filter((shape) => shape.radius)) space.keepClear([-0.5, -0.25, 0, 0.25, 0.5].map((part) => moved(T, [0, 0, part * length])), radius);
  space.keepClear([...axes.flatMap(([a, b]) => [b, scaled(add(a, b), 0.5)]), motion.trails[0][0], motion.trails[0].at(-1), ...marks.map(({ from }) => from)], DOT * data.size);
  const css = touching.size || wrong ? page.touching : page.ink;
  for (const { from, to, text, arrow } of marks) {
    if (arrow) drawArrow(from, to, css);
    else if (String(from) === String(to) || (text && touching.size)) space.dot(scaled(add(from, to), 0.5), page.ink, 5, true);
    else space.line([from, to], text ? css : page.ink, text ? 4 : 3), text && [from, to].forEach((end) => space.dot(end, css, 4));
    space.keepClear(Array.from({ length: 17 }, (_, k) => add(scaled(from, 1 - k / 16), scaled(to, k / 16))), 0);
  }
  if (motion.loads) tellLoads(poses[0]);
  for (const [j, { status }] of failing()) {
    if (status === worst) space.word(`J${j}`, moved(poses[0][j], data.rows[j - 1].middle), { caution: page.doubtful, fail: page.touching }[status] ?? page.ink);
  }
  if (moves && arms.length === 1 && !others.length) nameEnds(motion.trails[0]);
  space.keepClear(motion.trails[0], 0);
  const pixels = ([x, y], [u, v]) => Math.hypot(u - x, v - y);
  const gap = marks.find(({ from, to, text }) => text && String(from) !== String(to) && pixels(space.seen(from), space.seen(to)) < SHORT);
  if (gap && !touching.size && !motion.loads) space.closer(scaled(add(gap.from, gap.to), 0.5), gap.text);
  for (const { from, to, text } of marks) if (text) space.word(text, scaled(add(from, to), 0.5), css);
  data.signs.forEach(({ text, at }, k) => space.word(text, wrong ? column(poses[k][3], 3) : at, k === 0 && wrong ? page.touching : page.ink));
  space.names(surroundings, touching);
  space.end();
}

/** An arm as lines between its joints, which hide nothing; its joints where those of the arm that is shown are not. Returns the one farthest off, or []. */
function sticks(poses, css, shown) {
  const joints = poses.map((T) => column(T, 3));
  const off = joints.filter((joint, k) => Math.hypot(...subtract(joint, column(shown[k], 3))) > CLOSED * data.size);
  if (off.length) space.line(joints, css, 4);
  off.forEach((joint) => space.dot(joint, css, 4.5));
  if (off.length) space.keepClear(alongArm(poses), DOT * data.size);
  const away = (joint) => Math.min(...shown.map((T) => Math.hypot(...subtract(joint, column(T, 3)))));
  return off.length ? off.reduce((a, b) => (away(b) > away(a) ? b : a)) : [];
}

/** The axis of row `j`, whose frame is `T`, through the whole picture; with its name, unless the joint is named. */
function singularAxis(j, T, named) {
  const [middle, way] = [moved(T, data.rows[j - 1].middle), scaled(column(T, 2), 0.3 * data.size)];
  space.line([subtract(middle, way), add(middle, way)], data.colours.caution, 2.5);
  if (!named) space.word(`J${j}`, add(middle, way), space.page.doubtful);
}

/** What each joint bears now. */
function tellLoads(poses) {
  const most = Math.max(...motion.loads.flat().map(Math.abs).filter(Number.isFinite)) || 1;
  const digits = Math.max(0, 2 - Math.floor(Math.log10(most)));
  const loads = valuesAt(motion.times, motion.loads, t);
  loads.forEach((load, j) => {
    if (Number.isNaN(load)) return;
    const felt = Math.abs(load) > 0.3 * most; // what is not is in grey
    space.word(`J${j + 1} ${fixed(load, digits)} ${table.slides[j] ? "N" : "N m"}`, moved(poses[j + 1], data.rows[j].middle), felt ? space.page.ink : space.page.muted, felt);
  });
}

function nameEnds(trail) {
  const [first, last] = [trail[0], trail.at(-1)];
  const closed = Math.hypot(...subtract(last, first)) < CLOSED * data.size;
  const arrives = whole() - end() < ROUNDED;
  for (const [at, text] of closed ? [[first, words.start_and_end]] : [[first, words.start], ...(arrives ? [[last, words.end]] : [])]) {
    space.dot(at, space.page.ink, 4);
    space.word(text, at, space.page.ink, false);
  }
}

/** Time bar, clock, events and the cursors of the plots. */
function tell() {
  bar.value = String(t);
  const several = motion.ghosts.length > 1; // a second for each solution
  const [at, last, said] = several ? [String(Math.floor(t) + 1), String(Math.ceil(end())), words.solution] : [fixed(t), fixed(whole()), words.clock];
  clock.textContent = said.replace("{t}", at).replace("{end}", last);
  bar.setAttribute("aria-valuetext", clock.textContent);
  const now = motion.events.filter(isNow).sort((a, b) => GRAVEST.indexOf(a.status) - GRAVEST.indexOf(b.status));
  const ends = playedUntil() < end() ? words.ends : apart ? (several ? clock.textContent + words.between : "") + words.apart.replace("{off}", apart) : motion.text;
  show(nowShown, (now[0]?.status === "plain" ? now.at(-1) : now[0])?.text || ends); // the first fault is the cause
  nowShown.className = `now-shown ${playedUntil() < end() && (now[0]?.status ?? "plain") === "plain" ? "pass" : (now[0]?.status ?? "plain")}`;
  tellJoints();
  for (const plot of plots) plot(motion.name, t);
  const on = stretches.filter(({ dataset }) => dataset.play === motion.name && isNow({ t: Number(dataset.from), until: Number(dataset.t) }));
  for (const part of stretches) {
    const now = part === on[0] || (on.includes(part) && part.dataset.from === part.dataset.t); // where two meet, the first; what has no motion too
    if (now && !part.classList.contains("now")) listed(part), part.dataset.fix && dispatchEvent(new CustomEvent("advice", { detail: part }));
    part.classList.toggle("now", now);
  }
}

/** The joints that fail at this moment, each with how gravely and what it would need; of several causes the gravest. */
function failing() {
  const now = motion.events.filter(isNow).sort((a, b) => GRAVEST.indexOf(b.status) - GRAVEST.indexOf(a.status));
  return new Map(now.flatMap(({ status, joints }) => joints.map(([j, needed]) => [j, { status, needed }])));
}

/** Joint values with their margins; those that fail are marked, or else the least of those in deg, and of those in mm. */
function tellJoints() {
  const values = valuesAt(motion.times, motion.values[0], t).map((value, j) => value * (table.slides[j] ? 1000 : 180 / Math.PI));
  const rooms = data.joints.map(({ lower, upper }, i) => (lower === null ? Infinity : Math.min(values[i] - lower, upper - values[i])));
  const fails = failing();
  const quiet = !unjudged && fails.size === 0 && !motion.events.some((event) => isNow(event) && (event.status === "fail" || event.bodies.length));
  const least = new Map();
  data.joints.forEach(({ unit }, i) => (rooms[i] < (rooms[least.get(unit)] ?? Infinity) ? least.set(unit, i) : null));
  const withUnit = (value, unit) => fixed(value, 1) + (unit === "°" ? unit : ` ${unit}`);
  data.joints.forEach(({ unit, lower, upper }, i) => {
    const fault = fails.get(i + 1);
    const past = rooms[i] <= -0.05; // what one decimal shows
    const text = rooms[i] === Infinity ? words.unlimited : past ? words.beyond : words.room;
    show(cells[i].value, withUnit(values[i], unit));
    show(cells[i].room, fault?.needed || text.replace("{room}", fixed(Math.abs(rooms[i]), 1)));
    cells[i].place.classList.toggle("least", quiet && least.get(unit) === i);
    cells[i].place.classList.toggle("doubtful", fault?.status === "caution");
    cells[i].place.classList.toggle("past", past || fault?.status === "fail");
    show(ranges[i].nextElementSibling, withUnit(values[i], unit));
    ranges[i].className = cells[i].place.className;
    ranges[i].style.setProperty("--at", rooms[i] === Infinity ? 0.5 : Math.min(1.04, Math.max(-0.04, (values[i] - lower) / (upper - lower || 1))));
  });
}

function show(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function newMotion() {
  motion.trails ??= arms.map((arm, k) => motion.values[k].map((q) => column(posesOf(arm, q).at(-1), 3)));
  dispatchEvent(new CustomEvent("motion", { detail: motion.name }));
  bar.dataset.motion = chooser.value = motion.name;
  part("ticks").classList.toggle("solutions", motion.ghosts.length > 0);
  part("controls").classList.toggle("rests", new Set(motion.values.flat().map(String)).size === arms.length);
  Object.assign(bar, { min: String(start()), max: String(whole()), step: "any" });
  const beyond = { t: end(), until: whole(), status: "none", text: motion.events.at(-1)?.text || motion.name };
  const ticks = [...(whole() - end() > ROUNDED ? [beyond] : []), ...motion.events].map((event) => {
    const at = (value) => Math.min(100, (100 * (value - start())) / (whole() - start() || 1));
    const tick = Object.assign(document.createElement("button"), { type: "button", className: `tick ${event.status}`, title: event.text, tabIndex: -1 });
    tick.style.left = `min(${at(event.t)}%, 100% - 0.6rem)`; // what is at the end is seen too
    tick.style.width = `${Math.max(0, at(event.until) - at(event.t))}%`;
    tick.addEventListener("click", () => goTo(null, event.t));
    return tick;
  });
  part("ticks").replaceChildren(...ticks);
}

/** Lays a cursor over each panel of a plot; returns what moves them. */
function withCursors(figure) {
  const image = figure.querySelector("img");
  const panels = JSON.parse(figure.dataset.panels).map(([left, bottom, right, top, t0, t1, name = figure.dataset.play]) => {
    const cursor = Object.assign(document.createElement("span"), { className: "cursor" });
    figure.append(cursor);
    return { left, bottom, right, top, t0, t1, name, cursor };
  });
  const inner = () => drawnPart(image, image.offsetLeft, image.offsetTop);
  image.addEventListener("load", refresh);
  image.addEventListener("click", (event) => {
    const { x, y, width, height } = inner();
    const [u, v] = [(event.offsetX - x + image.offsetLeft) / width, 1 - (event.offsetY - y + image.offsetTop) / height];
    const panel = panels.find(({ left, right, bottom, top }) => u >= left && u <= right && v >= bottom && v <= top);
    if (!panel) return;
    goTo(panel.name, panel.t0 + ((u - panel.left) / (panel.right - panel.left)) * (panel.t1 - panel.t0));
    dock(event.clientY + (v - panel.bottom) * height);
  });
  return (shown, time) => {
    const { x, y, width, height } = inner();
    for (const { left, right, bottom, top, t0, t1, name, cursor } of panels) {
      cursor.hidden = shown !== name || time < t0 || time > t1;
      const u = left + ((time - t0) / (t1 - t0 || 1)) * (right - left);
      cursor.style.left = `${(100 * (x + u * width)) / figure.clientWidth}%`; // never past a page that just became narrower
      cursor.style.top = `${y + (1 - top) * height}px`;
      cursor.style.height = `${(top - bottom) * height}px`;
    }
  };
}

/** Scrolls a listing to the row that is shown of it: into the middle, or to its top where it has no room; its first row is whole. */
function listed(row) {
  const box = row.closest(".listing");
  box?.scrollTo(0, [...row.closest("table").rows].map(({ offsetTop }) => offsetTop).findLast((top) => top <= Math.min(box.scrollHeight - box.clientHeight, row.offsetTop - Math.max(0, (box.clientHeight - row.offsetHeight) / 2))));
}

/** Keeps the player in sight below what the reader points at, whose lower edge is at ``edge`` in the window. */
function dock(edge = 0) {
  const { top, bottom } = place.getBoundingClientRect();
  place.style.minHeight = `${bottom - top}px`; // the page stays as it is when the player leaves its place
  place.classList.toggle("docked", bottom < 80 || top > innerHeight - 80);
  if (place.classList.contains("docked")) scrollBy(0, Math.max(0, edge + 40 - part("stand").getBoundingClientRect().top));
  refresh();
}

const step = (sign) => {
  const next = sign > 0 ? motion.times.find((time) => time > t + 1e-9) : motion.times.findLast((time) => time < t - 1e-9);
  play(false);
  goTo(null, next ?? t);
};

part("play").addEventListener("click", () => play(!playing));
part("back").addEventListener("click", () => step(-1));
part("forward").addEventListener("click", () => step(1));
part("undock").addEventListener("click", () => place.classList.remove("docked"));
part("looks")?.addEventListener("change", refresh);
chooser.addEventListener("change", () => goTo(chooser.value, motions.get(chooser.value).times[0]));
bar.addEventListener("input", () => goTo(null, Number(bar.value)));
for (const link of document.querySelectorAll("[data-t]")) {
  link.addEventListener("click", (event) => {
    if ((event.target.closest("a, summary") ?? link) !== link) return; // a link of its own within a row, as to the teach panel, or a fold
    play(false);
    event.preventDefault();
    event.stopPropagation(); // a link to a moment within a row that leads to its end
    goTo(link.dataset.play, Number(link.dataset.t));
    if (link.closest(".runs")) part("space").scrollIntoView({ block: "nearest" });
    dock(link.getBoundingClientRect().bottom);
    tell();
  });
}
addEventListener("resize", refresh);
addEventListener("click", ({ target }) => target.closest("a[href^='teach.html#']")?.setAttribute("href", `teach.html?eye=${space.azimuth},${space.elevation}${target.closest("a").hash}`), true); // it is seen from the same side there
const choose = (name) => motions.has(name) && goTo(name, motions.get(name).times[0]);
addEventListener("chosen", ({ detail }) => choose(detail));
addEventListener("entry", ({ detail }) => motions.has(detail) && goTo(detail, Infinity)); // of a table, where it leads
/** Shows the moment that the query of an address asks for. */
function answer(query) {
  if (!motions.has(query.get("play")) || !Number.isFinite(Number(query.get("t")))) return false;
  asked = query;
  goTo(query.get("play"), Number(query.get("t")));
  dock();
  tell();
  return true;
}

document.querySelector(".hero .fix a")?.addEventListener("click", (event) => {
  if (!answer(new URLSearchParams(event.currentTarget.search))) return;
  event.preventDefault();
  place.classList.remove("docked");
  place.scrollIntoView({ block: "nearest" });
  play((asked.has("until") || t === start()) && t < playedUntil()); // or else the moment is what is to be seen
});
const row = document.querySelector(".runs [aria-current][data-t]"); // of the page's list, if its address names one
const named = decodeURIComponent(location.hash.slice(1)), entry = named.replace(/^cell-/, "");
if (!answer(asked)) {
  if (named !== row?.dataset.play && motions.has(named)) choose(named);
  else if (entry !== named && motions.has(entry)) goTo(entry, Infinity);
  else goTo(...(named && row ? [row.dataset.play, Number(row.dataset.t)] : data.opened));
}
part("controls").hidden = part("joints").hidden = false;
newMotion();
tell();
dispatchEvent(new Event("player")); // the page has its length now
refresh();
performance.mark("player");
