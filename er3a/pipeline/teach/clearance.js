/** How far the arm is from its surroundings and from itself, pair by pair of the bodies that the collision stage watches. */

import { IDENTITY, add, moved, norm, scaled, subtract } from "er3a/algebra";
import { ballAround, bodyDistance } from "er3a/distance";
import { write } from "er3a/readouts";
import { surfaceDistance } from "er3a/surface";
import { fill, inMillimetres } from "er3a/text";

const FAR = 1e3; // m
const WORLD = -1; // link of what stands around the arm
const balls = new WeakMap(); // around bodies, in their links' frames

const byId = (id) => document.getElementById(id);

/**
 * The nearest pair at frames `T` (of `frames`), or null where nothing can meet: `{pair, distance, from, to, deep}`, m,
 * with points on the bodies' surfaces. A pair that a joint joins counts only where it overlaps. `bodies` are those of
 * `bodyDistance`, each with its `link` (0 the base, k what row k moves, -1 the world), points in the link's frame;
 * `pairs` are `{bodies: [first, second], joined, text}`. The points of a body with a `surface` are those of a hull around
 * it; triangles are looked at only where hulls are nearer than what was found.
 */
export function nearestPair({ bodies, pairs }, base, T) {
  const frame = (link) => (link ? T[link - 1] : base);
  const local = balls.get(bodies) ?? balls.set(bodies, bodies.map(ballAround)).get(bodies);
  const around = local.map((ball, i) => ball && (bodies[i].link === WORLD ? ball : { ...ball, centre: moved(frame(bodies[i].link), ball.centre) }));
  const places = new Map();
  const placed = (i) => {
    const { link, points } = bodies[i];
    if (!places.has(i)) places.set(i, link === WORLD ? points : points.map((point) => moved(frame(link), point)));
    return places.get(i);
  };
  const frameOf = (i) => (bodies[i].link === WORLD ? IDENTITY : frame(bodies[i].link));
  const surfaces = (pair) => pair.bodies.some((i) => bodies[i].surface);
  let best = null;
  const waiting = [];
  const consider = (pair, found) => {
    if (found && !(pair.joined && found.distance >= 0) && (!best || found.distance < best.distance)) best = { pair, ...found };
  };
  for (const pair of pairs) {
    const [i, j] = pair.bodies;
    const [ball, other] = [around[i], around[j]];
    const apart = other ? norm(subtract(ball.centre, other.centre)) - ball.reach - other.reach : -Infinity;
    if (best && apart >= best.distance) continue;
    const found = bodyDistance(bodies[i], placed(i), bodies[j], placed(j));
    if (surfaces(pair)) waiting.push([found.distance, pair]); // of hulls around them: at most that of the surfaces
    else consider(pair, found);
  }
  for (const [least, pair] of waiting.sort(([a], [b]) => a - b)) {
    if (best && least >= best.distance) break;
    const [i, j] = bodies[pair.bodies[0]].surface ? pair.bodies : [...pair.bodies].reverse();
    const found = surfaceDistance(bodies[i], frameOf(i), bodies[j], frameOf(j), placed(j), best ? Math.max(best.distance, 0) : FAR);
    consider(pair, found && { ...found, near: i === pair.bodies[0] ? found.near : [...found.near].reverse() });
  }
  if (!best) return null;
  const [i, j] = best.pair.bodies;
  const [a, b] = best.near;
  const length = norm(subtract(b, a));
  const along = length > 0 ? scaled(subtract(b, a), 1 / length) : [0, 0, 0];
  return { ...best, from: add(a, scaled(along, bodies[i].radius)), to: subtract(b, scaled(along, bodies[j].radius)) };
}

export class Clearance {
  constructor({ table, clearance, words }) {
    Object.assign(this, { table, clearance, words });
  }

  /** What overlaps at frames `T`, in few words; empty where nothing does. */
  overlap(T) {
    const found = nearestPair(this.clearance, this.table.base, T);
    return found && found.distance <= 0 ? fill(this.words.collides, { pair: found.pair.text }) : "";
  }

  /** Writes the least distance at frames `T` into the page; returns what is to be drawn of it, null for nothing. */
  show(T) {
    const { words } = this;
    const found = nearestPair(this.clearance, this.table.base, T);
    const element = byId("clearance");
    if (!found) {
      element.dataset.state = "clear";
      write(element, words.nothing_meets);
      return null;
    }
    const { distance, deep, pair } = found;
    const touching = distance <= 0;
    element.dataset.state = touching ? "at" : distance < this.clearance.near ? "near" : "clear";
    const said = this.clearance.assumed ? words.assumed : words;
    write(element, fill(touching ? (deep ? said.overlap_deep : said.overlap) : said.clearance_is, { distance: inMillimetres(Math.abs(distance)), pair: pair.text }));
    return { from: found.from, to: found.to, text: deep ? "" : inMillimetres(distance), touching: touching ? pair.names : [] };
  }
}
