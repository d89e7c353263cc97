/** The canvas: keeps its size to the room it has, and redraws at most once per animation frame. */

import { inMotion } from "./board.js";
import { draw } from "./draw.js";
import { WALL, still } from "./backdrop.js";
import { Sprites, newCanvas } from "./sprites.js";

/** @typedef {import("./board.js").Board} Board */

const LARGEST_TILE = 96;
const SMALLEST_TILE = 24;

/**
 * Edge of a tile in CSS pixels so that the kitchen fills the room it has.
 * @param {number} width of the kitchen in tiles @param {number} height
 * @param {number} roomWidth in CSS pixels @param {number} roomHeight
 */
export function tileFor(width, height, roomWidth, roomHeight) {
  const fits = Math.min(roomWidth / width, roomHeight / (height + WALL));
  return Math.max(SMALLEST_TILE, Math.min(LARGEST_TILE, fits));
}

export class View {
  /** @param {HTMLCanvasElement} canvas @param {HTMLElement} room @param {Map<string, HTMLImageElement>} images */
  constructor(canvas, room, images) {
    this.canvas = canvas;
    this.room = room;
    const context = canvas.getContext("2d", { alpha: false });
    if (!context) throw new Error("this browser has no canvas");
    this.context = context;
    this.images = images;
    /** @type {Board | null} */
    this.board = null;
    this.sprites = new Sprites(images, 1);
    this.kitchen = newCanvas(1, 1).canvas;
    this.drawn = "";
    this.due = 0;
    new ResizeObserver(() => this.redraw()).observe(room);
    document.addEventListener("visibilitychange", () => this.redraw());
  }

  /** @param {Board} board */
  show(board) {
    this.board = board;
    this.redraw();
  }

  /** Asks for one frame; asking again before it comes changes nothing. */
  redraw() {
    if (!this.due) this.due = requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now */
  frame(now) {
    this.due = 0;
    const board = this.board;
    if (!board) return;
    this.fit(board);
    draw(this.context, board, this.sprites, this.kitchen, now);
    if (inMotion(board, now)) this.redraw();
  }

  /** Makes the drawings anew when the kitchen, its size or the display's density has changed. @param {Board} board */
  fit(board) {
    const width = board.grid[0]?.length ?? 1;
    const density = window.devicePixelRatio || 1;
    const css = tileFor(width, board.grid.length, this.room.clientWidth, this.room.clientHeight);
    const tile = Math.max(1, Math.floor(css * density));
    const wanted = `${tile} ${density} ${board.grid.join("/")}`;
    if (wanted === this.drawn) return;
    this.drawn = wanted;
    if (tile !== this.sprites.tile) this.sprites = new Sprites(this.images, tile);
    this.kitchen = still(board.grid, this.sprites);
    this.canvas.width = this.kitchen.width;
    this.canvas.height = this.kitchen.height;
    this.canvas.style.width = `${this.kitchen.width / density}px`;
    document.documentElement.style.setProperty("--board", `${this.kitchen.width / density}px`);
    this.canvas.style.height = `${this.kitchen.height / density}px`;
  }
}
