// Both arms of a comparison in one picture: sliders move them, dragging turns the view.
"use strict";

{
  const { arms, base, zeros, signs, joints } = JSON.parse(document.getElementById("arms").textContent);
  const canvas = document.getElementById("overlay");
  const aligned = document.getElementById("aligned");
  const apart = document.getElementById("apart");
  const q = joints.map((joint) => joint.start);
  let [azimuth, elevation] = [-0.9, 0.35];

  const times = (A, B) => A.map((row) => [0, 1, 2, 3].map((j) => row.reduce((sum, a, k) => sum + a * B[k][j], 0)));
  const moved = (x, slides) => {
    const [c, s] = slides ? [1, 0] : [Math.cos(x), Math.sin(x)];
    return [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, slides ? x : 0], [0, 0, 0, 1]];
  };
  const rows = (arm, values) => arm.coupling.map((row) => row.reduce((sum, factor, j) => sum + factor * values[j], 0));

  function points(arm, u, start) {
    let T = start ? times(start, arm.links[0]) : arm.links[0];
    const origin = start ? start.map((row) => row[3]).slice(0, 3) : [0, 0, 0];
    const found = [origin, T.slice(0, 3).map((row) => row[3])];
    u.forEach((value, k) => {
      T = times(times(T, moved(arm.starts[k] + arm.directions[k] * value, arm.sliding[k])), arm.links[k + 1]);
      found.push(T.slice(0, 3).map((row) => row[3]));
    });
    return found;
  }

  function shown() {
    const values = q.map((value, j) => (joints[j].unit === "mm" ? value / 1000 : (value * Math.PI) / 180));
    const u = rows(arms[0], values);
    const there = aligned.checked ? u.map((value, k) => signs[k] * (value - zeros[k])) : rows(arms[1], values);
    return [points(arms[0], u), points(arms[1], there, aligned.checked ? base : null)];
  }

  function draw() {
    const lines = shown();
    const scale = devicePixelRatio;
    [canvas.width, canvas.height] = [canvas.clientWidth * scale, canvas.clientHeight * scale];
    const context = canvas.getContext("2d");
    const size = Math.max(0.1, ...lines.flat().map((p) => Math.hypot(...p)));
    const unit = (0.42 * Math.min(canvas.width, canvas.height)) / size;
    const flat = ([x, y, z]) => {
      const [across, deep] = [x * Math.cos(azimuth) - y * Math.sin(azimuth), x * Math.sin(azimuth) + y * Math.cos(azimuth)];
      return [canvas.width / 2 + unit * across, canvas.height * 0.6 - unit * (z * Math.cos(elevation) - deep * Math.sin(elevation))];
    };
    lines.forEach((line, arm) => {
      context.strokeStyle = context.fillStyle = arm ? "#d9730d" : "#2f7fc1";
      context.lineWidth = (arm ? 3 : 6) * scale;
      context.beginPath();
      line.forEach((point, k) => context[k ? "lineTo" : "moveTo"](...flat(point)));
      context.stroke();
      for (const point of line) {
        context.beginPath();
        context.arc(...flat(point), (arm ? 4 : 6) * scale, 0, 2 * Math.PI);
        context.fill();
      }
    });
    const [a, b] = lines.map((line) => line[line.length - 1]);
    apart.textContent = `${apart.dataset.text} ${(1000 * Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])).toFixed(2)} mm`;
  }

  joints.forEach((joint, j) => {
    const label = document.createElement("label");
    label.className = "slider";
    const input = Object.assign(document.createElement("input"), { type: "range", min: joint.lower, max: joint.upper, step: 0.1, value: joint.start });
    const output = document.createElement("output");
    const say = () => (output.textContent = `${q[j].toFixed(1)} ${joint.unit}`);
    input.addEventListener("input", () => {
      q[j] = Number(input.value);
      say();
      draw();
    });
    say();
    label.append(`J${j + 1}`, input, output);
    document.getElementById("sliders").append(label);
  });
  aligned.addEventListener("change", draw);
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    azimuth += event.movementX / 150;
    elevation = Math.min(1.5, Math.max(-1.5, elevation + event.movementY / 150));
    draw();
  });
  addEventListener("resize", draw);
  canvas.closest("details").addEventListener("toggle", draw);
  document.getElementById("copy").addEventListener("click", () => navigator.clipboard.writeText(document.getElementById("corrected").textContent));
  draw();
}
