// Two small curves that scroll: the physics time against its budget, and the energies.

const LENGTH = 240; // samples on show

export class Chart {
  /** lines: CSS colour names (custom properties), one for each value pushed; options: `limit` draws a dashed line, `zero` keeps 0 in range. */
  constructor(canvas, lines, { zero = false } = {}) {
    this.canvas = canvas;
    this.lines = lines;
    this.zero = zero;
    this.limit = null;
    this.mark = null; // a dashed line that does not change the scale
    this.range = null; // the scale, where others share it
    this.clear();
  }

  clear() {
    this.samples = [];
  }

  push(...values) {
    this.samples.push(values);
    if (this.samples.length > LENGTH) this.samples.shift();
  }

  draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
    context.clearRect(0, 0, width, height);
    const sorted = this.samples.flat().filter((value) => value !== null).sort((a, b) => a - b);
    if (!sorted.length) return;
    // With a limit, the rare spike leaves the picture rather than flattening all the rest.
    const top = this.limit === null ? sorted.at(-1) : Math.max(1.25 * this.limit, 1.1 * sorted[Math.floor(0.97 * (sorted.length - 1))]);
    const [low, high] = this.range ?? [this.zero ? 0 : sorted[0], Math.max(top, this.zero ? 0 : sorted[0])];
    // A thousandth of the value is the finest thing on show: rounding noise is a flat line.
    const room = Math.max(0.05 * (high - low), 0.001 * Math.abs(high), 1e-12);
    const y = (value) => height - ((value - low + room) / (high - low + 2 * room)) * height;
    context.lineJoin = "round";
    for (const level of [this.limit, this.mark].filter((value) => value !== null)) {
      this.#line(context, style.getPropertyValue("--soft"), [[0, y(level)], [width, y(level)]], ratio, [3 * ratio, 3 * ratio]);
    }
    this.lines.forEach((colour, k) => {
      const points = this.samples.flatMap((values, i) => (values[k] === null ? [] : [[(i / (LENGTH - 1)) * width, y(values[k])]]));
      this.#line(context, style.getPropertyValue(colour), points, 1.4 * ratio, []);
    });
  }

  #line(context, colour, points, lineWidth, dash) {
    context.strokeStyle = colour;
    context.lineWidth = lineWidth;
    context.setLineDash(dash);
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x, y);
    context.stroke();
  }
}
