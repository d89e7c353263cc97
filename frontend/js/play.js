/** A round in the browser: server messages move the board, keys go to the server, cards lie between. */

import { applyTick, boardFrom } from "./board.js";
import { Connection } from "./connection.js";
import { Hud } from "./hud.js";
import { Keys } from "./keys.js";
import { Sounds } from "./sound.js";
import { loadImages } from "./sprites.js";
import { View } from "./view.js";
import { key, ready, release } from "./messages.js";
import { wordsOf } from "./words.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./connection.js").Link} Link */
/** @typedef {import("./messages.js").Keyframe} Keyframe */
/** @typedef {import("./messages.js").ServerMessage} ServerMessage */
/** @typedef {import("./words.js").Say} Say */

const END_CARD_MS = 1300;

class Round {
  /** @param {HTMLElement} root @param {View} view @param {Say} say */
  constructor(root, view, say) {
    this.root = root;
    this.view = view;
    this.say = say;
    this.hud = new Hud(root, say);
    const toggle = root.querySelector('[data-part="sound"]');
    this.sounds = new Sounds(toggle instanceof HTMLButtonElement ? toggle : null);
    /** @type {Board | null} */
    this.board = null;
    this.over = false;
    this.blocked = false;
    this.link = new Connection(root.dataset.socket ?? "", (message) => this.hear(message), (link, why) => this.linked(link, why));
    this.keys = new Keys(
      (name, down) => {
        this.link.send(key(name, down, this.link.nextSeq(), performance.now()));
        if (down) this.hud.usedKey(name);
      },
      (reason) => this.link.send(release(reason, this.link.nextSeq(), performance.now())),
    );
    for (const area of root.querySelectorAll("[data-part=touch]")) if (area instanceof HTMLElement) this.keys.touch(area);
    // A click leaves no focus behind: Space and Enter belong to the kitchen.
    root.addEventListener("mousedown", (event) => event.preventDefault());
    window.addEventListener("touchstart", () => root.classList.add("fingers"), { once: true, passive: true });
    this.link.open();
  }

  /** @param {ServerMessage} message */
  hear(message) {
    switch (message.type) {
      case "keyframe": this.start(message); break;
      case "countdown": this.count(message.seconds); break;
      case "tick": this.step(message); break;
      case "paused": this.pause(message.reason, message.seconds_left); break;
      case "ended": this.end(message.outcome, message.score, message.next); break;
      case "refused": console.warn("the server refused a message:", message.reason); break;
      default: break;
    }
  }

  /** @param {Keyframe} frame */
  start(frame) {
    this.board = boardFrom(frame, document.body.dataset.you ?? "");
    this.view.show(this.board);
    this.hud.update(this.board);
    this.root.classList.add("drawn");
    this.keys.enable(frame.phase === "playing" || frame.phase === "countdown");
    if (frame.phase === "waiting") this.invite();
    if (frame.phase === "playing") this.hud.hide();
  }

  invite() {
    const { title = "", text = "" } = this.root.dataset;
    this.hud.show({ kind: "start", title, text, button: this.say("start"), press: () => this.go() });
  }

  go() {
    this.link.send(ready());
    this.keys.enable(true);
    if (this.root.dataset.partner === "human") this.hud.show({ kind: "waiting", title: this.say("waiting"), text: this.say("waiting_text") });
  }

  /** @param {number} seconds */
  count(seconds) {
    if (this.board) this.board.phase = "countdown";
    this.view.redraw();
    this.keys.enable(true);
    if (seconds > 0) {
      const { episode = 1, episodes = 1 } = this.board ?? {};
      this.hud.show({ kind: "count", title: String(seconds), text: episodes > 1 ? this.say("game", { n: episode, of: episodes }) : "" });
      this.sounds.play("count");
    } else this.hud.hide();
  }

  /** @param {import("./messages.js").Tick} message */
  step(message) {
    const board = this.board;
    if (!board) return;
    if (this.hud.card) {
      this.hud.hide();
      this.keys.enable(true);
      if (message.tick <= 1) this.sounds.play("go");
    }
    const before = board.score;
    applyTick(board, message, performance.now());
    this.view.redraw();
    this.hud.update(board);
    if (board.score > before) this.hud.cheer();
    for (const [kind, seat] of message.events) {
      if (seat === null || seat === board.seat || kind === "delivery") this.sounds.play(kind);
    }
  }

  /** @param {string} reason @param {number} secondsLeft */
  pause(reason, secondsLeft) {
    if (this.board) this.board.phase = "paused";
    this.keys.enable(false);
    const { say } = this;
    if (reason === "partner") {
      this.hud.show({ kind: "waiting", title: say("partner_away"), text: say("partner_away_text"), until: secondsLeft });
    } else {
      this.hud.show({ kind: "paused", title: say("paused"), button: say("go_on"), press: () => this.go(), text: say("paused_text"), until: secondsLeft });
    }
  }

  /** @param {string} outcome @param {number} score @param {string} next */
  end(outcome, score, next) {
    this.over = true;
    const board = this.board;
    if (board) {
      Object.assign(board, { phase: "ended", score });
      this.hud.update(board);
    }
    this.keys.enable(false);
    this.sounds.play("end");
    const { say } = this;
    const press = () => location.assign(this.root.dataset.next || next || location.href);
    const [title, text] = outcome === "finished" ? [say("over"), summary(board, score, this.root.dataset.bonus, say)]
      : outcome === "partner_left" ? [say("partner_left"), say("partner_left_text")] : [say("closed"), say("closed_text")];
    this.hud.show({ kind: "end", title, text, button: say("continue"), press, after: END_CARD_MS });
  }

  /** @param {Link} link @param {import("./connection.js").Why} [why] */
  linked(link, why) {
    if (this.over) return;
    const { say } = this;
    const reload = () => location.reload();
    if (link === "blocked" && why) {
      const text = `${why.missing === "host" ? say("blocked_host") : say("blocked_websocket")} (Origin ${why.origin}, Host ${why.host})`;
      this.hud.show({ kind: "lost", title: say("blocked"), text });
      this.blocked = true;
    }
    if (link === "lost" && !this.blocked) {
      if (this.board?.phase === "playing") this.board.phase = "paused";
      this.keys.enable(false);
      this.hud.show({ kind: "lost", title: say("lost"), text: say("lost_text") });
    }
    if (link === "elsewhere") {
      this.keys.enable(false);
      this.hud.show({ kind: "elsewhere", title: say("elsewhere"), text: say("elsewhere_text"), button: say("play_here"), press: reload });
    }
    if (link === "over") location.assign(this.root.dataset.next ?? location.href);
    if (link === "refused") {
      this.hud.show({ kind: "lost", title: say("out_of_date"), text: say("out_of_date_text"), button: say("load_again"), press: reload });
    }
  }
}

/** What the card at the end says: soups and points if they may be known, and what came of the goal.
 * @param {Board | null} board @param {number} score @param {string | undefined} bonus @param {Say} say */
function summary(board, score, bonus, say) {
  if (board === null || board.showScore === "never") return say("over_text");
  const soups = board.points ? score / board.points : NaN;
  const told = Number.isInteger(soups) ? [say("soups", { soups })] : [];
  told.push(say("points", { points: score }));
  if (board.goal !== null && score >= board.goal) told.push(bonus ? say("bonus_earned", { bonus }) : say("goal_reached"));
  else if (board.goal !== null) told.push(say("goal_missed", { goal: board.goal }));
  return told.join(" ");
}

const root = document.getElementById("kitchen");
const canvas = root?.querySelector("canvas");
const room = root?.querySelector('[data-part="room"]');
if (root && canvas && room instanceof HTMLElement) {
  const images = await loadImages(root.dataset.sprites ?? "/static/sprites/");
  new Round(root, new View(canvas, room, images), wordsOf("words"));
}
