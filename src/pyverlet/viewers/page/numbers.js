// The numbers beside the picture, and their curves.

import { fillLedger } from "./ledger.js";
import { Chart } from "./chart.js";
import { fillGraph } from "./graph.js";
import { make } from "./text.js";

const STAGES = ["gather", "lists", "integrate", "surfaces", "pairs", "relax", "links", "contacts"]; // as in World.profile
const OTHER = "other"; // all stages that have no colour of their own
const NOTHING = "–";
const RATE_MS = 1000; // the rate of frames is that of the last second

export class Numbers {
  constructor(root) {
    this.root = root;
    this.drawn = []; // times of the last drawn frames, ms
    this.stages = new Chart(this.#id("physics-chart"), [...STAGES, OTHER].map((_, k) => `--stage-${k}`), { zero: true, stacked: true });
    this.energies = new Chart(this.#id("energy-chart"), ["--kinetic", "--potential", "--links", "--accent"]);
  }

  /** A new shape. */
  begin(shape) {
    this.#id("budget").textContent = shape.budgetMs;
    this.stages.limit = shape.budgetMs;
    this.budget = shape.budgetMs;
  }

  clear() {
    this.stages.clear();
    this.energies.clear();
  }

  /** A frame was drawn at this time, ms. */
  count(status, now) {
    this.drawn.push(now);
    if (status.frames === this.frames) return; // a picture between the substeps of a frame
    this.frames = status.frames;
    const known = STAGES.map((name) => status.stages[name] ?? 0);
    const others = Object.entries(status.stages).filter(([name]) => !STAGES.includes(name));
    this.stages.push(...known, others.reduce((sum, [, ms]) => sum + ms, 0));
  }

  /** Frames drawn a second. */
  rate(now) {
    this.drawn = this.drawn.filter((time) => now - time <= RATE_MS);
    return this.drawn.length > 1 ? (1000 * (this.drawn.length - 1)) / (this.drawn.at(-1) - this.drawn[0]) : 0;
  }

  show(status, drawing, now) {
    const rate = this.rate(now);
    this.#write("fps", status.paused || status.error || !rate ? NOTHING : rate.toFixed(0));
    this.#write("drawing", drawing);
    this.#write("physics-ms", status.physics_median_ms.toFixed(2));
    const physics = this.#named("physics-ms").parentElement;
    physics.classList.toggle("over", status.physics_median_ms > this.budget);
    physics.title = `median of the last frames; 95 % took less than ${status.physics_p95_ms.toFixed(2)} ms`;
    this.#write("particles", String(status.particles));
    this.#write("time", status.time.toFixed(3));
    this.#write("pace", status.paused || status.error || status.pace === null ? NOTHING : String(Number(status.pace.toPrecision(2))));
    this.#write("dropped", String(status.dropped));
    for (const name of ["energy", "kinetic", "potential", "links"]) this.#write(name, joules(status[name]));
    this.#id("links-row").hidden = !status.links;
    this.energies.push(status.kinetic, status.potential, status.links || null, status.energy);
    this.energies.draw();
    this.stages.draw();
    fillLedger(this.#id("ledger"), status.ledger, signed);
    fillGraph(this.#id("graph"), status.graph);
    this.#legend(status.stages);
  }

  /** Milliseconds by stage, each with the colour of its area. */
  #legend(stages) {
    const shown = Object.entries(stages).filter(([, ms]) => ms >= 0.005), names = shown.map(([name]) => name), legend = this.#id("stages");
    if (names.join() !== this.named) {
      this.named = names.join();
      legend.replaceChildren(...names.map(entry));
    }
    for (const [k, [name, ms]] of shown.entries()) legend.children[k].lastChild.data = `${name} ${ms.toFixed(2)}`;
  }

  #id(id) {
    return this.root.querySelector(`#${id}`);
  }

  #named(name) {
    return this.root.querySelector(`[data-testid="${name}"]`);
  }

  /** Write a number with its thousands set apart by style only, so that the text stays a plain number. */
  #write(name, text) {
    const element = this.#named(name);
    if (element.textContent === text) return;
    const [, sign, whole, rest] = text.match(/^(-?)(\d*)(.*)$/);
    const groups = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, " ").split(" ") : [whole];
    element.replaceChildren(sign + groups[0], ...groups.slice(1).map((digits) => make("span", { className: "group" }, digits)), rest);
  }
}

/** A row of the legend: its key, and room for a text. */
function entry(name) {
  const k = STAGES.indexOf(name), key = make("i", { className: "key" });
  key.style.background = `var(--stage-${k < 0 ? STAGES.length : k})`;
  return make("span", {}, key, "");
}

const joules = (value) => (value === null ? NOTHING : value.toFixed(Math.abs(value) < 100 ? 2 : 0).replace(/^-0(\.0*)?$/, "0$1"));
const signed = (value) => (value > 0 && joules(value) !== joules(0) ? "+" : "") + (value ? (Math.abs(value) < 0.005 ? value.toExponential(0) : joules(value)) : "0");
