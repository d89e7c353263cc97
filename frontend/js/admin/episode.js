/** A recorded round in the browser: any tick of it as a board. No rules live here; the server worked them out. */

import { NEVER, applyTick, boardFrom } from "../board.js";

/** @typedef {import("../board.js").Board} Board */
/** @typedef {import("../messages.js").Keyframe} Keyframe */
/** @typedef {import("../messages.js").Tick} Tick */
/** @typedef {import("../messages.js").EventRow} EventRow */

/** @typedef {Omit<Tick, "type" | "tick"> & {actions: [number, number], why: string | null}} Step one tick and both actions */
/**
 * @typedef {object} Recording
 * @property {string} status
 * @property {number} from number of the first step in `steps`
 * @property {number} ticks played so far
 * @property {number} whole ticks of the whole round
 * @property {number} tick_ms
 * @property {number} score
 * @property {{at: number, board: Keyframe}[]} frames start of each episode
 * @property {Step[]} steps
 */

export class Episode {
  /** @param {Recording} recording from its first tick on */
  constructor(recording) {
    this.recording = recording;
    this.steps = recording.steps;
    this.at = 0;
    this.since = 0;
    this.board = this.restart(1);
  }

  get ticks() {
    return this.steps.length;
  }

  /** Adds what was played since. @param {Recording} more */
  grow(more) {
    this.steps.splice(more.from, this.steps.length, ...more.steps);
    this.recording = { ...more, from: 0, steps: this.steps };
  }

  /** The board at the start of the episode that the `goal`th tick belongs to. @param {number} goal from 1 @returns {Board} */
  restart(goal) {
    const frame = this.frameOf(goal);
    this.at = frame.at;
    this.since = frame.at;
    return boardFrom(frame.board);
  }

  /** @param {number} goal from 1 */
  frameOf(goal) {
    const frame = this.recording.frames.filter((each) => each.at < goal).pop();
    if (!frame) throw new Error("a round without a beginning");
    return frame;
  }

  /**
   * The board after `tick` ticks; `now` lets the last step be seen moving when it follows on the board before.
   * @param {number} tick @param {number} now ms of performance.now(), or NEVER for a still
   * @returns {Board}
   */
  seek(tick, now = NEVER) {
    const goal = Math.max(0, Math.min(this.ticks, tick));
    if (goal < this.at || this.since !== this.frameOf(Math.max(1, goal)).at) this.board = this.restart(Math.max(1, goal));
    while (this.at < goal) {
      const step = this.steps[this.at];
      if (!step) break;
      this.at += 1;
      applyTick(this.board, { ...step, type: "tick", tick: this.at }, this.at === goal ? now : NEVER);
    }
    if (now === NEVER) {
      this.board.effects = [];
      for (const chef of this.board.chefs) Object.assign(chef, { bumpedAt: NEVER, heldAt: NEVER, movedAt: NEVER });
    }
    // Not "playing": nobody here is to be shown which chef is theirs.
    this.board.phase = "ended";
    return this.board;
  }
}
