/** What stands around the kitchen: score, goal, time, and the card that lies over it between phases. */

import { clock, fill } from "./words.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./messages.js").Key} Key */
/** @typedef {import("./words.js").Say} Say */

/**
 * @typedef {object} Card
 * @property {string} kind also the class of the card
 * @property {string} title
 * @property {string} [text]
 * @property {number} [until] seconds that run down while the card lies there; `{s}` in the text stands for them
 * @property {string} [button] its label; without one there is nothing to press
 * @property {() => void} [press]
 * @property {number} [after] ms before the button may be pressed: keys still held must not press it
 */

const LOW_S = 10;
const STORED = "galley-keys-used";

export class Hud {
  /** @param {HTMLElement} root @param {Say} say */
  constructor(root, say) {
    this.root = root;
    this.say = say;
    this.card = "";
    this.cardTimer = 0;
    this.runDown = 0;
    this.used = new Set(recall());
    for (const hint of this.used) this.hideHint(hint);
  }

  /** @param {string} name @returns {HTMLElement | null} */
  part(name) {
    return this.root.querySelector(`[data-part="${name}"]`);
  }

  /** @param {string} name @param {string} text */
  write(name, text) {
    const part = this.part(name);
    if (part && part.textContent !== text) part.textContent = text;
  }

  /** @param {string} name @param {number} value @param {number} max */
  bar(name, value, max) {
    const part = this.part(name);
    if (part instanceof HTMLProgressElement) {
      part.max = max;
      part.value = value;
    }
  }

  /** @param {Board} board */
  update(board) {
    const leftMs = (board.horizon - board.tick) * board.tickMs;
    const seconds = Math.ceil(leftMs / 1000);
    this.write("time", clock(seconds));
    if (board.episodes > 1) this.write("episode", this.say("game", { n: board.episode, of: board.episodes }));
    this.bar("time-bar", board.horizon - board.tick, board.horizon);
    this.root.classList.toggle("hurry", board.phase === "playing" && seconds <= LOW_S);
    this.write("score", String(board.score));
    if (board.goal !== null) this.bar("goal-bar", Math.min(board.score, board.goal), board.goal);
    this.root.classList.toggle("reached", board.goal !== null && board.score >= board.goal);
  }

  /** Makes the score jump. */
  cheer() {
    const score = this.part("score");
    if (!score) return;
    score.classList.remove("cheer");
    void score.offsetWidth; // starts the animation anew
    score.classList.add("cheer");
  }

  /** @param {Card} card */
  show(card) {
    const over = this.part("over");
    if (!over) return;
    this.stopTimers();
    this.card = card.kind;
    over.className = `over over-${card.kind}`;
    over.hidden = false;
    this.write("card-title", card.title);
    this.tell(card.text ?? "", card.until);
    const details = this.part("card-details");
    if (details) details.hidden = card.kind !== "start";
    const button = this.part("card-button");
    if (!(button instanceof HTMLButtonElement)) return;
    button.hidden = !card.button;
    button.textContent = card.button ?? "";
    button.onclick = () => card.press?.();
    button.disabled = Boolean(card.after);
    this.cardTimer = window.setTimeout(() => {
      button.disabled = false;
      if (card.button) button.focus({ preventScroll: true });
    }, card.after ?? 0);
  }

  /** @param {string} text @param {number | undefined} seconds */
  tell(text, seconds) {
    this.write("card-text", fill(text, { s: seconds ?? "" }));
    if (seconds) this.runDown = window.setTimeout(() => this.tell(text, seconds - 1), 1000);
  }

  stopTimers() {
    window.clearTimeout(this.cardTimer);
    window.clearTimeout(this.runDown);
  }

  hide() {
    const over = this.part("over");
    this.stopTimers();
    this.card = "";
    if (over) over.hidden = true;
    const focused = document.activeElement;
    if (focused instanceof HTMLElement && over?.contains(focused)) focused.blur();
  }

  /** The participant found this key: its hint goes. @param {Key} key */
  usedKey(key) {
    const hint = key === "interact" ? "interact" : "move";
    if (this.used.has(hint)) return;
    this.used.add(hint);
    this.hideHint(hint);
    remember([...this.used]);
  }

  /** @param {string} hint */
  hideHint(hint) {
    this.part(`hint-${hint}`)?.classList.add("known");
  }
}

/** @returns {string[]} */
function recall() {
  try {
    return (sessionStorage.getItem(STORED) ?? "").split(" ").filter(Boolean);
  } catch {
    return []; // storage is switched off
  }
}

/** @param {string[]} hints */
function remember(hints) {
  try {
    sessionStorage.setItem(STORED, hints.join(" "));
  } catch {
    // storage is switched off: the hints come again in the next round
  }
}
