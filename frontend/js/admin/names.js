/** Words and short signs for what the server sends as codes. */

export const ACTIONS = /** @type {const} */ (["north", "south", "east", "west", "stay", "interact"]);
export const SIGNS = /** @type {const} */ (["↑", "↓", "→", "←", "·", "●"]);
export const HELD = /** @type {const} */ (["nothing", "onion", "tomato", "dish", "onion soup", "tomato soup"]);

/** @param {import("../messages.js").EventRow} event @returns {string} */
export function eventWords([kind, , thing, place]) {
  const name = String(thing ?? "").replace("_", " ");
  switch (kind) {
    case "pick_up": return `takes ${name} from the ${place}`;
    case "put_down": return `puts ${name} down`;
    case "potting": return `puts ${name} into a pot`;
    case "soup_ready": return `${name} is ready`;
    case "delivery": return `delivers ${name}`;
    case "blocked": return place === "floor" ? "is blocked by the other chef" : `runs against the ${place}`;
    default: return kind;
  }
}

/** @param {number | null} seat */
export const seatWords = (seat) => (seat === null ? "Pot" : `Chef ${seat}`);

/** Minutes, seconds, tenths. @param {number} ms */
export function clock(ms) {
  const tenths = Math.floor(ms / 100);
  return `${Math.floor(tenths / 600)}:${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10}`;
}
