/** The participant's keys: arrows or WASD, space or enter, and buttons on the glass for fingers. */

/** @typedef {import("./messages.js").Key} Key */
/** @typedef {import("./messages.js").ReleaseReason} ReleaseReason */

/** Keys by place on the keyboard, so that WASD lies under the fingers on every national layout. */
const CODES = Object.freeze(/** @type {Record<string, Key>} */ ({
  ArrowUp: "up", ArrowDown: "down", ArrowLeft: "left", ArrowRight: "right",
  KeyW: "up", KeyS: "down", KeyA: "left", KeyD: "right",
  Space: "interact", Enter: "interact", NumpadEnter: "interact",
}));
/** Keys by what they mean, where the place says nothing: keyboards on the screen, remote desktops, the number pad. */
const MEANINGS = Object.freeze(/** @type {Record<string, Key>} */ ({
  ArrowUp: "up", ArrowDown: "down", ArrowLeft: "left", ArrowRight: "right", " ": "interact", Enter: "interact",
}));
const LETTERS = Object.freeze(/** @type {Record<string, Key>} */ ({ w: "up", s: "down", a: "left", d: "right" }));
/** How often the pulse of a held key is felt, and after how many beats without a repeat it counts as let go. */
const PULSE_MS = 100;
const QUIET_BEATS = 8;

/** @param {KeyboardEvent} event @returns {Key | undefined} */
function keyOf(event) {
  const placeless = event.code === "" || event.code === "Unidentified";
  return CODES[event.code] ?? MEANINGS[event.key] ?? (placeless ? LETTERS[event.key.toLowerCase()] : undefined);
}

/** What names a key from its press to its release. @param {KeyboardEvent} event */
function holderOf(event) {
  return event.code && event.code !== "Unidentified" ? event.code : event.key.toLowerCase();
}

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
    /** The key pressed last, how often it has repeated, and for how many beats it has not: only it repeats. */
    this.pulse = { holder: "", repeats: 0, quiet: 0 };
    this.stopped = ""; // held, but its repeats stopped; if they come again it was not let go
    window.addEventListener("keydown", (event) => this.keyDown(event));
    window.addEventListener("keyup", (event) => this.keyUp(event));
    window.setInterval(() => this.beat(), PULSE_MS);
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
    const holder = holderOf(event);
    if (holder !== this.pulse.holder) this.pulse = { holder, repeats: 0, quiet: 0 };
    else if (event.repeat) Object.assign(this.pulse, { repeats: this.pulse.repeats + 1, quiet: 0 });
    if (event.key === "Meta" && this.held.size > 0) this.releaseAll("meta"); // macOS tells no release while it is down
    const key = keyOf(event);
    if (!key || !this.enabled || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!event.repeat || this.stopped === holder) this.down(holder, key);
  }

  /** @param {KeyboardEvent} event */
  keyUp(event) {
    const holder = holderOf(event);
    if (this.pulse.holder === holder) this.pulse = { holder: "", repeats: 0, quiet: 0 };
    if (event.key === "Meta" && this.held.size > 0) this.releaseAll("meta");
    if (this.held.has(holder)) event.preventDefault(); // a button that has the focus is not pressed by it
    this.up(holder);
  }

  /** Lets go of a held key that repeated and has stopped to, for its release got lost; beats late or early do no harm. */
  beat() {
    const { holder, repeats } = this.pulse;
    if (repeats < 2 || !this.held.has(holder)) return;
    this.pulse.quiet += 1;
    if (this.pulse.quiet < QUIET_BEATS) return;
    this.stopped = holder;
    this.up(holder);
  }

  /** @param {string} holder @param {Key} key */
  down(holder, key) {
    if (!this.enabled || this.held.get(holder) === key) return;
    this.stopped = "";
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
