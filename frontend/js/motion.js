/** How things move between ticks: pure functions of time, all lengths in tiles, all times in ms. */

/** @typedef {import("./board.js").Chef} Chef */

/** Whether the participant asked for less movement; looked up live, it may change. */
const calmQuery = typeof matchMedia === "function" ? () => matchMedia("(prefers-reduced-motion: reduce)").matches : () => false;

export const POP_MS = 240;
export const BUMP_MS = 190;
const BUMP_TILES = 0.13;
const BOB_TILES = 0.055;

/** x and y of the four facings N S E W. */
export const TOWARDS = /** @type {const} */ ([[0, -1], [0, 1], [1, 0], [-1, 0]]);

/** @returns {boolean} */
export const calm = calmQuery;

/** Share of `ms` gone since `at`, within 0 and 1. @param {number} now @param {number} at @param {number} ms */
export const share = (now, at, ms) => Math.min(1, Math.max(0, (now - at) / ms));

/**
 * Size of a thing that has just come: it starts small, overshoots, settles at 1.
 * @param {number} now @param {number} at
 */
export function pop(now, at) {
  const t = share(now, at, POP_MS);
  if (t >= 1) return 1;
  const back = t - 1;
  return 0.45 + 0.55 * (1 + 2.9 * back * back * back + 1.9 * back * back);
}

/**
 * Offset of a chef that ran against something: out towards its facing and back.
 * @param {Chef} chef @param {number} now
 * @returns {[number, number]}
 */
export function bump(chef, now) {
  const t = share(now, chef.bumpedAt, BUMP_MS);
  if (t >= 1) return [0, 0];
  const [dx, dy] = TOWARDS[chef.facing] ?? [0, 0];
  const out = Math.sin(Math.PI * Math.pow(t, 0.7)) * BUMP_TILES;
  return [dx * out, dy * out];
}

/**
 * Height of a walking chef above the floor and its lean in radians; 0 when it stands.
 * @param {Chef} chef @param {number} now @param {number} tickMs
 * @returns {{lift: number, lean: number}}
 */
export function gait(chef, now, tickMs) {
  const t = share(now, chef.movedAt, tickMs);
  if (t >= 1) return { lift: 0, lean: 0 };
  const wave = Math.sin(Math.PI * t);
  return { lift: BOB_TILES * wave, lean: 0.05 * wave * (chef.steps % 2 ? 1 : -1) };
}

/** Slow breathing of a chef at rest: a factor near 1. @param {number} now @param {number} phase */
export const breath = (now, phase) => 1 + 0.012 * Math.sin(now / 420 + phase);

/** A pulse between 0 and 1. @param {number} now @param {number} periodMs */
export const pulse = (now, periodMs) => 0.5 - 0.5 * Math.cos((2 * Math.PI * now) / periodMs);
