/**
 * The messages between a round's page and the server, as types and builders.
 * The server's table of messages is the truth; a test holds these names against it.
 */

export const PROTOCOL = 2;

/** Every message type the page sends. */
export const CLIENT_TYPES = /** @type {const} */ (["hello", "ready", "key", "release", "ping"]);

/** Every message type the server sends. */
export const SERVER_TYPES = /** @type {const} */ ([
  "keyframe", "countdown", "tick", "paused", "ended", "pong", "elsewhere", "refused",
]);

/** The keys a participant has, whatever button stands for them. */
export const KEYS = /** @type {const} */ (["up", "down", "left", "right", "interact"]);

/** Close codes after which the page must not connect again by itself. */
export const CLOSE = Object.freeze({ elsewhere: 4001, over: 4002, refused: 4003 });

/** @typedef {typeof KEYS[number]} Key */
/** @typedef {"blur" | "hidden" | "shown" | "pagehide" | "meta"} ReleaseReason */
/** @typedef {"waiting" | "countdown" | "playing" | "paused" | "ended"} Phase */
/** @typedef {[x: number, y: number, facing: number, held: number]} ChefRow cell, facing 0-3 = N S E W, thing code */
/** @typedef {[x: number, y: number, thing: number]} ThingRow thing 0 clears the cell */
/** @typedef {[x: number, y: number, onions: number, tomatoes: number, ticks: number, ready: boolean | number]} PotRow */
/** @typedef {[kind: string, seat: number | null, thing: string | number | null, place: string | null, x: number, y: number]} EventRow */

/**
 * @typedef {object} Keyframe everything needed to draw the round
 * @property {"keyframe"} type
 * @property {Phase} phase
 * @property {number} tick
 * @property {number} horizon in ticks
 * @property {number} tick_ms
 * @property {0 | 1} seat the participant's own
 * @property {[string, string]} hats hat colour by seat
 * @property {string[]} grid rows of tiles, starts shown as floor
 * @property {number} cook_time in ticks
 * @property {[ChefRow, ChefRow]} chefs
 * @property {ThingRow[]} things
 * @property {PotRow[]} pots
 * @property {number} score
 * @property {number | null} goal
 * @property {number} round
 * @property {number} of
 * @property {boolean} tutorial
 * @property {string[] | null} orders
 * @property {number} points of one soup
 * @property {number} episode of the round, from 1; `tick` and `horizon` are its own, `score` is the round's
 * @property {number} episodes
 * @property {"during" | "after" | "never"} show_score
 * @property {"hold" | "press"} input_mode
 * @property {"agent" | "human" | "none"} partner
 */
/**
 * @typedef {object} Tick what one tick changed
 * @property {"tick"} type
 * @property {number} tick
 * @property {[ChefRow, ChefRow]} chefs
 * @property {ThingRow[]} things
 * @property {PotRow[]} pots
 * @property {number} score
 * @property {EventRow[]} events
 */
/** @typedef {{type: "countdown", seconds: number}} Countdown */
/** @typedef {{type: "paused", reason: string, seconds_left: number}} Paused */
/** @typedef {{type: "ended", outcome: string, score: number, next: string}} Ended */
/** @typedef {{type: "pong", client_ms: number, server_ms: number}} Pong */
/** @typedef {{type: "elsewhere"}} Elsewhere */
/** @typedef {{type: "refused", reason: string}} Refused */
/** @typedef {Keyframe | Tick | Countdown | Paused | Ended | Pong | Elsewhere | Refused} ServerMessage */

/** @typedef {{type: "hello", protocol: number, tab: string} | {type: "ready"}
 *   | {type: "key", key: Key, down: boolean, seq: number, client_ms: number}
 *   | {type: "release", reason: ReleaseReason, seq: number, client_ms: number}
 *   | {type: "ping", client_ms: number, rtt_ms: number | null}} ClientMessage */

/** @param {string} tab random id of this page load @returns {ClientMessage} */
export const hello = (tab) => ({ type: "hello", protocol: PROTOCOL, tab });

/** @returns {ClientMessage} */
export const ready = () => ({ type: "ready" });

/** @param {Key} name @param {boolean} down @param {number} seq @param {number} now @returns {ClientMessage} */
export const key = (name, down, seq, now) => ({ type: "key", key: name, down, seq, client_ms: now });

/** @param {ReleaseReason} reason @param {number} seq @param {number} now @returns {ClientMessage} */
export const release = (reason, seq, now) => ({ type: "release", reason, seq, client_ms: now });

/** @param {number} now @param {number | null} rtt round trip of the last ping @returns {ClientMessage} */
export const ping = (now, rtt) => ({ type: "ping", client_ms: now, rtt_ms: rtt });

/**
 * The server's message in a text frame, or null for anything this page does not know.
 * @param {unknown} text
 * @returns {ServerMessage | null}
 */
export function parse(text) {
  if (typeof text !== "string") return null;
  try {
    const message = JSON.parse(text);
    return SERVER_TYPES.includes(message?.type) ? message : null;
  } catch {
    return null;
  }
}
