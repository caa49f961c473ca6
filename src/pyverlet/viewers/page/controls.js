// Sliders, fields and switches. The server has the truth: another tab may have moved a slider, and a world may lack it.

import { make, makeSlider, tell } from "./text.js";

const HELD_MS = 400; // a slider in the user's hand does not follow the server

/** How each setting of the world is called, from where to where it goes, in steps of what, and how it is read off a status, shown, and sent. */
const SLIDERS = {
  gravity: {
    said: "Gravity", unit: " m/s²", range: [0, 20, 0.01],
    read: ({ gravity: [x, y] }) => Math.hypot(x, y),
    text: (value) => value.toFixed(2),
    send: (value, get) => ["gravity", pointing(value, get("angle"))],
  },
  angle: {
    said: "Direction", unit: "° ", range: [-180, 180, 1], about: "0° is down, 90° to the right. ",
    // Without gravity there is no direction: the slider stays where it is.
    read: ({ gravity: [x, y] }) => (x || y ? Math.round((Math.atan2(x, -y) * 180) / Math.PI) : null),
    text: (value) => value.toFixed(0),
    send: (value, get) => ["gravity", pointing(get("gravity"), value)],
    setting: "gravity",
  },
  substeps: {
    said: "Substeps", unit: " a frame", range: [1, 32, 1],
    read: (status) => status.substeps, text: String, send: (value) => ["substeps", { value: Math.round(value) }],
  },
  restitution: {
    said: "Restitution", range: [0, 1, 0.01], about: "0: no bounce. 1: all of it. ",
    read: (status) => status.restitution, text: (value) => value.toFixed(2), send: (value) => ["restitution", { value }],
  },
  friction: {
    said: "Friction", range: [0, 1, 0.01], about: "Coulomb's coefficient. ",
    read: (status) => status.friction, text: (value) => value.toFixed(2), send: (value) => ["friction", { value }],
  },
};

/** The vector of a gravity of so many m/s², so many degrees from straight down towards the right. */
export function pointing(strength, degrees) {
  const angle = (degrees * Math.PI) / 180, tidy = (value) => Number(value.toFixed(6)) || 0;
  return { x: tidy(strength * Math.sin(angle)), y: tidy(-strength * Math.cos(angle)) };
}

export class Controls {
  /** `send(type, fields)`: to the server. `changed()`: the user has changed something of the world. */
  constructor(root, send, changed) {
    this.root = root;
    this.send = send;
    this.changed = changed;
    this.held = new Map(); // ids in the user's hand, with the timers that let them go
    this.first = {}; // where double-click goes back to
    for (const [id, { said, unit = "", range: [min, max, step], about = "" }] of Object.entries(SLIDERS)) {
      const label = makeSlider(said, [make("b", { id: `${id}-value` }), unit], { id, testid: id, min, max, step });
      this.#id("sliders").append(Object.assign(label, { id: `${id}-field`, className: "slider live", title: `${about}Double-click to go back` }));
      this.#id(id).addEventListener("input", () => this.set(id, this.get(id)));
      this.#id(id).addEventListener("dblclick", () => this.first[id] !== undefined && this.set(id, this.first[id]));
    }
    this.#id("angle-value").parentElement.append(make("i", { id: "angle-arrow" }, "↓"));
    this.#choice("scene", (value) => ["build", { scene: value }]);
    this.#choice("integrator", (value) => ["integrator", { value }]);
    this.#choice("speed", (value) => ["speed", { value: Number(value) }]);
    this.#id("count").addEventListener("change", () => {
      const count = this.#id("count"), wish = Math.round(Number(count.value));
      count.value = Math.min(Math.max(wish || 1, 1), Number(count.max));
      this.#hold("count");
      this.send("build", { particles: Number(count.value) });
      this.changed();
    });
  }

  get(id) {
    return Number(this.#id(id).value);
  }

  /** Move a slider, as a user does. */
  set(id, value) {
    this.#hold(id);
    this.#fit(id, value);
    this.#label(id);
    this.send(...SLIDERS[id].send(value, (other) => this.get(other)));
    this.changed();
  }

  /** A new shape: what there is to choose from, and what may not be changed. */
  begin(shape) {
    this.shape = shape;
    this.first = {};
    this.#id("substeps").max = Math.min(32, shape.maxSubsteps);
    this.#id("count").max = shape.maxParticles;
    this.#options("scene", shape.scenes.map(([name, summary]) => ({ value: name, title: summary })));
    this.#options("integrator", shape.integrators.map((name) => ({ value: name })));
    this.#id("scene").value = shape.scene;
    this.#id("scene-field").hidden = !shape.scenes.length;
    this.#id("count-field").hidden = !shape.scenes.length || shape.countable === false;
  }

  /** Show what the server has. */
  follow(status) {
    for (const [id, slider] of Object.entries(SLIDERS)) {
      const value = slider.read(status), setting = slider.setting ?? id;
      this.#id(`${id}-field`).hidden = this.shape.differing.includes(setting) || status[setting] === null;
      if (value === null) continue;
      this.first[id] ??= value;
      if (!this.held.has(id) && !this.held.has(setting)) {
        this.#fit(id, value);
        this.#label(id);
      }
    }
    this.#id("integrator-field").hidden = this.shape.differing.includes("integrator");
    const integrator = this.#id("integrator");
    if (![...integrator.options].some(({ value }) => value === status.integrator)) integrator.add(new Option(status.integrator));
    this.#show("integrator", status.integrator);
    const speed = this.#id("speed");
    if (![...speed.options].some(({ value }) => Number(value) === status.speed)) speed.add(new Option(status.speed));
    this.#show("speed", String(status.speed));
    if (this.#id("count") !== this.root.getRootNode().activeElement) this.#show("count", String(Math.round(status.particles / Math.max(this.shape.panels.length, 1))));
  }

  /** The next option of a select, or the first after the last, as if chosen by hand. */
  next(id) {
    const select = this.#id(id), able = [...select.options].filter((option) => !option.disabled);
    select.value = able[(able.indexOf(select.selectedOptions[0]) + 1) % able.length].value;
    select.dispatchEvent(new Event("change"));
  }

  #choice(id, message) {
    const select = this.#id(id);
    select.addEventListener("change", () => {
      this.#hold(id);
      this.send(...message(select.value));
      this.changed();
      select.blur(); // keys are shortcuts again
    });
  }

  #options(id, options) {
    const select = this.#id(id);
    select.replaceChildren(...options.map(({ value, title = "" }) => Object.assign(new Option(value), { title })));
  }

  #show(id, value) {
    const element = this.#id(id);
    if (!this.held.has(id) && element.value !== value) element.value = value;
  }

  #hold(id) {
    clearTimeout(this.held.get(id));
    this.held.set(id, setTimeout(() => this.held.delete(id), HELD_MS));
  }

  /** Put a slider at a value, which its range makes room for. */
  #fit(id, value) {
    const slider = this.#id(id);
    if (value > Number(slider.max)) slider.max = Math.ceil(value);
    if (value < Number(slider.min)) slider.min = Math.floor(value);
    slider.value = value;
  }

  #label(id) {
    const value = this.get(id);
    tell(this.#id(`${id}-value`), SLIDERS[id].text(value));
    if (id === "angle") this.#id("angle-arrow").style.transform = `rotate(${-value}deg)`;
  }

  #id(id) {
    return this.root.querySelector(`#${id}`);
  }
}
