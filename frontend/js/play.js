/** A round in the browser: server messages move the board, keys go to the server, cards lie between. */

import { applyTick, boardFrom } from "./board.js";
import { Connection } from "./connection.js";
import { Hud } from "./hud.js";
import { Keys } from "./keys.js";
import { Sounds } from "./sound.js";
import { loadImages } from "./sprites.js";
import { View } from "./view.js";
import { key, ready, release } from "./wire.js";

/** @typedef {import("./board.js").Board} Board */
/** @typedef {import("./connection.js").Link} Link */
/** @typedef {import("./wire.js").Keyframe} Keyframe */
/** @typedef {import("./wire.js").ServerMessage} ServerMessage */

const END_CARD_MS = 1300;
const POINTS_A_SOUP = 20;

class Round {
  /** @param {HTMLElement} root @param {View} view */
  constructor(root, view) {
    this.root = root;
    this.view = view;
    this.hud = new Hud(root);
    const toggle = root.querySelector('[data-part="sound"]');
    this.sounds = new Sounds(toggle instanceof HTMLButtonElement ? toggle : null);
    /** @type {Board | null} */
    this.board = null;
    this.over = false;
    this.link = new Connection(root.dataset.socket ?? "", (message) => this.hear(message), (link) => this.linked(link));
    this.keys = new Keys(
      (name, down) => {
        this.link.send(key(name, down, this.link.nextSeq(), performance.now()));
        if (down) this.hud.usedKey(name);
      },
      (reason) => this.link.send(release(reason, this.link.nextSeq(), performance.now())),
    );
    for (const area of root.querySelectorAll("[data-part=touch]")) if (area instanceof HTMLElement) this.keys.touch(area);
    window.addEventListener("touchstart", () => root.classList.add("fingers"), { once: true, passive: true });
    this.link.open();
  }

  /** @param {ServerMessage} message */
  hear(message) {
    switch (message.type) {
      case "keyframe": this.start(message); break;
      case "countdown": this.count(message.seconds); break;
      case "tick": this.step(message); break;
      case "paused": this.pause(message.seconds_left); break;
      case "ended": this.end(message.outcome, message.score, message.next); break;
      case "refused": console.warn("the server refused a message:", message.reason); break;
      default: break;
    }
  }

  /** @param {Keyframe} frame */
  start(frame) {
    this.board = boardFrom(frame);
    this.view.show(this.board);
    this.hud.update(this.board);
    this.root.classList.add("drawn");
    this.keys.enable(frame.phase === "playing" || frame.phase === "countdown");
    if (frame.phase === "waiting") this.invite();
    if (frame.phase === "playing") this.hud.hide();
  }

  invite() {
    const { title, text } = this.root.dataset;
    this.hud.show({ kind: "start", title: title ?? "Ready?", text: text ?? "", button: "Start", press: () => this.go() });
  }

  go() {
    this.link.send(ready());
    this.keys.enable(true);
  }

  /** @param {number} seconds */
  count(seconds) {
    if (this.board) this.board.phase = "countdown";
    this.view.redraw();
    this.keys.enable(true);
    if (seconds > 0) {
      this.hud.show({ kind: "count", title: String(seconds) });
      this.sounds.play("count");
    } else this.hud.hide();
  }

  /** @param {import("./wire.js").Tick} message */
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

  /** @param {number} secondsLeft */
  pause(secondsLeft) {
    if (this.board) this.board.phase = "paused";
    this.keys.enable(false);
    this.hud.show({
      kind: "paused", title: "Paused", button: "Go on", press: () => this.go(),
      text: "The kitchen waits for you, {s} seconds more.", until: secondsLeft,
    });
  }

  /** @param {"finished" | "abandoned"} outcome @param {number} score @param {string} next */
  end(outcome, score, next) {
    this.over = true;
    const board = this.board;
    if (board) {
      Object.assign(board, { phase: "ended", score });
      this.hud.update(board);
    }
    this.keys.enable(false);
    this.sounds.play("end");
    const press = () => location.assign(next || this.root.dataset.next || location.href);
    if (outcome === "abandoned") {
      this.hud.show({ kind: "end", title: "This round has closed", text: "It waited too long. You can go on with the next page.", button: "Continue", press });
      return;
    }
    this.hud.show({ kind: "end", title: "Time is up!", text: summary(board, score), button: "Continue", press, after: END_CARD_MS });
  }

  /** @param {Link} link */
  linked(link) {
    if (this.over) return;
    if (link === "lost") {
      if (this.board?.phase === "playing") this.board.phase = "paused";
      this.keys.enable(false);
      this.hud.show({ kind: "lost", title: "Connection lost", text: "Trying to come back. Your round is kept." });
    }
    if (link === "elsewhere") {
      this.keys.enable(false);
      this.hud.show({
        kind: "elsewhere", title: "This round is open in another tab",
        text: "Play on there, or take it back into this tab.", button: "Play here", press: () => location.reload(),
      });
    }
    if (link === "over") location.assign(this.root.dataset.next ?? location.href);
    if (link === "refused") {
      this.hud.show({ kind: "lost", title: "This page is out of date", text: "Please load it again.", button: "Load again", press: () => location.reload() });
    }
  }
}

/** @param {Board | null} board @param {number} score @returns {string} */
function summary(board, score) {
  const soups = score / POINTS_A_SOUP;
  const served = Number.isInteger(soups) ? `You two served ${soups} ${soups === 1 ? "soup" : "soups"}: ${score} points.` : `You two made ${score} points.`;
  if (board === null || board.goal === null) return served;
  return score >= board.goal ? `${served} That is the goal!` : `${served} The goal was ${board.goal}.`;
}

const root = document.getElementById("kitchen");
const canvas = root?.querySelector("canvas");
const room = root?.querySelector('[data-part="room"]');
if (root && canvas && room instanceof HTMLElement) {
  const images = await loadImages(root.dataset.sprites ?? "/static/sprites/");
  new Round(root, new View(canvas, room, images));
}
