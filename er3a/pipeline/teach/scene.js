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
// Where a word may stand, in its widths and heights from its point: there, beside, at a corner, farther off.
const PLACES = [
  [0, 0], [0, -1], [1, 0], [-1, 0], [0, 1], [1, -1], [-1, -1], [1, 1], [-1, 1], [0, -2], [0, 2], [2, 0], [-2, 0],
];
const WORD = 0.82; // height of words, in letters of the page
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
    this.context.strokeStyle = colour;
    this.context.lineWidth = width * this.ratio;
    this.context.beginPath();
    this.#trace(points);
    this.context.stroke();
  }

  /** A word beside a point in space, where no earlier word stands in its way. */
  word(text, point, colour, halo) {
    const { context, ratio } = this;
    const size = WORD * this.letters * ratio;
    context.font = `600 ${size}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const [x, y] = this.seen(point);
    const [width, height] = [context.measureText(text).width + 0.3 * size, 1.2 * size];
    const places = PLACES.map(([i, j]) => [x + i * width, y + j * height]);
    const free = ([u, v]) => this.taken.every(([a, b, w]) => Math.abs(u - a) > (width + w) / 2 || Math.abs(v - b) > height);
    const [u, v] = places.find(free) ?? [x, y];
    this.taken.push([u, v, width]);
    context.lineWidth = 4 * ratio;
    context.strokeStyle = halo;
    context.strokeText(text, u, v);
    context.fillStyle = colour;
    context.fillText(text, u, v);
  }

  /** The names of solids that stand around the arm, each at the middle of its points. */
  names(solids, colour, halo) {
    for (const { name, points } of solids) {
      const sum = points.reduce((all, point) => all.map((value, i) => value + point[i]), [0, 0, 0]);
      if (points.length) this.word(name, sum.map((value) => value / points.length), colour, halo);
    }
  }

  #trace(points) {
    this.#join(points.map((point) => this.seen(point)));
  }

  #join(flat) {
    flat.forEach(([x, y], i) => (i ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }
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
