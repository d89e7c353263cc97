/** The socket of a round: says hello, comes back by itself when it is lost, relates the two clocks. */

import { CLOSE, hello, parse, ping } from "./messages.js";

/** @typedef {import("./messages.js").ClientMessage} ClientMessage */
/** @typedef {import("./messages.js").ServerMessage} ServerMessage */
/** @typedef {"connecting" | "open" | "lost" | "elsewhere" | "over" | "refused" | "blocked"} Link */
/** @typedef {{ missing: string, origin: string, host: string }} Why what a proxy does not pass on */

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 4000;
const PING_EVERY_MS = 2000;
const SILENCE_MS = 7000;
const TRIES_BEFORE_ASKING = 2;

/** @type {Readonly<Record<number, Link>>} */
const FINAL = Object.freeze({ [CLOSE.elsewhere]: "elsewhere", [CLOSE.over]: "over", [CLOSE.refused]: "refused" });

export class Connection {
  /**
   * @param {string} path of the socket on this host
   * @param {(message: ServerMessage) => void} onMessage
   * @param {(link: Link, why?: Why) => void} onLink
   */
  constructor(path, onMessage, onLink) {
    const url = new URL(path, location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    this.url = url.href;
    this.onMessage = onMessage;
    this.onLink = onLink;
    this.tab = [...crypto.getRandomValues(new Uint8Array(12))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    /** @type {WebSocket | null} */
    this.socket = null;
    this.tries = 0;
    this.stopped = false;
    /** Whether any socket of this page ever opened. */
    this.opened = false;
    /** @type {number | null} */
    this.rtt = null;
    this.heardAt = 0;
    this.seq = 0;
    window.setInterval(() => this.beat(), PING_EVERY_MS);
    window.addEventListener("online", () => this.open());
  }

  /** Connects, unless it is connected or must not be. */
  open() {
    if (this.stopped || this.socket) return;
    this.onLink("connecting");
    const socket = new WebSocket(this.url);
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.opened = true;
      this.heardAt = performance.now();
      this.rtt = null;
      this.send(hello(this.tab));
      this.onLink("open");
    });
    socket.addEventListener("message", (event) => this.hear(event.data));
    socket.addEventListener("close", (event) => this.lose(socket, event.code));
  }

  /** @param {unknown} data */
  hear(data) {
    const message = parse(data);
    if (!message) return;
    this.heardAt = performance.now();
    if (message.type === "pong") this.rtt = Math.max(0, this.heardAt - message.client_ms);
    else if (message.type === "elsewhere") this.end("elsewhere");
    else {
      if (message.type === "keyframe") this.tries = 0;
      if (message.type === "ended") this.stopped = true;
      this.onMessage(message);
    }
  }

  /** @param {WebSocket} socket @param {number} code */
  lose(socket, code) {
    if (this.socket !== socket) return;
    this.socket = null;
    if (this.stopped) return;
    const final = FINAL[code];
    if (final) {
      this.end(final);
      return;
    }
    this.onLink("lost");
    if (!this.opened && this.tries === TRIES_BEFORE_ASKING) this.askWhy();
    const wait = Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** this.tries) * (0.75 + Math.random() / 2);
    this.tries += 1;
    window.setTimeout(() => this.open(), wait);
  }

  /** Asks by an ordinary request what keeps the socket from opening: a proxy may pass on too little. */
  async askWhy() {
    try {
      const url = `${this.url.replace(/^ws/, "http")}?origin=${encodeURIComponent(location.origin)}`;
      const answer = await fetch(url, { cache: "no-store" });
      if (answer.ok && !this.opened) this.onLink("blocked", await answer.json());
    } catch {
      // The network is away as well: nothing to tell.
    }
  }

  /** @param {Link} link */
  end(link) {
    this.stopped = true;
    this.onLink(link);
  }

  /** Pings, and gives up a socket on which nothing came for long: a dead network does not close it. */
  beat() {
    const socket = this.socket;
    if (!socket || socket.readyState !== WebSocket.OPEN) return;
    if (performance.now() - this.heardAt > SILENCE_MS) {
      this.lose(socket, 0);
      socket.close();
    } else this.send(ping(performance.now(), this.rtt));
  }

  /** Number for the next key or release message. */
  nextSeq() {
    this.seq += 1;
    return this.seq;
  }

  /** @param {ClientMessage} message @returns {boolean} whether it could be sent */
  send(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
