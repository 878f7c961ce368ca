/** The picture of the arm: what is drawn at given joint angles. */

import { add, column, moved, norm, scaled, subtract, turned } from "er3a/algebra";
import { frames, tableFrames } from "er3a/kinematics";
import { Orbit } from "er3a/orbit";
import { alongArm, ARM, eyeOf, Picture } from "er3a/scene";
import { armLooks, drums, recoloured, sceneSolids } from "er3a/solids";

const TOUCHING = "#d1242f";
const FRAME_COLOURS = ["#d62728", "#2ca02c", "#1f77b4"]; // of x, y, z

/** Where to look, and about how long the arm is from there (m). */
function lookedAt(table, links, size) {
  if (table.sliding.some(Boolean) || table.a.length < 3) {
    const middle = table.lower.map((low, j) => (low + table.upper[j]) / 2);
    return [scaled(add(column(table.base, 3), column(frames(table, links, middle).at(-1), 3)), 0.5), 0.75 * size];
  }
  const origins = frames(table, links, table.lower.map(() => 0)).map((T) => column(T, 3));
  return [origins[1], origins.slice(2).reduce((sum, origin, k) => sum + norm(subtract(origin, origins[k + 1])), 0)];
}

export class ArmView extends Orbit {
  /** `draw` is called when the view has changed and the picture has to be drawn again. */
  constructor(canvas, { table, size, colours, joint_names: names, pieces, visuals, scene, carried, floor }, links, draw) {
    super(canvas, ...lookedAt(table, links, size), () => draw());
    Object.assign(this, { table, links, size, rows: table.coupling ? table.a.map((_, k) => String(k + 1)) : names });
    this.surroundings = sceneSolids(scene ?? []);
    this.looks = armLooks(table, size, colours, { pieces, visuals }, sceneSolids(carried ?? [], table.a.length + 1));
    this.drums = drums(table, size);
    this.jointColours = colours.joints;
    this.picture = new Picture(canvas);
    this.base = column(table.base, 3);
    this.floor = floor ?? this.base[2];
  }

  /**
   * Draws the arm at joint values `q` by a look of `armLooks`, a pale one at `ghost` (null for none), the table's frames with these numbers, and
   * the nearest pair, `{from, to, text, touching}`: a line, and bodies of those names in red.
   */
  show(q, ghost, numbers = [], nearest = null, look = "visual") {
    const { picture, page, size, base, floor } = this;
    picture.fit();
    picture.begin(eyeOf(this));
    const poses = this.#poses(q);
    const groups = this.looks(look);
    const [{ solids }] = groups;
    picture.floor(base, size / 10, floor, page.grid);
    picture.shadow(solids, poses, floor, page.grid);
    const touching = new Set(nearest?.touching ?? []);
    const seen = (things) => recoloured(things, touching, TOUCHING);
    const arm = groups.map((group) => ({ ...group, solids: seen(group.solids), poses }));
    if (ghost) arm.push({ solids, poses: this.#poses(ghost), ghost: true });
    picture.solids([...picture.around(seen(this.surroundings), poses), ...arm]);
    if (numbers.length) this.#tableFrames(tableFrames(this.table, poses.slice(1)), numbers);
    else this.#axes(poses);
    this.#toolFrame(poses.at(-1));
    picture.keepClear(alongArm(poses), ARM * size);
    if (nearest?.text) this.#nearest(nearest);
    picture.names(this.surroundings, page.ink, page.halo, touching, page.touching);
  }

  /** Poses of base, the frames that the joints turn, and tool. */
  #poses(q) {
    return [this.table.base, ...frames(this.table, this.links, q)];
  }

  #nearest({ from, to, text, touching }) {
    const { picture, page } = this;
    picture.line([from, to], touching.length ? TOUCHING : page.ink, 3);
    picture.word(text, scaled(add(from, to), 0.5), touching.length ? page.touching : page.ink, page.halo);
  }

  #tableFrames(found, numbers) {
    const at = new Map(); // frames in one place share a label
    for (const k of numbers) {
      const origin = column(found[k], 3);
      FRAME_COLOURS.forEach((colour, c) => {
        this.picture.line([origin, add(origin, scaled(column(found[k], c), 0.12 * this.size))], colour, 3);
      });
      const place = origin.map((value) => value.toFixed(4)).join();
      at.set(place, { origin, texts: [...(at.get(place)?.texts ?? []), k] });
    }
    for (const { origin, texts } of at.values()) this.picture.word(texts.join(", "), origin, this.page.ink, this.page.halo);
  }

  #axes(poses) {
    for (const [k, { middle, half }] of this.drums.entries()) {
      const axis = scaled(column(poses[k + 1], 2), this.table.direction[k]);
      const start = add(moved(poses[k + 1], middle), scaled(axis, half));
      const tip = add(start, scaled(axis, half));
      this.picture.line([start, tip], this.jointColours[k], 3);
      this.picture.word(this.rows[k], add(tip, scaled(axis, 0.6 * half)), this.page.ink, this.page.halo);
    }
  }

  #toolFrame(T) {
    ["x", "y", "z"].forEach((name, c) => {
      const arrow = [0, 1, 2].map((i) => (i === c ? 0.11 * this.size : 0));
      const tip = add(column(T, 3), turned(T, arrow));
      this.picture.line([column(T, 3), tip], this.page.ink);
      this.picture.word(name, add(tip, turned(T, scaled(arrow, 0.2))), this.page.ink, this.page.halo);
    });
  }
}
