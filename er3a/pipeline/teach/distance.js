/**
 * Distances between convex bodies, as er3a/collision/distances.py has them.
 *
 * A body is `{kind, link, points, radius, disc}`: a core grown by a radius (m). The core is the hull of its points, a
 * cylinder (two points, the ends of its axis, with the radius of its disc) or a half-space (its normal, then how far
 * along it the solid ends). Two lines are measured in closed form [1], all else by the iteration of [2].
 *
 * References
 * [1] C. Ericson, Real-Time Collision Detection, 2005, sections 5.1.5, 5.1.6 and 5.1.9.
 * [2] E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A fast procedure for computing the distance between complex objects
 *     in three-dimensional space", IEEE J. Robotics and Automation 4, 1988.
 * [3] G. van den Bergen, Collision Detection in Interactive 3D Environments, 2003, section 4.3.
 */

import { across, add, cross, dot, norm, scaled, subtract } from "er3a/algebra";

const EXACT = 1e-11; // m, to which the iteration goes on
const TOUCHING = 1e-9; // m; cores that are nearer overlap
const ROUNDS = 64;
const ON_AXIS = 1e-12; // part of a direction across an axis below which it has none
const FLAT = 1e-18; // m^3
const PARALLEL = 1e-14;
const ENOUGH = 1e-7; // m, to which a depth is found
const ROUNDING = 1e-13; // m
const MAX_FACES = 256; // steps

/**
 * Distance (m) of two bodies with points `p` and `r` in space, negative by the depth where they overlap: `{distance,
 * near, deep}`, with the two points of their cores that are nearest (of overlapping cores, those that a shift by the
 * depth brings together). Where `deep`, the depth is at least what is given. The second body may be a half-space.
 */
export function bodyDistance(a, p, b, r) {
  const sizes = a.radius + b.radius;
  const core = b.kind === "half_space" ? abovePlane(a, p, r) : p.length < 3 && r.length < 3 && !a.disc && !b.disc ? lines(p, r) : iterated(a, p, b, r);
  const deep = core.deep ?? false;
  return { distance: core.distance - sizes, near: core.near, deep };
}

/** A ball around a body: `{centre, reach}`, m; none for a half-space. */
export function ballAround({ kind, points, radius, disc }) {
  if (kind === "half_space") return null;
  const [low, high] = [Math.min, Math.max].map((of) => [0, 1, 2].map((i) => of(...points.map((point) => point[i]))));
  const centre = scaled(add(low, high), 0.5);
  const spread = Math.max(...points.map((point) => norm(subtract(point, centre))));
  return { centre, reach: Math.hypot(spread, disc) + radius };
}

/** The nearest points of the lines from the first to the last of each of two sets of points. */
function lines(p, r) {
  const [a0, a1, b0, b1] = [p[0], p.at(-1), r[0], r.at(-1)];
  const [u, v, d] = [subtract(a1, a0), subtract(b1, b0), subtract(b0, a0)];
  const [aa, ab, bb, ac, bc] = [dot(u, u), dot(u, v), dot(v, v), dot(u, d), dot(v, d)];
  const at = (s, t) => {
    const near = [add(a0, scaled(u, s)), add(b0, scaled(v, t))];
    return { distance: norm(subtract(...near)), near };
  };
  const slanted = aa * bb - ab * ab;
  if (slanted > PARALLEL * aa * bb) {
    const [s, t] = [(ac * bb - bc * ab) / slanted, (ac * ab - bc * aa) / slanted];
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return at(s, t);
  }
  const clamp = (value, length) => (length > 0 ? Math.min(1, Math.max(0, value / length)) : 0);
  const ends = [0, 1].flatMap((end) => [at(end, clamp(ab * end - bc, bb)), at(clamp(ab * end + ac, aa), end)]);
  return ends.reduce((best, other) => (other.distance < best.distance ? other : best));
}

/** How far a core stays above a half-space. */
function abovePlane(body, points, [normal, [offset]]) {
  let lowest = points.reduce((best, point) => (dot(point, normal) < dot(best, normal) ? point : best));
  if (body.disc) lowest = onRim(body, points, lowest, scaled(normal, -1));
  const distance = dot(lowest, normal) - offset;
  return { distance, near: [lowest, subtract(lowest, scaled(normal, distance))] };
}

/** A point of a cylinder's axis, put to the rim of its disc, as far along `direction` as that goes. */
function onRim({ disc }, [start, end], point, direction) {
  const axis = subtract(end, start);
  const outward = across(direction, scaled(axis, 1 / norm(axis)));
  const size = norm(outward);
  return size > ON_AXIS * norm(direction) ? add(point, scaled(outward, disc / size)) : point;
}

function support(body, points, direction) {
  let best = points[0];
  let most = dot(best, direction);
  for (const point of points) {
    const value = dot(point, direction);
    if (value > most) [best, most] = [point, value];
  }
  return body.disc ? onRim(body, points, best, direction) : best;
}

/** Gilbert, Johnson and Keerthi's iteration [2]. */
function iterated(a, p, b, r) {
  let v = subtract(p[0], r[0]);
  if (norm(v) === 0) v = [1, 0, 0];
  let simplex = []; // of {w, onA, onB}
  let size = norm(v);
  let last = Infinity;
  let near = [p[0], r[0]];
  for (let round = 0; round < ROUNDS; round++) {
    const onA = support(a, p, scaled(v, -1));
    const onB = support(b, r, v);
    const w = subtract(onA, onB);
    if (simplex.length && size - dot(v, w) / size <= EXACT) break;
    simplex.push({ w, onA, onB });
    const weights = nearestToOrigin(simplex.map((corner) => corner.w));
    if (!weights) return overlap(a, p, b, r, simplex);
    const mixed = (key) => simplex.reduce((sum, corner, i) => add(sum, scaled(corner[key], weights[i])), [0, 0, 0]);
    const mixture = [mixed("onA"), mixed("onB")];
    v = subtract(...mixture);
    if (norm(v) >= last) break; // a flat simplex, by rounding: what was found before is nearer
    near = mixture;
    size = last = norm(v);
    simplex = simplex.filter((_, i) => weights[i] > 0);
    if (size <= TOUCHING) return { distance: 0, near, deep: true };
    if (simplex.length === 4) break;
  }
  return { distance: size, near };
}

/**
 * How deep two cores overlap: the nearest face of the hull of their differences, grown from a tetrahedron around the
 * origin [3]. `deep` if that doesn't come to an end: then the depth is at least what was found.
 */
function overlap(a, p, b, r, simplex) {
  const along = (n) => {
    const [onA, onB] = [support(a, p, n), support(b, r, scaled(n, -1))];
    return { w: subtract(onA, onB), onA, onB };
  };
  const faceOf = (...corners) => {
    const [u, v, w] = corners.map((corner) => corner.w);
    const normal = cross(subtract(v, u), subtract(w, u));
    const size = norm(normal);
    const n = scaled(normal, 1 / size);
    return size > FLAT ? { corners, n, away: dot(n, u) } : { corners, n: [0, 0, 0], away: Infinity };
  };
  const [i, j, k, l] = simplex;
  let faces = [[i, j, k, l], [i, l, j, k], [i, k, l, j], [j, l, k, i]].map(([x, y, z, inner]) => {
    const face = faceOf(x, y, z);
    return dot(face.n, subtract(inner.w, x.w)) > 0 ? faceOf(x, z, y) : face;
  });
  for (let round = 0; ; round++) {
    const nearest = faces.reduce((best, face) => (face.away < best.away ? face : best));
    const next = along(nearest.n);
    const ended = dot(next.w, nearest.n) - nearest.away < ENOUGH;
    if (ended || round === MAX_FACES) {
      const weights = ofTriangle(...nearest.corners.map((corner) => corner.w));
      const mixed = (key) => nearest.corners.reduce((sum, corner, at) => add(sum, scaled(corner[key], weights[at])), [0, 0, 0]);
      return { distance: -Math.max(0, nearest.away), near: [mixed("onA"), mixed("onB")], deep: !ended };
    }
    const seen = new Set(faces.filter(({ n, corners }) => dot(n, subtract(next.w, corners[0].w)) > ROUNDING));
    const edges = [...seen].flatMap(({ corners: [x, y, z] }) => [[x, y], [y, z], [z, x]]);
    const horizon = edges.filter(([x, y]) => !edges.some(([u, v]) => u === y && v === x));
    faces = [...faces.filter((face) => !seen.has(face)), ...horizon.map(([x, y]) => faceOf(x, y, next))];
  }
}

/** Weights of the simplex's point that is nearest to the origin; null if the origin lies inside. */
function nearestToOrigin(w) {
  if (w.length === 1) return [1];
  if (w.length === 2) {
    const along = subtract(w[1], w[0]);
    const length = dot(along, along);
    const t = length > 0 ? Math.min(1, Math.max(0, -dot(w[0], along) / length)) : 0;
    return [1 - t, t];
  }
  if (w.length === 3) return ofTriangle(...w);
  let best = null;
  let least = Infinity;
  for (const out of [0, 1, 2, 3]) {
    const corners = [0, 1, 2, 3].filter((i) => i !== out);
    if (!facesOrigin(corners.map((i) => w[i]), w[out])) continue;
    const share = ofTriangle(...corners.map((i) => w[i]));
    const point = corners.reduce((sum, i, k) => add(sum, scaled(w[i], share[k])), [0, 0, 0]);
    if (dot(point, point) < least) {
      least = dot(point, point);
      best = [0, 0, 0, 0];
      corners.forEach((i, k) => (best[i] = share[k]));
    }
  }
  return best;
}

/** Whether a face has the origin on its outer side, `inner` being the tetrahedron's fourth corner, or all is flat. */
function facesOrigin([a, b, c], inner) {
  const normal = cross(subtract(b, a), subtract(c, a));
  const there = dot(normal, subtract(inner, a));
  return -dot(normal, a) * there <= 0 || Math.abs(there) <= FLAT;
}

/** Weights of the point of a triangle that is nearest to the origin [1, section 5.1.5]. */
function ofTriangle(a, b, c) {
  const [u, v] = [subtract(b, a), subtract(c, a)];
  const [d1, d2, d3, d4, d5, d6] = [a, b, c].flatMap((corner) => [-dot(u, corner), -dot(v, corner)]);
  if (d1 <= 0 && d2 <= 0) return [1, 0, 0];
  if (d3 >= 0 && d4 <= d3) return [0, 1, 0];
  const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return [1 - d1 / (d1 - d3), d1 / (d1 - d3), 0];
  if (d6 >= 0 && d5 <= d6) return [0, 0, 1];
  const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return [1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)];
  const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const t = (d4 - d3) / (d4 - d3 + (d5 - d6));
    return [0, 1 - t, t];
  }
  const total = va + vb + vc;
  return [va / total, vb / total, vc / total];
}
