// What the user's own program has on the page: its sliders, and the numbers it watches.

import { Chart } from "./chart.js";
import { make, makeSlider, tell } from "./text.js";

const MINE_MS = 400; // a slider in the user's hand does not follow the server
const WATCH_COLOURS = ["--accent", "--kinetic", "--potential", "--links"];

const short = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(4))));

export class Own {
  /** `send(type, fields)`: to the server. */
  constructor(root, send) {
    this.sliders = root.querySelector("#own");
    this.curves = root.querySelector("#watched");
    this.send = send;
    this.made = "";
    this.named = "";
    this.held = new Map();
    this.charts = new Map();
  }

  /** Show what the server has. */
  follow({ sliders = [], watched = {} }) {
    const made = JSON.stringify(sliders.map(([name, low, high, step]) => [name, low, high, step]));
    if (made !== this.made) {
      this.made = made;
      this.sliders.replaceChildren(...sliders.map((slider) => this.#slider(slider)));
      this.sliders.parentElement.hidden = !sliders.length;
    }
    sliders.forEach(([name, , , , value], k) => {
      const label = this.sliders.children[k];
      if (this.held.has(name)) return;
      label.querySelector("input").value = value;
      tell(label.querySelector("b"), short(value));
    });
    const names = Object.keys(watched);
    if (names.join("\n") !== this.named) {
      this.named = names.join("\n");
      this.charts.clear();
      this.curves.replaceChildren(...names.map((name, k) => this.#curve(name, k)));
    }
    for (const [name, value] of Object.entries(watched)) {
      const { chart, text } = this.charts.get(name);
      tell(text, short(value));
      chart.push(value);
      chart.draw();
    }
  }

  /** Time starts over. */
  clear() {
    for (const { chart } of this.charts.values()) chart.clear();
  }

  #slider([name, low, high, step, value]) {
    const said = make("b"), label = makeSlider(name, [said], { min: low, max: high, step: step || "any", value, testid: `slider-${name}` });
    const input = label.lastChild;
    input.addEventListener("input", () => {
      clearTimeout(this.held.get(name));
      this.held.set(name, setTimeout(() => this.held.delete(name), MINE_MS));
      this.send("slider", { name, value: Number(input.value) });
      tell(said, short(Number(input.value)));
    });
    return label;
  }

  #curve(name, k) {
    const colour = WATCH_COLOURS[k % WATCH_COLOURS.length], part = document.createDocumentFragment(), key = make("i", { className: "key" });
    const text = make("b", { testid: `watched-${name}` }), canvas = make("canvas", { role: "img", ariaLabel: `${name} over time` });
    key.style.background = `var(${colour})`;
    const row = make("div", {}, make("dt", {}, key, name), make("dd", {}, text));
    part.append(row, make("div", { className: "chart tall" }, make("dt", { className: "unseen" }, `${name}, curve`), make("dd", {}, canvas)));
    this.charts.set(name, { chart: new Chart(canvas, [colour]), text });
    return part;
  }
}
