// Small curves that scroll, on a plain canvas: lines beside each other, or areas on top of each other.

import { setPixels } from "./text.js";

const LENGTH = 240; // samples on show

export class Chart {
  /** lines: custom properties that hold colours, one for each value pushed. `zero` keeps 0 in range, `stacked` adds the values up. */
  constructor(canvas, lines, { zero = false, stacked = false } = {}) {
    this.canvas = canvas;
    this.lines = lines;
    this.zero = zero;
    this.stacked = stacked;
    this.limit = null; // a dashed line that stays in range
    this.mark = null; // a dashed line that does not change the scale
    this.range = null; // the scale, where others share it
    this.size = null; // (width, height) on the page, where known: asking has the browser lay the page out
    new ResizeObserver(() => (this.size = null)).observe(canvas);
    this.clear();
  }

  clear() {
    this.samples = [];
  }

  push(...values) {
    let sum = 0;
    this.samples.push(this.stacked ? values.map((value) => (sum += value)) : values);
    if (this.samples.length > LENGTH) this.samples.shift();
  }

  draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.size ??= [this.canvas.clientWidth, this.canvas.clientHeight];
    const [width, height] = this.size.map((pixels) => Math.round(pixels * ratio));
    if (!width || !height) return;
    setPixels(this.canvas, width, height);
    const context = this.canvas.getContext("2d"), style = getComputedStyle(this.canvas);
    context.clearRect(0, 0, width, height);
    const sorted = this.samples.flat().filter((value) => value !== null).sort((a, b) => a - b);
    if (!sorted.length) return;
    // With a limit, the rare spike leaves the picture rather than flattening all the rest.
    const usual = this.stacked ? this.samples.map((values) => values.at(-1)).sort((a, b) => a - b) : sorted;
    const top = this.limit === null ? sorted.at(-1) : Math.max(1.25 * this.limit, 1.1 * usual[Math.floor(0.97 * (usual.length - 1))]);
    const [low, high] = this.range ?? [this.zero ? 0 : sorted[0], Math.max(top, this.zero ? 0 : sorted[0])];
    // A thousandth of the value is the finest thing on show: rounding noise is a flat line.
    const room = Math.max(0.05 * (high - low), 0.001 * Math.abs(high), 1e-12);
    const y = (value) => height - ((value - low + room) / (high - low + 2 * room)) * height;
    context.lineJoin = "round";
    const points = (k) => this.samples.flatMap((values, i) => ((values[k] ?? null) === null ? [] : [[(i / (LENGTH - 1)) * width, y(values[k])]]));
    this.lines.forEach((colour, k) => {
      if (this.stacked) this.#area(context, style.getPropertyValue(colour), points(k), k ? points(k - 1) : [[(this.samples.length - 1) / (LENGTH - 1) * width, y(0)], [0, y(0)]].reverse());
      else this.#line(context, style.getPropertyValue(colour), points(k), 1.4 * ratio, []);
    });
    for (const level of [this.limit, this.mark].filter((value) => value !== null)) {
      this.#line(context, style.getPropertyValue("--soft"), [[0, y(level)], [width, y(level)]], ratio, [3 * ratio, 3 * ratio]);
    }
  }

  #line(context, colour, points, lineWidth, dash) {
    context.strokeStyle = colour;
    context.lineWidth = lineWidth;
    context.setLineDash(dash);
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x, y);
    context.stroke();
  }

  #area(context, colour, above, below) {
    context.fillStyle = colour;
    context.beginPath();
    for (const [x, y] of above) context.lineTo(x, y);
    for (const [x, y] of below.reverse()) context.lineTo(x, y);
    context.fill();
  }
}
