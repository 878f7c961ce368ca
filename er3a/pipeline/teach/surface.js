/**
 * Surfaces of triangles: a tree of boxes around them, and how far a body is from one, as er3a/collision/triangles.py has it.
 *
 * A surface is `{points, faces, shells, probes}`, m, in its link's frame: `faces` are rows of `points`, `shells` the number
 * of the closed shell of each face (0 for one that is not closed), `probes` a point of each shell that no other one holds.
 * What does not cross a surface, but has a point of one of its shells inside a closed one, is inside as a whole.
 */

import { IDENTITY, add, column, dot, moved, multiply, norm, scaled, subtract, turnedBack } from "er3a/algebra";
import { bodyDistance } from "er3a/distance";

const TOUCHING = 1e-9; // m; what is nearer crosses
const SLANT = [1, 0.01374529, 0.02913857]; // of the ray from a point: along no edge that a drawing has
const CORE = { kind: "hull", radius: 0, disc: 0 };
const trees = new WeakMap(); // of surfaces

/** A box around points: `{middle, half}`. */
function boxAround(points) {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (const point of points) {
    for (const i of [0, 1, 2]) {
      low[i] = Math.min(low[i], point[i]);
      high[i] = Math.max(high[i], point[i]);
    }
  }
  return { middle: scaled(add(low, high), 0.5), half: scaled(subtract(high, low), 0.5) };
}

/** Boxes around halves of the triangles, along the longest side of their middles' box, down to one triangle each. */
function grown(triangles) {
  const box = boxAround(triangles.flatMap(({ corners }) => corners));
  if (triangles.length === 1) return { ...box, triangle: triangles[0] };
  const { half } = boxAround(triangles.map(({ middle }) => middle));
  const side = half.indexOf(Math.max(...half));
  triangles.sort((a, b) => a.middle[side] - b.middle[side]);
  const cut = triangles.length >> 1;
  return { ...box, parts: [grown(triangles.slice(0, cut)), grown(triangles.slice(cut))] };
}

function treeOf(surface) {
  if (!trees.has(surface)) {
    const { points, faces, shells } = surface;
    const triangles = faces.map((face, row) => {
      const corners = face.map((k) => points[k]);
      return { corners, middle: scaled(corners.reduce(add), 1 / 3), shell: shells[row] };
    });
    trees.set(surface, grown(triangles));
  }
  return trees.get(surface);
}

/** A lower bound of the distance of two boxes, the second seen from the first's frame by `T`. */
function apart(a, b, T) {
  const middle = subtract(moved(T, b.middle), a.middle);
  const gap = [0, 1, 2].map((r) => {
    const half = Math.abs(T[r][0]) * b.half[0] + Math.abs(T[r][1]) * b.half[1] + Math.abs(T[r][2]) * b.half[2];
    return Math.max(0, Math.abs(middle[r]) - a.half[r] - half);
  });
  return norm(gap);
}

const size = ({ half }) => half[0] + half[1] + half[2];

/** Whether a point, in a surface's frame, lies in one of its closed shells: where a ray from it crosses an odd number. */
function holds(surface, point) {
  const odd = new Set();
  const flat = (p) => [1, 2].map((r) => p[r] - point[r] - SLANT[r] * (p[0] - point[0]));
  const visit = (box) => {
    const { middle, half, parts, triangle } = box;
    if (middle[0] + half[0] < point[0]) return;
    if (flat(middle).some((away, r) => Math.abs(away) > half[r + 1] + SLANT[r + 1] * half[0])) return;
    if (parts) return void parts.forEach(visit);
    if (!triangle.shell) return;
    const seen = triangle.corners.map(flat);
    const areas = seen.map(([ya, za], k) => ya * seen[(k + 1) % 3][1] - seen[(k + 1) % 3][0] * za);
    const area = areas[0] + areas[1] + areas[2];
    if (!area || areas.some((part) => part * area < 0)) return;
    const depth = areas.reduce((sum, part, k) => sum + part * (triangle.corners[(k + 2) % 3][0] - point[0]), 0) / area;
    if (depth > 0 && !odd.delete(triangle.shell)) odd.add(triangle.shell);
  };
  visit(treeOf(surface));
  return odd.size > 0;
}

const inverted = (T) => {
  const back = scaled(turnedBack(T, column(T, 3)), -1);
  return [0, 1, 2].map((r) => [...column(T, r), back[r]]).concat([[0, 0, 0, 1]]);
};

/**
 * Distance (m) of a body with a surface, placed by `T`, from another one with a surface, placed by `S`, or a convex one
 * with points `r` in space: `{distance, near, deep}`, with the two points that are nearest. Below 0 where one is inside the
 * other; 0 and `deep` where they cross. `null` if they are `far` (m) or more from each other.
 */
export function surfaceDistance(a, T, b, S, r, far) {
  const tree = treeOf(a.surface);
  if (b.kind === "half_space") {
    const [normal, [offset]] = r;
    const lowest = a.surface.points.map((p) => moved(T, p)).reduce((best, p) => (dot(p, normal) < dot(best, normal) ? p : best));
    const distance = dot(lowest, normal) - offset;
    return { distance, near: [lowest, subtract(lowest, scaled(normal, distance))], deep: false };
  }
  const back = inverted(T);
  const seen = b.surface ? multiply(back, S) : IDENTITY;
  const points = b.surface ? null : r.map((p) => moved(back, p));
  const core = b.surface ? CORE : { ...b, radius: 0 };
  const round = points && boxAround(points);
  const other = b.surface ? treeOf(b.surface) : { middle: round.middle, half: round.half.map((h) => h + b.disc) };
  const sizes = a.radius + b.radius;
  let [best, near] = [far + sizes, null];
  const waiting = [[tree, other, 0]];
  while (waiting.length && best > TOUCHING) {
    const [one, two, bound] = waiting.pop();
    if (bound >= best) continue;
    if (one.parts || two.parts) {
      const opened = one.parts && !(two.parts && size(two) >= size(one)) ? one.parts.map((part) => [part, two]) : two.parts.map((part) => [one, part]);
      const kept = opened.map(([x, y]) => [x, y, apart(x, y, seen)]).filter(([, , away]) => away < best);
      waiting.push(...kept.sort((x, y) => y[2] - x[2]));
      continue;
    }
    const corners = points ?? two.triangle.corners.map((p) => moved(seen, p));
    const found = bodyDistance(CORE, one.triangle.corners, core, corners);
    if (found.distance < best) [best, near] = [Math.max(found.distance, 0), found.near.map((p) => moved(T, p))];
  }
  if (best <= TOUCHING) return { distance: -sizes, near, deep: true };
  const inside = (surface, frame, probes) => probes.some((p) => holds(surface, moved(frame, p)));
  const within = b.surface
    ? inside(a.surface, seen, b.surface.probes) || inside(b.surface, inverted(seen), a.surface.probes)
    : inside(a.surface, seen, [points[0]]);
  if (within) return { distance: -(near ? best : 0) - sizes, near: near ?? [moved(T, tree.middle), moved(T, tree.middle)], deep: true };
  return near && { distance: best - sizes, near, deep: false };
}
