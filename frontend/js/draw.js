/** Draws a board on a canvas: the still kitchen, then everything that moves, back to front. */

import { cellOf, seenAt } from "./board.js";
import { drawEffect } from "./effects.js";
import { isFloor, middle, wallOf } from "./backdrop.js";
import { TOWARDS, breath, bump, calm, gait, pop, pulse } from "./motion.js";
import { drawPot } from "./pots.js";
import { CHEF_SIZE, THINGS } from "./sprites.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./board.js").Chef} Chef */
/** @typedef {import("./sprites.js").Sprites} Sprites */
/** @typedef {CanvasRenderingContext2D} Context */

/** @typedef {{context: Context, board: Board, sprites: Sprites, now: number, quiet: boolean}} Frame one frame being drawn */

/** Where a chef stands in its cell; where the feet are in its drawing; how much smaller than drawn, so that a hat hides little. */
const STAND = 0.9;
const FEET = 1.31;
const SHRINK = 0.95;

/** From this tick on a participant knows which chef is theirs. */
const ALREADY_KNOWN_TICKS = 14;

/** Where a held thing's middle is in a chef's drawing, in tiles, and its size, by facing N S E W. */
const HANDS = /** @type {const} */ ([[0.83, 0.9], [0.5, 1.1], [0.8, 1.05], [0.2, 1.05]]);
const HELD_SIZE = 0.86;

/**
 * Draws one frame.
 * @param {Context} context of a canvas as large as `kitchen`
 * @param {Board} board @param {Sprites} sprites
 * @param {HTMLCanvasElement} kitchen made by `backdrop.still`
 * @param {number} now ms of performance.now()
 */
export function draw(context, board, sprites, kitchen, now) {
  const s = sprites.tile;
  const quiet = calm();
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.drawImage(kitchen, 0, 0);
  context.translate(0, wallOf(s));
  const seen = board.chefs.map((chef) => place(chef, now, board.tickMs, quiet));
  marker(context, board, seen[board.seat] ?? [0, 0], s, now, quiet);
  /** @type {Array<[number, () => void]>} */
  const layers = [];
  for (const [cell, pot] of board.pots) {
    const [x, y] = cellOf(cell);
    layers.push([y, () => drawPot(context, board, pot, x, y, sprites, now, quiet)]);
  }
  for (const [cell, { thing, at }] of board.things) {
    const [x, y] = cellOf(cell);
    layers.push([y, () => drawThing(context, sprites, thing, x + 0.5, y + middle(board.grid, x, y), quiet ? 1 : pop(now, at))]);
  }
  board.chefs.forEach((chef, seat) => {
    if (board.alone && seat !== board.seat) return;
    const [x, y] = seen[seat] ?? [chef.x, chef.y];
    layers.push([y + 0.5, () => drawChef({ context, board, sprites, now, quiet }, seat, x, y)]);
  });
  layers.sort((a, b) => a[0] - b[0]);
  for (const [, layer] of layers) layer();
  for (const effect of board.effects) drawEffect(context, board, effect, s, now, quiet);
  if (board.phase === "playing" ? board.tick < ALREADY_KNOWN_TICKS : board.phase !== "ended") pointer(context, board.you, seen[board.seat] ?? [0, 0], s, now, quiet);
}

/** @param {Chef} chef @param {number} now @param {number} tickMs @param {boolean} quiet @returns {[number, number]} */
function place(chef, now, tickMs, quiet) {
  if (quiet) return [chef.x, chef.y];
  const [x, y] = seenAt(chef, now, tickMs);
  const [dx, dy] = bump(chef, now);
  return [x + dx, y + dy];
}

/** @param {Context} context @param {Sprites} sprites @param {number} thing @param {number} x middle in tiles @param {number} y @param {number} scale */
function drawThing(context, sprites, thing, x, y, scale) {
  const name = THINGS[thing];
  if (!name) return;
  const s = sprites.tile;
  const [w, h] = sprites.size(name);
  context.fillStyle = "rgba(50, 24, 8, 0.32)";
  context.beginPath();
  context.ellipse((x + 0.025) * s, (y + h * 0.42) * s, w * 0.46 * scale * s, h * 0.16 * scale * s, 0, 0, 2 * Math.PI);
  context.fill();
  context.drawImage(sprites.get(name), (x - (w / 2) * scale) * s, (y - (h / 2) * scale) * s, w * scale * s, h * scale * s);
}

/** @param {Frame} frame @param {number} seat @param {number} x where it is seen, in tiles @param {number} y */
function drawChef({ context, board, sprites, now, quiet }, seat, x, y) {
  const chef = board.chefs[/** @type {0 | 1} */ (seat)];
  const s = sprites.tile;
  const { lift, lean } = quiet ? { lift: 0, lean: 0 } : gait(chef, now, board.tickMs);
  const [fx, fy] = [(x + 0.5) * s, (y + STAND) * s];
  context.fillStyle = "rgba(58, 30, 10, 0.34)";
  context.beginPath();
  context.ellipse(fx + 0.03 * s, fy + 0.02 * s, (0.27 - lift) * s, 0.085 * s, 0, 0, 2 * Math.PI);
  context.fill();
  context.save();
  context.translate(fx, fy - lift * s);
  context.rotate(lean);
  const tall = quiet || lift ? 1 : breath(now, seat * 1.7);
  context.scale(1, tall);
  const [w, h] = [CHEF_SIZE[0] * SHRINK * s, CHEF_SIZE[1] * SHRINK * s];
  const top = -FEET * SHRINK * s;
  context.drawImage(sprites.chef(chef.facing, board.hats[/** @type {0 | 1} */ (seat)]), -w / 2, top, w, h);
  const held = THINGS[chef.held];
  if (held) {
    const [hx, hy] = HANDS[chef.facing] ?? HANDS[1];
    const [tw, th] = sprites.size(held);
    const scale = HELD_SIZE * (quiet ? 1 : pop(now, chef.heldAt)) * s;
    context.drawImage(sprites.get(held), -w / 2 + hx * SHRINK * s - (tw / 2) * scale, top + hy * SHRINK * s - (th / 2) * scale, tw * scale, th * scale);
  }
  context.restore();
}

/** A ring under the participant's own chef and a frame on the tile it faces. @param {Context} context @param {Board} board
 * @param {readonly number[]} seen @param {number} s @param {number} now @param {boolean} quiet */
function marker(context, board, [x = 0, y = 0], s, now, quiet) {
  const own = board.chefs[board.seat];
  context.lineWidth = 0.045 * s;
  context.strokeStyle = "rgba(255, 255, 255, 0.95)";
  context.fillStyle = "rgba(255, 255, 255, 0.35)";
  context.beginPath();
  context.ellipse((x + 0.5) * s, (y + STAND - 0.01) * s, 0.38 * s, 0.15 * s, 0, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  const [dx, dy] = TOWARDS[own.facing] ?? [0, 0];
  const [tx, ty] = [own.x + dx, own.y + dy];
  if (isFloor(board.grid, tx, ty)) return;
  const inset = 0.05 * s;
  context.globalAlpha = quiet ? 0.8 : 0.55 + 0.35 * pulse(now, 1400);
  context.strokeStyle = "#fff";
  context.lineWidth = 0.05 * s;
  context.beginPath();
  context.roundRect(tx * s + inset, ty * s + inset, s - 2 * inset, s - 2 * inset, 0.14 * s);
  context.stroke();
  context.globalAlpha = 1;
}

/** "You" in the page's language: an arrow over the own chef until it has moved. @param {Context} context
 * @param {string} you @param {readonly number[]} seen @param {number} s @param {number} now @param {boolean} quiet */
function pointer(context, you, [x = 0, y = 0], s, now, quiet) {
  if (!you) return;
  const bob = quiet ? 0 : 0.06 * pulse(now, 800);
  const [mx, my] = [(x + 0.5) * s, (y - 0.42 - bob) * s];
  context.font = `700 ${Math.round(0.24 * s)}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const w = context.measureText(you).width + 0.26 * s;
  context.beginPath();
  context.roundRect(mx - w / 2, my - 0.2 * s, w, 0.34 * s, 0.17 * s);
  context.moveTo(mx - 0.1 * s, my + 0.13 * s);
  context.lineTo(mx + 0.1 * s, my + 0.13 * s);
  context.lineTo(mx, my + 0.26 * s);
  context.closePath();
  context.fillStyle = "#2b1a10";
  context.fill();
  context.fillStyle = "#fff";
  context.fillText(you, mx, my - 0.02 * s);
}
