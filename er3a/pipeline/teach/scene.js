/**
 * A picture of solids on a plain 2-D canvas, without a graphics processor: faces that look towards the eye are shaded by
 * one lamp and painted from the farthest to the nearest.
 */

import { add, column, cross, dot, moved, scaled, subtract, translation, unit } from "er3a/algebra";

const WORLD = translation(0, 0, 0);
const LAMP = unit([0.35, -0.55, 0.9]);
const AMBIENT = 0.55;
const MAX_PIXELS = 1.6e6; // more can't be painted often enough without a graphics processor
const GRID_STEPS = 6; // lines of the floor on each side of the base
const GHOST = 0.3;
const WIDE = 3; // a word, in its heights, about
// Where a word may stand, in its widths and heights from its point, the nearest place first.
const PLACES = [-1.5, -1, -0.5, 0, 0.5, 1, 1.5]
  .flatMap((i) => [-6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6].map((j) => [i, j]))
  .sort((a, b) => Math.hypot(WIDE * a[0], a[1]) - Math.hypot(WIDE * b[0], b[1]));
const NEAR = 3.2; // heights: a word that is not needed stands no farther from its point
const WORD = 0.82; // height of words, in letters of the page
export const ARM = 0.045; // about half the width of an arm, in parts of its size: words keep off it
const FIELD = 1.9; // distance of the eye, in heights of the picture at the target

/** Looks at `target` from `distance` (m), turned by `azimuth` about z and raised by `elevation` (rad). */
export function eyeOf({ azimuth, elevation, distance, target }) {
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  const back = [ca * ce, sa * ce, se];
  const right = [-sa, ca, 0];
  return { position: add(target, scaled(back, distance)), right, up: cross(back, right), back };
}

/** Draws on a canvas; colours are CSS colours, those of faces `#rrggbb`. */
export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  /** Fits the canvas to its place on the page. */
  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    this.letters = Number.parseFloat(getComputedStyle(this.canvas).fontSize);
    const most = Math.sqrt(MAX_PIXELS / Math.max(1, clientWidth * clientHeight));
    this.ratio = Math.min(window.devicePixelRatio || 1, Math.max(most, 0.5));
    const [width, height] = [clientWidth, clientHeight].map((length) => Math.max(1, Math.round(length * this.ratio)));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
  }

  /** Starts a picture as seen by `eye`. */
  begin(eye) {
    this.eye = eye;
    this.taken = [];
    this.scale = Math.min(this.canvas.width, this.canvas.height) * FIELD;
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    Object.assign(this.context, { lineJoin: "round", lineCap: "round" });
  }

  /** Canvas coordinates of a point, and its distance along the line of sight. */
  seen(point) {
    const from = subtract(point, this.eye.position);
    const depth = -dot(from, this.eye.back);
    const zoom = this.scale / Math.max(depth, 1e-6);
    const { width, height } = this.canvas;
    return [width / 2 + zoom * dot(from, this.eye.right), height / 2 - zoom * dot(from, this.eye.up), depth];
  }

  /** A square floor at height `z` around a point. */
  floor(centre, step, z, colour) {
    const half = GRID_STEPS * step;
    this.context.lineWidth = this.ratio;
    this.context.strokeStyle = colour;
    this.context.beginPath();
    for (let i = -GRID_STEPS; i <= GRID_STEPS; i++) {
      this.#trace([[centre[0] + i * step, centre[1] - half, z], [centre[0] + i * step, centre[1] + half, z]]);
      this.#trace([[centre[0] - half, centre[1] + i * step, z], [centre[0] + half, centre[1] + i * step, z]]);
    }
    this.context.stroke();
  }

  /** The shadow of solids that stand at `poses`, straight below them on the floor at height `z`. */
  shadow(solids, poses, z, colour) {
    this.context.fillStyle = colour;
    this.context.beginPath();
    for (const solid of solids) {
      const points = solid.points.map((point) => moved(poses[solid.frame], point));
      for (const face of solid.faces) {
        if (normalOf(points, face)[2] > 0) this.#trace(face.corners.map((i) => [points[i][0], points[i][1], z]));
      }
    }
    this.context.fill();
  }

  /**
   * What stands around the arm as groups of `solids`: what would hide one of the arm's `poses`, or the middle between two,
   * lets through what is behind.
   */
  around(solids, poses) {
    const origins = poses.map((T) => column(T, 3));
    const points = [...origins, ...origins.slice(1).map((origin, k) => scaled(add(origin, origins[k]), 0.5))].map((point) => this.seen(point));
    const hides = ({ points: corners, faces }) => {
      const flat = corners.map((point) => this.seen(point));
      return faces.some((face) => {
        const outline = face.corners.map((i) => flat[i]);
        return points.some((point) => point[2] > outline[0][2] && inside(point, outline));
      });
    };
    const hiding = new Set(solids.filter(hides));
    const [pale, full] = [true, false].map((ghost) => solids.filter((solid) => hiding.has(solid) === ghost));
    return [{ solids: full, poses: [WORLD], ghost: false }, { solids: pale, poses: [WORLD], ghost: true }];
  }

  /** Solids at their poses; each group is `{solids, poses, ghost}`, a ghost is pale and lets through what is behind. */
  solids(groups) {
    const painted = [];
    for (const { solids, poses, ghost } of groups) {
      for (const solid of solids) {
        const points = solid.points.map((point) => moved(poses[solid.frame], point));
        const flat = points.map((point) => this.seen(point));
        for (const face of solid.faces) {
          const normal = normalOf(points, face);
          if (dot(normal, subtract(this.eye.position, points[face.corners[0]])) <= 0) continue;
          const light = AMBIENT + (1 - AMBIENT) * Math.max(0, dot(unit(normal), LAMP));
          const corners = face.corners.map((i) => flat[i]);
          const depth = corners.reduce((sum, corner) => sum + corner[2], 0) / corners.length - solid.before;
          painted.push({ corners, depth, ghost, fill: shaded(face.colour, light) });
        }
      }
    }
    painted.sort((a, b) => b.depth - a.depth);
    const { context } = this;
    context.lineWidth = 0.7 * this.ratio;
    for (const { corners, fill, ghost } of painted) {
      context.globalAlpha = ghost ? GHOST : 1;
      context.fillStyle = fill;
      context.strokeStyle = fill;
      context.beginPath();
      this.#join(corners);
      context.closePath();
      context.fill();
      if (!ghost) context.stroke(); // closes the hair lines between neighbours
    }
    context.globalAlpha = 1;
  }

  /** A line through points in space. */
  line(points, colour, width = 2) {
    this.#stroke(points.map((point) => this.seen(point)), colour, width);
  }

  /** Keeps words off what is within `radius` (m) of points in space. */
  keepClear(points, radius) {
    for (const [x, y, depth] of points.map((point) => this.seen(point))) {
      const side = (2 * radius * this.scale) / Math.max(depth, 1e-6);
      this.taken.push([x, y, side, side]);
    }
  }

  /**
   * A word beside a point in space, where no earlier word stands in its way, nor what is kept clear; a line leads to it
   * from afar. Where no place is free, one that is not `needed` is left out.
   */
  word(text, point, colour, halo, needed = true) {
    const { context, ratio, canvas } = this;
    const size = WORD * this.letters * ratio;
    context.font = `600 ${size}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const [x, y] = this.seen(point);
    const [width, height] = [context.measureText(text).width + 0.3 * size, 1.2 * size];
    const places = PLACES.filter(([i, j]) => needed || Math.hypot(WIDE * i, j) < NEAR).map(([i, j]) => [x + i * width, y + j * height]);
    const seen = ([u, v]) => Math.min(u, canvas.width - u) > width / 2 && Math.min(v, canvas.height - v) > height / 2;
    const apart = ([u, v]) => this.taken.every(([a, b, w, h]) => Math.abs(u - a) > (width + w) / 2 || Math.abs(v - b) > (height + h) / 2);
    const free = places.find((place) => seen(place) && apart(place));
    if (!free && !needed) return;
    const [u, v] = free ?? [x, y];
    this.taken.push([u, v, width, height]);
    const edge = [Math.min(u + width / 2, Math.max(u - width / 2, x)), Math.min(v + height / 2, Math.max(v - height / 2, y))];
    if (Math.hypot(edge[0] - x, edge[1] - y) > height) this.#stroke([[x, y], edge], colour, 1);
    context.lineWidth = 4 * ratio;
    context.strokeStyle = halo;
    context.strokeText(text, u, v);
    context.fillStyle = colour;
    context.fillText(text, u, v);
  }

  /**
   * The names of solids that stand around the arm, each at the middle of its points: those of `needed`, in a colour of
   * their own, then others as far as there is room.
   */
  names(solids, colour, halo, needed = new Set(), marked = colour) {
    const named = solids.filter(({ points }) => points.length).sort((a, b) => needed.has(b.name) - needed.has(a.name));
    for (const { name, points } of named) {
      const sum = points.reduce((all, point) => all.map((value, i) => value + point[i]), [0, 0, 0]);
      const asked = needed.has(name);
      this.word(name, sum.map((value) => value / points.length), asked ? marked : colour, halo, asked);
    }
  }

  #stroke(flat, colour, width) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = width * this.ratio;
    this.context.beginPath();
    this.#join(flat);
    this.context.stroke();
  }

  #trace(points) {
    this.#join(points.map((point) => this.seen(point)));
  }

  #join(flat) {
    flat.forEach(([x, y], i) => (i ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }
}

/** Points from an arm's base to its tool. */
export function alongArm(poses) {
  const origins = poses.map((T) => column(T, 3));
  const between = (a, b) => [0.25, 0.5, 0.75, 1].map((part) => add(scaled(a, 1 - part), scaled(b, part)));
  return [origins[0], ...origins.slice(1).flatMap((origin, k) => between(origins[k], origin))];
}

/** Whether a point of the canvas is inside a convex outline, seen from either side. */
function inside([x, y], outline) {
  const sides = outline.map(([a, b], i) => {
    const [c, d] = outline[(i + 1) % outline.length];
    return (c - a) * (y - b) - (d - b) * (x - a);
  });
  return sides.every((side) => side >= 0) || sides.every((side) => side <= 0);
}

/** A normal of a face, not of unit length, pointing outwards. */
function normalOf(points, { corners: [a, b, c] }) {
  return cross(subtract(points[b], points[a]), subtract(points[c], points[b]));
}

/** A `#rrggbb` colour in a light of 0..1. */
function shaded(colour, light) {
  const value = Number.parseInt(colour.slice(1), 16);
  return `rgb(${[16, 8, 0].map((shift) => Math.round(((value >> shift) & 255) * light)).join(",")})`;
}
