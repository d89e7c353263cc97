/**
 * The drawings: SVG files, each rasterised once for the tile size in device pixels.
 * A chef is put together from body, cloth tinted in the hat's colour, and hat.
 */

export const FACINGS = /** @type {const} */ (["north", "south", "east", "west"]);

/** Hat colours (Okabe and Ito, Color Universal Design, 2008), with the mark on each. */
export const HATS = Object.freeze(/** @type {Record<string, {colour: string, mark: string}>} */ ({
  "orange": { colour: "#E69F00", mark: "circle" },
  "sky-blue": { colour: "#56B4E9", mark: "diamond" },
  "bluish-green": { colour: "#009E73", mark: "triangle" },
  "vermillion": { colour: "#D55E00", mark: "square" },
  "blue": { colour: "#0072B2", mark: "star" },
  "reddish-purple": { colour: "#CC79A7", mark: "cross" },
  "yellow": { colour: "#F0E442", mark: "heart" },
}));

/** Drawing by thing code; 0 is nothing. */
export const THINGS = /** @type {const} */ ([null, "onion", "tomato", "dish", "soup-onion", "soup-tomato"]);

/** Drawing of what stands on the worktop, by tile. */
export const STATIONS = Object.freeze(/** @type {Record<string, string>} */ ({
  P: "stove", O: "onion-crate", T: "tomato-crate", D: "dish-rack", S: "hatch",
}));

/** Width and height of each drawing in tiles. */
const SIZES = Object.freeze(/** @type {Record<string, [number, number]>} */ ({
  "floor": [1, 1], "floor-dark": [1, 1], "counter": [1, 1], "front": [1, 1], "wall": [1, 0.4],
  "stove": [1, 1], "stove-front": [1, 1],
  "onion-crate": [1, 1], "tomato-crate": [1, 1], "dish-rack": [1, 1], "hatch": [1, 1],
  "pot": [0.84, 0.84], "broth-onion": [0.84, 0.84], "broth-tomato": [0.84, 0.84],
  "flame": [0.24, 0.24], "steam": [0.5, 0.5], "ready": [0.36, 0.36],
  "onion": [0.62, 0.62], "tomato": [0.62, 0.62], "dish": [0.66, 0.66],
  "soup-onion": [0.7, 0.7], "soup-tomato": [0.7, 0.7],
}));

const CHEF_PARTS = FACINGS.flatMap((facing) => [`chef-${facing}`, `cloth-${facing}`])
  .concat(["chef-east-arm", "chef-west-arm"]);

/** A chef's drawing is 1 by 1.4 tiles; its hat lies in it here, in tiles. */
export const CHEF_SIZE = /** @type {const} */ ([1, 1.4]);
const HAT_BOX = /** @type {const} */ ([0.15, 0.02, 0.7, 0.7 * 62 / 80]);

/** Every file the kitchen may need, without its ending. */
export const NAMES = Object.freeze([...Object.keys(SIZES), ...CHEF_PARTS, ...Object.keys(HATS).map((hat) => `hat-${hat}`)]);

/**
 * The named drawings, fetched and decoded.
 * @param {string} base folder of the drawings, ending in a slash
 * @param {readonly string[]} [names]
 * @returns {Promise<Map<string, HTMLImageElement>>}
 */
export async function loadImages(base, names = NAMES) {
  const images = names.map(async (name) => {
    const image = new Image();
    image.src = `${base}${name}.svg`;
    await image.decode();
    return /** @type {[string, HTMLImageElement]} */ ([name, image]);
  });
  return new Map(await Promise.all(images));
}

/** @param {number} width @param {number} height in device pixels */
export function newCanvas(width, height) {
  const canvas = document.createElement("canvas");
  canvas.width = Math.max(1, Math.round(width));
  canvas.height = Math.max(1, Math.round(height));
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this browser has no canvas");
  return { canvas, context };
}

/** Drawings at one tile size. */
export class Sprites {
  /** @param {Map<string, HTMLImageElement>} images @param {number} tile size in device pixels */
  constructor(images, tile) {
    this.images = images;
    this.tile = tile;
    /** @type {Map<string, HTMLCanvasElement>} */
    this.made = new Map();
  }

  /** @param {string} name @returns {HTMLImageElement} */
  image(name) {
    const image = this.images.get(name);
    if (!image) throw new Error(`no drawing named ${name}`);
    return image;
  }

  /** @param {string} name @returns {[number, number]} width and height in tiles */
  size(name) {
    return SIZES[name] ?? [1, 1];
  }

  /** The drawing at its own size. @param {string} name @returns {HTMLCanvasElement} */
  get(name) {
    const made = this.made.get(name);
    if (made) return made;
    const [w, h] = this.size(name);
    const { canvas, context } = newCanvas(w * this.tile, h * this.tile);
    context.drawImage(this.image(name), 0, 0, canvas.width, canvas.height);
    this.made.set(name, canvas);
    return canvas;
  }

  /** A whole chef. @param {number} facing @param {string} hat @returns {HTMLCanvasElement} */
  chef(facing, hat) {
    const name = `chef ${facing} ${hat}`;
    const made = this.made.get(name);
    if (made) return made;
    const side = FACINGS[facing] ?? "south";
    const [w, h] = CHEF_SIZE;
    const { canvas, context } = newCanvas(w * this.tile, h * this.tile);
    const whole = /** @type {const} */ ([0, 0, canvas.width, canvas.height]);
    context.drawImage(this.image(`chef-${side}`), ...whole);
    context.drawImage(this.tinted(`cloth-${side}`, HATS[hat]?.colour ?? "#888888", canvas.width, canvas.height), 0, 0);
    if (side === "east" || side === "west") context.drawImage(this.image(`chef-${side}-arm`), ...whole);
    const [x, y, hatW, hatH] = HAT_BOX;
    const shift = side === "east" ? 0.015 : side === "west" ? -0.015 : 0;
    context.drawImage(this.image(`hat-${HATS[hat] ? hat : "orange"}`),
      (x + shift) * this.tile, y * this.tile, hatW * this.tile, hatH * this.tile);
    this.made.set(name, canvas);
    return canvas;
  }

  /** A white-and-grey drawing in a colour. @param {string} name @param {string} colour @param {number} w @param {number} h */
  tinted(name, colour, w, h) {
    const { canvas, context } = newCanvas(w, h);
    context.drawImage(this.image(name), 0, 0, w, h);
    context.globalCompositeOperation = "multiply";
    context.fillStyle = colour;
    context.fillRect(0, 0, w, h);
    context.globalCompositeOperation = "destination-in";
    context.drawImage(this.image(name), 0, 0, w, h);
    return canvas;
  }
}
