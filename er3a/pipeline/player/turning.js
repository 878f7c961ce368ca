/**
 * A figure in space: layers of points and surfaces among solids, over a floor. A reader turns it, cuts it open, and leaves
 * layers out.
 */

import { add, column, scaled, subtract } from "er3a/algebra";
import { ARM, Space, alongArm, surface } from "er3a/space";
import three from "er3a/three";

const STEPS = 65535; // that the box is divided into
const FLOOR = 14; // lines of the floor, along what is seen
const THROUGH = { transparent: true, depthWrite: false, side: three.DoubleSide };

const place = document.getElementById("turning");
const data = JSON.parse(document.getElementById("turning-figure").textContent);
const [canvas, key, knife] = ["canvas", ".key", ".cut"].map((name) => place.querySelector(name));
const [low, high] = data.box.map((corner) => scaled(corner, 1e-3)); // m
const size = subtract(high, low);
const middle = scaled(add(low, high), 0.5);
const left = new Set(); // names of what is not shown
let awaited = false;

const space = new Space(canvas, middle, data.filled * Math.hypot(...size), refresh);
const plane = new three.Plane(new three.Vector3(0, 1, 0));
const solids = data.solids.map((each) => ({ ...each, parts: space.add(each.shapes) }));
const layers = data.layers.map(made);
const whole = space.distance;
Object.assign(space, { azimuth: data.azimuth, elevation: data.elevation });

const all = [...layers, ...solids];
const named = (name) => all.find(({ address }) => address && address === name);
const chosen = () => named(location.hash.slice(1)) ?? named("tray-1");

/** The middle of a layer, or the top of solids. */
function placeOf({ points, shapes }) {
  return points ? scaled(points.reduce(add), 1 / points.length) : add(column(shapes[0].T, 3), [0, 0, shapes[0].size[2] / 2]);
}

/** Turns the picture until what the address names is before the rest; all stays in sight. */
function face() {
  const [x, y] = subtract(placeOf(chosen()), middle);
  Object.assign(space, { azimuth: Math.hypot(x, y) < 0.1 * size[0] ? data.azimuth : Math.atan2(y, x) + 0.35, distance: whole, elevation: 0.35 });
  refresh();
}

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function refresh() {
  if (!awaited) requestAnimationFrame(draw);
  awaited = true;
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
  const look = { color: colour, size: 2, sizeAttenuation: false, clippingPlanes: cut ? [plane] : [] };
  return [new three.Points(geometry, new three.PointsMaterial(look))];
}

/** A closed surface; where it is cut, its sides count up and down in the stencil, and a sheet fills what is between them. */
function body({ faces, colour, cut }, points) {
  const corners = new Uint32Array(bytes(faces).buffer);
  const geometry = surface(points, [...corners]);
  geometry.computeVertexNormals();
  const look = { color: colour, roughness: 0.7, ...THROUGH };
  if (!cut) return [new three.Mesh(geometry, new three.MeshStandardMaterial({ ...look, opacity: 0.85, depthWrite: true }))];
  const clippingPlanes = [plane];
  const sides = [[three.BackSide, three.IncrementWrapStencilOp], [three.FrontSide, three.DecrementWrapStencilOp]].map(([side, stencilZPass]) => {
    const counted = { side, clippingPlanes, colorWrite: false, depthWrite: false, depthTest: false, stencilWrite: true, stencilZPass };
    return new three.Mesh(geometry, new three.MeshStandardMaterial(counted));
  });
  const filled = { stencilWrite: true, stencilFunc: three.NotEqualStencilFunc, stencilZPass: three.ReplaceStencilOp };
  const sheet = new three.Mesh(new three.PlaneGeometry(2 * Math.max(...size), 2 * Math.max(...size)), new three.MeshStandardMaterial({ ...look, ...filled, opacity: 0.4 }));
  sheet.geometry.rotateX(Math.PI / 2);
  sheet.onBeforeRender = () => sheet.position.set(middle[0], -plane.constant, middle[2]);
  const shell = new three.Mesh(geometry, new three.MeshStandardMaterial({ ...look, clippingPlanes, opacity: 0.3 }));
  [...sides, shell, sheet].forEach((part, k) => (part.renderOrder = k + 1));
  return [...sides, shell, sheet];
}

function draw() {
  awaited = false;
  plane.constant = -low[1] - Number(knife.value) * size[1];
  space.begin();
  space.floor(middle, size[0] / FLOOR, data.floor);
  const shown = chosen();
  for (const { name, parts } of all) for (const part of parts) part.visible = !left.has(name);
  for (const each of solids.filter(({ name }) => !left.has(name))) {
    const hiding = each.poses.length === 1 ? space.hiding(each.parts, solids[0].poses) : new Set();
    space.place(each.parts, each.poses, new Map(), (part) => each !== shown && (each.address !== "" || hiding.has(part)));
  }
  if (shown && !left.has(shown.name)) {
    space.keepClear([...alongArm(solids[0].poses), ...(shown.points ?? [placeOf(shown)])], ARM * size[0]);
    space.word(shown.name, placeOf(shown), space.page.accent);
  }
  space.end();
  place.toggleAttribute("data-drawn", true);
}

// The names of what is seen, each with its colour and a box to leave it out.
for (const { name, colour } of all) {
  const [label, check, swatch] = ["label", "input", "i"].map((tag) => document.createElement(tag));
  Object.assign(check, { type: "checkbox", checked: !left.has(name) });
  check.addEventListener("change", () => {
    if (check.checked) left.delete(name);
    else left.add(name);
    refresh();
  });
  swatch.style.background = colour;
  label.append(check, swatch, ` ${name}`);
  key.append(label);
}

knife.addEventListener("input", refresh);
addEventListener("hashchange", () => named(location.hash.slice(1)) && face());
refresh();
performance.mark("turning");
