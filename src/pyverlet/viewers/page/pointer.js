// Mice and fingers: one works in the world with the chosen tool, two fingers or the right button move the view, the wheel zooms.

import { setBox } from "./text.js";

const REACH_PX = 9; // a near miss still takes the circle
const FINGER_PX = 18; // fingers are wider than mice
const WHEEL = 0.0015; // a notch of 100 zooms by 15 %
const BUTTON_NAMES = ["left", "middle", "right"];
const POUR = 2.2; // circles poured by a moving mouse are so many radii of the usual circle apart

export class Pointer {
  /** `page`: {camera, shape(), send, tool(), zoomed()}; listens on `surface`, inside `root`. */
  constructor(root, surface, page) {
    this.root = root;
    this.surface = surface;
    this.page = page;
    this.fingers = new Map(); // pointers that are down, with where they are
    this.hand = null; // "drag", "poke", "spawn", "delete" or "move" while one is down
    this.ring = root.querySelector("#poke");
    surface.addEventListener("pointerdown", (event) => this.#down(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) surface.addEventListener(end, (event) => this.#up(event));
    surface.addEventListener("contextmenu", (event) => event.preventDefault());
    surface.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    window.addEventListener("blur", () => this.letGo());
  }

  letGo() {
    if (this.hand && this.hand !== "move") this.page.send("release");
    this.hand = null;
    this.ring.hidden = true;
    this.root.classList.remove("holding");
  }

  #at(event) {
    const { left, top } = this.root.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  #down(event) {
    if (!this.page.camera.room) return; // nothing has been on show yet
    this.root.focus({ preventScroll: true });
    this.surface.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.#at(event));
    if (this.fingers.size > 1) {
      this.letGo(); // a second finger: now the view moves
      return;
    }
    if (this.hand || event.button > 2) return;
    const tool = event.button || event.altKey ? "move" : event.shiftKey ? "poke" : this.page.tool();
    const [left, top] = this.#at(event), [x, y] = this.page.camera.toWorld(left, top);
    if (this.page.shape().callbacks?.includes("click")) this.page.send("click", { x, y, button: BUTTON_NAMES[event.button] });
    if (tool === "pin") return this.page.send("pin", { x, y, reach: this.#reach(event) });
    this.hand = tool;
    this.last = null;
    this.ring.hidden = tool !== "poke";
    this.root.classList.toggle("holding", tool === "drag" || tool === "move");
    this.#work(event);
  }

  #move(event) {
    this.root.classList.toggle("shift", event.shiftKey);
    if (!this.fingers.has(event.pointerId)) return;
    const before = this.fingers.get(event.pointerId), now = this.#at(event);
    if (this.fingers.size === 2) this.#pinch(event.pointerId, before, now);
    this.fingers.set(event.pointerId, now);
    if (this.fingers.size > 1) return;
    if (this.hand === "move") {
      this.page.camera.move(now[0] - before[0], now[1] - before[1]);
      this.page.zoomed();
    } else if (this.hand) this.#work(event);
  }

  #up(event) {
    this.fingers.delete(event.pointerId);
    this.letGo();
  }

  #work(event) {
    const { camera, send, shape } = this.page, [left, top] = this.#at(event), [x, y] = camera.toWorld(left, top);
    if (this.hand === "drag") send("drag", { x, y, reach: this.#reach(event) });
    if (this.hand === "spawn" && (!this.last || Math.hypot(x - this.last[0], y - this.last[1]) > POUR * this.page.usualRadius())) {
      this.last = [x, y];
      send("spawn", { x, y });
    }
    if (this.hand === "delete") send("delete", { x, y, reach: this.last ? 0 : this.#reach(event) }); // moved on, it takes what it meets
    if (this.hand === "delete") this.last = [x, y];
    if (this.hand !== "poke") return;
    send("poke", { x, y });
    const [x0, y0, x1, y1] = camera.room, panels = shape().panels, size = panels.length ? this.page.panelSize() : Math.max(x1 - x0, y1 - y0);
    const across = 2 * shape().pokeRadius * size * camera.scale;
    setBox(this.ring, { left, top, width: across, height: across });
  }

  #reach(event) {
    return (event.pointerType === "touch" ? FINGER_PX : REACH_PX) / this.page.camera.scale;
  }

  /** Two fingers: what is between them stays between them. */
  #pinch(moved, before, now) {
    const [other] = [...this.fingers].filter(([id]) => id !== moved).map(([, at]) => at);
    const apart = (a) => Math.max(Math.hypot(a[0] - other[0], a[1] - other[1]), 1), camera = this.page.camera;
    camera.move((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    camera.zoom(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    this.page.zoomed();
  }

  #wheel(event) {
    if (!this.page.camera.room) return; // nothing has been on show yet
    event.preventDefault();
    const pixels = event.deltaMode ? 33 * event.deltaY : event.deltaY; // lines, on some systems
    this.page.camera.zoom(Math.exp(-WHEEL * Math.min(Math.max(pixels, -600), 600)), ...this.#at(event));
    this.page.zoomed();
  }
}
