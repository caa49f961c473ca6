// The page: receives frames, draws the newest at the screen's pace, acknowledges what it drew, sends what the user wants.
// It lives in one element, so that a notebook can show it too.

import { Backdrop } from "./backdrop.js";
import { Camera } from "./camera.js";
import { Tints, isLively } from "./colour.js";
import { Capture } from "./capture.js";
import { Circles } from "./circles.js";
import { Controls } from "./controls.js";
import { GRID_MAX } from "./draw.js";
import { fillSheet, listen } from "./keys.js";
import { Numbers } from "./numbers.js";
import { MOST_CONTACTS, MOST_FORCES, Overlay } from "./overlay.js";
import { Own } from "./own.js";
import { Panels } from "./panels.js";
import { read, written } from "./permalink.js";
import { Pointer } from "./pointer.js";
import { Queue } from "./queue.js";
import { tell } from "./text.js";
import { unpack } from "./wire.js";

const NUMBERS_EVERY_MS = 200; // as fast as people read
const QUICK_MS = 25; // between two ticks of a page that keeps up with the screen
const SLOW = 0.95; // of real time: less is said
const HEADER_PX = 62; // names of panels, and walls, stay clear of the title
const STEP_ZOOM = 1.25, STEP_TURN = 15; // of a key: times as large, degrees
const NAMES = { canvas: "Canvas2D", webgl2: "WebGL2" };

/**
 * Bring the page to life.
 * root: an element with the page's markup. connect: see main.js. address: a Location, whose hash has settings; null in a notebook.
 * film: what keys do in place of what only a live world does, if this is none; null otherwise.
 */
export function mount(root, connect, { address = null, renderer: wanted = "auto", film = null } = {}) {
  const $ = (id) => root.querySelector(`#${id}`);
  const circles = new Circles($("stage"), $("photo"), wanted), { renderer } = circles;
  const darkness = matchMedia("(prefers-color-scheme: dark)");
  const backdrop = new Backdrop($("backdrop")), overlay = new Overlay($("overlay")), camera = new Camera(), tints = new Tints();
  const panels = new Panels($("panels"), root), numbers = new Numbers(root);
  root.dataset.renderer = renderer.name;

  let shape = null; // the last shape message
  let frame = null; // the frame on screen
  let last = null; // its numbers, or those of the frame before while there is none
  const pending = new Queue(); // newer ones
  let arrived = 0, newest = 0; // messages so far, and which of them is on show or about to be
  let lookSent = "", stale = true, numbersDue = 0, numbersStale = false, ticked = 0, beat = QUICK_MS, measured = false, awake = false, alarm = 0;
  let open = false, begun = false, linking = false, stopped = false;

  // -- the connection -------------------------------------------------------------------------------------------------

  const write = connect({ receive, state: (is) => {
    open = is;
    lookSent = ""; // a new server does not know it
    wake();
    if (!open) link("lost", "the server has stopped; waiting for it");
  } });
  const send = (type, fields = {}) => write({ type, ...fields });

  async function receive(data) {
    const message = data instanceof ArrayBuffer ? unpack(data) : data, order = ++arrived;
    if (message.kind === "shape") {
      newest = order;
      newShape(message);
    } else if (message.kind === "frame") {
      newest = order;
      wait(message);
    } else if (message.kind === "picture") {
      const bitmap = await createImageBitmap(message.jpeg);
      if (order < newest) return bitmap.close(); // while it was decoded, something newer has come
      newest = order;
      wait({ ...message, bitmap });
    } else if (message.kind === "refused") console.warn(message.reason);
  }

  /** To be drawn in one of the next ticks. */
  function wait(message) {
    wake();
    pending.put(message);
  }

  function newShape(message) {
    const other = !shape || shape.scene !== message.scene || shape.title !== message.title || shape.panels.length !== message.panels.length;
    shape = message;
    measured = false; // panels have a header
    frame = null;
    pending.clear();
    circles.forget(shape.drawnHere);
    Object.assign(camera, { bounded: shape.bounded && !shape.parted, parted: shape.parted });
    if (other) begin();
    controls.shape = shape;
    panels.build(shape.panels);
    const pictures = shape.drawnHere && "Not drawn over pictures: of so many circles the server sends no more than these";
    offer("velocities", pictures);
    const over = (most) => shape.count > most && `Drawn for at most ${most} circles; here are ${shape.count}`;
    offer("contacts", pictures || over(MOST_CONTACTS));
    offer("forces", pictures || (film && "A film does not know them") || over(MOST_FORCES));
    notice(shape.note);
    paint();
  }

  /** Another scene, or the first. */
  function begin() {
    camera.fit();
    $("title").textContent = shape.title;
    if (address) document.title = `${shape.title} · pyverlet`;
    for (const option of $("colour").options) option.disabled = (option.value === "picture" && !shape.coloured) || (option.value === "force" && Boolean(film || shape.count > MOST_FORCES));
    if (shape.coloured || $("colour").value === "picture") $("colour").value = shape.coloured ? "picture" : "order";
    controls.begin(shape);
    numbers.begin(shape);
    startOver();
  }

  /** A tick box, unless there is a reason against it, which it then tells. */
  function offer(id, against) {
    $(id).disabled = Boolean(against);
    $(id).parentElement.title = against || "";
  }

  function link(state, text) {
    $("link").className = state;
    tell($("link").lastElementChild, text);
  }

  function notice(text) {
    $("notice").hidden = !text;
    if (text) tell($("notice"), text);
  }

  // -- drawing --------------------------------------------------------------------------------------------------------

  const dark = () => ($("theme").value === "auto" ? darkness.matches : $("theme").value === "dark");
  const colour = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const ratio = () => Math.min(window.devicePixelRatio || 1, 2);
  const size = () => ({ width: root.clientWidth, height: root.clientHeight });

  /** Have a tick with the next picture of the screen: there are none while nothing is new, which spares a slow machine. */
  function wake() {
    if (awake || stopped) return;
    awake = true;
    requestAnimationFrame(tick);
  }

  function refresh() {
    stale = true;
    wake();
  }

  function tick(now) {
    awake = false;
    if (stopped) return;
    beat += (Math.min(now - ticked, 100) - beat) / 5; // a mean of the last few: one late tick is none of a slow page
    ticked = now;
    if (pending.length && shape) {
      const before = frame;
      frame = pending.next(beat < QUICK_MS);
      last = frame.status;
      camera.room = frame.room;
      if (!begun) arrive();
      if (before && frame.status.time < before.status.time) startOver();
      if (frame.grid) tints.follow(frame.velocity, frame.unit, frame.status.time), tints.byForce(frame);
      drawCircles();
      send("ack", { seq: frame.seq });
      numbers.count(frame.status, now);
      stale = numbersStale = true;
    }
    if (!frame) return;
    look();
    if (stale) drawRest();
    if (numbersStale && (now >= numbersDue || frame.status.paused)) {
      numbersStale = false;
      numbersDue = now + NUMBERS_EVERY_MS;
      showNumbers(now);
    }
    if (pending.length) wake();
    clearTimeout(alarm);
    if (numbersStale) alarm = setTimeout(wake, Math.max(numbersDue - now, 0));
  }

  function drawCircles() {
    measure();
    circles.draw(frame, shape, camera, ratio(), tints.tint);
  }

  /** What lies behind, over and beside the circles; and the canvas of the circles to its place. */
  function drawRest() {
    stale = false;
    measure();
    circles.place(camera.place(frame.view));
    backdrop.draw(shape, camera, size(), ratio(), root.dataset.theme, colour);
    overlay.draw(shape, frame, camera, size(), ratio(), { velocities: $("velocities").checked, contacts: $("contacts").checked, forces: $("forces").checked }, colour, root.dataset.theme === "dark");
    panels.layout(camera.place(camera.room));
    capture.frame();
  }

  /** The picture without the controls, at once: what a canvas of WebGL shows is gone after the tick that drew it. */
  function compose(context, { width, height }, pixels) {
    drawCircles();
    context.setTransform(pixels, 0, 0, pixels, 0, 0);
    context.drawImage($("backdrop"), 0, 0, width, height);
    const place = camera.place(frame.view), canvas = shape.drawnHere ? $("photo") : $("stage");
    if (canvas.width && canvas.height) context.drawImage(canvas, place.left, place.top, place.width, place.height);
    if (!$("overlay").hidden) context.drawImage($("overlay"), 0, 0, width, height);
  }

  /** The part of the page that the controls leave free. */
  function measure() {
    if (measured) return; // asking the browser has it lay the page out
    measured = true;
    const whole = root.getBoundingClientRect(), aside = root.querySelector("aside").getBoundingClientRect();
    const below = aside.left - whole.left <= 1; // on a narrow page the controls are at its foot
    const width = Math.max(below ? whole.width : aside.left - whole.left, 1), height = below ? aside.top - whole.top : whole.height;
    const foot = below ? 0 : root.querySelector("#transport")?.offsetHeight ?? 0; // of a film
    const leave = (top) => (camera.free = { left: 0, top, width, height: Math.max(height - top - foot, 1) });
    leave(0);
    const title = root.querySelector("header").getBoundingClientRect();
    if (shape.panels.length || (!shape.parted && camera.encloses(shape.outlines, title.right - whole.left, title.bottom - whole.top))) leave(HEADER_PX);
  }

  /** Tell the server what is looked at, if that has changed. */
  function look() {
    measure();
    const { part, free } = camera, { width } = free, height = free.height + (part ? free.top : 0), by = $("colour").value, pixels = ratio();
    const wish = {
      part,
      width: Math.min(Math.max(Math.round(width * pixels), 1), 4096),
      height: Math.min(Math.max(Math.round(height * pixels), 1), 4096),
      colour: by,
      dark: dark(),
      velocity: !shape.drawnHere && (isLively(by) || $("velocities").checked),
      force: !shape.drawnHere && $("forces").checked,
    };
    const text = JSON.stringify(wish);
    if (text === lookSent) return;
    lookSent = text;
    send("look", wish);
  }

  /** All colours anew. */
  function paint() {
    root.dataset.theme = dark() ? "dark" : "light";
    if (!shape) return;
    const { number } = shape, ever = (number.at(-1) ?? 0) + 1; // circles keep their colours when others come and go
    tints.begin($("colour").value, shape, shape.panels.length ? (i) => panels.within(i) : (i) => [number[i], ever], dark());
    if (!frame) return;
    if (frame.grid) tints.follow(frame.velocity, frame.unit, frame.status.time), tints.byForce(frame), drawCircles();
    refresh();
  }

  /** How fast the world goes, unless that is as fast as the clock: wished so, or more the machine cannot do. */
  const pace = ({ pace, speed }) => (speed === 1 && (pace === null || pace > SLOW) ? kind : `${kind} at ${pace === null ? speed : Number(pace.toPrecision(2))}× speed`);
  const kind = film ? "film" : "live";

  // -- numbers --------------------------------------------------------------------------------------------------------

  function showNumbers(now) {
    const { status } = frame;
    numbers.show(status, shape.drawnHere ? "pictures (JPEG)" : NAMES[renderer.name], now);
    panels.push(status.energies);
    panels.draw();
    tell($("pause"), status.paused ? "Resume" : "Pause");
    if (open) link(status.error ? "lost" : status.paused ? "held" : "live", status.error ? "stopped" : status.paused ? "paused" : pace(status));
    $("busy").hidden = !status.busy;
    tell($("busy"), status.busy ?? "");
    notice(status.error ? `${status.error}. Reset starts over.` : status.complaint ?? shape.note);
    controls.follow(status);
    own.follow(status);
    [$("undo").disabled, $("redo").disabled] = (status.undo ?? [0, 0]).map((depth) => !depth);
    if (linking && address) history.replaceState(null, "", `#${settings()}`);
  }

  function startOver() {
    numbers.clear();
    panels.clear();
    own.clear();
  }

  const settings = () => written(shape, last, { colour: $("colour").value, theme: $("theme").value });

  /** The first frame: bring the world to what the address asks for. */
  function arrive() {
    begun = true;
    const { messages, view } = address ? read(address.hash.slice(1), shape, frame.status) : { messages: [], view: {} };
    for (const [type, fields] of messages) send(type, fields);
    for (const [id, value] of Object.entries(view)) if ([...$(id).options].some((option) => option.value === value && !option.disabled)) $(id).value = value;
    linking = Boolean(address?.hash.length > 1);
    paint();
  }

  // -- controls -------------------------------------------------------------------------------------------------------

  const controls = new Controls(root, send, () => (linking = true)), own = new Own(root, send), capture = new Capture($("film"), compose);
  const tools = () => [...root.querySelectorAll("[name=tool]")];
  const flip = (id) => !$(id).disabled && $(id).click();
  let before = null; // gravity before it was switched off

  const act = {
    pause: () => send("pause", { on: !last?.paused }),
    step: () => send("step"),
    reset: () => send("reset"),
    undo: () => send("undo"),
    redo: () => send("redo"),
    still: () => frame && capture.still(shape.title, size(), ratio()),
    film: () => frame && capture.kind && capture.film(shape.title, size(), ratio()),
    slower: () => controls.next("speed"),
    turn: (key) => controls.set("angle", ((controls.get("angle") + (key === "ArrowLeft" ? -STEP_TURN : STEP_TURN) + 540) % 360) - 180),
    weightless() {
      const now = controls.get("gravity");
      controls.set("gravity", now ? 0 : before ?? 9.81);
      before = now || null;
    },
    tool: (key) => tools()[Number(key) - 1].click(),
    colour: () => controls.next("colour"),
    theme: () => (($("theme").value = dark() ? "light" : "dark"), $("theme").dispatchEvent(new Event("change"))),
    velocities: () => flip("velocities"),
    contacts: () => flip("contacts"),
    forces: () => flip("forces"),
    zoom: (key) => (camera.zoom(key === "+" ? STEP_ZOOM : 1 / STEP_ZOOM, camera.free.left + camera.free.width / 2, camera.free.top + camera.free.height / 2), zoomed()),
    fit: () => (camera.fit(), zoomed()),
    async copy() {
      const text = address ? `${address.origin}${address.pathname}${address.search}#${settings()}` : settings();
      if (address) history.replaceState(null, "", text);
      linking = true;
      const copied = await navigator.clipboard?.writeText(text).then(() => true, () => false);
      $("copy").textContent = copied ? "Copied" : "In the address";
      setTimeout(() => ($("copy").textContent = "Copy link"), 1500);
    },
    help: () => ($("sheet").open ? $("sheet").close() : $("sheet").showModal()),
    fold() {
      const folded = root.classList.toggle("folded");
      $("fold").setAttribute("aria-expanded", String(!folded));
      refresh();
    },
  };
  if (film) Object.assign(act, film);
  for (const id of ["pause", "step", "reset", "undo", "redo", "still", "film", "fit", "copy", "help", "fold"]) {
    $(id).addEventListener("click", (event) => {
      act[id]();
      if (event.detail) $(id).blur(); // after a click with the mouse, space is pause again and not this button
    });
  }
  for (const id of ["colour", "theme"]) {
    $(id).addEventListener("change", () => {
      linking = true;
      $(id).blur();
      paint();
      numbersStale = true;
    });
  }
  for (const id of ["velocities", "contacts", "forces"]) $(id).addEventListener("change", () => (refresh(), $(id).blur()));
  for (const tool of tools()) tool.addEventListener("change", () => ((root.dataset.tool = tool.value), tool.blur()));
  $("sheet-close").addEventListener("click", () => $("sheet").close());
  fillSheet($("sheet").querySelector("tbody"), act, film);
  listen(address || film ? document : root, root, act, (key, again) => shape?.callbacks?.includes("keys") && (again || send("key", { key }), true));

  const zoomed = () => ((numbersStale = true), refresh());

  new Pointer(root, $("backdrop"), {
    camera, send, zoomed,
    shape: () => shape,
    tool: () => tools().find(({ checked }) => checked).value,
    usualRadius: () => (shape.radius.length ? shape.radius[shape.radius.length >> 1] : 4 / camera.scale),
    panelSize: () => panels.cell(camera.room),
  });

  const resized = new ResizeObserver(() => {
    measured = false;
    refresh();
  });
  for (const each of [root, root.querySelector("aside")]) resized.observe(each);
  darkness.addEventListener("change", paint);
  paint();

  return {
    /** Where particle `i` is on screen, CSS pixels, and in the world, metres. */
    where(i) {
      const [x0, y0, x1, y1] = frame.view;
      const x = x0 + ((x1 - x0) * frame.grid[2 * i]) / GRID_MAX, y = y0 + ((y1 - y0) * frame.grid[2 * i + 1]) / GRID_MAX;
      const [left, top] = camera.toScreen(x, y), box = root.getBoundingClientRect();
      return { x, y, left: left + box.left, top: top + box.top };
    },
    status: () => last,
    mass: (i) => shape.mass[i],
    groups: () => shape.groups,
    tint: (i) => tints.tint[i],
    overlay,
    capture,
    camera,
    /** The element is gone. */
    stop() {
      stopped = true;
      resized.disconnect();
      darkness.removeEventListener("change", paint);
    },
  };
}
