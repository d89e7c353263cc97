/** Small comforts of the question pages; everything works without them. */

/** Shows an item that depends on an earlier answer only when that answer was given. @param {HTMLFormElement} form */
function follow(form) {
  for (const item of form.querySelectorAll("[data-when]")) {
    if (!(item instanceof HTMLFieldSetElement)) continue;
    const wanted = (item.dataset.anyOf ?? "").split(" ");
    const chosen = new FormData(form).getAll(item.dataset.when ?? "").map(String);
    const asked = chosen.some((value) => wanted.includes(value));
    item.hidden = !asked;
    item.disabled = !asked;
  }
}

/** A digit chooses that point of the scale that has the focus. @param {KeyboardEvent} event */
function digit(event) {
  const focused = event.target;
  if (!(focused instanceof HTMLInputElement) || focused.type !== "radio" || event.ctrlKey || event.altKey || event.metaKey) return;
  const scale = focused.closest(".scale");
  const point = /^[1-9]$/.test(event.key) && scale?.querySelector(`input[value="${event.key}"]`);
  if (point instanceof HTMLInputElement) {
    event.preventDefault();
    point.focus();
    point.click();
  }
}

for (const form of document.querySelectorAll("form")) {
  follow(form);
  form.addEventListener("change", () => follow(form));
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
const summary = document.getElementById("problems");
summary?.focus();
