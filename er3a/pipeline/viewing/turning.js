// Draws the page's 3-D figure once a reader comes near it, or prints; until then it keeps no one waiting.
"use strict";

const ON_A4 = { width: 680, height: 460 };
// All buttons that work offline: one of Plotly's own would send the figure to a server.
const BUTTONS = [["toImage", "zoom3d", "pan3d", "orbitRotation", "tableRotation", "resetCameraDefault3d"]];

async function unpackPlotly() {
  const packed = await fetch(`data:application/gzip;base64,${document.getElementById("plotly").textContent}`);
  return new Response(packed.body.pipeThrough(new DecompressionStream("gzip"))).text();
}

{
  const place = document.getElementById("turning");
  // Drawing takes a second, so a motion that is played is not held up.
  const look = (entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    if (document.querySelector("[data-playing]")) addEventListener("player-rests", draw, { once: true });
    else draw();
  };
  const near = new IntersectionObserver(look, { rootMargin: "25%" });
  let plotly = null;

  const draw = () => {
    if (plotly === null || place.hasChildNodes()) return;
    near.disconnect();
    const script = document.createElement("script");
    script.textContent = plotly;
    document.head.append(script);
    const { data, layout } = JSON.parse(document.getElementById("turning-figure").textContent);
    const scale = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;
    layout.font = { size: 12 * scale };
    layout.legend.font = { size: 12 * scale };
    for (const { marker, line } of data) {
      if (marker) marker.size *= scale;
      if (line) line.width *= scale;
    }
    const dictionary = JSON.parse(document.getElementById("turning-words").textContent);
    const config = {
      displaylogo: false,
      responsive: true,
      plotGlPixelRatio: Math.max(1, devicePixelRatio),
      modeBarButtons: BUTTONS,
      locale: "page",
      locales: { page: { dictionary } },
    };
    Plotly.newPlot(place, data, layout, config).then(() => performance.mark("turning"));
  };

  unpackPlotly().then((text) => {
    plotly = text;
    near.observe(place);
  });
  addEventListener("beforeprint", () => {
    draw();
    if (place.hasChildNodes()) Plotly.relayout(place, ON_A4);
  });
  addEventListener("afterprint", () => place.hasChildNodes() && Plotly.relayout(place, { width: null, height: null, autosize: true }));
}
