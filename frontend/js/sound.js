/** Small sounds made on the spot; silent until the participant turns them on. */

/** @typedef {"pick_up" | "put_down" | "potting" | "soup_ready" | "delivery" | "count" | "go" | "end"} Sound */
/** @typedef {[hz: number, at_s: number, length_s: number, wave: OscillatorType, loudness: number]} Note */

/** @type {Readonly<Record<Sound, Note[]>>} */
const NOTES = Object.freeze({
  pick_up: [[520, 0, 0.07, "triangle", 0.5], [700, 0.045, 0.08, "triangle", 0.45]],
  put_down: [[330, 0, 0.08, "triangle", 0.5], [247, 0.04, 0.09, "triangle", 0.4]],
  potting: [[210, 0, 0.09, "sine", 0.8], [140, 0.05, 0.14, "sine", 0.7]],
  soup_ready: [[988, 0, 0.35, "sine", 0.5], [1319, 0.13, 0.5, "sine", 0.45]],
  delivery: [[523, 0, 0.14, "triangle", 0.5], [659, 0.09, 0.14, "triangle", 0.5], [784, 0.18, 0.14, "triangle", 0.5], [1047, 0.27, 0.34, "triangle", 0.5]],
  count: [[440, 0, 0.12, "sine", 0.5]],
  go: [[880, 0, 0.28, "sine", 0.5]],
  end: [[659, 0, 0.2, "triangle", 0.5], [523, 0.16, 0.2, "triangle", 0.5], [784, 0.32, 0.5, "triangle", 0.5]],
});
const STORED = "galley-sound";

export class Sounds {
  /** @param {HTMLButtonElement | null} button turns them on and off */
  constructor(button) {
    this.button = button;
    /** @type {AudioContext | null} */
    this.audio = null;
    this.on = recall() === "on";
    button?.addEventListener("click", () => this.turn(!this.on));
    this.label();
  }

  /** @param {boolean} on */
  turn(on) {
    this.on = on;
    remember(on ? "on" : "off");
    this.label();
    if (on) this.play("pick_up");
  }

  label() {
    this.button?.setAttribute("aria-pressed", String(this.on));
  }

  /** @param {string} name one of the sounds; others are silent */
  play(name) {
    const notes = NOTES[/** @type {Sound} */ (name)];
    if (!this.on || !notes) return;
    this.audio ??= new AudioContext();
    if (this.audio.state === "suspended") void this.audio.resume();
    for (const note of notes) strike(this.audio, note);
  }
}

/** @param {AudioContext} audio @param {Note} note */
function strike(audio, [hz, at, length, wave, loudness]) {
  const start = audio.currentTime + at;
  const tone = new OscillatorNode(audio, { type: wave, frequency: hz });
  const volume = new GainNode(audio, { gain: 0 });
  volume.gain.linearRampToValueAtTime(loudness * 0.22, start + 0.012);
  volume.gain.exponentialRampToValueAtTime(0.0001, start + length);
  tone.connect(volume).connect(audio.destination);
  tone.start(start);
  tone.stop(start + length + 0.02);
}

/** @returns {string | null} */
function recall() {
  try {
    return localStorage.getItem(STORED);
  } catch {
    return null; // storage is switched off
  }
}

/** @param {string} value */
function remember(value) {
  try {
    localStorage.setItem(STORED, value);
  } catch {
    // storage is switched off: the choice lasts for this page
  }
}
