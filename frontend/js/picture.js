/** Redraws the kitchen pictures on a page with the drawings of the game; without it they are made of tiles. */

import { boardFrom } from "./board.js";
import { draw } from "./draw.js";
import { still } from "./backdrop.js";
import { stillFrame } from "./still_frame.js";
import { HATS, Sprites, loadImages, newCanvas } from "./sprites.js";
import { tileFor } from "./view.js";

/** @typedef {import("./messages.js").ChefRow} ChefRow */
/** @typedef {import("./messages.js").PotRow} PotRow */

const TALLEST_PX = 420;
const LARGEST_TILE = 84;
const WORDS = Object.keys(HATS);

/**
 * Where the two chefs of an ASCII drawing stand.
 * @param {string[]} rows
 * @returns {[ChefRow, ChefRow] | null}
 */
function starts(rows) {
  /** @param {string} mark @returns {ChefRow | null} */
  const find = (mark) => {
    const y = rows.findIndex((row) => row.includes(mark));
    return y < 0 ? null : [rows[y]?.indexOf(mark) ?? 0, y, 1, 0];
  };
  const [first, second] = [find("1"), find("2")];
  return first && second ? [first, second] : null;
}

/**
 * The pots of a kitchen: empty, or in the middle of work.
 * @param {string[]} grid @param {boolean} busy
 * @returns {PotRow[]}
 */
function potsOf(grid, busy) {
  const places = grid.flatMap((row, y) => [...row].flatMap((tile, x) => (tile === "P" ? [[x, y]] : [])));
  return places.map(([x = 0, y = 0], i) => (busy ? [x, y, 3, 0, i % 2 ? 20 : 13, i % 2 === 1] : [x, y, 0, 0, 0, false]));
}

/** @param {HTMLElement} figure @param {Map<string, HTMLImageElement>} images */
function redraw(figure, images) {
  const tiles = figure.querySelector(".kitchen-tiles");
  const rows = (figure.dataset.grid ?? "").split("/");
  const chefs = starts(rows);
  if (!tiles || !chefs) return;
  const density = window.devicePixelRatio || 1;
  const css = Math.min(LARGEST_TILE, tileFor(rows[0]?.length ?? 1, rows.length, figure.clientWidth, TALLEST_PX));
  const sprites = new Sprites(images, Math.floor(css * density));
  const grid = rows.map((row) => row.replace(/[12]/g, " "));
  const kitchen = still(grid, sprites);
  const { canvas, context } = newCanvas(kitchen.width, kitchen.height);
  const hats = /** @type {[string, string]} */ ([figure.dataset.hat ?? WORDS[4], figure.dataset.partnerHat ?? WORDS[0]]);
  const busy = figure.dataset.scene === "busy";
  const pots = potsOf(grid, busy);
  if (busy) Object.assign(chefs, { 0: [chefs[0][0], chefs[0][1], 2, 1], 1: [chefs[1][0], chefs[1][1], 1, 4] });
  draw(context, boardFrom(stillFrame(grid, chefs, pots, hats), document.body.dataset.you ?? ""), sprites, kitchen, 0);
  canvas.className = "kitchen-canvas";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", tiles.getAttribute("aria-label") ?? "");
  canvas.style.width = `${kitchen.width / density}px`;
  tiles.replaceWith(canvas);
}

const figures = [...document.querySelectorAll("figure.kitchen-picture")];
if (figures.length > 0) {
  const images = await loadImages(new URL("../sprites/", import.meta.url).href);
  for (const figure of figures) if (figure instanceof HTMLElement) redraw(figure, images);
}
