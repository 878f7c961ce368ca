/** The picture of the arm: what is drawn at given joint angles. */

import { add, column, moved, scaled, turned } from "er3a/algebra";
import { frames, tableFrames } from "er3a/kinematics";
import { alongArm, Arm, ARM, Space, WORLD } from "er3a/space";

export class ArmView extends Space {
  /** `draw` is called when the view has changed and the picture has to be drawn again. */
  constructor(canvas, data, links, draw) {
    const { table, size } = data;
    super(canvas, data.target, data.length, () => draw());
    const names = table.coupling ? table.a.map((_, k) => String(k + 1)) : data.joint_names;
    Object.assign(this, { data, table, links, reach: size, rows: names, base: column(table.base, 3), turn0: data.turned });
    this.surroundings = this.add(data.scene ?? []);
    [this.arm, this.other] = [data.carried ?? [], []].map((carried) => new Arm(this, data, carried));
    if (!location.search.includes("eye=")) this.look("overview");
  }

  /**
   * Draws the arm at joint values `q` by a look of `Arm`, a pale one at `ghost` (null for none), the table's frames with these numbers, and
   * the nearest pair, `{from, to, text, touching}`: a line, and bodies of those names in red.
   */
  show(q, ghost, numbers = [], nearest = null, look = "visual") {
    const { data, base, reach } = this;
    const poses = this.#poses(q);
    const touching = new Set(nearest?.touching ?? []);
    const colours = new Map([...touching].map((name) => [name, data.colours.touching]));
    this.begin();
    this.floor(base, reach / 10, data.floor ?? base[2]);
    this.arm.show(poses, colours, look);
    if (ghost) this.other.show(this.#poses(ghost), new Map(), look, true);
    else this.other.hide();
    const hiding = this.hiding(this.surroundings, poses);
    this.place(this.surroundings, [WORLD], colours, (mesh) => hiding.has(mesh) || mesh.shape.large);
    this.keepClear(alongArm(poses), ARM * reach);
    if (numbers.length) this.#tableFrames(tableFrames(this.table, poses.slice(1)), numbers);
    else this.#axes(poses);
    this.#frame(poses.at(-1), 0.11, ["x", "y", "z"]);
    if (nearest?.text) this.#nearest(nearest);
    this.names(this.surroundings, touching);
    this.end();
  }

  /** Poses of base, the frames that the joints turn, and tool. */
  #poses(q) {
    return [this.table.base, ...frames(this.table, this.links, q)];
  }

  #nearest({ from, to, text, touching }) {
    const { data, page } = this;
    this.line([from, to], touching.length ? data.colours.touching : page.ink, 3);
    for (const end of [from, to]) this.dot(end, touching.length ? page.touching : page.ink, 4, touching.length > 0);
    this.word(text, scaled(add(from, to), 0.5), touching.length ? page.touching : page.ink);
  }

  #tableFrames(found, numbers) {
    const at = new Map(); // frames in one place share a label
    for (const k of numbers) {
      const origin = column(found[k], 3);
      this.#frame(found[k], 0.12);
      const place = origin.map((value) => value.toFixed(4)).join();
      at.set(place, { origin, texts: [...(at.get(place)?.texts ?? []), k] });
    }
    for (const { origin, texts } of at.values()) this.word(texts.join(", "), origin);
  }

  /** The joints' axes, each from the arm outwards in its own colour. */
  #axes(poses) {
    for (const [k, { middle, half }] of this.data.rows.entries()) {
      const at = moved(poses[k + 1], middle);
      const tip = add(at, scaled(column(poses[k + 1], 2), 2 * this.table.direction[k] * half));
      this.line([at, tip], this.data.colours.joints[k], 3);
      this.word(this.rows[k], Math.hypot(...middle) ? at : tip); // an axis along its link is in the arm
    }
  }

  /** A frame's axes, `part` of the arm's size long. */
  #frame(T, part, names = []) {
    this.data.axes.forEach((colour, c) => {
      const arrow = [0, 1, 2].map((i) => (i === c ? part * this.reach : 0));
      const tip = add(column(T, 3), turned(T, arrow));
      this.line([column(T, 3), tip], colour, 3);
      if (names[c]) this.word(names[c], tip, colour);
    });
  }
}
