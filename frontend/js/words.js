/** The words that a page was sent for its scripts, in the participant's language. */

/** @typedef {(key: string, places?: Record<string, string | number>) => string} Say */

/**
 * Fills the `{places}` of a message.
 * @param {string} message @param {Record<string, string | number>} places
 */
export function fill(message, places) {
  return message.replace(/\{(\w+)\}/g, (whole, name) => String(places[name] ?? whole));
}

/**
 * The words in the page's block of that name.
 * @param {string} id
 * @returns {Say}
 */
export function wordsOf(id) {
  /** @type {Record<string, string>} */
  const words = JSON.parse(document.getElementById(id)?.textContent || "{}");
  return (key, places = {}) => fill(words[key] ?? key, places);
}

/** Minutes and seconds as a clock shows them. @param {number} seconds */
export function clock(seconds) {
  const whole = Math.max(0, Math.ceil(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
