/** A line to press or drag on. The typed field below it stays the answer: empty until the line is touched. */

const KEYS = Object.freeze(["Enter", " "]);

/** @param {HTMLElement} box of one slider item */
export function layLine(box) {
  const field = box.querySelector("input");
  if (!field) return;
  const { min = "0", max = "100", step = "1", untouched = "", hint = "" } = box.dataset;
  const line = document.createElement("input");
  Object.assign(line, { type: "range", min, max, step, className: "line-input" });
  line.setAttribute("aria-label", field.getAttribute("aria-label") ?? "");
  const told = document.createElement("span");
  Object.assign(told, { className: "slider-told" });
  const wrong = field.getAttribute("aria-describedby");
  if (wrong) line.setAttribute("aria-describedby", wrong);

  /** @param {string} value "" for untouched */
  const show = (value) => {
    box.classList.toggle("untouched", value === "");
    if (value === "") line.setAttribute("aria-valuetext", untouched);
    else line.removeAttribute("aria-valuetext");
    told.textContent = value === "" ? hint : box.dataset.shown ? `${value}${unit}` : "";
  };
  const unit = box.dataset.unit ? ` ${box.dataset.unit}` : "";
  const take = () => {
    if (field.value === line.value && !box.classList.contains("untouched")) return;
    field.value = line.value;
    show(line.value);
    field.dispatchEvent(new Event("change", { bubbles: true }));
  };
  line.addEventListener("input", take);
  // A press just where the line already is changes nothing in the browser's eyes, but it is an answer.
  line.addEventListener("pointerup", take);
  line.addEventListener("keydown", (event) => {
    if (!KEYS.includes(event.key)) return;
    event.preventDefault();
    take();
  });
  if (field.value !== "" && Number.isFinite(Number(field.value))) line.value = field.value;
  else line.value = String((Number(min) + Number(max)) / 2);
  show(field.value);
  field.type = "hidden";
  field.closest(".line")?.classList.add("replaced");
  box.prepend(line);
  const ends = box.querySelector(".ends");
  ends?.insertBefore(told, ends.lastElementChild);
}
