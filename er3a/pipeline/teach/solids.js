/**
 * The arm's shapes, made from its table as recordings make them: rods along the links, drums on the joints' axes.
 *
 * A solid is `{frame, before, points, faces}`: it moves with `frame` (0 the base, k the frame that joint k moves, the
 * last the tool) and is painted as if it were nearer by `before` (m), so that a drum hides the rod in it. A face is
 * `{corners, colour}`, the corners (indices of points) counter-clockwise as seen from outside.
 */

import { add, beside, column, cross, moved, multiply, norm, scaled, subtract, turnedBack, unit } from "er3a/algebra";
import { linkParts, rowRange } from "er3a/kinematics";

const TAPER = [1.0, 0.92, 0.8, 0.66, 0.55, 0.45]; // how much thinner the arm is at each joint; the last for all behind
const THICKNESS = 0.046; // radius of the first joint's rods, in parts of the arm's size
const ROD_SIDES = 14;
const DRUM_SIDES = 22;
const SHORT = 1e-6; // m

/**
 * What shows an arm: a function of `visual`, `checked` or `both` that returns groups `{solids, ghost}`, in which the
 * shapes that are checked are pale beside the arm's meshes. An arm without meshes has one look.
 */
export function armLooks(table, size, colours, { pieces, visuals }, carried = []) {
  const [visual, checked] = [visuals, pieces].map((surfaces) => [...armSolids(table, size, colours, surfaces), ...carried]);
  const groups = { visual: [visual], checked: [checked], both: [visual, checked] };
  return (look = "visual") => groups[visuals.length ? look : "checked"].map((solids, k) => ({ solids, ghost: k > 0 }));
}

/**
 * Everything that is drawn of an arm of the given size (m): surfaces `{link, points, faces, colour}` of links that
 * have them, rods and drums of all others.
 */
function armSolids(table, size, colours, surfaces) {
  const known = new Set(surfaces.map(({ link }) => link));
  const own = surfaces.map(({ link, points, faces, colour }) => ({ frame: link, ...mesh({ points, faces, colour }) }));
  return [...own, ...plainSolids(table, size, colours).filter((solid) => !known.has(solid.frame))];
}

function plainSolids(table, size, colours) {
  const parts = linkParts(table);
  const thickest = THICKNESS * size;
  const body = { colour: colours.body, sides: ROD_SIDES };
  const link = { colour: colours.link, sides: ROD_SIDES };
  const origin = [0, 0, 0];
  const last = parts.length;
  const solids = [
    rod(0, origin, [0, 0, 0.9 * thickest], 2.3 * thickest, { ...body, sides: DRUM_SIDES }),
    rod(0, origin, column(parts[0].across, 3), 0.75 * thickest, body),
  ];
  drums(table, size).forEach(({ middle, half }, k) => {
    const radius = thickest * taper(k);
    const along = column(parts[k + 1].along, 3);
    const corner = moved(parts[k + 1].along, column(parts[k + 1].across, 3));
    const ends = [[0, 0, -half], [0, 0, half]].map((end) => add(middle, end));
    const drum = { colour: colours.joints[k % colours.joints.length], sides: DRUM_SIDES, mark: colours.mark, before: radius };
    solids.push(rod(k + 1, origin, along, 0.75 * radius, link), rod(k + 1, along, corner, 0.75 * radius, link));
    solids.push(rod(k + 1, ...ends, radius, drum));
    if (table.sliding[k]) solids.push(rail(table, parts[k], k, 0.5 * radius, body));
  });
  const thin = 0.3 * thickest;
  solids.push(rod(last, scaled(turnedBack(table.tool, column(table.tool, 3)), -1), origin, thin, body));
  solids.push(rod(last, [0, 0, -0.25 * thin], [0, 0, 0.25 * thin], 2 * thin, { ...body, sides: DRUM_SIDES }));
  return solids.filter(Boolean);
}

/** What row k slides along, fixed to the link before it. */
function rail(table, before, k, radius, look) {
  const start = multiply(before.along, before.across);
  return rod(k, ...rowRange(table, k).map((x) => moved(start, [0, 0, x])), radius, look);
}

/** The bodies of these names, `base`, `link_3` or those of solids, in another colour. */
export const recoloured = (solids, names, colour) =>
  names.size === 0
    ? solids
    : solids.map((solid) =>
        names.has(solid.name ?? (solid.frame ? `link_${solid.frame}` : "base"))
          ? { ...solid, faces: solid.faces.map((face) => ({ ...face, colour })) }
          : solid,
      );

/** Middles (m, in the frame that the joint turns) of the joints' drums, and their half length. */
export function drums(table, size) {
  const parts = linkParts(table);
  return parts.slice(1).map(({ along }, k) => ({
    middle: scaled(column(along, 3), 0.5),
    half: 1.3 * THICKNESS * size * taper(k),
  }));
}

const taper = (k) => TAPER[Math.min(k, TAPER.length - 1)];

/**
 * A rod with flat ends, cut into rings about as long as they are thick so that they sort well by distance; null where
 * it has no length. `mark` colours a stripe along it, which shows its turning.
 */
function rod(frame, start, end, radius, { colour, sides, mark = colour, before = 0 }) {
  const vector = subtract(end, start);
  const length = norm(vector);
  if (length < SHORT) return null;
  const axis = unit(vector);
  const u = beside(axis);
  const v = cross(axis, u);
  const rings = Math.max(1, Math.round(length / (1.5 * radius)));
  const points = [];
  for (let ring = 0; ring <= rings; ring++) {
    const middle = add(start, scaled(vector, ring / rings));
    for (let i = 0; i < sides; i++) {
      const angle = (2 * Math.PI * i) / sides;
      const spoke = add(scaled(u, Math.cos(angle)), scaled(v, Math.sin(angle)));
      points.push(add(middle, scaled(spoke, radius)));
    }
  }
  const faces = [];
  for (let ring = 0; ring < rings; ring++) {
    for (let i = 0; i < sides; i++) {
      const [a, b] = [ring * sides + i, ring * sides + ((i + 1) % sides)];
      faces.push({ corners: [a, b, b + sides, a + sides], colour: i < 2 ? mark : colour });
    }
  }
  const ends = Array.from({ length: sides }, (_, i) => i);
  faces.push({ corners: [...ends].reverse(), colour });
  faces.push({ corners: ends.map((i) => rings * sides + i), colour });
  return { frame, before, points, faces };
}

const BOX_CORNERS = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const PIECES = 6; // of a box's edge, so that its faces sort well by distance
const BELTS = 10; // of a ball, from pole to pole

/** What stands around an arm, or is carried: `{kind, T, size | radius, length | points, faces, colour}`, m, in a frame. */
export function sceneSolids(things, frame = 0) {
  const made = { box, cylinder, sphere, mesh };
  return things.map((thing) => {
    const solid = made[thing.kind](thing);
    return { ...solid, frame, name: thing.name, points: solid.points.map((point) => moved(thing.T, point)) };
  });
}

function box({ size, colour }) {
  const half = scaled(size, 0.5);
  const at = (i) => [[-1, 1, 1, -1][i % 4], [-1, -1, 1, 1][i % 4], i < 4 ? -1 : 1].map((sign, k) => sign * half[k]);
  const points = [];
  const faces = [];
  for (const [a, b, c, d] of BOX_CORNERS.map((corners) => corners.map(at))) {
    const first = points.length;
    for (let i = 0; i <= PIECES; i++) {
      for (let j = 0; j <= PIECES; j++) {
        const [u, v] = [i / PIECES, j / PIECES];
        const edge = (p, q) => add(scaled(p, 1 - u), scaled(q, u));
        points.push(add(scaled(edge(a, b), 1 - v), scaled(edge(d, c), v)));
        if (i === 0 || j === 0) continue;
        const corner = (k, l) => first + (i - k) * (PIECES + 1) + (j - l);
        faces.push({ corners: [corner(1, 1), corner(0, 1), corner(0, 0), corner(1, 0)], colour });
      }
    }
  }
  return { before: 0, points, faces };
}

function mesh({ points, faces, colour }) {
  return { before: 0, points, faces: faces.map((corners) => ({ corners, colour })) };
}

function cylinder({ radius, length, colour }) {
  return rod(0, [0, 0, -length / 2], [0, 0, length / 2], radius, { colour, sides: DRUM_SIDES });
}

function sphere({ radius, colour }) {
  const sides = 2 * BELTS;
  const points = [];
  const faces = [];
  for (let belt = 0; belt <= BELTS; belt++) {
    const [c, s] = [Math.cos((Math.PI * belt) / BELTS), Math.sin((Math.PI * belt) / BELTS)];
    for (let i = 0; i < sides; i++) {
      const angle = (2 * Math.PI * i) / sides;
      points.push([radius * s * Math.cos(angle), radius * s * Math.sin(angle), -radius * c]);
      const [a, b] = [(belt - 1) * sides + i, (belt - 1) * sides + ((i + 1) % sides)];
      if (belt === 1) faces.push({ corners: [a, b + sides, a + sides], colour });
      else if (belt > 1) faces.push({ corners: [a, b, b + sides, a + sides], colour });
    }
  }
  return { before: 0, points, faces };
}
