// Two robots side by side: fills the table and colours the borders for the pair that is picked.
"use strict";

const compared = JSON.parse(document.getElementById("compared").textContent);
const pickers = ["a", "b"].map((side) => document.getElementById(`robot-${side}`));
const onlyDifferences = document.getElementById("only-differences");
const comparedRows = [...document.querySelectorAll("#comparison tbody tr")].map((row, index) => ({ row, index }));

// Up to six significant digits, a typographic minus, no trailing zeros, as the other pages write numbers.
function shownValue(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number") return value;
  const [digits, exponent] = String(Number(value.toPrecision(6))).split("e");
  const [whole, ...fraction] = digits.split(".");
  const power = exponent ? "·10" + [...exponent].map((sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? (sign === "-" ? "⁻" : "")).join("") : "";
  return [/\d{5}/.test(whole) ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole, ...fraction].join(".").replace("-", "−") + power;
}

function shownDifference(a, b) {
  if (typeof a === "number" && typeof b === "number") return a === b ? "" : shownValue(b - a);
  return a === b ? "" : document.querySelector("[data-differs]").dataset.differs;
}

// The address keeps what is compared: "#a=NAME&b=NAME&differs".
function takeAddress() {
  const asked = new URLSearchParams(location.hash.slice(1));
  pickers.forEach((picker, side) => {
    const name = asked.get("ab"[side]);
    if (name !== null && Object.hasOwn(compared, name)) picker.value = name;
  });
  if (asked.has("a")) onlyDifferences.checked = asked.has("differs");
  compareRobots();
}

function compareRobots() {
  const [a, b] = pickers.map((picker) => compared[picker.value]);
  document.getElementById("title-a").textContent = a.title;
  document.getElementById("title-b").textContent = b.title;
  const [keyA, keyB] = document.querySelectorAll(".borders-key span");
  for (const [key, robot] of [[keyA, a], [keyB, b]]) key.textContent = robot.border.length ? robot.title : `${robot.title} (${key.dataset.none})`;
  keyB.hidden = a === b; // drawn once
  for (const { row, index } of comparedRows) {
    const cells = [shownValue(a.values[index]), shownValue(b.values[index]), shownDifference(a.values[index], b.values[index])];
    cells.forEach((text, column) => (row.cells[column + 3].textContent = text));
    row.hidden = onlyDifferences.checked && cells[2] === "";
  }
  for (const group of document.querySelectorAll("#borders g[data-robot]")) {
    group.setAttribute("class", pickers.map((picker, side) => (picker.value === group.dataset.robot ? "ab"[side] : "")).join(" ").trim());
  }
  const thin = document.querySelector("#borders g.b");
  thin?.parentNode.append(thin); // above the thick one
}

function picked() {
  const differs = onlyDifferences.checked ? "&differs" : "";
  history.replaceState(null, "", `#a=${pickers[0].value}&b=${pickers[1].value}${differs}`);
  compareRobots();
}

[...pickers, onlyDifferences].forEach((control) => control.addEventListener("change", picked));
addEventListener("hashchange", takeAddress);
takeAddress();

// Where the pointer is in the section, on a border if one is close.
function sectionAt(event) {
  const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(borders.getScreenCTM().inverse());
  if (place.x < 0) return [];
  const reach = NEAR / borders.getScreenCTM().a;
  let near = { gap: reach, x: place.x, y: place.y };
  for (const group of borders.querySelectorAll("g.a, g.b")) {
    for (const { x, y } of [...group.children].flatMap((line) => [...line.points])) {
      const gap = Math.hypot(x - place.x, y - place.y);
      if (gap < near.gap) near = { gap, x, y, title: compared[group.dataset.robot].title, colour: getComputedStyle(group).stroke };
    }
  }
  const line = (name, value) => ({ text: `${name}: ${shownValue(Math.round(value))}` });
  const on = near.title ? [{ text: near.title, colour: near.colour }] : [];
  return [...on, line(borders.dataset.across, near.x), line(borders.dataset.up, -near.y)];
}

const borders = document.getElementById("borders");
addEventListener("DOMContentLoaded", () => answerPointer(borders, sectionAt));
