/** A figure in space: layers of points and surfaces among solids. A reader turns it, cuts it open, and leaves layers out. */

import { add, column, dot, scaled, subtract } from "er3a/algebra";
import { ARM, Space, alongArm, eyeOf, surface } from "er3a/space";
import three from "er3a/three";

const STEPS = 65535; // that the box is divided into
const FLOOR = 14; // lines of the floor, along what is seen
const SIDES = [0.9, 0.5, 1.3, -0.9, -0.5, -1.3, 0.9]; // rad, from which a tray is looked at: the first where nothing hides the arm
const SPARSE = 20; // one of so many points of a void keeps words off it
const AWAY = 0.8; // of its opacity what is reachable keeps before a tray

const place = document.getElementById("turning");
const data = JSON.parse(document.getElementById("turning-figure").textContent);
const [canvas, key, knife] = ["canvas", ".key", ".cut"].map((name) => place.querySelector(name));
const [low, high] = data.box.map((corner) => scaled(corner, 1e-3)); // m
const size = subtract(high, low);
const middle = scaled(add(low, high), 0.5);
let awaited = 0; // the next frame

const space = new Space(canvas, middle, data.filled * Math.hypot(...size), refresh);
const plane = new three.Plane(new three.Vector3(0, 1, 0));
const solids = data.solids.map((each) => ({ ...each, parts: space.add(each.shapes) }));
const layers = data.layers.map(made);
const whole = space.distance;

const all = [...layers, ...solids];
const unlisted = all.filter(({ address }) => !address);
const asked = () => all.find(({ address }) => address && address === location.hash.slice(1));
let shown = asked() ?? all.find(({ address }) => address === "tray-1"); // the row that the list marks

/** The highest point of a layer, or the top of solids. */
function placeOf({ points, shapes }) {
  return points ? points.reduce((a, b) => (b[2] > a[2] ? b : a)) : add(column(shapes[0].T, 3), [0, 0, shapes[0].size[2] / 2]);
}

/** Turns the picture until what is chosen is before the rest: a tray from its side, with the arm in it and nothing before the arm. */
function face(chosen) {
  shown = chosen;
  const at = placeOf(shown);
  const [[x, y], near] = [subtract(at, middle), Boolean(shown.shapes)];
  const about = Math.hypot(x, y) < 0.1 * size[0]; // axis 1
  Object.assign(space, { elevation: 0.35, distance: whole, target: near ? scaled(add(at, middle), 0.5) : middle });
  for (const turn of near ? SIDES : [0.35]) {
    space.azimuth = about ? data.azimuth : Math.atan2(y, x) + turn;
    space.begin();
    if (!near || !solids.slice(1).some(({ address, parts }) => !address && space.hiding(parts, shown.reached, ARM * size[0]).size)) break;
  }
  refresh();
}

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function refresh() {
  cancelAnimationFrame(awaited);
  awaited = requestAnimationFrame(draw);
}

/** A layer with its points (m) and what three.js draws of it. */
function made(layer) {
  const steps = new Uint16Array(bytes(layer.points).buffer);
  const points = [];
  for (let i = 0; i < steps.length; i += 3) points.push([0, 1, 2].map((k) => low[k] + (size[k] * steps[i + k]) / STEPS));
  const parts = (layer.faces ? body : cloud)(layer, points);
  for (const part of parts) space.scene.add(part);
  return { ...layer, points, parts };
}

function cloud({ colour, cut }, points) {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(points.flat(), 3));
  return [new three.Points(geometry, new three.PointsMaterial({ color: colour, size: 2, sizeAttenuation: false, clippingPlanes: cut ? [plane] : [] }))];
}

/** A closed surface; where it is cut, its sides count up and down in the stencil, and a sheet fills what is between them. */
function body({ faces, colour, cut }, points) {
  const corners = new Uint32Array(bytes(faces).buffer);
  const geometry = surface(points, [...corners]);
  geometry.computeVertexNormals();
  const look = { color: colour, roughness: 0.7, transparent: true, depthWrite: false, side: three.DoubleSide };
  if (!cut) return [new three.Mesh(geometry, new three.MeshStandardMaterial({ ...look, opacity: 0.85, depthWrite: true }))];
  const clippingPlanes = [plane];
  const sides = [[three.BackSide, three.IncrementWrapStencilOp], [three.FrontSide, three.DecrementWrapStencilOp]].map(([side, stencilZPass]) => {
    const counted = { side, clippingPlanes, colorWrite: false, depthWrite: false, depthTest: false, stencilWrite: true, stencilZPass };
    return new three.Mesh(geometry, new three.MeshStandardMaterial(counted));
  });
  const filled = { stencilWrite: true, stencilFunc: three.NotEqualStencilFunc, stencilZPass: three.ReplaceStencilOp };
  const sheet = new three.Mesh(new three.PlaneGeometry(2 * Math.max(...size), 2 * Math.max(...size)), new three.MeshStandardMaterial({ ...look, ...filled, opacity: 0.5, emissive: colour, emissiveIntensity: 0.35 }));
  sheet.geometry.rotateX(Math.PI / 2);
  sheet.onBeforeRender = () => sheet.position.set(middle[0], -plane.constant, middle[2]);
  const shell = new three.Mesh(geometry, new three.MeshStandardMaterial({ ...look, clippingPlanes, opacity: 0.22 }));
  [...sides, shell, sheet].forEach((part, k) => (part.renderOrder = k + 1));
  return [...sides, shell, sheet];
}

function draw() {
  plane.constant = -low[1] - Number(knife.value) * size[1];
  space.begin();
  space.floor(middle, size[0] / FLOOR, data.floor);
  const near = shown?.shapes;
  const isSeen = (each) => each.check?.checked ?? (!each.shapes || each === shown);
  const arm = near && shown.reached.length ? shown.reached : solids[0].poses;
  for (const each of all) for (const part of each.parts) part.visible = isSeen(each);
  for (const { material } of layers.flatMap(({ parts }) => parts)) material.opacity = (material.userData.opacity ??= material.opacity) * (near ? AWAY : 1);
  for (const each of solids.filter(isSeen)) {
    const hiding = each === solids[0] || each === shown ? new Set() : space.hiding(each.parts, arm);
    space.place(each.parts, each === solids[0] ? arm : each.poses, new Map(), (part) => hiding.has(part));
  }
  const named = all.filter((each) => each.address && isSeen(each));
  space.keepClear(alongArm(arm), ARM * size[0]);
  for (const each of named) space.keepClear(each.points?.filter((_, i) => i % SPARSE === 0) ?? [placeOf(each)], each.points ? 0 : ARM * size[0]);
  for (const [from, to, text] of (near ? shown : solids[0]).ways) {
    space.line([from, to], space.page.accent, 3);
    space.keepClear([...Array(21).keys()].map((i) => add(scaled(from, 1 - i / 20), scaled(to, i / 20))), 0);
    space.word(text, add(scaled(from, 0.4), scaled(to, 0.6)), space.page.accent, Boolean(near) || !space.small);
  }
  for (const each of named) space.word(each.name, each.points?.reduce((a, b) => (dot(eyeOf(space).back, subtract(b, a)) > 0 ? b : a)) ?? placeOf(each), space.page[each.points ? "hole" : "accent"]);
  for (const each of solids.slice(1).filter((each) => !each.address && isSeen(each) && !space.small)) space.names(each.parts);
  space.end();
  place.toggleAttribute("data-drawn", true);
}

// What no list of the page names, each with its colour and a box to leave it out.
for (const each of unlisted) {
  const [label, check, swatch] = ["label", "input", "i"].map((tag) => document.createElement(tag));
  each.check = Object.assign(check, { type: "checkbox", checked: true, onchange: refresh });
  swatch.style.background = each.colour;
  label.append(check, swatch, ` ${each.name}`);
  key.append(label);
}

knife.addEventListener("input", refresh);
addEventListener("hashchange", () => asked() && face(asked()));
shown ? face(shown) : refresh();
performance.mark("turning");
