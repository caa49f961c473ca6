// Several worlds side by side: above each its name, its energy, and the energy's curve, all on one scale.

import { Chart } from "./chart.js";
import { make, setBox } from "./text.js";

export class Panels {
  constructor(container, root) {
    this.container = container;
    this.root = root; // told by a class whether there are several
    this.panels = [];
  }

  /** A new shape: one section for each of its panels; none for a single world. */
  build(panels) {
    this.panels = panels.map(({ name, strip, first, count, energy: start }) => {
      const canvas = make("canvas", { role: "img", ariaLabel: `Energy of ${name} over time` });
      const energy = make("p", { testid: "panel-energy" }), section = make("section", {}, make("h2", {}, name), energy, canvas);
      const chart = new Chart(canvas, ["--accent"]);
      chart.mark = start; // a dashed line where it started
      return { section, energy, strip, first, count, chart, start };
    });
    this.container.replaceChildren(...this.panels.map(({ section }) => section));
    this.root.classList.toggle("side-by-side", this.panels.length > 1);
  }

  /** Put each strip where the picture has it; `place` is the picture on screen, CSS pixels. */
  layout(place) {
    for (const { section, strip: [left, top, width, height] } of this.panels) {
      setBox(section, { left: place.left + left * place.width, top: place.top + top * place.height, width: width * place.width, height: height * place.height });
    }
  }

  /** The particle's number within its own panel and how many that has: alike particles of all panels get one colour. */
  within(i) {
    const panel = this.panels.findLast(({ first }) => first <= i);
    return [i - panel.first, panel.count];
  }

  /** The longer side of what is shown of one panel, metres; `room` is the whole picture. */
  cell([x0, y0, x1, y1]) {
    const rows = new Set(this.panels.map(({ strip: [, top] }) => top)).size, [, , width, strip] = this.panels[0].strip;
    return Math.max(width * (x1 - x0), (1 / rows - strip) * (y1 - y0));
  }

  push(energies) {
    this.panels.forEach((panel, k) => {
      panel.chart.push(energies[k]);
      const change = energies[k] - panel.start;
      const percent = Math.abs(change) < 10 * Math.abs(panel.start) ? ` (${change < 0 ? "−" : "+"}${Math.abs((100 * change) / Math.abs(panel.start)).toFixed(1)} %)` : "";
      panel.energy.textContent = energies[k] === null ? "–" : `${energies[k].toFixed(Math.abs(energies[k]) < 1000 ? 2 : 0)} J${percent}`;
    });
  }

  draw() {
    // One scale for all: curves beside each other can be compared.
    const values = this.panels.flatMap(({ chart }) => [...chart.samples.flat(), chart.mark]).filter(Number.isFinite);
    const range = values.length ? [Math.min(...values), Math.max(...values)] : null;
    for (const { chart } of this.panels) {
      chart.range = range;
      chart.draw();
    }
  }

  clear() {
    for (const { chart } of this.panels) chart.clear();
  }
}
