/** The picture of the arm: what is drawn at given joint angles. */

import { add, column, moved, scaled, subtract } from "er3a/algebra";
import { constantLinks, frames, tableFrames } from "er3a/kinematics";
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
    this.others = (data.others ?? []).map((other) => ({ table: other.table, links: constantLinks(other.table), shown: new Arm(this, other) })); // over a wrong table's arm
    if (!location.search.includes("eye=")) this.look("overview");
  }

  /**
   * Draws the arm, and the right one over it if its table is wrong, at joint values `q` by a look of `Arm`, a pale one at `ghost` (null for none), the table's frames with these numbers, and
   * the nearest pair, `{from, to, text, touching}`: a line, and bodies of those names in red.
   */
  show(q, ghost, numbers = [], nearest = null, look = "visual") {
    const { data, base, reach } = this;
    const poses = this.#poses(q);
    const touching = new Set(nearest?.touching ?? []);
    const colours = new Map((data.wrong ? poses.map((_, j) => (j ? `link_${j}` : "base")) : [...touching]).map((name) => [name, data.colours.touching]));
    this.begin();
    this.floor(base, reach / 10, data.floor ?? base[2]);
    this.arm.show(poses, colours, look, Boolean(data.wrong)); // the right one is seen in it
    if (ghost) this.other.show(this.#poses(ghost), new Map(), look, true);
    else this.other.hide();
    const hiding = this.hiding(this.surroundings, poses);
    this.place(this.surroundings, [WORLD], colours, (mesh) => hiding.has(mesh) || mesh.shape.large);
    this.keepClear(alongArm(poses), ARM * reach);
    this.#frame(poses.at(-1), 0.11, ["x", "y", "z"]);
    for (const other of this.others) {
      const right = this.#poses(q, other);
      const [from, to] = [poses, right].map((own) => column(own.at(-1), 3));
      other.shown.show(right, new Map(), look);
      this.keepClear(alongArm(right), ARM * reach);
      nearest = { from, to, text: data.words.flange_off.replace("{off}", `${(1000 * Math.hypot(...subtract(to, from))).toFixed(0)} mm`), touching: [] };
    }
    if (nearest?.text) this.#nearest(nearest);
    if (numbers.length) this.#tableFrames(tableFrames(this.table, poses.slice(1)), numbers);
    else this.#axes(poses);
    if (this.others.length) this.word(document.getElementById("arm").dataset.own, column(poses[4], 3), this.page.touching);
    for (const other of this.others) this.word(document.getElementById("arm").dataset.right, column(this.#poses(q, other)[3], 3));
    this.names(this.surroundings, touching);
    this.end();
  }

  /** Poses of base, the frames that the joints turn, and tool. */
  #poses(q, { table, links } = this) {
    return [table.base, ...frames(table, links, q)];
  }

  #nearest({ from, to, text, touching }) {
    const { data, page } = this;
    this.line([from, to], touching.length || data.wrong ? data.colours.touching : page.ink, 3);
    for (const end of [from, to]) this.dot(end, touching.length ? page.touching : page.ink, 4, touching.length > 0);
    this.keepClear([0, 0.25, 0.5, 0.75, 1].map((part) => add(scaled(from, 1 - part), scaled(to, part))), 0);
    if (data.wrong) document.getElementById("clearance").textContent = text;
    this.word(text, scaled(add(from, to), 0.5), touching.length || data.wrong ? page.touching : page.ink);
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
      this.word(this.rows[k], Math.hypot(...middle) ? at : tip, this.data.wrong ? this.page.touching : this.page.ink); // an axis along its link is in the arm
    }
  }

  /** A frame's axes, `part` of the arm's size long. */
  #frame(T, part, names = []) {
    const [origin, ...tips] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map((arrow) => moved(T, scaled(arrow, part * this.reach)));
    for (const [c, tip] of tips.entries()) this.line([origin, tip], this.data.axes[c], 3);
    for (const tip of names.length ? tips : []) this.keepClear([tip, scaled(add(origin, tip), 0.5)], 0.015 * this.reach);
    for (const [c, name] of names.entries()) this.word(name, tips[c], this.data.axes[c]);
  }
}
