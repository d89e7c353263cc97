/** The participant's keys: arrows or WASD, space or enter, and buttons on the glass for fingers. */

/** @typedef {import("./messages.js").Key} Key */
/** @typedef {import("./messages.js").ReleaseReason} ReleaseReason */

/** Keys by place on the keyboard, so that WASD lies under the fingers on every national layout. */
const CODES = Object.freeze(/** @type {Record<string, Key>} */ ({
  ArrowUp: "up", ArrowDown: "down", ArrowLeft: "left", ArrowRight: "right",
  KeyW: "up", KeyS: "down", KeyA: "left", KeyD: "right",
  Space: "interact", Enter: "interact", NumpadEnter: "interact",
}));

export class Keys {
  /**
   * @param {(key: Key, down: boolean) => void} onKey once per press and once per release, never repeated
   * @param {(reason: ReleaseReason) => void} onRelease the page lost the keyboard, or is in sight again: everything is let go
   */
  constructor(onKey, onRelease) {
    this.onKey = onKey;
    this.onRelease = onRelease;
    this.enabled = false;
    /** @type {Map<string, Key>} what holds each key down: a key code or a finger */
    this.held = new Map();
    window.addEventListener("keydown", (event) => this.keyDown(event));
    window.addEventListener("keyup", (event) => this.up(event.code));
    window.addEventListener("blur", () => this.releaseAll("blur"));
    window.addEventListener("pagehide", () => this.releaseAll("pagehide"));
    document.addEventListener("visibilitychange", () => this.releaseAll(document.hidden ? "hidden" : "shown"));
  }

  /** @param {boolean} enabled */
  enable(enabled) {
    if (this.enabled && !enabled) this.held.clear();
    this.enabled = enabled;
  }

  /** @param {KeyboardEvent} event */
  keyDown(event) {
    const key = CODES[event.code];
    if (!key || !this.enabled || event.ctrlKey || event.metaKey || event.altKey) return;
    const focused = document.activeElement;
    if (key === "interact" && focused instanceof HTMLButtonElement && !focused.dataset.key) return;
    event.preventDefault();
    if (!event.repeat) this.down(event.code, key);
  }

  /** @param {string} holder @param {Key} key */
  down(holder, key) {
    if (!this.enabled || this.held.get(holder) === key) return;
    this.up(holder);
    const already = this.isHeld(key);
    this.held.set(holder, key);
    if (!already) this.onKey(key, true);
  }

  /** @param {string} holder */
  up(holder) {
    const key = this.held.get(holder);
    if (!key) return;
    this.held.delete(holder);
    if (!this.isHeld(key)) this.onKey(key, false);
  }

  /** @param {Key} key */
  isHeld(key) {
    return [...this.held.values()].includes(key);
  }

  /** @param {ReleaseReason} reason */
  releaseAll(reason) {
    if (this.held.size === 0 && !this.enabled) return;
    this.held.clear();
    this.onRelease(reason);
  }

  /**
   * Makes an area of buttons work: a finger may slide from one button to another.
   * @param {HTMLElement} area whose buttons carry data-key
   */
  touch(area) {
    /** @param {PointerEvent} event @returns {Key | null} */
    const under = (event) => {
      const button = document.elementFromPoint(event.clientX, event.clientY)?.closest("[data-key]");
      return button instanceof HTMLElement && area.contains(button) ? /** @type {Key} */ (button.dataset.key) : null;
    };
    /** @param {PointerEvent} event */
    const follow = (event) => {
      const key = under(event);
      if (key) this.down(`finger ${event.pointerId}`, key);
      else this.up(`finger ${event.pointerId}`);
      this.show(area);
    };
    /** @param {PointerEvent} event */
    const lift = (event) => {
      this.up(`finger ${event.pointerId}`);
      this.show(area);
    };
    area.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      area.setPointerCapture(event.pointerId);
      follow(event);
    });
    area.addEventListener("pointermove", (event) => {
      if (area.hasPointerCapture(event.pointerId)) follow(event);
    });
    area.addEventListener("pointerup", lift);
    area.addEventListener("pointercancel", lift);
    area.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** @param {HTMLElement} area */
  show(area) {
    for (const button of area.querySelectorAll("[data-key]")) {
      if (button instanceof HTMLElement) button.classList.toggle("down", this.isHeld(/** @type {Key} */ (button.dataset.key)));
    }
  }
}
