/** Draws what flies up for a moment: points for a delivery, sparks, splashes. */

import { EFFECT_MS } from "./board.js";
import { WALL, middle } from "./backdrop.js";
import { share } from "./motion.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./board.js").Effect} Effect */
/** @typedef {CanvasRenderingContext2D} Context */

/** @param {Context} context @param {Board} board @param {Effect} effect @param {number} s @param {number} now @param {boolean} quiet */
export function drawEffect(context, board, effect, s, now, quiet) {
  const t = share(now, effect.at, EFFECT_MS);
  if (t >= 1) return;
  const [mx, my] = [(effect.x + 0.5) * s, (effect.y + middle(board.grid, effect.x, effect.y)) * s];
  if (effect.kind === "points") points(context, board, effect.text, mx, my, s, t, quiet);
  else if (!quiet) burst(context, effect.kind, mx, my, s, share(now, effect.at, effect.kind === "sparkle" ? 800 : 320));
}

/** @param {Context} context @param {Board} board @param {string} text @param {number} x @param {number} y @param {number} s
 * @param {number} t @param {boolean} quiet */
function points(context, board, text, x, y, s, t, quiet) {
  const rise = quiet ? 0.5 : 1.15 * (1 - (1 - t) * (1 - t));
  const size = Math.round((quiet ? 0.5 : 0.38 + 0.18 * Math.min(1, t * 6)) * s);
  context.globalAlpha = t > 0.7 ? (1 - t) / 0.3 : 1;
  context.font = `800 ${size}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.lineWidth = 0.13 * s;
  context.strokeStyle = "#2b1a10";
  const half = context.measureText(text).width / 2 + 0.08 * s;
  const width = (board.grid[0]?.length ?? 0) * s;
  const px = Math.min(width - half, Math.max(half, x));
  const py = Math.max((0.32 - WALL) * s, y - rise * s);
  context.strokeText(text, px, py);
  context.fillStyle = "#ffd84d";
  context.fillText(text, px, py);
  context.globalAlpha = 1;
}

/** @param {Context} context @param {Effect["kind"]} kind @param {number} x @param {number} y @param {number} s @param {number} t */
function burst(context, kind, x, y, s, t) {
  if (t >= 1) return;
  const many = kind === "sparkle" ? 10 : 6;
  const reach = kind === "sparkle" ? 0.62 : 0.4;
  context.fillStyle = kind === "sparkle" ? "#ffe27a" : "#fff6e2";
  context.globalAlpha = 1 - t;
  for (let i = 0; i < many; i += 1) {
    const angle = (i / many) * 2 * Math.PI + 0.4;
    const far = (0.2 + reach * Math.sqrt(t) * (i % 2 ? 1 : 0.75)) * s;
    context.beginPath();
    context.arc(x + Math.cos(angle) * far, y + Math.sin(angle) * far * 0.8, (0.055 - 0.035 * t) * s, 0, 2 * Math.PI);
    context.fill();
  }
  context.globalAlpha = 1;
}
