/** The picture of the arm: what is drawn at given joint angles. */

import { add, column, moved, norm, scaled, subtract, turned } from "er3a/algebra";
import { frames, JOINTS, sizeOf, tableFrames } from "er3a/kinematics";
import { Orbit } from "er3a/orbit";
import { eyeOf, Picture } from "er3a/scene";
import { armSolids, drums, sceneSolids } from "er3a/solids";

const FRAME_COLOURS = ["#d62728", "#2ca02c", "#1f77b4"]; // of x, y, z

export class ArmView extends Orbit {
  /** `draw` is called when the view has changed and the picture has to be drawn again. */
  constructor(canvas, { table, colours, joint_names: names, scene }, links, draw) {
    const atZero = frames(table, links, [0, 0, 0, 0, 0, 0]);
    const apart = (k) => norm(subtract(column(atZero[k], 3), column(atZero[k - 1], 3)));
    super(canvas, column(atZero[1], 3), [2, 3, 4, 5, 6].reduce((sum, k) => sum + apart(k), 0), () => draw());
    Object.assign(this, { table, links, names });
    this.size = sizeOf(table);
    this.surroundings = sceneSolids(scene ?? []);
    this.solids = armSolids(table, this.size, colours);
    this.drums = drums(table, this.size);
    this.jointColours = colours.joints;
    this.picture = new Picture(canvas);
    this.base = column(table.base, 3);
  }

  /** Draws the arm at joint angles `q`, a pale one at `ghost` (null for none), and the table's frames with these numbers. */
  show(q, ghost, numbers = []) {
    const { picture, solids, page, size, base } = this;
    picture.fit();
    picture.begin(eyeOf(this));
    const poses = this.#poses(q);
    picture.floor(base, size / 10, base[2], page.grid);
    picture.shadow(solids, poses, base[2], page.grid);
    const groups = [{ solids: this.surroundings, poses, ghost: false }, { solids, poses, ghost: false }];
    if (ghost) groups.push({ solids, poses: this.#poses(ghost), ghost: true });
    picture.solids(groups);
    if (numbers.length) this.#tableFrames(tableFrames(this.table, poses.slice(1)), numbers);
    else this.#axes(poses);
    this.#toolFrame(poses[7]);
  }

  /** Poses of base, the frames that the joints turn, and tool. */
  #poses(q) {
    return [this.table.base, ...frames(this.table, this.links, q)];
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
    for (const k of JOINTS) {
      const { middle, half } = this.drums[k];
      const axis = scaled(column(poses[k + 1], 2), this.table.direction[k]);
      const start = add(moved(poses[k + 1], middle), scaled(axis, half));
      const tip = add(start, scaled(axis, half));
      this.picture.line([start, tip], this.jointColours[k], 3);
      this.picture.word(this.names[k], add(tip, scaled(axis, 0.6 * half)), this.page.ink, this.page.halo);
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
