/** Tells the server when the page is in the background and when it is back; nothing is asked of the participant. */

const { away = "", step = "" } = document.body.dataset;

function tell() {
  navigator.sendBeacon(away, new URLSearchParams({ step, hidden: document.hidden ? "1" : "0" }));
}

document.addEventListener("visibilitychange", tell);
if (document.hidden) tell();
