/** Options put in order by pressing, dragging, or with arrow buttons; the selects below stay the answer. */

import { fill } from "./words.js";

/** @typedef {{select: HTMLSelectElement, label: string, row: HTMLLIElement}} Option */

export class Ranking {
  /** @param {HTMLElement} box of one ranking item */
  constructor(box) {
    this.box = box;
    this.list = document.createElement("ol");
    this.list.className = "ranks";
    this.told = document.createElement("p");
    this.told.className = "help";
    this.said = document.createElement("p");
    this.said.className = "hidden";
    this.said.setAttribute("role", "status");
    /** @type {Option[]} */
    this.options = [...box.querySelectorAll("select")].map((select) => {
      const label = select.labels?.[0]?.textContent ?? "";
      return { select, label, row: document.createElement("li") };
    });
    /** @type {Option[]} those that have a place, the first one first */
    this.placed = this.options.filter(({ select }) => select.value).sort((a, b) => Number(a.select.value) - Number(b.select.value));
    for (const select of box.querySelectorAll("select")) {
      const line = select.closest(".rank");
      if (line instanceof HTMLElement) line.hidden = true;
    }
    for (const option of this.options) this.draggable(option);
    box.prepend(this.told, this.list, this.said);
    this.draw();
  }

  /** @param {Option} option */
  give(option) {
    this.placed.push(option);
    const left = this.options.filter((one) => !this.placed.includes(one));
    if (left.length === 1) this.placed.push(...left);
    this.settle(option);
  }

  /** @param {Option} option @param {number} to */
  move(option, to) {
    const from = this.placed.indexOf(option);
    if (from < 0 || to < 0 || to >= this.placed.length || to === from) return;
    this.placed.splice(from, 1);
    this.placed.splice(to, 0, option);
    this.settle(option);
  }

  /** Writes the places into the fields. @param {Option} option the one that was moved */
  settle(option) {
    for (const one of this.options) {
      const place = this.placed.indexOf(one);
      one.select.value = place < 0 ? "" : String(place + 1);
    }
    this.draw();
    const place = this.placed.indexOf(option) + 1;
    this.said.textContent = fill(this.box.dataset.placed ?? "", { option: option.label, place });
    option.select.dispatchEvent(new Event("change", { bubbles: true }));
  }

  draw() {
    const { hint = "", change = "" } = this.box.dataset;
    const done = this.placed.length === this.options.length;
    this.told.textContent = done ? change : hint;
    const rest = this.options.filter((option) => !this.placed.includes(option));
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.button : undefined;
    const [focusedRow] = this.options.filter((option) => option.row.contains(document.activeElement));
    const rows = [...this.placed, ...rest];
    rows.forEach((option, n) => {
      if (this.list.children[n] !== option.row) this.list.insertBefore(option.row, this.list.children[n] ?? null);
      this.fillRow(option, this.placed.includes(option) ? n : -1);
    });
    if (!focusedRow || !focused) return;
    const wanted = focusedRow.row.querySelector(`[data-button="${focused}"]:not(:disabled)`) ?? this.list.querySelector('[data-button="give"]')
      ?? focusedRow.row.querySelector("button:not(:disabled)");
    if (wanted instanceof HTMLElement) wanted.focus();
  }

  /** @param {Option} option @param {number} place -1 for none yet */
  fillRow(option, place) {
    const { row, label } = option;
    const { up = "", down = "", give = "" } = this.box.dataset;
    row.className = place < 0 ? "rank-row rank-free" : "rank-row";
    const number = document.createElement("span");
    number.className = "rank-place";
    number.textContent = place < 0 ? "" : String(place + 1);
    if (place < 0) {
      const whole = this.button("give", "", fill(give, { option: label }), () => this.give(option));
      whole.className = "rank-whole";
      whole.append(number, label);
      row.replaceChildren(whole);
      return;
    }
    const words = document.createElement("span");
    words.className = "rank-words";
    words.textContent = label;
    const raise = this.button("up", "▲", fill(up, { option: label }), () => this.move(option, place - 1));
    const lower = this.button("down", "▼", fill(down, { option: label }), () => this.move(option, place + 1));
    raise.disabled = place === 0;
    lower.disabled = place === this.placed.length - 1;
    row.replaceChildren(number, words, raise, lower);
  }

  /** @param {string} name @param {string} text @param {string} label @param {() => void} press */
  button(name, text, label, press) {
    const made = document.createElement("button");
    made.type = "button";
    made.dataset.button = name;
    made.textContent = text;
    made.setAttribute("aria-label", label);
    made.addEventListener("click", press);
    return made;
  }

  /** @param {Option} option */
  draggable(option) {
    const { row } = option;
    row.addEventListener("pointerdown", (event) => {
      const onButton = event.target instanceof Element && event.target.closest("button");
      if (onButton || !this.placed.includes(option)) return;
      row.setPointerCapture(event.pointerId);
      row.classList.add("rank-held");
    });
    row.addEventListener("pointermove", (event) => {
      if (!row.hasPointerCapture(event.pointerId)) return;
      const to = this.placed.findIndex(({ row: other }) => event.clientY < other.getBoundingClientRect().bottom);
      this.move(option, to < 0 ? this.placed.length - 1 : to);
      row.classList.add("rank-held");
    });
    for (const end of ["pointerup", "pointercancel"]) row.addEventListener(end, () => row.classList.remove("rank-held"));
  }
}
