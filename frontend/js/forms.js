/** Small comforts of the question pages; everything works without them. */

import { Ranking } from "./ranking.js";
import { layLine } from "./slider.js";
import { fill } from "./words.js";

const FEW = 4;

/** The values of a field by name; a hidden or disabled item has none. @param {HTMLFormElement} form @param {string} name */
const chosen = (form, name) => new FormData(form).getAll(name).map(String);

/** Shows an item that depends on an earlier answer only when that answer was given. @param {HTMLFormElement} form */
function follow(form) {
  for (const item of form.querySelectorAll("[data-when]")) {
    if (!(item instanceof HTMLFieldSetElement)) continue;
    const wanted = (item.dataset.anyOf ?? "").split(" ");
    const asked = chosen(form, item.dataset.when ?? "").some((value) => wanted.includes(value));
    item.hidden = !asked;
    item.disabled = !asked;
  }
}

/** Tells how many of the items are answered, where there are more than a few. @param {HTMLFormElement} form */
function count(form) {
  const line = form.querySelector(".answered");
  if (!(line instanceof HTMLElement)) return;
  const items = [...form.querySelectorAll("fieldset.item")].filter((item) => !(/** @type {HTMLElement} */ (item).hidden));
  const given = new FormData(form);
  const done = items.filter((item) => {
    const names = [...item.querySelectorAll("[name]")].map((field) => field.getAttribute("name") ?? "");
    return names.every((name) => given.getAll(name).some((value) => String(value).trim()));
  }).length;
  line.hidden = items.length < FEW;
  const words = line.querySelector("span");
  const bar = line.querySelector("progress");
  if (words) words.textContent = fill(line.dataset.words ?? "", { n: done, of: items.length });
  if (bar) Object.assign(bar, { max: items.length, value: done });
}

/** A digit chooses that point of the scale that has the focus. @param {KeyboardEvent} event */
function digit(event) {
  const focused = event.target;
  if (!(focused instanceof HTMLInputElement) || focused.type !== "radio" || event.ctrlKey || event.altKey || event.metaKey) return;
  const scale = focused.closest(".scale");
  const point = /^[0-9]$/.test(event.key) && scale?.querySelector(`input[value="${event.key}"]`);
  if (point instanceof HTMLInputElement) {
    event.preventDefault();
    point.focus();
    point.click();
  }
}

/** The points of a ruled line are narrow: a finger or a pressed mouse may slide along them. @param {HTMLElement} scale */
function slide(scale) {
  let held = -1;
  /** @param {PointerEvent} event */
  const choose = (event) => {
    if (held !== event.pointerId) return;
    const middle = scale.getBoundingClientRect().top + scale.clientHeight / 2;
    const input = document.elementFromPoint(event.clientX, middle)?.closest(".point")?.querySelector("input");
    if (!input || input.checked || !scale.contains(input)) return;
    input.checked = true;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  };
  scale.addEventListener("pointerdown", (event) => {
    held = event.pointerId;
    choose(event);
  });
  window.addEventListener("pointermove", choose);
  for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) window.addEventListener(end, () => { held = -1; });
}

for (const box of document.querySelectorAll(".slider")) if (box instanceof HTMLElement) layLine(box);
for (const box of document.querySelectorAll(".ranking")) if (box instanceof HTMLElement) new Ranking(box);
for (const scale of document.querySelectorAll(".scale-fine")) if (scale instanceof HTMLElement) slide(scale);
for (const form of document.querySelectorAll("form")) {
  const changed = () => {
    follow(form);
    count(form);
  };
  changed();
  form.addEventListener("change", changed);
  form.addEventListener("input", () => count(form));
  form.addEventListener("keydown", digit);
  // Sending twice is harmless, but a second press should not look as if it did something.
  form.addEventListener("submit", (event) => {
    if (form.classList.contains("sent")) event.preventDefault();
    form.classList.add("sent");
  });
}
window.addEventListener("pageshow", () => {
  for (const form of document.querySelectorAll("form.sent")) form.classList.remove("sent");
});
document.getElementById("problems")?.focus();
