/**
 * Keeps the numbers of a page fresh: asks for its parts every few seconds and puts in those that changed.
 * The server renders each part with the template of the whole page, so both always agree.
 */

const SLOWEST_MS = 30_000;

/** @typedef {{parts: Record<string, string>}} Answer */

class Live {
  /** @param {HTMLElement} sign says whether the numbers are fresh; names the address and the pace */
  constructor(sign) {
    this.sign = sign;
    this.url = sign.dataset.live ?? "";
    this.every = 1000 * Number(sign.dataset.every || 3);
    this.wait = this.every;
    /** @type {Map<string, string>} */
    this.shown = new Map();
    this.timer = 0;
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) return;
      clearTimeout(this.timer);
      this.turn();
    });
    this.later();
  }

  later() {
    this.timer = window.setTimeout(() => this.turn(), this.wait);
  }

  async turn() {
    if (document.hidden) return;
    try {
      const response = await fetch(this.url, { headers: { accept: "application/json" } });
      if (response.status === 401) {
        location.reload();
        return;
      }
      if (!response.ok) throw new Error(String(response.status));
      this.put(/** @type {Answer} */ (await response.json()));
      this.wait = this.every;
      this.say("live", "");
    } catch {
      this.wait = Math.min(SLOWEST_MS, this.wait * 2);
      this.say("not reached; trying again", "lost");
    }
    this.later();
  }

  /** @param {string} words @param {string} state */
  say(words, state) {
    this.sign.textContent = words;
    this.sign.dataset.state = state;
  }

  /** @param {Answer} answer */
  put({ parts }) {
    for (const [name, html] of Object.entries(parts)) {
      const place = document.querySelector(`[data-part="${name}"]`);
      if (!(place instanceof HTMLElement) || this.shown.get(name) === html) continue;
      this.shown.set(name, html);
      replaceInside(place, html);
    }
  }
}

/**
 * Puts new content into an element; what has the focus or is scrolled stays so where it is still there.
 * @param {HTMLElement} place @param {string} html
 */
function replaceInside(place, html) {
  const focused = place.contains(document.activeElement) ? document.activeElement : null;
  const focusable = "a, button, [tabindex]";
  const which = focused ? [...place.querySelectorAll(focusable)].indexOf(focused) : -1;
  const id = focused?.id ?? "";
  const scrolled = place.querySelector(".wide")?.scrollLeft ?? 0;
  const parsed = new DOMParser().parseFromString(html, "text/html");
  place.replaceChildren(...document.importNode(parsed.body, true).childNodes);
  const wide = place.querySelector(".wide");
  if (wide) wide.scrollLeft = scrolled;
  const again = id ? document.getElementById(id) : place.querySelectorAll(focusable)[which];
  if (which >= 0 && again instanceof HTMLElement) again.focus({ preventScroll: true });
}

const sign = document.querySelector("[data-live]");
if (sign instanceof HTMLElement) new Live(sign);
