// The keyframe of a picture: a kitchen that stands still.

/**
 * The keyframe of a kitchen that nobody plays, for a picture of it.
 * @param {string[]} grid @param {[import("./messages.js").ChefRow, import("./messages.js").ChefRow]} chefs @param {import("./messages.js").PotRow[]} pots @param {[string, string]} hats
 * @returns {import("./messages.js").Keyframe}
 */
export const stillFrame = (grid, chefs, pots, hats) => ({
  type: "keyframe", phase: "waiting", tick: 99, horizon: 99, tick_ms: 150, seat: 0, hats, grid, cook_time: 20, chefs,
  things: [], pots, score: 0, goal: null, round: 1, of: 1, tutorial: false, orders: null,
  episode: 1, episodes: 1, partner: "agent", input_mode: "hold", show_score: "during", points: 20,
});
