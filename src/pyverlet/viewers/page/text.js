// Elements of the page: their texts, their sizes, new ones.

/** Write a text, unless it is there: the browser lays the page out anew even for the same. */
export function tell(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A new element with these properties, `testid` among them, and children. */
export function make(tag, { testid, ...properties } = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  if (testid) made.dataset.testid = testid;
  made.append(...children);
  return made;
}

/** A slider: what stands to its left, what to its right, and properties of its input. */
export function makeSlider(said, output, properties) {
  return make("label", { className: "slider" }, make("span", {}, said), make("output", {}, ...output), make("input", { type: "range", ...properties }));
}

/** Give a canvas so many pixels, unless it has them: that would clear it. Whether it had others. */
export function setPixels(canvas, width, height) {
  const other = canvas.width !== width || canvas.height !== height;
  if (other) Object.assign(canvas, { width, height });
  return other;
}

/** Bring an element to a place, {left, top, width, height} in CSS pixels or some of these. */
export function setBox(element, box) {
  for (const [side, value] of Object.entries(box)) element.style[side] = `${value}px`;
}
