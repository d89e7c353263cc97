/** The lobby asks every other second whether somebody came, and shows the time; without it the page reloads itself. */

import { clock } from "./words.js";

const ASK_EVERY_MS = 2000;
const SHOW_EVERY_MS = 250;

class Waiting {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    this.waited = Number(root.dataset.waited);
    this.whole = this.waited + Number(root.dataset.left);
    this.since = performance.now() - 1000 * this.waited;
    this.words = root.querySelector('[data-part="words"]');
    this.plain = this.words?.textContent ?? "";
    window.setInterval(() => this.show(), SHOW_EVERY_MS);
    window.setInterval(() => this.ask(), ASK_EVERY_MS);
  }

  show() {
    const left = this.whole - (performance.now() - this.since) / 1000;
    const time = this.root.querySelector('[data-part="time"]');
    const bar = this.root.querySelector("progress");
    if (time) time.textContent = clock(left);
    if (bar) Object.assign(bar, { max: this.whole, value: this.whole - left });
  }

  async ask() {
    try {
      const answer = await fetch(this.root.dataset.poll ?? "", { cache: "no-store", headers: { accept: "application/json" } });
      if (!answer.ok) throw new Error(String(answer.status));
      const { waiting, seconds_left: left } = await answer.json();
      if (waiting) {
        this.since = performance.now() - 1000 * (this.whole - left);
        this.tell(this.plain);
      } else location.replace(this.root.dataset.next ?? location.href);
    } catch {
      this.tell(this.root.dataset.lost ?? "");
    }
  }

  /** @param {string} words */
  tell(words) {
    if (this.words && this.words.textContent !== words) this.words.textContent = words;
    this.root.classList.toggle("lobby-lost", words !== this.plain);
  }
}

const root = document.querySelector(".lobby");
if (root instanceof HTMLElement) new Waiting(root);
