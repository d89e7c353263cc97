/** Draws a pot on its stove: flames, contents, progress ring, steam and the sign that it is ready. */

import { middle } from "./backdrop.js";
import { pulse, share } from "./motion.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./board.js").Pot} Pot */
/** @typedef {import("./sprites.js").Sprites} Sprites */
/** @typedef {CanvasRenderingContext2D} Context */

const INGREDIENTS = 3;

/** @param {Context} context @param {Board} board @param {Pot} pot @param {number} x @param {number} y
 * @param {Sprites} sprites @param {number} now @param {boolean} quiet */
export function drawPot(context, board, pot, x, y, sprites, now, quiet) {
  const s = sprites.tile;
  const drop = middle(board.grid, x, y) - 0.38;
  const [mx, my] = [(x + 0.5) * s, (y + 0.36 + drop) * s];
  const count = pot.onions + pot.tomatoes;
  const cooking = count === INGREDIENTS && !pot.ready;
  if (cooking || pot.ready) ring(context, mx, my, s, pot.ready ? 1 : pot.ticks / board.cookTime, pot.ready, quiet ? 1 : pulse(now, 900));
  const heat = cooking ? 1 : 0.62;
  for (const [i, dx] of [-0.17, 0.17, 0].entries()) {
    const flicker = quiet ? 1 : 1 + 0.14 * Math.sin(now / 70 + i * 2.1 + x);
    const [w, h] = [0.24 * heat * s, 0.26 * heat * flicker * s];
    context.drawImage(sprites.get("flame"), mx + dx * s - w / 2, (y + drop + 0.74) * s - h, w, h);
  }
  const wobble = cooking && !quiet ? Math.sin(now / 45) * 0.006 : 0;
  const size = 0.84 * (quiet ? 1 : 1 + 0.1 * Math.sin(Math.PI * share(now, pot.at, 200)));
  const box = /** @type {const} */ ([mx - (size / 2) * s, my - (0.42 + (size - 0.84) - wobble) * s, size * s, size * s]);
  context.drawImage(sprites.get("pot"), ...box);
  /** @type {string[]} */
  const names = [...Array(pot.onions).fill("onion"), ...Array(pot.tomatoes).fill("tomato")];
  const [px, py] = [box[0], box[1]];
  if (cooking || pot.ready) context.drawImage(sprites.get(`broth-${pot.tomatoes > pot.onions ? "tomato" : "onion"}`), ...box);
  if (!pot.ready) {
    const spots = /** @type {const} */ ([[0.35, 0.255], [0.65, 0.26], [0.5, 0.31]]);
    for (const [i, [sx, sy]] of spots.slice(0, count).entries()) {
      const float = cooking && !quiet ? 0.012 * Math.sin(now / 190 + i * 2) : 0;
      const w = 0.27 * s;
      context.drawImage(sprites.get(names[i] ?? "onion"), px + sx * size * s - w / 2, py + (sy + float) * size * s - w * 0.62, w, w);
    }
  }
  if (count > 0 && !pot.ready) pips(context, mx, py + 0.63 * size * s, s, pot);
  if (pot.ready) {
    steam(context, sprites, mx, my - 0.2 * s, s, now, quiet);
    const lift = quiet ? 0 : 0.03 * pulse(now, 900) * s;
    context.drawImage(sprites.get("ready"), mx + 0.15 * s, my - 0.42 * s - lift);
  }
}

/** The pot's progress. @param {Context} context @param {number} x @param {number} y @param {number} s
 * @param {number} done from 0 to 1 @param {boolean} ready @param {number} beat */
function ring(context, x, y, s, done, ready, beat) {
  context.lineCap = "round";
  if (ready) {
    context.fillStyle = `rgba(90, 220, 130, ${0.2 + 0.25 * beat})`;
    context.beginPath();
    context.arc(x, y, 0.46 * s, 0, 2 * Math.PI);
    context.fill();
  }
  context.lineWidth = 0.1 * s;
  context.strokeStyle = "#20140c";
  context.beginPath();
  context.arc(x, y, 0.4 * s, 0, 2 * Math.PI);
  context.stroke();
  context.lineWidth = 0.062 * s;
  context.strokeStyle = ready ? "#4cd07d" : "#ffc23d";
  context.beginPath();
  context.arc(x, y, 0.4 * s, -Math.PI / 2, -Math.PI / 2 + Math.max(0.02, done) * 2 * Math.PI);
  context.stroke();
}

/** How many ingredients are in: three dots on the pot's belly. @param {Context} context @param {number} x @param {number} y
 * @param {number} s @param {Pot} pot */
function pips(context, x, y, s, pot) {
  for (let i = 0; i < INGREDIENTS; i += 1) {
    context.beginPath();
    context.arc(x + (i - 1) * 0.135 * s, y, 0.048 * s, 0, 2 * Math.PI);
    context.fillStyle = i < pot.onions ? "#f0a83c" : i < pot.onions + pot.tomatoes ? "#e0402c" : "#f4f6f8";
    context.fill();
    context.lineWidth = 0.022 * s;
    context.strokeStyle = "#3b2418";
    context.stroke();
  }
}

/** @param {Context} context @param {Sprites} sprites @param {number} x @param {number} y @param {number} s @param {number} now @param {boolean} quiet */
function steam(context, sprites, x, y, s, now, quiet) {
  for (const offset of quiet ? [0.35] : [0, 0.5]) {
    const t = quiet ? offset : (now / 1600 + offset) % 1;
    context.globalAlpha = 0.85 * Math.sin(Math.PI * t);
    const w = (0.3 + 0.2 * t) * s;
    context.drawImage(sprites.get("steam"), x - w / 2 - 0.06 * s, y - (0.26 + 0.36 * t) * s, w, w);
  }
  context.globalAlpha = 1;
}
