/** The picture of the arm: what is drawn, and how pointer and keys turn it. */

import { add, column, moved, norm, scaled, subtract, turned } from "er3a/algebra";
import { frames, JOINTS, sizeOf } from "er3a/kinematics";
import { eyeOf, Picture } from "er3a/scene";
import { armSolids, drums } from "er3a/solids";

const VIEWS = {
  overview: { azimuth: -1.0, elevation: 0.35 },
  side: { azimuth: -Math.PI / 2, elevation: 0 },
  front: { azimuth: 0, elevation: 0 },
  top: { azimuth: -Math.PI / 2, elevation: Math.PI / 2 },
};
const DISTANCE = 3.7; // of the eye, in lengths of the arm from axis 2
const NEAREST = 1.2;
const FARTHEST = 12;
const KEY_TURN = Math.PI / 36;
const KEY_ZOOM = 1.15;

export class ArmView {
  /** `draw` is called when the view has changed and the picture has to be drawn again. */
  constructor(canvas, { table, colours, joint_names: names }, links, draw) {
    Object.assign(this, { canvas, table, links, names, draw });
    this.size = sizeOf(table);
    this.solids = armSolids(table, this.size, colours);
    this.drums = drums(table, this.size);
    this.jointColours = colours.joints;
    this.picture = new Picture(canvas);
    this.base = column(table.base, 3);
    const atZero = frames(table, links, [0, 0, 0, 0, 0, 0]);
    this.target = column(atZero[1], 3);
    const apart = (k) => norm(subtract(column(atZero[k], 3), column(atZero[k - 1], 3)));
    this.length = [2, 3, 4, 5, 6].reduce((sum, k) => sum + apart(k), 0);
    this.distance = DISTANCE * this.length;
    this.readColours();
    this.look("overview");
    this.#listen();
  }

  /** Takes the page's colours, which follow light and dark. */
  readColours() {
    const style = getComputedStyle(document.documentElement);
    const named = (name) => style.getPropertyValue(`--${name}`).trim();
    this.page = { ink: named("ink"), grid: named("line"), halo: named("card") };
  }

  look(name) {
    Object.assign(this, VIEWS[name]);
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(FARTHEST * this.length, Math.max(NEAREST * this.length, this.distance * factor));
    this.draw();
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.elevation + elevation));
    this.draw();
  }

  /** Draws the arm at joint angles `q`, and a pale one at `ghost` (null for none). */
  show(q, ghost) {
    const { picture, solids, page, size, base } = this;
    picture.fit();
    picture.begin(eyeOf(this));
    const poses = this.#poses(q);
    picture.floor(base, size / 10, base[2], page.grid);
    picture.shadow(solids, poses, base[2], page.grid);
    const groups = [{ solids, poses, ghost: false }];
    if (ghost) groups.push({ solids, poses: this.#poses(ghost), ghost: true });
    picture.solids(groups);
    this.#axes(poses);
    this.#toolFrame(poses[7]);
  }

  /** Poses of base, the frames that the joints turn, and tool. */
  #poses(q) {
    return [this.table.base, ...frames(this.table, this.links, q)];
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

  #listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      const step = Math.PI / Math.max(300, canvas.clientWidth);
      this.turn(-event.movementX * step, event.movementY * step);
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (document.activeElement !== canvas) return;
        event.preventDefault();
        this.zoom(event.deltaY > 0 ? KEY_ZOOM : 1 / KEY_ZOOM);
      },
      { passive: false },
    );
    const keys = {
      ArrowLeft: () => this.turn(-KEY_TURN, 0),
      ArrowRight: () => this.turn(KEY_TURN, 0),
      ArrowUp: () => this.turn(0, KEY_TURN),
      ArrowDown: () => this.turn(0, -KEY_TURN),
      "+": () => this.zoom(1 / KEY_ZOOM),
      "-": () => this.zoom(KEY_ZOOM),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.readColours();
      this.draw();
    });
  }
}
