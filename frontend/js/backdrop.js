/** The kitchen without anything that moves, drawn once per size: wall, floor, worktops, stations, shadows. */

import { STATIONS, newCanvas } from "./sprites.js";

/** @typedef {import("./sprites.js").Sprites} Sprites */
/** @typedef {CanvasRenderingContext2D} Context */

/** Height of the back wall above the first row, in tiles: room for steam. */
export const WALL = 0.4;

/** The same in whole device pixels, so that no tile lies between two. @param {number} tile */
export const wallOf = (tile) => Math.round(WALL * tile);

const CORNER = 0.17;

/** @param {string[]} grid @param {number} x @param {number} y @returns {string} outside counts as a counter */
const tileAt = (grid, x, y) => grid[y]?.[x] ?? "X";

/** @param {string[]} grid @param {number} x @param {number} y */
export const isFloor = (grid, x, y) => tileAt(grid, x, y) === " ";

/**
 * The kitchen without anything that moves.
 * @param {string[]} grid @param {Sprites} sprites
 * @returns {HTMLCanvasElement}
 */
export function still(grid, sprites) {
  const s = sprites.tile;
  const width = grid[0]?.length ?? 0;
  const { canvas, context } = newCanvas(width * s, grid.length * s + wallOf(s));
  for (let x = 0; x < width; x += 1) context.drawImage(sprites.get("wall"), x * s, 0, s + 1, wallOf(s) + 1);
  context.translate(0, wallOf(s));
  for (const [x, y] of cells(grid)) context.drawImage(sprites.get((x + y) % 2 ? "floor-dark" : "floor"), x * s, y * s);
  for (const [x, y] of cells(grid)) if (isFloor(grid, x, y)) shade(context, grid, x, y, s);
  for (const [x, y, tile] of cells(grid)) if (tile !== " ") worktop(context, grid, x, y, sprites);
  return canvas;
}

/** @param {string[]} grid @returns {Array<[number, number, string]>} x, y, tile in row-major order */
function cells(grid) {
  return grid.flatMap((row, y) => [...row].map((tile, x) => /** @type {[number, number, string]} */ ([x, y, tile])));
}

/** Soft shadow of the worktops on one cell of floor: the light comes from the top left.
 * @param {Context} context @param {string[]} grid @param {number} x @param {number} y @param {number} s */
function shade(context, grid, x, y, s) {
  /** @param {number} x1 @param {number} y1 @param {number} strength */
  const fall = (x1, y1, strength) => {
    const gradient = context.createLinearGradient(x * s, y * s, x * s + x1, y * s + y1);
    gradient.addColorStop(0, `rgba(74, 40, 16, ${strength})`);
    gradient.addColorStop(1, "rgba(74, 40, 16, 0)");
    context.fillStyle = gradient;
    context.fillRect(x * s, y * s, x1 ? Math.abs(x1) : s, y1 ? Math.abs(y1) : s);
  };
  if (!isFloor(grid, x, y - 1)) fall(0, 0.34 * s, 0.42);
  if (!isFloor(grid, x - 1, y)) fall(0.24 * s, 0, 0.3);
}

/** @param {Context} context @param {string[]} grid @param {number} x @param {number} y @param {Sprites} sprites */
function worktop(context, grid, x, y, sprites) {
  const s = sprites.tile;
  const tile = tileAt(grid, x, y);
  const [n, e, south, w] = [isFloor(grid, x, y - 1), isFloor(grid, x + 1, y), isFloor(grid, x, y + 1), isFloor(grid, x - 1, y)];
  const lip = south || y === grid.length - 1;
  const r = CORNER * s;
  context.save();
  context.beginPath();
  context.roundRect(x * s, y * s, s, s, [n && w ? r : 0, n && e ? r : 0, south && e ? r : 0, south && w ? r : 0]);
  context.clip();
  context.drawImage(sprites.get("counter"), x * s, y * s);
  if (lip) context.drawImage(sprites.get(tile === "P" ? "stove-front" : "front"), x * s, y * s);
  context.lineWidth = Math.max(1, 0.035 * s);
  context.strokeStyle = "#5f3619";
  context.stroke(edges(x, y, s, n, e, south, w));
  context.restore();
  const station = STATIONS[tile];
  if (station) context.drawImage(sprites.get(station), x * s, y * s + (lip ? 0 : 0.09 * s));
}

/** The sides of a worktop that border on floor. @param {number} x @param {number} y @param {number} s
 * @param {boolean} n @param {boolean} e @param {boolean} south @param {boolean} w */
function edges(x, y, s, n, e, south, w) {
  const path = new Path2D();
  const [x0, y0, x1, y1] = [x * s, y * s, (x + 1) * s, (y + 1) * s];
  const r = CORNER * s;
  if (n) { path.moveTo(x0 + (w ? r : 0), y0); path.lineTo(x1 - (e ? r : 0), y0); }
  if (n && e) path.arc(x1 - r, y0 + r, r, -Math.PI / 2, 0);
  if (e) { path.moveTo(x1, y0 + (n ? r : 0)); path.lineTo(x1, y1 - (south ? r : 0)); }
  if (south && e) path.arc(x1 - r, y1 - r, r, 0, Math.PI / 2);
  if (south && w) { path.moveTo(x0 + r, y1); path.arc(x0 + r, y1 - r, r, Math.PI / 2, Math.PI); }
  if (w) { path.moveTo(x0, y1 - (south ? r : 0)); path.lineTo(x0, y0 + (n ? r : 0)); }
  if (n && w) path.arc(x0 + r, y0 + r, r, Math.PI, 1.5 * Math.PI);
  return path;
}

/** Middle of a worktop's visible top. @param {string[]} grid @param {number} x @param {number} y */
export const middle = (grid, x, y) => (isFloor(grid, x, y + 1) || y === grid.length - 1 ? 0.38 : 0.47);
