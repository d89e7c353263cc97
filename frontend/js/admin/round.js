/** The replay of a round: scrubber, steps, speed, timeline; a round under way is followed as it is played. */

import { NEVER } from "../board.js";
import { loadImages } from "../sprites.js";
import { View } from "../view.js";
import { Episode } from "./episode.js";
import { Lanes } from "./lanes.js";
import { ACTIONS, HELD, SIGNS, clock, eventWords, seatWords } from "./names.js";

const ASK_EVERY_MS = 1000;
const BIG_STEP = 10;
const KEY = /** @type {const} */ ([["act-north", "north"], ["act-south", "south"], ["act-east", "east"], ["act-west", "west"], ["act-interact", "interact"], ["late", "agent late"], ["mark-pick_up", "takes"], ["mark-put_down", "puts down"], ["mark-potting", "into a pot"], ["mark-soup_ready", "soup ready"], ["mark-delivery", "delivers"]]);

/**
 * The part of the page with this name.
 * @template {Element} T
 * @param {string} name @param {new () => T} kind @returns {T}
 */
function part(name, kind) {
  const found = document.querySelector(`[data-part="${name}"]`);
  if (!(found instanceof kind)) throw new Error(`the page has no ${name}`);
  return found;
}

class Player {
  /** @param {View} view @param {Episode} episode @param {string} url */
  constructor(view, episode, url) {
    this.view = view;
    this.episode = episode;
    this.url = url;
    this.tick = 0;
    this.playing = false;
    this.due = 0;
    this.scrubber = part("scrubber", HTMLInputElement);
    this.speed = part("speed", HTMLSelectElement);
    this.events = part("events", HTMLElement);
    const follow = document.querySelector('[data-part="follow"]');
    this.follow = follow instanceof HTMLInputElement ? follow : null;
    this.lanes = new Lanes(part("lanes", SVGSVGElement), (tick) => this.jump(tick));
    this.play = button("play");
    this.wire();
    this.filled();
    this.go(this.following() ? episode.ticks : 0);
    requestAnimationFrame((now) => this.frame(now));
  }

  following() {
    return this.follow?.checked ?? false;
  }

  wire() {
    this.scrubber.addEventListener("input", () => this.jump(Number(this.scrubber.value)));
    button("start").addEventListener("click", () => this.jump(0));
    button("end").addEventListener("click", () => this.jump(this.episode.ticks));
    button("back").addEventListener("click", () => this.jump(this.tick - 1));
    button("on").addEventListener("click", () => this.jump(this.tick + 1));
    this.play.addEventListener("click", () => this.toggle());
    this.follow?.addEventListener("change", () => { if (this.following()) this.go(this.episode.ticks); });
    document.addEventListener("keydown", (event) => this.key(event));
    const data = document.querySelector("details.data");
    data?.addEventListener("toggle", () => this.table());
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const on = event.target instanceof Element ? event.target : document.body;
    if (on.closest("select, textarea, input:not([type=range])")) return;
    const many = event.shiftKey ? BIG_STEP : 1;
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => this.jump(this.tick - many), ArrowRight: () => this.jump(this.tick + many),
      Home: () => this.jump(0), End: () => this.jump(this.episode.ticks), " ": () => this.toggle(),
    };
    if (event.key === " " && on.closest("button, a, summary")) return;
    const does = keys[event.key];
    if (!does) return;
    event.preventDefault();
    does();
  }

  toggle() {
    if (this.follow) this.follow.checked = false;
    if (!this.playing && this.tick >= this.episode.ticks) this.go(0);
    this.setPlaying(!this.playing);
  }

  /** @param {boolean} playing */
  setPlaying(playing) {
    this.playing = playing;
    this.due = performance.now();
    this.play.textContent = playing ? "⏸ Pause" : "▶ Play";
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
  }

  /** A tick chosen by hand: playing stops. @param {number} tick */
  jump(tick) {
    if (this.follow) this.follow.checked = false;
    this.setPlaying(false);
    this.go(tick);
  }

  /** Length of a tick as it is shown now, ms. */
  tickMs() {
    return this.episode.recording.tick_ms / (this.following() ? 1 : Number(this.speed.value));
  }

  /** @param {number} now */
  frame(now) {
    if ((this.playing || this.following()) && now >= this.due) {
      const behind = this.episode.ticks - this.tick;
      if (behind > 0) {
        // A follower who fell back (a hidden tab) catches up at once.
        const skip = this.following() && behind * this.tickMs() > 4 * ASK_EVERY_MS;
        const many = this.playing ? Math.min(8, 1 + Math.floor((now - this.due) / this.tickMs())) : 1;
        this.due = Math.max(this.due + many * this.tickMs(), now - 100);
        this.go(skip ? this.episode.ticks : this.tick + many, now);
      } else if (this.playing && this.episode.recording.status !== "open") this.setPlaying(false);
    }
    if (this.view.board && now - this.moved < 1500) this.view.redraw();
    requestAnimationFrame((next) => this.frame(next));
  }

  moved = 0;

  /** Shows a tick. @param {number} tick @param {number} now when its movement begins, NEVER for a still */
  go(tick, now = NEVER) {
    this.tick = Math.max(0, Math.min(this.episode.ticks, tick));
    const board = this.episode.seek(this.tick, now);
    board.tickMs = this.tickMs();
    this.moved = performance.now();
    this.view.show(board);
    this.scrubber.value = String(this.tick);
    this.scrubber.setAttribute("aria-valuetext", `tick ${this.tick} of ${this.episode.ticks}`);
    part("tick", HTMLElement).textContent = String(this.tick);
    part("time", HTMLElement).textContent = clock(this.tick * this.episode.recording.tick_ms);
    part("score", HTMLElement).textContent = String(board.score);
    const step = this.episode.steps[this.tick - 1];
    for (const seat of /** @type {const} */ ([0, 1])) {
      const action = step?.actions[seat];
      const agent = board.seat !== seat && step?.why ? ` (${step.why})` : "";
      part(`action-${seat}`, HTMLElement).textContent = action === undefined ? "–" : `${SIGNS[action]} ${ACTIONS[action]}${agent}`;
      part(`held-${seat}`, HTMLElement).textContent = HELD[board.chefs[seat].held] ?? "";
    }
    this.lanes.point(this.tick);
    this.mark();
  }

  /** Lights up the last event that has happened by now. */
  mark() {
    /** @type {HTMLElement | null} */
    let last = null;
    for (const item of this.events.children) {
      if (!(item instanceof HTMLElement)) continue;
      item.removeAttribute("aria-current");
      if (Number(item.dataset.tick) < this.tick) last = item;
    }
    if (!last) return;
    last.setAttribute("aria-current", "true");
    const { offsetTop, offsetHeight } = last;
    if (offsetTop < this.events.scrollTop || offsetTop + offsetHeight > this.events.scrollTop + this.events.clientHeight) {
      this.events.scrollTop = offsetTop - this.events.clientHeight / 2;
    }
  }

  /** Everything that depends on how much was played. */
  filled() {
    const { episode } = this;
    this.scrubber.max = String(episode.ticks);
    this.lanes.draw(episode);
    const items = episode.steps.flatMap((step, tick) => step.events.filter(([kind]) => kind !== "blocked").map((event) => {
      const item = document.createElement("li");
      item.dataset.tick = String(tick);
      const to = document.createElement("button");
      to.type = "button";
      to.className = "plain";
      to.textContent = `${tick} ${seatWords(event[1])} ${eventWords(event)}`;
      to.addEventListener("click", () => this.jump(tick + 1));
      item.append(to);
      return item;
    }));
    this.events.replaceChildren(...items);
    this.table();
  }

  /** All ticks with actions and events, made when somebody opens it. */
  table() {
    const data = document.querySelector("details.data");
    if (!(data instanceof HTMLDetailsElement) || !data.open) return;
    const table = document.createElement("table");
    table.className = "tight";
    const head = table.createTHead().insertRow();
    for (const words of ["Tick", "Chef 0", "Chef 1", "Agent", "Score", "Events"]) {
      const cell = document.createElement("th");
      cell.textContent = words;
      head.append(cell);
    }
    const body = table.createTBody();
    this.episode.steps.forEach((step, tick) => {
      const row = body.insertRow();
      const events = step.events.map((event) => `${seatWords(event[1])} ${eventWords(event)}`).join("; ");
      for (const words of [tick, ACTIONS[step.actions[0]], ACTIONS[step.actions[1]], step.why ?? "", step.score, events]) row.insertCell().textContent = String(words);
    });
    part("table", HTMLElement).replaceChildren(table);
  }

  /** Asks for what was played since, until the round is over. */
  async ask() {
    const note = part("note", HTMLElement);
    try {
      const response = await fetch(`${this.url}?after=${this.episode.ticks}`);
      if (response.status === 401) return location.reload();
      if (!response.ok) throw new Error(String(response.status));
      /** @type {import("./episode.js").Recording} */
      const more = await response.json();
      note.hidden = true;
      const grown = more.ticks !== this.episode.ticks;
      const over = more.status !== this.episode.recording.status;
      this.episode.grow(more);
      if (grown || over) this.filled();
      if (over) return location.reload();
    } catch {
      note.textContent = "Not reached; trying again …";
      note.hidden = false;
    }
    window.setTimeout(() => this.ask(), ASK_EVERY_MS);
    return undefined;
  }
}

/** @param {string} does @returns {HTMLButtonElement} */
function button(does) {
  const found = document.querySelector(`button[data-do="${does}"]`);
  if (!(found instanceof HTMLButtonElement)) throw new Error(`the page has no button ${does}`);
  return found;
}

/** What the colours of the timeline mean. */
function legend() {
  part("key", HTMLElement).replaceChildren(...KEY.map(([kind, words]) => {
    const item = document.createElement("span");
    const picture = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    picture.setAttribute("viewBox", "0 0 10 10");
    picture.setAttribute("width", "10");
    picture.setAttribute("height", "10");
    picture.setAttribute("aria-hidden", "true");
    const square = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    square.setAttribute("class", kind);
    square.setAttribute("width", "10");
    square.setAttribute("height", "10");
    picture.append(square);
    item.append(picture, ` ${words}`);
    return item;
  }));
}

async function start() {
  const root = document.getElementById("replay");
  const note = part("note", HTMLElement);
  const url = root?.dataset.url ?? "";
  try {
    const [images, response] = await Promise.all([loadImages(root?.dataset.sprites ?? "/static/sprites/"), fetch(url)]);
    if (response.status === 401) return location.reload();
    if (!response.ok) throw new Error((await response.json()).error);
    const episode = new Episode(await response.json());
    const view = new View(part("room", HTMLElement).querySelector("canvas") ?? document.createElement("canvas"), part("room", HTMLElement), images);
    legend();
    const player = new Player(view, episode, url);
    note.hidden = true;
    if (root?.dataset.live && episode.recording.status === "open") window.setTimeout(() => player.ask(), ASK_EVERY_MS);
    root?.classList.add("drawn");
  } catch (problem) {
    note.textContent = `The round cannot be shown: ${problem instanceof Error ? problem.message : "unknown"}`;
  }
  return undefined;
}

await start();
