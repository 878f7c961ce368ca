/** How pointer and keys turn a picture in space: what the eye looks at, from where, and how far away. */

const VIEWS = {
  overview: { azimuth: -1.0, elevation: 0.35 },
  side: { azimuth: -Math.PI / 2, elevation: 0 },
  front: { azimuth: 0, elevation: 0 },
  top: { azimuth: -Math.PI / 2, elevation: Math.PI / 2 },
};
const DISTANCE = 3.7; // of the eye, in lengths of the arm from axis 2
const MIN_DISTANCE = 1.2;
const MAX_DISTANCE = 12;
const KEY_TURN = Math.PI / 36;
const KEY_ZOOM = 1.15;

export class Orbit {
  /** Looks at `target` (m), round which the arm has about the given length; `draw` has the picture drawn again. */
  constructor(canvas, target, length, draw) {
    Object.assign(this, { canvas, target, length, draw });
    this.distance = DISTANCE * length;
    this.readColours();
    this.look("overview");
    const [azimuth, elevation] = (new URLSearchParams(location.search).get("eye") ?? "").split(",").map(Number);
    if (elevation) Object.assign(this, { azimuth, elevation }); // of the page that one comes from
    this.#listen();
  }

  /** Takes the page's colours, which follow light and dark. */
  readColours() {
    const style = getComputedStyle(document.documentElement);
    const named = (name) => style.getPropertyValue(`--${name}`).trim();
    this.page = { ink: named("ink"), grid: named("line"), muted: named("muted"), halo: named("card"), hole: named("hole"), touching: named("fail"), doubtful: named("caution"), accent: named("accent") };
  }

  look(name) {
    Object.assign(this, VIEWS[name]);
    if (name === "overview") this.azimuth += this.turn0 ?? 0; // from where nothing hides the arm
    this.draw();
  }

  zoom(factor) {
    this.distance = Math.min(MAX_DISTANCE * this.length, Math.max(MIN_DISTANCE * this.length, this.distance * factor));
    this.draw();
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.elevation + elevation));
    this.draw();
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
