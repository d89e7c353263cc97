/** The timeline under a replay: a lane of actions per chef, a lane of events, the score, and where one is. */

import { ACTIONS, eventWords, seatWords } from "./names.js";

/** @typedef {import("./episode.js").Episode} Episode */

const SVG = "http://www.w3.org/2000/svg";
const LANE = 16;
const GAP = 5;
const SCORE = 34;
const EVENT_ROWS = 3 * (LANE + GAP);
const HEIGHT = 2 * (LANE + GAP) + EVENT_ROWS + SCORE;

/** Row of each event: chef 0, chef 1, pots. @param {number | null} seat */
const rowOf = (seat) => (seat === null ? 2 : seat);

/** @param {string} name @param {Record<string, string | number>} attributes @param {string} [title] */
function shape(name, attributes, title) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (title) {
    const words = document.createElementNS(SVG, "title");
    words.textContent = title;
    made.append(words);
  }
  return made;
}

export class Lanes {
  /** @param {SVGSVGElement} svg @param {(tick: number) => void} go told the tick that was pointed at */
  constructor(svg, go) {
    this.svg = svg;
    this.whole = 1;
    this.cursor = shape("line", { class: "cursor", y1: 0, y2: HEIGHT, x1: 0, x2: 0 });
    let held = false;
    /** @param {PointerEvent} event */
    const point = (event) => {
      const box = svg.getBoundingClientRect();
      go(Math.round(((event.clientX - box.left) / box.width) * this.whole));
    };
    svg.addEventListener("pointerdown", (event) => { held = true; svg.setPointerCapture(event.pointerId); point(event); });
    svg.addEventListener("pointermove", (event) => { if (held) point(event); });
    for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) svg.addEventListener(end, () => { held = false; });
  }

  /** Draws everything; x is ticks. @param {Episode} episode */
  draw(episode) {
    const { whole } = episode.recording;
    this.whole = Math.max(1, whole, episode.ticks);
    this.svg.setAttribute("viewBox", `0 0 ${this.whole} ${HEIGHT}`);
    this.svg.setAttribute("preserveAspectRatio", "none");
    /** @type {Element[]} */
    const shapes = [];
    for (let lane = 0; lane < 5; lane += 1) shapes.push(shape("rect", { class: "ground", x: 0, y: lane * (LANE + GAP), width: this.whole, height: LANE }));
    for (const seat of /** @type {const} */ ([0, 1])) shapes.push(...runs(episode, seat));
    shapes.push(...marks(episode), score(episode));
    for (const frame of episode.recording.frames.slice(1)) shapes.push(shape("line", { class: "episode", x1: frame.at, x2: frame.at, y1: 0, y2: HEIGHT }));
    this.svg.replaceChildren(...shapes, this.cursor);
  }

  /** @param {number} tick */
  point(tick) {
    this.cursor.setAttribute("x1", String(tick));
    this.cursor.setAttribute("x2", String(tick));
  }
}

/** Equal actions one after the other as one rectangle. @param {Episode} episode @param {0 | 1} seat */
function runs(episode, seat) {
  const found = [];
  let from = 0;
  for (let tick = 1; tick <= episode.ticks; tick += 1) {
    const action = episode.steps[from]?.actions[seat];
    if (tick < episode.ticks && episode.steps[tick]?.actions[seat] === action) continue;
    const name = ACTIONS[action ?? 4] ?? "stay";
    const words = `chef ${seat}: ${name}, ticks ${from} to ${tick - 1}`;
    if (name !== "stay") found.push(shape("rect", { class: `act-${name}`, x: from, y: seat * (LANE + GAP), width: tick - from, height: LANE }, words));
    from = tick;
  }
  episode.steps.forEach((step, tick) => {
    if (step.why && seat === 0) found.push(shape("rect", { class: "late", x: tick, y: 2 * (LANE + GAP) - 3, width: 1, height: 3 }, `the agent was ${step.why} at tick ${tick}`));
  });
  return found;
}

/** @param {Episode} episode */
function marks(episode) {
  return episode.steps.flatMap((step, tick) => step.events.filter(([kind]) => kind !== "blocked").map((event) => {
    const wide = Math.max(1, episode.recording.whole / 260);
    const y = (2 + rowOf(event[1])) * (LANE + GAP);
    return shape("rect", { class: `mark mark-${event[0]}`, x: tick + 0.5 - wide / 2, y, width: wide, height: LANE }, `tick ${tick}: ${seatWords(event[1])} ${eventWords(event)}`);
  }));
}

/** @param {Episode} episode */
function score(episode) {
  const top = Math.max(20, episode.recording.score);
  const base = HEIGHT - 2;
  let path = `M0 ${base}`;
  let last = 0;
  episode.steps.forEach((step, tick) => {
    if (step.score === last) return;
    path += `H${tick + 1}V${(base - (step.score / top) * (SCORE - 8)).toFixed(2)}`;
    last = step.score;
  });
  return shape("path", { class: "score-line", d: `${path}H${episode.ticks}` }, `score, ${episode.recording.score} in the end`);
}
