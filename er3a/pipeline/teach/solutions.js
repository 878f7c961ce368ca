/** The list of all joint solutions of the tool's pose, to click through. */

import { excesses, inverse } from "er3a/inverse";
import { write } from "er3a/readouts";
import { fill, fixed, inDegrees, inMillimetres, limited, shown } from "er3a/text";

const SAME_ARM = 1e-6; // rad

const byId = (id) => document.getElementById(id);

function element(tag, className, text = "", parts = []) {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text;
  made.append(...parts);
  return made;
}

export class SolutionList {
  /** `choose(q)` moves the arm; `ghost(q)` shows a pale one, null takes it away; `overlap(q)` says what collides. */
  constructor(data, arm, choose, ghost, overlap) {
    Object.assign(this, { data, arm, choose, ghost, overlap, refused: byId("refused") });
    byId("previous").addEventListener("click", () => this.#step(-1));
    byId("next").addEventListener("click", () => this.#step(1));
  }

  /** Lists the solutions of pose `T`, which the arm has at joint angles `q`. */
  list(T, q) {
    const { words } = this.data;
    const { rows, unsolved, free } = inverse(this.data.table, this.arm, T, q);
    if (!rows.some((row) => same(row.q, q))) rows.push({ slot: null, q: [...q], withinLimits: true });
    Object.assign(this, { rows, buttons: [], reason: "" });
    const items = [];
    const branches = []; // of each its first row: whole turns change nothing
    for (const slot of [0, 1, 2, 3, 4, 5, 6, 7, null]) {
      const turns = rows.filter((row) => row.slot === slot);
      if (turns.length) items.push(this.#branch(turns)) && branches.push(turns[0]);
      const fault = unsolved.find((branch) => branch.slot === slot);
      if (fault) items.push(this.#missing(fault));
    }
    byId("branches").replaceChildren(...items);
    const within = branches.filter((row) => row.withinLimits);
    const colliding = within.filter((row) => row.overlap).length;
    write(byId("count"), fill(colliding ? words.count_colliding : words.count, { within: within.length, total: branches.length, colliding }));
    write(byId("free"), free.map((kind) => words.free[kind]).join(" "));
    this.ghost(null);
    this.mark(q);
  }

  /** Lists solutions that iteration found, the arm's own first, and `text` about them. */
  listFound(found, text) {
    this.rows = found.map((q) => ({ slot: null, q, withinLimits: true }));
    this.buttons = [];
    byId("branches").replaceChildren(...this.rows.map((row) => this.#branch([row])));
    write(byId("count"), text);
    this.ghost(null);
    this.mark(found[0]);
  }

  /** Marks the solution that the arm is in. */
  mark(q) {
    this.current = this.rows.findIndex((row) => same(row.q, q));
    for (const button of this.buttons) button.ariaPressed = String(Number(button.dataset.row) === this.current);
  }

  #label(row) {
    const { words, branch_labels: labels } = this.data;
    if (row.slot !== null) return labels[row.slot];
    return this.arm ? words.current : fill(words.found, { number: this.rows.indexOf(row) + 1 });
  }

  #branch(turns) {
    const { words, joint_names: names } = this.data;
    const [first, ...further] = turns;
    const overlap = this.overlap(first.q); // whole turns change nothing
    for (const row of turns) row.overlap = overlap;
    const joints = element("span", "row-joints", "", first.q.map((value, k) => element("span", "", fixed(shown(this.data.table, k, value)))));
    const state = !first.withinLimits || overlap ? "fail" : this.#atLimit(first).length ? "near" : "pass";
    const verdict = element("span", `row-verdict ${state}`, (first.withinLimits && overlap) || this.#verdict(first));
    const button = this.#button(first, [element("b", "", this.#label(first)), joints, verdict]);
    const item = element("li", "branch", "", [button]);
    if (further.length) {
      const chips = further.map((row) => {
        const turns = names.map((name, k) => [name, row.q[k] - first.q[k]]).filter(([, turn]) => Math.abs(turn) > 1);
        const texts = turns.map(([joint, turn]) => fill(words.turn, { joint, turn: `${turn > 0 ? "+" : ""}${inDegrees(turn, 0)}` }));
        return this.#button(row, [texts.join(", ")]);
      });
      item.append(element("p", "turns", `${words.other_turns} `, chips));
    }
    return item;
  }

  #missing({ slot, fault, gap }) {
    const { words, branch_labels: labels } = this.data;
    const reason = fill(words.missing, { reason: faultWords(words, fault, gap) });
    const again = reason === this.reason; // as that of the branch before: it is said once
    this.reason = reason;
    return element("li", "branch missing", "", [element("b", "", labels[slot]), element("span", "row-verdict", again ? "″" : reason)]);
  }

  /** Names of the joints that stand at a limit. */
  #atLimit({ q }) {
    const { table, joint_names: names } = this.data;
    return names.filter((_, k) => !table.continuous[k] && Math.min(q[k] - table.lower[k], table.upper[k] - q[k]) < SAME_ARM);
  }

  #verdict(row) {
    const { words } = this.data;
    const at = this.#atLimit(row).join(", ");
    if (row.withinLimits) return at && fill(words.within_at, { joints: at });
    const [beyond] = excesses(this.data.table, row.q); // all of it is said when it is asked for
    const { name, text } = limited(this.data, beyond);
    return fill(words.leaves, { joint: name, excess: text(beyond.excess, 0) });
  }

  #button(row, parts) {
    const button = element("button", "solution", "", parts);
    button.type = "button";
    button.dataset.row = this.rows.indexOf(row);
    button.setAttribute("aria-disabled", String(!row.withinLimits));
    button.addEventListener("click", () => {
      if (row.withinLimits) this.choose(row.q);
      else button.after(this.refused);
      write(this.refused, row.withinLimits ? "" : fill(this.data.words.not_moved, { reasons: beyondLimits(this.data, row.q).join(this.data.words.separator) }));
    });
    for (const event of ["pointerenter", "focus"]) button.addEventListener(event, () => this.ghost(row.q));
    for (const event of ["pointerleave", "blur"]) button.addEventListener(event, () => this.ghost(null));
    this.buttons.push(button);
    return button;
  }

  #step(by) {
    const order = this.buttons.map((button) => Number(button.dataset.row)).filter((row) => this.rows[row].withinLimits);
    const at = order.indexOf(this.current);
    write(this.refused, "");
    this.choose(this.rows[order[(at + by + order.length) % order.length]].q);
  }
}

/** Which joints leave their limits, and by how much. */
export function beyondLimits(data, q) {
  const { words, table } = data;
  return excesses(table, q).map((beyond) => {
    const { name, text } = limited(data, beyond);
    const { angle, excess, above, limit } = beyond;
    return fill(words[above ? "above" : "below"], { joint: name, angle: text(angle), excess: text(excess), limit: text(limit, 0) });
  });
}

const faultWords = (words, fault, gap) =>
  fill(words.faults[fault], { gap: fault === "orientation" ? inDegrees(gap) : inMillimetres(gap) });

/** Why the arm can't take a pose, from what was found instead of joints. */
export function whyNot(data, { row, branch, miss }) {
  if (row) return beyondLimits(data, row.q).join(data.words.separator);
  if (branch) return faultWords(data.words, branch.fault, branch.gap);
  return fill(data.words.not_found, { length: inMillimetres(miss.length), angle: inDegrees(miss.angle) });
}

const same = (a, b) => a.every((value, k) => Math.abs(value - b[k]) < SAME_ARM);
