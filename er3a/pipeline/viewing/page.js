// What a page's tables and figures can do beyond being read, and files to save from it. Without scripts the page loses
// nothing but these.
"use strict";

const WORDS = JSON.parse(document.getElementById("script-words").textContent);

// "−1 234.5" as "-1234.5" and "5.0·10⁻³" as "5.0e-3"; what is no number stays as it is.
function plain(text) {
  const superscripts = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const exponent = (shown) => "e" + shown.slice(3).replace("⁻", "-").replace(/[⁰-⁹¹²³]/g, (digit) => superscripts.indexOf(digit));
  const candidate = text.trim().replaceAll("\u202f", "").replace("−", "-").replace(/·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+$/, exponent);
  return candidate !== "" && Number.isFinite(Number(candidate)) ? candidate : text;
}

const numberIn = (text) => (text === "" ? NaN : Number(plain(text)));

const textOf = (cell) => (cell.innerText || cell.textContent).replace(/\s*\n\s*/g, " ").trim(); // what is folded has no inner text

const NUMBER = /[+−-]?\d+(?:\u202f\d{3})*(?:\.\d+)?(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|e[+−-]?\d+)?/u;
const LEADING = new RegExp(`^(?:[^\\d:：=()（）.,;]{0,20}[:：=])?\\s*(?:${WORDS.bounds})?[^\\p{L}\\d+−-]*(${NUMBER.source})(?![\\p{L}\\d_.-])`, "u");

// The number that a cell begins with, after a mark, its name ("t = 4 s") or "at least", and before a unit, a spread or
// words; NaN if it begins otherwise.
function valueOf(text) {
  const exact = numberIn(text);
  const found = Number.isNaN(exact) && LEADING.exec(text);
  return found ? numberIn(found[1].replaceAll("−", "-")) : exact;
}

// Where a verdict stands among all, the gravest first; -1 for a cell without one.
const GRAVEST = ["fail", "conflict", "caution", "no_reference", "not_computed", "not_examined", "pass"];
const gravity = (cell) => GRAVEST.findIndex((status) => cell?.querySelector(".badge, .decision")?.classList.contains(status));

// What each row of a column sorts by: if most cells with a number begin with it, that.
function sortedBy(texts) {
  const numbered = texts.filter((text) => /\d/.test(text));
  const numeric = 2 * numbered.filter((text) => !Number.isNaN(valueOf(text))).length > numbered.length;
  return texts.map((text) => [text, (numeric ? valueOf : numberIn)(text)]);
}

// Numbers by value, then words by letter, with the numbers in them by value; empty cells and dashes come last either way.
function compare([a, x], [b, y], sign) {
  const rank = (text, number) => (Number.isNaN(number) ? (text === "" || text === "–" ? 2 : 1) : 0);
  const ranks = rank(a, x) - rank(b, y);
  if (ranks !== 0) return ranks;
  return sign * (rank(a, x) === 0 ? x - y : a.localeCompare(b, undefined, { numeric: true }));
}

// A header's button turns the order: rising, falling, as written.
function makeSortable(table) {
  const body = table.tBodies[0];
  const written = [...body.rows];
  if (written.length < 2 || !table.tHead || table.matches(".entries, .matrix table")) return; // listings and D-H tables keep their order
  const headers = [...table.tHead.rows[0].cells];
  headers.forEach((header, column) => {
    // No button element: browsers leave those out of a header that is repeated on the next printed sheet.
    const control = Object.assign(document.createElement("span"), { role: "button", tabIndex: 0, className: "sort", title: WORDS.sort });
    control.append(...header.childNodes);
    header.append(control);
    const turn = () => {
      const next = { none: "ascending", ascending: "descending", descending: "none" }[header.ariaSort || "none"];
      headers.forEach((other) => other.removeAttribute("aria-sort"));
      if (next !== "none") header.setAttribute("aria-sort", next);
      const sign = next === "descending" ? -1 : 1;
      const texts = written.map((row) => (row.cells[column] ? textOf(row.cells[column]) : ""));
      const ranks = written.map((row) => gravity(row.cells[column]));
      const by = ranks.includes(-1) ? sortedBy(texts) : texts.map((text, place) => [text, ranks[place]]);
      const keys = new Map(written.map((row, place) => [row, by[place]]));
      const rows = next === "none" ? written : [...written].sort((a, b) => compare(keys.get(a), keys.get(b), sign));
      body.append(...rows);
    };
    control.addEventListener("click", turn);
    control.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      turn();
    });
  });
}

// A spreadsheet takes for a formula what begins as one; an apostrophe before it says that it is a text.
function csvOf(table) {
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const asText = (text) => (/^[=+@\t\r]/.test(text) || (text[0] === "-" && Number.isNaN(Number(text))) ? `'${text}` : text);
  return [...table.rows].map((row) => [...row.cells].map(textOf).map((text) => quoted(asText(plain(text)))).join(",")).join("\n") + "\n";
}

function nameFor(element) {
  const heading = document.title.replace(/ · er3a$/, "");
  const title = element.querySelector("caption, img")?.innerText || element.querySelector("img")?.alt || "table";
  return `${heading} ${title}`.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "_").slice(0, 80);
}

function download(text, type, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([text], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function toolButton(label, action) {
  const button = Object.assign(document.createElement("button"), { type: "button", className: "tool", textContent: label });
  button.addEventListener("click", action);
  return button;
}

function enlarge(image) {
  const dialog = Object.assign(document.createElement("dialog"), { className: "enlarged", ariaLabel: image.alt, closedBy: "any" });
  const close = toolButton(WORDS.close, () => dialog.close());
  const large = image.cloneNode();
  dialog.append(close, large);
  if (large.dataset.axes) answer(large);
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

// The number that an axis has at a part of its length.
const along = ({ from, to, log }, part) => (log ? from * (to / from) ** part : from + part * (to - from));

// As precise as a pointer is: a thousandth of the axis.
function reading({ from, to, log, ticks }, value, precision = 3) {
  if (ticks) return ticks.reduce((best, tick) => (Math.abs(tick[0] - value) < Math.abs(best[0] - value) ? tick : best))[1];
  const digits = precision - Math.ceil(Math.log10(log ? Math.abs(value) : Math.abs(to - from)));
  const rounded = digits < 0 ? Math.round(value * 10 ** digits) * 10 ** -digits : value;
  const text = rounded.toFixed(Math.min(9, Math.max(0, digits)));
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

// The points of a curve of a drawing, in parts of it from its lower left: runs that are drawn without a gap.
function runsOf(drawing, name) {
  const { width, height } = drawing.viewBox.baseVal;
  const group = drawing.getElementById(name);
  if (!group) return { runs: [], colour: "" };
  const own = [...group.children].find((part) => part.tagName === "path");
  const marks = [...group.querySelectorAll("use")];
  const point = (x, y) => [x / width, 1 - y / height];
  const drawn = (own?.getAttribute("d") ?? "").split("M").slice(1).map((run) => run.match(/[-\d.e]+/g).map(Number));
  const runs = drawn.map((flat) => Array.from({ length: flat.length / 2 }, (_, i) => point(flat[2 * i], flat[2 * i + 1])));
  for (const mark of own ? [] : marks) runs.push([point(Number(mark.getAttribute("x")), Number(mark.getAttribute("y")))]);
  return { runs, colour: own?.style.stroke || marks[0]?.style.fill || "" };
}

// The height of a curve above a place, where it has one.
function heightAt(runs, u) {
  for (const run of runs) {
    const i = run.findIndex(([x], k) => k > 0 && run[k - 1][0] <= u && u <= x);
    if (i < 0) continue;
    const [[x0, y0], [x1, y1]] = [run[i - 1], run[i]];
    return x1 > x0 ? y0 + ((u - x0) / (x1 - x0)) * (y1 - y0) : y1;
  }
  return NaN;
}

/** Where a figure's own edge is, whose place begins at `left`, `top`: in the middle of it, less border and padding. */
function drawnPart(image, left, top) {
  const { paddingLeft, borderLeftWidth } = getComputedStyle(image);
  const edges = 2 * (parseFloat(paddingLeft) + parseFloat(borderLeftWidth));
  const scale = Math.min((image.offsetWidth - edges) / image.naturalWidth, (image.offsetHeight - edges) / image.naturalHeight);
  const [width, height] = [scale * image.naturalWidth, scale * image.naturalHeight];
  return { x: left + (image.offsetWidth - width) / 2, y: top + (image.offsetHeight - height) / 2, width, height };
}

const NEAR = 12; // pixels

// What a figure's axes say where the pointer is: curves over an axis at that place, what is near, and bars.
class Answers {
  constructor(image) {
    this.image = image;
    this.axes = JSON.parse(image.dataset.axes);
    const source = decodeURIComponent(image.src.slice(image.src.indexOf(",") + 1));
    this.drawing = new DOMParser().parseFromString(source, "image/svg+xml").documentElement;
    for (const axes of this.axes) {
      axes.drawn = axes.curves.map(([name, title]) => ({ title, ...runsOf(this.drawing, name) }));
      for (const curve of axes.drawn) curve.over = !axes.drawn_to_scale && curve.runs.some((run) => run.length > 2) && curve.runs.every((run) => run.every(([x], k) => k === 0 || x >= run[k - 1][0]));
    }
  }

  /** Lines of text, each with the colour of what it is about; none outside of all axes. */
  at(event) {
    const { left, top } = this.image.getBoundingClientRect();
    const { x: x0, y: y0, width: w, height: h } = drawnPart(this.image, left, top);
    const [u, v] = [(event.clientX - x0) / w, 1 - (event.clientY - y0) / h];
    const axes = this.axes.find(({ box }) => u >= box[0] && u <= box[2] && v >= box[1] && v <= box[3]);
    if (!axes) return [];
    const { box, x, y } = axes;
    const across = (part) => along(x, (part - box[0]) / (box[2] - box[0]));
    const up = (part) => along(y, (part - box[1]) / (box[3] - box[1]));
    const named = (scale, value) => ({ text: `${scale.name ? `${scale.name}: ` : ""}${reading(scale, value)}` });
    const bars = axes.bars.filter(([from, to, , , upright]) => {
      const at = upright ? across(u) : up(v);
      return at >= from && at <= to;
    });
    if (bars.length) {
      const [along0, across0] = bars[0][4] ? [y, named(x, (bars[0][0] + bars[0][1]) / 2)] : [x, named(y, (bars[0][0] + bars[0][1]) / 2)];
      const marks = this.near(axes, u, v, w, h);
      return [across0, ...bars.map(([, , from, to, , title, colour]) => ({
        text: `${title || along0.name}${WORDS.colon}${from === 0 ? "" : `${reading(along0, from)} … `}${reading(along0, to)}`, colour,
      })), ...marks.map(({ title, colour, point }) => ({ text: `${title || "●"}${WORDS.colon}${reading(along0, bars[0][4] ? up(point[1]) : across(point[0]))}`, colour }))];
    }
    const over = axes.drawn.filter((curve) => curve.over).map((curve) => ({ ...curve, height: heightAt(curve.runs, u) }));
    const read = over.filter(({ height }) => height >= box[1] - 1e-3 && height <= box[3] + 1e-3);
    if (read.length) {
      return [named(x, across(u)), ...read.map(({ title, colour, height }) => ({ text: `${title || y.name}${WORDS.colon}${reading(y, up(height))}`, colour }))];
    }
    const [found] = this.near(axes, u, v, w, h);
    const [place, title] = found ? [found.point, found.title] : [[u, v], ""];
    return [...(title ? [{ text: title, colour: found.colour }] : []), named(x, across(place[0])), named(y, up(place[1]))];
  }

  /** What is drawn close to the pointer, the closest first. */
  near({ drawn }, u, v, w, h) {
    const away = ([x, y]) => Math.hypot((x - u) * w, (y - v) * h);
    return drawn
      .flatMap(({ title, colour, runs }) => runs.flat().map((point) => ({ title, colour, point, gap: away(point) })))
      .filter(({ gap }) => gap < NEAR)
      .sort((a, b) => a.gap - b.gap)
      .slice(0, 1);
  }
}

function answer(image) {
  let answers = null;
  answerPointer(image, (event) => (answers ??= new Answers(image)).at(event));
}

// The pointer, or a finger, asks a figure; the lines that it answers stand beside it.
function answerPointer(image, linesAt) {
  const box = Object.assign(document.createElement("div"), { className: "reading", hidden: true });
  image.after(box);
  const ask = (event) => {
    const lines = linesAt(event);
    box.hidden = lines.length === 0;
    box.replaceChildren(...lines.map(({ text, colour }) => {
      const line = Object.assign(document.createElement("div"), { textContent: text });
      if (colour) line.style.setProperty("--swatch", colour);
      line.classList.toggle("swatch", Boolean(colour));
      return line;
    }));
    const { offsetWidth: width, offsetHeight: height } = box;
    const beyond = event.clientX + 16 + width > document.documentElement.clientWidth;
    box.style.left = `${Math.max(4, beyond ? event.clientX - 16 - width : event.clientX + 16)}px`;
    box.style.top = `${Math.max(4, Math.min(event.clientY + 12, innerHeight - height - 4))}px`;
  };
  image.addEventListener("pointermove", ask);
  image.addEventListener("pointerdown", ask);
  image.addEventListener("pointerleave", () => (box.hidden = true));
  addEventListener("scroll", () => (box.hidden = true), { passive: true, capture: true });
}

// The address keeps what a reader chose, so that a reload, the way back and a link lead to it; what is empty goes.
function keepInAddress(queries, place) {
  const address = new URL(location.href);
  for (const [name, value] of Object.entries(queries)) value ? address.searchParams.set(name, value) : address.searchParams.delete(name);
  if (place) ["play", "t", "until"].forEach((name) => address.searchParams.delete(name)); // of another choice
  if (place || queries.play) address.hash = encodeURIComponent(place ?? "");
  history.replaceState(history.state, "", address);
}

const MANY_ROWS = 12;

// A field that leaves the rows in which its words stand. The address keeps them, as "?2=words" for the page's third table.
function filterFor(table) {
  const box = document.createElement("label");
  const count = document.createElement("span");
  const number = String([...document.querySelectorAll("table")].indexOf(table));
  const field = document.createElement("input");
  field.type = "search";
  field.placeholder = field.ariaLabel = WORDS.filter;
  field.value = new URLSearchParams(location.search).get(number) ?? "";
  const filter = () => {
    const words = sought(field.value).split(/\s+/);
    for (const row of table.tBodies[0].rows) {
      const text = sought(textOf(row));
      row.hidden = !words.every((word) => text.includes(word));
    }
    const { rows } = table.tBodies[0];
    const shown = [...rows].filter((row) => !row.hidden).length;
    count.textContent = shown < rows.length ? ` ${shown} / ${rows.length}` : "";
  };
  count.role = "status";
  box.append(field, count);
  field.addEventListener("input", () => {
    filter();
    keepInAddress({ [number]: field.value });
  });
  if (field.value) {
    unfold(table); // first: Chromium leaves room for nothing in a fold that is opened after its rows were measured
    filter();
  }
  return box;
}

// Whether a text holds a word, from the word's beginning on.
const holdsWord = (text, word) => new RegExp(`(?<![a-z\\d])${word.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")}`).test(text);

// As it is compared: in small letters, with plain minus signs and numbers.
const sought = (text) => text.toLowerCase().replaceAll("−", "-").replaceAll("\u202f", "");

const SHOWN_PLACES = 4;
const SHOWN_LETTERS = 160;
const BEGINNING = 60; // letters by which an address names a place
const PLACES = "h1, h2, h3, summary, caption, figcaption, p, li, dt, dd, tr, img, div";
let places = null; // of all pages, this one first: its address, its title, texts with what they are sought in

async function loadPlaces(root) {
  const pages = await (await unpacked(globalThis.PLACES)).json();
  places = pages.map(([page, title, parts]) => {
    const texts = parts.flatMap(([head, own]) => own.map((text) => ({ text, letters: sought(text), above: sought(`${title} ${head}`) })));
    return { address: new URL(page, root).href, title, whole: sought(title), texts };
  });
  places.sort((a, b) => location.href.startsWith(b.address) - location.href.startsWith(a.address));
}

// A menu with a field for words and the places that have them, on all pages; the page beneath stays as it is.
function addFinder() {
  if (!globalThis.PLACES) return;
  const menu = Object.assign(document.createElement("details"), { className: "menu find" });
  menu.innerHTML = '<summary></summary><div role="search"><input type="search"> <span role="status"></span><ul></ul></div>';
  const [label, field, status, list] = ["summary", "input", "span", "ul"].map((part) => menu.querySelector(part));
  [label.textContent, field.ariaLabel] = [WORDS.find, WORDS.find];
  const header = document.querySelector("header");
  header.insertBefore(menu, header.querySelector(".chip"));
  menu.addEventListener("toggle", () => menu.open && field.focus());
  field.addEventListener("input", async () => {
    if (!places) await loadPlaces(document.querySelector('script[src$="marks.js"]').src);
    const words = sought(field.value).split(/\s+/).filter(Boolean);
    const found = words.length ? placesWith(words) : [];
    list.replaceChildren(...found.map((each) => linkTo(each, words)));
    status.textContent = words.length && !found.length ? WORDS.none : "";
  });
  addEventListener("keydown", (event) => {
    const busy = event.target.closest?.("input, select, textarea, canvas, [contenteditable]");
    if (event.key !== "/" || busy || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    menu.open = true;
  });
}

// What pages have that holds all words, at least one of them itself and the others in a heading above it, by page.
// Words that a page's title has lead to the page.
function placesWith(words) {
  const holds = ({ letters, above }) => words.every((word) => holdsWord(`${above} ${letters}`, word)) && words.some((word) => holdsWord(letters, word));
  const found = places.map(({ address, title, whole, texts }) => {
    const held = texts.filter(holds).map(({ text }) => text);
    return { address, title, texts: held.length || !words.every((word) => holdsWord(whole, word)) ? held : [title] };
  });
  return found.filter(({ texts }) => texts.length);
}

// Of a long text the part with the first word that it holds.
function excerpt(text, words) {
  const at = Math.max(0, Math.min(...words.map((word) => sought(text).indexOf(word)).filter((place) => place >= 0)) - SHOWN_LETTERS / 3);
  const from = Number.isFinite(at) && text.length > SHOWN_LETTERS ? Math.floor(at) : 0;
  return (from ? "…" : "") + text.slice(from, from + SHOWN_LETTERS) + (from + SHOWN_LETTERS < text.length ? "…" : "");
}

const squeezed = (text) => text.replace(/\s+/g, "");

// Links to a page and to the first places that have the words.
function linkTo({ address, title, texts }, words) {
  const item = document.createElement("li");
  const link = (text, place) => Object.assign(document.createElement("a"), { href: `${address}${place ? `?at=${encodeURIComponent(squeezed(place).slice(0, BEGINNING))}` : ""}`, textContent: text });
  const shown = texts.slice(0, SHOWN_PLACES).flatMap((text) => [" · ", link(excerpt(text, words), text)]).slice(1);
  item.append(link(title), WORDS.colon, ...shown, texts.length > SHOWN_PLACES ? ` … (${texts.length})` : "");
  return item;
}

// Where the text begins that the address names; of parts that are shown one at a time that one is then shown.
function goToPlace() {
  const beginning = new URLSearchParams(location.search).get("at");
  const all = beginning ? [...document.querySelectorAll(`main :is(${PLACES})`)].filter((part) => squeezed(part.textContent).startsWith(beginning)) : [];
  const place = all.find((part) => part.checkVisibility()) ?? all[0];
  if (!place) return;
  const part = place.closest("[data-one-of] > *");
  if (part) {
    part.dispatchEvent(new Event("beforematch"));
    keepInAddress({}, part.querySelector("h2").id); // the player takes it up
  }
  unfold(place);
  place.classList.add("sought");
  place.scrollIntoView({ block: "center" });
}

// Joints that a sentence names, as "(10, −20, 30, 0, 45, 0) deg" or "(10°, −20°, 300 mm, 0°)", lead to the arm in the
// teach panel.
function linkJoints(page) {
  const value = "[−-]?\\d+(?:\\.\\d+)?";
  const unit = "(?:°|\\s*mm)";
  const more = Number(page.dataset.joints) - 1;
  if (more < 3) return; // three numbers may as well be a place or a turn
  const vector = new RegExp(`[(（]((?:${value}${unit}?[,，]\\s*){${more}}${value})(?=${unit}[)）]|[)）]\\s*(?:deg|°|度))`);
  const texts = document.createTreeWalker(page, NodeFilter.SHOW_TEXT);
  const found = [];
  while (texts.nextNode()) if (vector.test(texts.currentNode.data) && !texts.currentNode.parentElement.closest("a, code, h2, script")) found.push(texts.currentNode);
  for (let text of found) {
    for (let hit; (hit = vector.exec(text.data)); ) {
      const named = text.splitText(hit.index + 1);
      text = named.splitText(hit[1].length);
      const link = document.createElement("a");
      link.href = `${page.dataset.panel}#q=${hit[1].replace(/[\s°m]/g, "").replaceAll("−", "-").replaceAll("，", ",")}`;
      named.replaceWith(link);
      link.append(named);
    }
  }
}

// What the address names: a place on the page, or a motion.
const addressed = () => decodeURIComponent(location.hash.slice(1));

// Of parts that are alike, one at a time: picked by list, a link, the browser's search, or by the motion that is shown. A
// sheet of paper has all.
function showOneOf(group) {
  const parts = [...group.children];
  if (parts.length < 2) return;
  const motionOf = (part) => part.querySelector("h2").dataset.motion ?? part.querySelector("h2").id.replace(/-(solutions|clearance)$/, "");
  const chooser = document.createElement("select");
  chooser.append(...parts.map((part) => new Option(motionOf(part))));
  const show = (part) => {
    chooser.value = motionOf(part);
    for (const other of parts) other === part ? other.removeAttribute("hidden") : other.setAttribute("hidden", "until-found");
    dispatchEvent(new Event("resize")); // for what takes its size from a part that was not there
  };
  const choose = (part) => {
    show(part);
    dispatchEvent(new CustomEvent("chosen", { detail: motionOf(part) }));
  };
  const label = Object.assign(document.createElement("label"), { className: "pickers" });
  label.append(`${group.dataset.oneOf} `, chooser);
  group.before(label);
  chooser.addEventListener("change", () => choose(parts[chooser.selectedIndex]));
  for (const part of parts) part.addEventListener("beforematch", () => choose(part));
  const follow = () => {
    const aim = document.getElementById(addressed());
    const part = aim && parts.find((each) => each.contains(aim));
    if (!part) return;
    choose(part);
    aim.scrollIntoView();
  };
  addEventListener("hashchange", follow);
  addEventListener("motion", ({ detail }) => parts.filter((part) => motionOf(part) === detail).forEach(show));
  show(parts[0]);
  follow();
}

// What an address leads to may be folded, or inside of what is.
function unfoldTarget() {
  const aim = document.getElementById(addressed());
  if (!aim?.closest("details:not([open])")) return;
  unfold(aim);
  aim.scrollIntoView();
}

function unfold(part) {
  for (let fold = part.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
}

// Back leads to where one was: what was unfolded, and how far down.
const folds = () => [...document.querySelectorAll("main details")];

function keepPlace(event) {
  if (event.target.closest("a[href]")) history.replaceState({ ...history.state, open: folds().map((fold) => fold.open), y: scrollY }, "");
}

function returnToPlace() {
  if (!history.state?.open) return;
  folds().forEach((fold, index) => (fold.open = history.state.open[index] ?? fold.open));
  scrollTo(0, history.state.y);
}

// The first time that a page uses a term of the glossary, its meaning can be asked for, by pointer, key or touch.
function explainTerms(terms) {
  const letters = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&").replaceAll(" ", "\\s+");
  const named = Object.keys(terms).sort((a, b) => b.length - a.length);
  const pattern = new RegExp(named.map((term) => (/\w$/.test(term) ? `\\b${letters(term)}(?:s|es)?\\b` : letters(term))).join("|"), "i");
  const open = new Map(named.map((term) => [term.toLowerCase(), terms[term]]));
  const skipped = "a, button, label, summary, code, svg, script, noscript, h1, h2, h3, thead, .cells, .badge, .term, [hidden]";
  const texts = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  const found = [];
  while (texts.nextNode()) if (pattern.test(texts.currentNode.data) && !texts.currentNode.parentElement.closest(skipped)) found.push(texts.currentNode);
  for (let text of found) {
    for (let hit; (hit = pattern.exec(text.data)); ) {
      const rest = text.splitText(hit.index + hit[0].length);
      const said = hit[0].toLowerCase().replace(/\s+/g, " ");
      const term = [said, said.replace(/s$/, ""), said.replace(/es$/, "")].find((word) => open.has(word));
      if (term) {
        explain(text.splitText(hit.index), open.get(term));
        open.delete(term);
      }
      text = rest;
    }
  }
}

function explain(text, meaning) {
  const term = Object.assign(document.createElement("span"), { className: "term", tabIndex: 0 });
  const id = `term-${document.querySelectorAll(".tip").length}`;
  const tip = Object.assign(document.createElement("span"), { id, className: "tip", role: "tooltip", textContent: meaning, hidden: true });
  term.setAttribute("aria-describedby", tip.id);
  text.replaceWith(term);
  term.append(text);
  document.body.append(tip);
  const show = () => {
    tip.hidden = false;
    const at = term.getBoundingClientRect();
    tip.style.left = `${Math.max(8, Math.min(at.left, document.documentElement.clientWidth - tip.offsetWidth - 8))}px`;
    tip.style.top = `${at.top > tip.offsetHeight + 8 ? at.top - tip.offsetHeight - 4 : at.bottom + 4}px`;
  };
  const asked = () => document.activeElement === term || term.matches(":hover") || tip.matches(":hover");
  const leave = () => setTimeout(() => asked() || (tip.hidden = true), 150);
  for (const event of ["pointerenter", "focus"]) term.addEventListener(event, show);
  for (const event of ["pointerleave", "blur"]) term.addEventListener(event, leave);
  tip.addEventListener("pointerleave", leave);
  term.addEventListener("keydown", (event) => event.key === "Escape" && (tip.hidden = true));
  addEventListener("scroll", () => tip.hidden || (asked() ? show() : leave()), { passive: true, capture: true });
}

document.querySelectorAll("main[data-panel]").forEach(linkJoints);
if (!document.querySelector("main[data-panel]")) document.querySelectorAll('a[href^="teach.html#q="]').forEach((link) => link.replaceWith(...link.childNodes));
addEventListener("hashchange", unfoldTarget);
unfoldTarget();
document.querySelectorAll("[data-one-of]").forEach(showOneOf);
explainTerms(JSON.parse(document.getElementById("terms").textContent));

// A sheet of paper can't be unfolded.
addEventListener("beforeprint", () => document.querySelectorAll("details.section").forEach((details) => (details.open = true)));

// On a phone each row of a table of cards is one: its cells stand below one another, each after its column's name. A row
// that an address leads to has these names too.
function nameCells(table) {
  const names = [...table.tHead.rows[0].cells].map((header) => (header.innerText || header.textContent).replace(/\s+/g, " ").trim());
  for (const row of table.tBodies[0].rows) [...row.cells].forEach((cell, column) => (cell.dataset.column = names[column]));
}

for (const table of document.querySelectorAll("table")) {
  if (table.tHead && (table.classList.contains("cards") || table.querySelector("tbody tr[id]"))) nameCells(table);
  makeSortable(table);
  if (table.matches(".matrix table, .tile table")) continue;
  const tools = document.createElement("p");
  tools.className = "tools";
  tools.append(toolButton(WORDS.csv, () => download(csvOf(table), "text/csv", `${nameFor(table)}.csv`)));
  if (table.tHead && table.tBodies[0]?.rows.length >= MANY_ROWS) tools.append(filterFor(table));
  (table.closest(".scroll") || table).after(tools);
}

for (const figure of document.querySelectorAll("figure")) {
  const image = figure.querySelector("img");
  if (!image) continue;
  if (image.dataset.axes) answer(image);
  const tools = document.createElement("p");
  tools.className = "tools";
  const file = `${nameFor(figure)}.${image.src.match(/^data:image\/(\w+)/)?.[1] ?? "svg"}`;
  const save = Object.assign(document.createElement("a"), { href: image.src, download: file, textContent: WORDS.svg });
  tools.append(toolButton(WORDS.enlarge, () => enlarge(image)), save);
  image.after(tools);
}

// What travels packed.
async function unpacked(text) {
  const packed = await fetch(`data:application/gzip;base64,${text}`);
  return new Response(packed.body.pipeThrough(new DecompressionStream("gzip")));
}

// A file that travels packed in its link is saved as it is.
async function save(link) {
  const text = await (await unpacked(link.dataset.packed)).blob();
  const saved = Object.assign(document.createElement("a"), { href: URL.createObjectURL(text), download: link.download });
  saved.click();
  URL.revokeObjectURL(saved.href);
}

for (const link of document.querySelectorAll("[data-packed]")) {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    save(link);
  });
}

// What each stage of this robot came to, where the index has left word of it.
const SIGNS = { pass: "✓", caution: "▲", fail: "✕", conflict: "≠", no_reference: "○", not_computed: "–", no_verdict: "⊘" };
for (const link of document.querySelectorAll("nav [data-stage]")) {
  const status = globalThis.MARKS?.[document.querySelector("main").dataset.name]?.[link.dataset.stage];
  if (!status) continue;
  link.dataset.mark = SIGNS[status] ?? "○";
  link.classList.add(status);
}

document.querySelector("nav [aria-current]")?.scrollIntoView({ inline: "center", block: "nearest" }); // where the pages' names don't fit

// The row of the list whose moment or picture is shown.
const rows = [...document.querySelectorAll(".runs:not(.plain) a[href]")];
const fix = rows.some((row) => row.dataset.fix) && document.querySelector(".hero .fix"); // it follows the row
const mark = (shown, part = shown) => {
  rows.forEach((row) => (row === shown ? row.setAttribute("aria-current", "true") : row.removeAttribute("aria-current")));
  shown?.closest("details")?.setAttribute("open", "");
  if (!fix || fix.toggleAttribute("hidden", !part?.dataset.fix)) return;
  const { lead, fix: advice, instead, go } = part.dataset;
  fix.querySelector("b").textContent = lead;
  fix.querySelector("span").replaceChildren(fix.querySelector("b"), ` ${advice}`);
  const link = fix.querySelector("a");
  if (instead) [link.href, link.textContent] = [instead, go];
  link.hidden = !instead || (link.hash === shown.hash && !instead.includes("?")); // nothing else is there to be shown
};
addEventListener("advice", ({ detail }) => mark(rows.find((row) => row.ariaCurrent), detail)); // of a part of the row's motion
// Several rows may show one motion, each another moment of it.
const other = (row) => new URLSearchParams(row.dataset.instead?.split(/[?#]/)[1]).get("play"); // that it leads to instead
const playing = (name, t) => rows.find((row) => row.dataset.play === name && row.dataset.t === t) ?? rows.find((row) => row.dataset.play === name) ?? rows.find((row) => name && other(row) === name);
const choose = (row, play, t) => {
  mark(row);
  keepInAddress({ play, t, until: "" }); // no place: who opens it sees the first screen
};
for (const row of rows) row.addEventListener("click", () => (row.dataset.play ? choose(row, row.dataset.play, row.dataset.t) : mark(row)));
addEventListener("hashchange", () => rows.filter((row) => !row.dataset.play && row.hash === location.hash).forEach(mark)); // as by the one thing to do
const [named, asked] = [addressed(), new URLSearchParams(location.search)];
mark(playing(asked.get("play"), asked.get("t")) ?? rows.find((row) => row.querySelector("b").textContent === named || row.hash === location.hash) ?? (location.hash.startsWith("#cell-") ? undefined : playing(named || document.querySelector(".player")?.dataset.opened) ?? rows[0]));
const follow = ({ detail }) => rows.some((row) => row.ariaCurrent && row.dataset.play === detail) || (entryOf(location.hash) === detail ? mark(playing(detail)) : choose(playing(detail), detail));
addEventListener("player", () => addEventListener("motion", follow)); // the first one is not of the reader's choice

addFinder();

// A menu closes by a click elsewhere and by Escape.
const menus = document.querySelectorAll(".menu");
addEventListener("click", ({ target }) => menus.forEach((menu) => menu.contains(target) || (menu.open = false)));
addEventListener("keydown", ({ key }) => key === "Escape" && menus.forEach((menu) => (menu.open = false)));

goToPlace();
addEventListener("click", keepPlace, true);
addEventListener("player", returnToPlace);
returnToPlace();

// What an entry of a table is of is marked in the picture: of the address, or under the pointer. What the address asks for
// together is marked in the table; the evidence of an entry stands below.
const entryOf = (hash) => hash?.slice(1).replace(/^(cell|entry)-/, "") || null;
const entryLinks = document.querySelectorAll(".runs a[href^='#cell-'], .grid .entries a");
const evidence = Object.assign(document.createElement("b"), { className: "evidence", role: "status" });
document.querySelector(".grid .key")?.append(evidence);
function showEntry(entry = entryOf(location.hash) || new URLSearchParams(location.search).get("play")) {
  for (const part of document.querySelectorAll("[data-entry]")) part.classList.toggle("shown", part.dataset.entry === entry);
  evidence.textContent = document.getElementById(`cell-${entry}`)?.querySelector("a")?.dataset.said ?? "";
  for (const link of document.querySelectorAll(".grid .key > a")) link.hash = document.getElementById(`entry-${entry}`)?.id ?? "marks";
  for (const link of entryLinks) link.toggleAttribute("data-shown", [entryOf(link.hash), link.dataset.asked].includes(entry || document.querySelector(".player")?.dataset.opened));
}
for (const link of entryLinks) {
  link.addEventListener("pointerenter", () => showEntry(entryOf(link.hash)));
  link.addEventListener("pointerleave", () => showEntry());
}
for (const part of document.querySelectorAll(".hero svg [data-entry]")) part.addEventListener("click", () => (location.hash = `cell-${part.dataset.entry}`));
for (const event of ["hashchange", "motion"]) addEventListener(event, () => showEntry());
addEventListener("hashchange", () => dispatchEvent(new CustomEvent("entry", { detail: entryOf(location.hash) }))); // the player shows it
showEntry();
// The one thing to do opens lines to copy.
const asking = document.querySelector(".hero .fix a");
for (const lines of document.querySelectorAll(".hero .lines")) asking?.addEventListener("click", () => setTimeout(() => lines.scrollIntoView({ block: "nearest" }), (lines.open = true) && 100));
