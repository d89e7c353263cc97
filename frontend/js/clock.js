/** Time on a page: what is left of a limit, and the wait before going on. Without it the server keeps the time. */

import { clock, fill } from "./words.js";

const STEP_MS = 250;

/**
 * Calls back with the seconds left until none are.
 * @param {number} seconds @param {(left: number) => void} show
 */
function countDown(seconds, show) {
  const end = performance.now() + 1000 * seconds;
  const timer = window.setInterval(step, STEP_MS);
  function step() {
    const left = (end - performance.now()) / 1000;
    if (left <= 0) window.clearInterval(timer);
    show(Math.max(0, left));
  }
  step();
}

/** The page's form goes as it stands; the server knows that the time is up. @param {HTMLFormElement | null} form */
function leave(form) {
  if (!form) {
    location.reload();
    return;
  }
  const field = document.createElement("input");
  Object.assign(field, { type: "hidden", name: "time_up", value: "1" });
  form.append(field);
  form.submit();
}

for (const limit of document.querySelectorAll(".limit")) {
  if (!(limit instanceof HTMLElement)) continue;
  countDown(Number(limit.dataset.left), (left) => {
    limit.hidden = left > Number(limit.dataset.from ?? Infinity);
    limit.textContent = fill(limit.dataset.words ?? "{time}", { time: clock(left) });
    if (left === 0) leave(document.querySelector("main form:not(.leave)"));
  });
}

const button = document.querySelector("button[data-wait]");
const told = document.getElementById("wait");
if (button instanceof HTMLButtonElement && told) {
  button.setAttribute("aria-disabled", "true");
  button.classList.add("waits");
  button.addEventListener("click", (event) => {
    if (button.classList.contains("waits")) event.preventDefault();
  });
  countDown(Number(button.dataset.wait), (left) => {
    told.textContent = fill(button.dataset.words ?? "{time}", { time: clock(left) });
    if (left > 0) return;
    button.classList.remove("waits");
    button.removeAttribute("aria-disabled");
    told.hidden = true;
  });
}
