/**
 * The round as the page knows it: one state object, changed only by server messages.
 * No rules live here; the page shows what it is told.
 */

/** @typedef {import("./messages.js").Keyframe} Keyframe */
/** @typedef {import("./messages.js").Tick} Tick */
/** @typedef {import("./messages.js").EventRow} EventRow */
/** @typedef {import("./messages.js").Phase} Phase */
/** @typedef {import("./messages.js").ChefRow} ChefRow */

/**
 * @typedef {object} Chef
 * @property {number} x cell
 * @property {number} y cell
 * @property {number} facing 0-3 = N S E W
 * @property {number} held thing code
 * @property {number} fromX where the eye saw it when the move began, in tiles
 * @property {number} fromY
 * @property {number} movedAt start of the move, ms of performance.now()
 * @property {number} bumpedAt start of the bump of a blocked move
 * @property {number} heldAt when the hands last changed
 * @property {number} steps cells walked so far: the feet alternate
 */
/** @typedef {{thing: number, at: number}} Lying a thing on a counter and when it came there */
/** @typedef {{onions: number, tomatoes: number, ticks: number, ready: boolean, at: number}} Pot `at`: last change of contents */
/** @typedef {{kind: "points" | "sparkle" | "splash" | "puff", x: number, y: number, at: number, text: string}} Effect */

/**
 * @typedef {object} Board
 * @property {Phase} phase
 * @property {number} tick
 * @property {number} horizon
 * @property {number} tickMs
 * @property {0 | 1} seat
 * @property {[string, string]} hats
 * @property {string[]} grid
 * @property {number} cookTime
 * @property {[Chef, Chef]} chefs
 * @property {Map<string, Lying>} things by "x,y"
 * @property {Map<string, Pot>} pots by "x,y"
 * @property {number} score
 * @property {number} scoredAt
 * @property {number | null} goal
 * @property {number} round
 * @property {number} of
 * @property {boolean} tutorial
 * @property {string[] | null} orders
 * @property {Effect[]} effects
 * @property {number} points of one soup
 * @property {number} episode
 * @property {number} episodes
 * @property {"during" | "after" | "never"} showScore
 * @property {string} you the word over the participant's own chef
 * @property {boolean} alone nobody is on the other seat
 */

export const NEVER = -1e9;
export const EFFECT_MS = 1400;

/** @param {number} x @param {number} y */
export const cellKey = (x, y) => `${x},${y}`;

/** @param {string} cell @returns {[number, number]} */
export function cellOf(cell) {
  const [x, y] = cell.split(",");
  return [Number(x), Number(y)];
}

/** @param {ChefRow} row @returns {Chef} */
function standing([x, y, facing, held]) {
  return { x, y, facing, held, fromX: x, fromY: y, movedAt: NEVER, bumpedAt: NEVER, heldAt: NEVER, steps: 0 };
}

/**
 * The board a keyframe describes.
 * @param {Keyframe} frame @param {string} [you] the word for the participant's own chef
 * @returns {Board}
 */
export function boardFrom(frame, you = "") {
  return {
    phase: frame.phase, tick: frame.tick, horizon: frame.horizon, tickMs: frame.tick_ms,
    seat: frame.seat, hats: frame.hats, grid: frame.grid, cookTime: frame.cook_time,
    chefs: [standing(frame.chefs[0]), standing(frame.chefs[1])],
    things: new Map(frame.things.filter((row) => row[2]).map(([x, y, thing]) => [cellKey(x, y), { thing, at: NEVER }])),
    pots: new Map(frame.pots.map(([x, y, onions, tomatoes, ticks, ready]) =>
      [cellKey(x, y), { onions, tomatoes, ticks, ready: Boolean(ready), at: NEVER }])),
    score: frame.score, scoredAt: NEVER, goal: frame.goal, round: frame.round, of: frame.of,
    tutorial: frame.tutorial, orders: frame.orders, effects: [],
    points: frame.points, episode: frame.episode, episodes: frame.episodes,
    showScore: frame.show_score, you, alone: frame.partner === "none",
  };
}

/** How far a move is at a share of its tick; films draw it the same. @param {number} t 0 to 1 */
export const eased = (t) => 0.65 * t + 0.35 * t * t * (3 - 2 * t);

/**
 * Where a chef is seen, in tiles: its move eases over one tick.
 * @param {Chef} chef @param {number} now @param {number} tickMs
 * @returns {[number, number]}
 */
export function seenAt(chef, now, tickMs) {
  const t = Math.min(1, Math.max(0, (now - chef.movedAt) / tickMs));
  return [chef.fromX + (chef.x - chef.fromX) * eased(t), chef.fromY + (chef.y - chef.fromY) * eased(t)];
}

/**
 * Brings the board to the state after a tick; `now` starts the movements to be seen.
 * @param {Board} board @param {Tick} message @param {number} now ms of performance.now()
 */
export function applyTick(board, message, now) {
  board.phase = "playing";
  board.tick = message.tick;
  message.chefs.forEach(([x, y, facing, held], seat) => {
    const chef = board.chefs[/** @type {0 | 1} */ (seat)];
    if (x !== chef.x || y !== chef.y) {
      [chef.fromX, chef.fromY] = seenAt(chef, now, board.tickMs);
      chef.movedAt = now;
      chef.steps += 1;
    }
    if (held !== chef.held) chef.heldAt = now;
    Object.assign(chef, { x, y, facing, held });
  });
  for (const [x, y, thing] of message.things) {
    if (thing) board.things.set(cellKey(x, y), { thing, at: now });
    else board.things.delete(cellKey(x, y));
  }
  for (const [x, y, onions, tomatoes, ticks, ready] of message.pots) {
    const before = board.pots.get(cellKey(x, y));
    const changed = before?.onions !== onions || before.tomatoes !== tomatoes || before.ready !== Boolean(ready);
    board.pots.set(cellKey(x, y), { onions, tomatoes, ticks, ready: Boolean(ready), at: changed ? now : before.at });
  }
  const gained = message.score - board.score;
  if (gained !== 0) board.scoredAt = now;
  board.score = message.score;
  board.effects = board.effects.filter((effect) => now - effect.at < EFFECT_MS);
  for (const event of message.events) addEvent(board, event, gained, now);
}

/** @param {Board} board @param {EventRow} event @param {number} gained @param {number} now */
function addEvent(board, [kind, seat, , , x, y], gained, now) {
  if (kind === "blocked" && (seat === 0 || seat === 1)) board.chefs[seat].bumpedAt = now;
  if (kind === "potting") board.effects.push({ kind: "splash", x, y, at: now, text: "" });
  if (kind === "put_down") board.effects.push({ kind: "puff", x, y, at: now, text: "" });
  if (kind === "soup_ready") board.effects.push({ kind: "sparkle", x, y, at: now, text: "" });
  if (kind === "delivery") {
    board.effects.push({ kind: "sparkle", x, y, at: now, text: "" });
    if (board.showScore === "during") board.effects.push({ kind: "points", x, y, at: now, text: gained > 0 ? `+${gained}` : "0" });
  }
}

/**
 * Whether anything on the board is in motion, so that another frame is due.
 * @param {Board} board @param {number} now
 */
export function inMotion(board, now) {
  return board.phase === "playing" || board.phase === "countdown" ||
    board.effects.some((effect) => now - effect.at < EFFECT_MS);
}
