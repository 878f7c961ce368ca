/**
 * A picture in space: shapes in frames, drawn by three.js; lines; and words in an SVG over the canvas, which keep off the
 * arm and off each other. Where the browser has no WebGL, the picture that came with the page stays.
 */

import { add, column, cross, dot, scaled, subtract, translation } from "er3a/algebra";
import { Orbit } from "er3a/orbit";
import three from "er3a/three";

export const WORLD = translation(0, 0, 0);
const LAMP = [0.9, -1.3, 2.4];
const SHADOWS = 1024; // side of the map of shadows, px
const MAX_PIXELS = 1.6e6; // more can't be painted often enough without a graphics processor
const GRID_STEPS = 8; // lines of the floor on each side of the base
const [PALE, DIMMED] = [0.36, 0.4];
const SMALL = 0.12; // radius of a body that its name would hide, in parts of what is seen
// Lines behind bodies are faint; those of the floor are under all: they don't cross an arm below it.
const LINES = {
  hidden: { order: 1, style: { depthTest: false, transparent: true, opacity: 0.22 } },
  seen: { order: 0, style: {} },
  under: { order: -1, style: { depthWrite: false } },
};
const CREASE = 0.7; // rad between two faces: less is drawn as one that is curved
// Where a word may be, in its widths and heights from its point.
const PLACES = [0, -0.5, 0.5, -1, 1, -1.5, 1.5, -2, 2, -2.5, 2.5].flatMap((i) => [0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6].map((j) => [i, j]));
const NEAR = 3.2; // heights: a word that is not needed is no farther from its point
const NARROW = 30; // letters of the page: a picture of no more is small
const WIDE = 3; // heights that a step sideways counts for, at most
const WORD = 0.85; // height of words, in letters of the page
export const ARM = 0.05; // about half the width of an arm, in parts of its size: words keep off it
const SIDES = 1.2; // a picture that is less wide, of its height, is filled on its sides
const [INSET, CLOSER] = [0.26, 10]; // of the picture's smaller side, a part that is shown so many times larger
const FIELD = 1.9; // distance of the eye, in heights of the picture at the target

const pen = document.createElement("canvas").getContext("2d");
const matrix = (T) => new three.Matrix4().set(...T.flat());

const GEOMETRIES = {
  box: ({ size }) => new three.BoxGeometry(...size),
  sphere: ({ radius }) => new three.SphereGeometry(radius, 40, 24),
  cylinder: ({ radius, length }) => new three.CylinderGeometry(radius, radius, length, 48).rotateX(Math.PI / 2),
  capsule: ({ radius, length }) => new three.CapsuleGeometry(radius, length, 10, 40).rotateX(Math.PI / 2),
  mesh: ({ points, faces }) => three.toCreasedNormals(surface(points, faces), CREASE),
};

/** Triangles as three.js takes them. */
export function surface(points, faces) {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(points.flat(), 3));
  geometry.setIndex(faces.flat());
  return geometry;
}

/** Looks at `target` from `distance` (m), turned by `azimuth` about z and raised by `elevation` (rad). */
export function eyeOf({ azimuth, elevation, distance, target }) {
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  const back = [ca * ce, sa * ce, se];
  const right = [-sa, ca, 0];
  return { position: add(target, scaled(back, distance)), right, up: cross(back, right), back };
}

export class Space extends Orbit {
  scene = new three.Scene();
  strokes = new three.Group();
  camera = new three.PerspectiveCamera();
  materials = new Map();
  fineness = 1; // less where frames have to come faster

  /** Looks at `target` (m), round which there is about `length` to be seen; `draw` has the picture drawn again. */
  constructor(canvas, target, length, draw) {
    super(canvas, target, length, draw);
    this.svg = canvas.parentNode.querySelector(".words");
    const context = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true, stencil: true });
    canvas.parentNode.classList.add(context ? "live" : "bare");
    this.camera.matrixAutoUpdate = false;
    this.scene.add(this.strokes);
    if (!context) return;
    this.renderer = new three.WebGLRenderer({ canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.localClippingEnabled = true;
    this.#light();
  }

  /** Adds shapes (see viewing/drawn.py) that move together; returns what `place` takes. */
  add(shapes) {
    const meshes = shapes.map((shape) => {
      const mesh = new three.Mesh(GEOMETRIES[shape.kind](shape));
      Object.assign(mesh, { shape, local: matrix(shape.T), matrixAutoUpdate: false, receiveShadow: true });
      this.scene.add(mesh);
      return mesh;
    });
    this.place(meshes, [WORLD]);
    return meshes;
  }

  /** Puts shapes into frames at `poses`; bodies named in `colours` are in these; `pale` ones let through what is behind. */
  place(meshes, poses, colours = new Map(), pale = () => false) {
    for (const mesh of meshes) {
      const { shape, local } = mesh;
      mesh.matrix.multiplyMatrices(matrix(poses[Math.min(shape.frame, poses.length - 1)]), local);
      mesh.updateMatrixWorld(true);
      const through = shape.pale || pale(mesh);
      const css = colours.get(shape.kind === "cylinder" ? shape.joint : null) ?? colours.get(shape.name);
      const marked = !shape.pale && Boolean(css); // a floor is not red all over
      mesh.material = this.material(marked ? css : shape.pale ? (shape.own ?? this.page.grid) : shape.colour, through, marked);
      mesh.castShadow = !through;
      mesh.visible = true;
    }
  }

  /** A matt surface of a CSS colour; one that is marked is seen where it coincides with others. */
  material(css, pale = false, marked = false) {
    const key = `${css} ${pale} ${marked}`;
    if (!this.materials.has(key)) {
      const through = pale ? { transparent: true, opacity: pale === true ? PALE : pale, depthWrite: marked } : {};
      const nearer = { polygonOffset: marked, polygonOffsetFactor: -1, polygonOffsetUnits: -4 };
      this.materials.set(key, new three.MeshStandardMaterial({ color: new three.Color(css), roughness: 0.55, ...nearer, ...through }));
    }
    return this.materials.get(key);
  }

  /** A square floor at height `z` around a point, which shadows fall on; one that is `solid` dims what is below it. */
  floor(centre, step, z, solid = false) {
    const half = GRID_STEPS * step;
    const ends = Array.from({ length: 2 * GRID_STEPS + 1 }, (_, i) => (i - GRID_STEPS) * step).flatMap((at) => [
      [at, -half], [at, half], [-half, at], [half, at],
    ]);
    this.segments(ends.flatMap(([x, y]) => [centre[0] + x, centre[1] + y, z]), this.page.grid, 1, ["under"]);
    if (this.ground) return;
    const side = (solid ? 6 : 2) * half;
    this.ground = new three.Mesh(new three.PlaneGeometry(side, side), solid ? this.material(this.page.halo, DIMMED) : new three.ShadowMaterial({ opacity: 0.22, depthWrite: false }));
    this.ground.renderOrder = solid ? 2 : 0;
    this.ground.position.set(centre[0], centre[1], z);
    this.ground.receiveShadow = true;
    this.scene.add(this.ground);
  }

  /** Starts a picture: lines and words of the one before are gone. */
  begin() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    Object.assign(this, { width, height, eye: eyeOf(this), taken: [], words: [], scale: Math.min(width / SIDES, height) * FIELD });
    this.letters = Number.parseFloat(getComputedStyle(this.canvas).fontSize);
    for (const stroke of this.strokes.children) stroke.geometry.dispose();
    this.strokes.clear();
    const { position, right, up, back } = this.eye;
    this.camera.matrix.set(...[0, 1, 2].flatMap((i) => [right[i], up[i], back[i], position[i]]), 0, 0, 0, 1);
    this.camera.updateMatrixWorld(true);
    this.#field(width, height, this.distance);
    this.inset = null;
  }

  /** The camera's field: so many px of the picture, of what is about `distance` (m) off. */
  #field(width, height, distance) {
    const fov = (2 * Math.atan(height / 2 / this.scale) * 180) / Math.PI;
    Object.assign(this.camera, { fov, aspect: width / Math.max(1, height), near: distance / 50, far: distance * 10 });
    this.camera.updateProjectionMatrix();
  }

  /** Shows what is about a point again in a corner, `CLOSER` times as large. */
  closer(point, text) {
    const [x, y, depth] = this.seen(point);
    const side = INSET * Math.min(this.width, this.height);
    const [left, top] = [this.width, this.height].map((end) => end - side - this.letters);
    this.inset = { left, side, depth: depth / CLOSER, position: add(point, scaled(this.eye.back, depth / CLOSER)) };
    this.#svg("path", { d: `M${x},${y}L${left},${top}h${side}v${side}h${-side}v${-side}`, fill: "none", stroke: this.page.muted });
    this.taken.push([left + side / 2, top + side / 2, side, side]);
    this.#svg("text", { x: left + side / 2, y: top + this.letters, fill: this.page.ink, stroke: this.page.halo, "font-size": WORD * this.letters }, `${text} × ${CLOSER}`);
  }

  /** Shows the picture. */
  end() {
    const { renderer, width, height } = this;
    if (!renderer || !width || !height) return;
    const most = Math.sqrt(MAX_PIXELS / (width * height));
    const ratio = this.fineness * Math.min(devicePixelRatio || 1, Math.max(most, 0.5));
    if (this.size !== `${width} ${height} ${ratio}`) {
      this.size = `${width} ${height} ${ratio}`;
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height, false);
    }
    renderer.setViewport(0, 0, width, height);
    renderer.render(this.scene, this.camera);
    if (this.inset) {
      const { left, side, depth, position } = this.inset;
      this.camera.matrix.setPosition(...position);
      this.camera.updateMatrixWorld(true);
      this.#field(side, side, depth);
      renderer.setScissorTest(true);
      for (const part of ["setViewport", "setScissor"]) renderer[part](left, this.letters, side, side);
      renderer.render(this.scene, this.camera);
      renderer.setScissorTest(false);
    }
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.svg.replaceChildren(...this.words);
  }

  /** Place of a point in the picture (CSS px), and its distance along the line of sight. */
  seen(point) {
    const from = subtract(point, this.eye.position);
    const depth = -dot(from, this.eye.back);
    const zoom = this.scale / Math.max(depth, 1e-6);
    return [this.width / 2 + zoom * dot(from, this.eye.right), this.height / 2 - zoom * dot(from, this.eye.up), depth];
  }

  /** Which of the shapes around the arm hide it, at its `poses`, or what is within `radius` (m) of it: these are drawn pale. */
  hiding(meshes, poses, radius = 0) {
    const points = alongArm(poses).flatMap((at) => [-radius, radius].map((far) => add(at, scaled(this.eye.right, far))));
    const rays = points.map((point) => {
      const way = subtract(point, this.eye.position);
      const length = Math.hypot(...way);
      return new three.Raycaster(new three.Vector3(...this.eye.position), new three.Vector3(...scaled(way, 1 / length)), 0, length);
    });
    return new Set(meshes.filter((mesh) => rays.some((ray) => ray.intersectObject(mesh).length)));
  }

  /** A line through points in space, `width` px wide; faint where a body is before it. */
  line(points, css, width = 2) {
    const pairs = points.slice(1).flatMap((point, i) => [...points[i], ...point]);
    this.segments(pairs, css, width, ["hidden", "seen"]);
  }

  /** Pieces of lines, given as coordinates of their ends; `looks`: see `LINES`. */
  segments(pairs, css, width, looks) {
    for (const look of looks) {
      const geometry = new three.LineSegmentsGeometry().setPositions(pairs);
      const line = new three.LineSegments2(geometry, this.#pencil(css, width, look));
      line.renderOrder = LINES[look].order;
      line.frustumCulled = false;
      this.strokes.add(line);
    }
  }

  /** A dot of `radius` px at a point in space, and a ring around it where it is to be found at once. */
  dot(point, css, radius, ring = false) {
    const [cx, cy] = this.seen(point);
    this.#svg("circle", { cx, cy, r: radius, fill: css, stroke: this.page.halo, "stroke-width": 1.5 });
    if (ring) this.taken.push([cx, cy, 8 * radius, 8 * radius]);
    for (const share of ring ? [2.4, 4] : []) this.#svg("circle", { cx, cy, r: share * radius, fill: "none", stroke: css, "stroke-width": 4 / share });
  }

  get small() { return this.width <= NARROW * this.letters; }

  /** Keeps words off what is within `radius` (m) of points in space. */
  keepClear(points, radius) {
    for (const [x, y, depth] of points.map((point) => this.seen(point))) {
      const side = (2 * radius * this.scale) / Math.max(depth, 1e-6);
      this.taken.push([x, y, side, side]);
    }
  }

  /**
   * A word near a point in space, where no earlier word is in its way, nor what is kept clear; a line leads to it from afar.
   * Where no place is free, one that is not `needed` is left out.
   */
  word(text, point, css = this.page.ink, needed = true) {
    const size = WORD * this.letters;
    pen.font = `600 ${size}px system-ui, sans-serif`;
    const [x, y] = this.seen(point);
    const [width, height] = [pen.measureText(text).width + 0.5 * size, 1.25 * size];
    const far = ([i, j]) => Math.hypot(Math.min(WIDE, width / height) * i, j);
    const places = PLACES.filter((place) => needed || far(place) < NEAR).sort((a, b) => far(a) - far(b)).map(([i, j]) => [x + i * width, y + j * height]);
    const seen = ([u, v]) => Math.min(u, this.width - u) > width / 2 + size && Math.min(v, this.height - v) > height / 2;
    const apart = (others) => ([u, v]) => seen([u, v]) && others.every(([a, b, w, h]) => Math.abs(u - a) > (width + w) / 2 || Math.abs(v - b) > (height + h) / 2);
    const gap = ([u, v]) => Math.hypot(Math.max(0, Math.abs(u - x) - width / 2), Math.max(0, Math.abs(v - y) - height / 2));
    const clear = places.find(apart(this.taken)); // or else, in a small picture, on a body beside the word's point rather than far from it
    const free = !needed || !this.small || (clear && gap(clear) < 2 * height) ? clear : (places.filter((place) => gap(place) > height).find(apart(this.taken.filter(([, , , , said]) => said))) ?? clear);
    if (!free && !needed) return;
    const [u, v] = free ?? [x, y];
    this.taken.push([u, v, width, height, text]);
    const edge = [Math.min(u + width / 2, Math.max(u - width / 2, x)), Math.min(v + height / 2, Math.max(v - height / 2, y))];
    if (Math.hypot(edge[0] - x, edge[1] - y) > 0.4 * height) this.#svg("line", { x1: x, y1: y, x2: edge[0], y2: edge[1], stroke: css });
    this.#svg("text", { x: u, y: v, fill: css, stroke: this.page.halo, "font-size": size }, text);
  }

  /** The names of what is around the arm: those of `needed` in a colour of their own, then others as far as there is room. */
  names(meshes, needed = new Set()) {
    const named = meshes.filter(({ shape }) => !shape.pale || needed.has(shape.name)).sort((a, b) => needed.has(b.shape.name) - needed.has(a.shape.name));
    const tops = named.map(({ geometry, matrixWorld }) => {
      const { min, max } = (geometry.boundingBox ?? (geometry.computeBoundingBox(), geometry.boundingBox)).clone().applyMatrix4(matrixWorld);
      const [middle, small] = [scaled(add(min.toArray(), max.toArray()), 0.5), max.distanceTo(min) < 4 * SMALL * this.length];
      if (small) this.keepClear([middle], (max.x - min.x) / 2);
      const corners = small || max.z - min.z > max.x - min.x ? [] : [min.x, max.x].flatMap((x) => [min.y, max.y].map((y) => [x, y, max.z])); // of a wide top, on which others stand
      return corners.filter((at) => (([u, v]) => u > 0 && u < this.width && v < this.height)(this.seen(at))).sort((a, b) => this.seen(b)[1] - this.seen(a)[1])[0] ?? [...middle.slice(0, 2), max.z];
    });
    named.forEach(({ shape: { name, label } }, k) => this.word(label ?? name, tops[k], needed.has(name) ? this.page.touching : this.page.ink, needed.has(name) || named.length < 10));
  }

  #light() {
    const { scene, target, length } = this;
    const lamp = new three.DirectionalLight("#ffffff", 2.2);
    lamp.position.set(...add(target, scaled(LAMP, length)));
    lamp.target.position.set(...target);
    lamp.castShadow = true;
    lamp.shadow.mapSize.set(SHADOWS, SHADOWS);
    Object.assign(lamp.shadow, { radius: 5, normalBias: 0.004 * length });
    Object.assign(lamp.shadow.camera, { left: -1.8 * length, right: 1.8 * length, top: 1.8 * length, bottom: -1.8 * length, near: 0.1 * length, far: 6 * length });
    scene.add(new three.HemisphereLight("#ffffff", "#aab4c0", 2), lamp, lamp.target);
  }

  #pencil(css, width, look) {
    const key = `line ${css} ${width} ${look}`;
    if (!this.materials.has(key)) {
      this.materials.set(key, new three.LineMaterial({ color: new three.Color(css), linewidth: width, ...LINES[look].style }));
    }
    return this.materials.get(key);
  }

  #svg(tag, attributes, text = "") {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.textContent = text;
    this.words.push(made);
  }
}

/** Points from an arm's base to its tool. */
export function alongArm(poses) {
  const origins = poses.map((T) => column(T, 3));
  const between = (a, b) => [0.25, 0.5, 0.75, 1].map((part) => add(scaled(a, 1 - part), scaled(b, part)));
  return [origins[0], ...origins.slice(1).flatMap((origin, k) => between(origins[k], origin))];
}

/** The shapes of an arm by its look: `visual`, `checked`, or `both`, in which those checked are pale. */
export class Arm {
  constructor(space, { looks }, carried = []) {
    const { checked, visual = checked } = looks;
    this.space = space;
    this.looks = { visual: space.add([...visual, ...carried]), checked: visual === checked ? null : space.add([...checked, ...carried]) };
  }

  /** Shows the arm at poses of its frames; bodies named in `colours` are in these. */
  show(poses, colours, look = "visual", pale = false) {
    const { visual, checked } = this.looks;
    const shown = { visual: [visual], checked: [checked ?? visual], both: [visual, checked ?? visual] }[look];
    this.hide();
    shown.forEach((meshes, k) => this.space.place(meshes, poses, colours, () => pale || k > 0));
  }

  hide() {
    for (const mesh of Object.values(this.looks).flatMap((meshes) => meshes ?? [])) mesh.visible = false;
  }
}
