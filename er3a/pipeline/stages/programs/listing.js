// Shows the arm in the figure where the motion of a chosen line ends.
"use strict";

{
  const arms = JSON.parse(document.getElementById("program-arms").textContent);
  const figure = document.getElementById("turning");

  const show = (row) => {
    const key = row.dataset.arm;
    const points = arms[key];
    if (!points || !figure || !figure.data) return;
    const { owners, programs } = figure.layout.meta;
    const name = key.slice(0, key.lastIndexOf(":"));
    const arm = owners.lastIndexOf(name);
    const [x, y, z] = [0, 1, 2].map((k) => points.map((point) => point[k]));
    Plotly.restyle(figure, { visible: owners.map((owner) => owner === name) });
    Plotly.restyle(figure, { x: [x], y: [y], z: [z] }, [arm]);
    Plotly.relayout(figure, { "updatemenus[0].active": programs.indexOf(name) });
    document.querySelectorAll(".listing tr.shown").forEach((other) => other.classList.remove("shown"));
    row.classList.add("shown");
  };

  document.querySelectorAll(".listing tr[data-arm]").forEach((row) => {
    row.addEventListener("click", () => show(row));
    row.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      show(row);
    });
  });
}
