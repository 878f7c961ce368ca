/**
 * A figure in space: layers of points, lines and surfaces in a box with ticks in mm, painted from the farthest part to
 * the nearest. A reader turns it, chooses the group of layers that is seen, and leaves layers out.
 */

import { add, cross, dot, scaled, subtract, unit } from "er3a/algebra";
import { Orbit } from "er3a/orbit";
import { eyeOf, Picture } from "er3a/scene";

const STEPS = 65535; // that the box is divided into
const LAMP = unit([0.35, -0.55, 0.9]);
const AMBIENT = 0.6;
const OPACITY = 0.6; // of surfaces
const TICKS = 6; // at most, along an edge
const PIECE = 40; // mm: longer parts of lines are cut, so that they sort well by distance

const place = document.getElementById("turning");
const data = JSON.parse(document.getElementById("turning-figure").textContent);
const [canvas, chooser, key] = ["canvas", ".group", ".key"].map((name) => place.querySelector(name));
const [low, high] = data.box;
const size = subtract(high, low);
const groups = new Map(data.groups.map(({ name, layers }) => [name, layers.map(unpacked)]));
const picture = new Picture(canvas);
const left = new Set(); // names of layers that are not shown
let awaited = false;

const middle = scaled(add(low, high), 0.5);
const orbit = new Orbit(canvas, middle, 0.55 * Math.hypot(...size), refresh);
chooser.value = data.first ?? chooser.value;
orbit.azimuth = data.azimuth;

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function unpacked(layer) {
  const steps = new Uint16Array(bytes(layer.points).buffer);
  const points = [];
  for (let i = 0; i < steps.length; i += 3) points.push([0, 1, 2].map((k) => low[k] + (size[k] * steps[i + k]) / STEPS));
  const shades = layer.shades ? bytes(layer.shades) : null;
  const made = { ...layer, points, colourOf: (i) => (shades ? data.palette[shades[i]] : layer.colour || null) };
  return layer.kind === "surface" ? { ...made, parts: triangles(made) } : { ...made, parts: layer.kind === "line" ? pieces(made) : [] };
}

function triangles({ points, faces, colour }) {
  const corners = new Uint32Array(bytes(faces).buffer);
  const parts = [];
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = [points[corners[i]], points[corners[i + 1]], points[corners[i + 2]]];
    const normal = cross(subtract(b, a), subtract(c, a));
    if (dot(normal, normal) === 0) continue;
    const light = AMBIENT + (1 - AMBIENT) * Math.max(0, dot(unit(normal), LAMP));
    parts.push({ points: [a, b, c], normal, fill: shaded(colour, light) });
  }
  return parts;
}

function pieces({ points, starts, colourOf, width }) {
  const parts = [];
  for (let i = 1; i < points.length; i++) {
    if (starts.includes(i)) continue;
    const way = subtract(points[i], points[i - 1]);
    const count = Math.max(1, Math.ceil(Math.hypot(...way) / PIECE));
    const at = (n) => add(points[i - 1], scaled(way, n / count));
    for (let n = 1; n <= count; n++) parts.push({ points: [at(n - 1), at(n)], stroke: colourOf(i - 1), width });
  }
  return parts;
}

function shaded(colour, light) {
  const value = Number.parseInt(colour.slice(1), 16);
  return `rgb(${[16, 8, 0].map((shift) => Math.round(((value >> shift) & 255) * light)).join(",")})`;
}

function refresh() {
  if (!awaited) requestAnimationFrame(draw);
  awaited = true;
}

function draw() {
  awaited = false;
  picture.fit();
  const eye = eyeOf(orbit);
  picture.begin(eye);
  const { context, ratio } = picture;
  box(eye);
  const painted = [];
  for (const layer of groups.get(chooser.value)) {
    if (left.has(layer.name)) continue;
    if (layer.kind === "points") layer.points.forEach((point, i) => dotAt(painted, layer, point, i));
    for (const part of layer.parts) {
      if (part.normal && dot(part.normal, subtract(eye.position, part.points[0])) <= 0) continue;
      const corners = part.points.map((point) => picture.seen(point));
      painted.push({ part, corners, depth: corners.reduce((sum, corner) => sum + corner[2], 0) / corners.length });
    }
  }
  painted.sort((a, b) => b.depth - a.depth);
  for (const { part, corners, x, y, side, colour } of painted) {
    if (!part) {
      context.fillStyle = colour;
      context.fillRect(x, y, side, side);
      continue;
    }
    context.beginPath();
    corners.forEach(([u, v], i) => (i ? context.lineTo(u, v) : context.moveTo(u, v)));
    if (part.fill) {
      context.globalAlpha = OPACITY;
      context.fillStyle = part.fill;
      context.fill();
      context.globalAlpha = 1;
    } else {
      context.strokeStyle = part.stroke ?? orbit.page.ink;
      context.lineWidth = part.width * ratio;
      context.stroke();
    }
  }
  place.dataset.drawn = chooser.value;
}

function dotAt(painted, { width, colourOf }, point, i) {
  const [x, y, depth] = picture.seen(point);
  const side = width * picture.ratio;
  painted.push({ x: x - side / 2, y: y - side / 2, side, depth, colour: colourOf(i) ?? orbit.page.ink });
}

/** The three far sides of the box, with lines at round numbers of mm, and the numbers along three edges. */
function box(eye) {
  const back = low.map((_, k) => (eye.position[k] > middle[k] ? low[k] : high[k]));
  const front = low.map((_, k) => low[k] + high[k] - back[k]);
  const { ink, grid, halo } = orbit.page;
  const ticks = low.map((_, k) => ticksOf(low[k], high[k]));
  const at = (k, value, others) => others.map((other, n) => (n === k ? value : other));
  for (const k of [0, 1, 2]) {
    for (const value of [low[k], ...ticks[k], high[k]]) {
      for (const other of [0, 1, 2].filter((n) => n !== k)) {
        const ends = [low, high].map((end) => at(k, value, back.map((side, n) => (n === other ? end[n] : side))));
        picture.line(ends, grid, 1);
      }
    }
  }
  const edges = [at(1, front[1], back), at(0, front[0], back), at(0, front[0], back)];
  edges.forEach((edge, k) => {
    const away = scaled(subtract(edge, at(k, edge[k], middle)), 0.06);
    for (const value of ticks[k]) picture.word(String(value), add(at(k, value, edge), at(k, 0, away)), ink, halo, false);
    picture.word(`${"xyz"[k]} (mm)`, add(at(k, middle[k], edge), at(k, 0, scaled(away, 3))), ink, halo);
  });
}

function ticksOf(from, to) {
  const rough = (to - from) / TICKS;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const ticks = [];
  for (let value = Math.ceil(from / step) * step; value <= to; value += step) ticks.push(Math.round(value));
  return ticks;
}

/** The names of the layers that are seen, each with its colour and a box to leave it out. */
function list() {
  const entries = groups.get(chooser.value).map(({ name, colourOf }) => {
    const [label, check, swatch] = ["label", "input", "i"].map((tag) => document.createElement(tag));
    Object.assign(check, { type: "checkbox", checked: !left.has(name) });
    check.addEventListener("change", () => {
      if (check.checked) left.delete(name);
      else left.add(name);
      refresh();
    });
    swatch.style.background = colourOf(0) ?? "var(--ink)";
    label.append(check, swatch, ` ${name}`);
    return label;
  });
  key.replaceChildren(...entries);
}

const choose = (name) => {
  if (!groups.has(name)) return;
  chooser.value = name;
  list();
  refresh();
};
chooser.addEventListener("change", () => choose(chooser.value));
addEventListener("chosen", ({ detail }) => choose(detail));
const colours = place.querySelector(".colours");
if (colours) colours.style.background = `linear-gradient(to right, ${data.palette.join(", ")})`;
choose(chooser.value);
performance.mark("turning");
