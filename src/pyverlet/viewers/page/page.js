// The page: receives frames, draws the newest at the screen's pace, acknowledges what it drew, sends commands.

import { Chart } from "./chart.js";
import { Panels } from "./panels.js";
import { makeRenderer, palette, shade, STEPS } from "./draw.js";

const $ = (id) => document.getElementById(id);
const show = (name) => document.querySelector(`[data-testid="${name}"]`);
const GRID_MAX = 65535;
const NUMBERS_EVERY_MS = 120; // nobody reads faster
const RETRY_MS = 1000;
const HEADER_PX = 62;
const REACH_PX = 9; // a near miss of the mouse still takes the circle

const backdrop = $("backdrop"), stage = $("stage");
const renderer = makeRenderer(stage, new URLSearchParams(location.search).get("renderer") ?? "auto");
const darkness = matchMedia("(prefers-color-scheme: dark)");
const physicsChart = new Chart($("physics-chart"), ["--accent"], { zero: true });
const energyChart = new Chart($("energy-chart"), ["--accent"]);
const panels = new Panels($("panels"));
document.documentElement.dataset.renderer = renderer.name;

let socket = null;
let shape = null; // head of the last shape message, with .radius
let frame = null; // the frame on screen
let pending = null; // a newer one, not drawn yet
let place = null; // where the view is on screen: {left, top, width, height} in CSS pixels, scale in CSS pixels per metre
let backdropKey = "";
let radiusPx = new Float32Array(0), colours = new Uint8Array(0), lut = palette("origin", true);
let numbersDue = 0, numbersStale = false;
let drawn = []; // times of the last drawn frames, ms

// -- the connection ---------------------------------------------------------------------------------------------------

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => receive(data);
  socket.onclose = () => {
    link("lost", "the server has stopped; waiting for it");
    setTimeout(connect, RETRY_MS);
  };
}

function send(type, fields = {}) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ type, ...fields }));
}

function receive(data) {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  if (head.kind === "shape") {
    newShape({ ...head, radius: new Float32Array(data, 4 + length) });
  } else if (head.kind === "frame") {
    pending = { ...head, grid: new Uint16Array(data, 4 + length) };
  } else if (head.kind === "refused") {
    console.warn(head.reason);
  }
}

function newShape(head) {
  shape = head;
  frame = pending = null;
  document.title = `${head.title} · pyverlet`;
  $("title").textContent = head.title;
  $("budget").textContent = head.budgetMs;
  physicsChart.limit = head.budgetMs;
  $("substeps").max = Math.min(32, head.maxSubsteps);
  $("substeps-slider").hidden = head.substepsDiffer;
  panels.build(head.panels);
  colours = new Uint8Array(head.radius.length);
  paint();
  layout();
}

function link(state, text) {
  $("link").className = state;
  $("link").lastElementChild.textContent = text;
}

// -- drawing ----------------------------------------------------------------------------------------------------------

function tick(now) {
  requestAnimationFrame(tick);
  if (pending && shape) {
    const before = frame;
    frame = pending;
    pending = null;
    if (before && frame.status.time < before.status.time) startOver();
    if (!place || String(frame.view) !== String(before?.view)) layout();
    if (colourBy() === "speed" && before) paintSpeed(before, frame);
    drawStage();
    send("ack", { seq: frame.seq });
    drawn.push(now);
    physicsChart.push(frame.status.physics_ms);
    numbersStale = true;
  }
  if (numbersStale && (now >= numbersDue || frame.status.paused)) {
    numbersStale = false;
    numbersDue = now + NUMBERS_EVERY_MS;
    numbers(now);
  }
}

function drawStage() {
  if (frame && place && frame.grid.length === 2 * shape.radius.length) renderer.draw(frame.grid, radiusPx, colours, lut);
}

/** Fit the view into the window beside the panel, and everything that follows from it. */
function layout() {
  const view = frame?.view ?? pending?.view;
  if (!view || !shape) return;
  const [x0, y0, x1, y1] = view;
  const panel = document.querySelector("aside").getBoundingClientRect();
  const below = panel.left <= 0; // a narrow window has the panel at its foot
  const above = shape.panels.length ? HEADER_PX : 0; // names of panels stay clear of the title
  const free = { width: below ? innerWidth : panel.left, height: (below ? panel.top : innerHeight) - above };
  const scale = Math.max(Math.min(free.width / (x1 - x0), free.height / (y1 - y0)), 1e-9);
  const width = (x1 - x0) * scale, height = (y1 - y0) * scale;
  place = { left: (free.width - width) / 2, top: above + (free.height - height) / 2, width, height, scale, view };
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const [pixelWidth, pixelHeight] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (stage.width !== pixelWidth || stage.height !== pixelHeight || !stage.style.width) {
    Object.assign(stage, { width: pixelWidth, height: pixelHeight });
    renderer.resize(pixelWidth, pixelHeight);
  }
  Object.assign(stage.style, { left: `${place.left}px`, top: `${place.top}px`, width: `${width}px`, height: `${height}px` });
  radiusPx = shape.radius.map((metres) => metres * scale * (pixelWidth / width));
  panels.layout(place);
  drawBackdrop(ratio);
}

function drawBackdrop(ratio) {
  const key = [place.view, innerWidth, innerHeight, ratio, darkness.matches, place.scale].join();
  if (key === backdropKey) return;
  backdropKey = key;
  const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name);
  Object.assign(backdrop, { width: innerWidth * ratio, height: innerHeight * ratio });
  Object.assign(backdrop.style, { width: `${innerWidth}px`, height: `${innerHeight}px` });
  const context = backdrop.getContext("2d");
  context.scale(ratio, ratio);
  context.fillStyle = colour("--ground");
  context.fillRect(0, 0, innerWidth, innerHeight);
  if (!shape.bounded) grid(context, colour);
  for (const outline of shape.outlines) {
    context.beginPath();
    for (const [x, y] of outline) context.lineTo(...toScreen(x, y));
    context.closePath();
    context.fillStyle = colour("--inside");
    context.strokeStyle = colour("--wall");
    context.lineWidth = 4; // the circles cover its inner half
    context.lineJoin = "round";
    context.stroke();
    context.fill();
  }
  context.strokeStyle = colour("--soft");
  context.lineWidth = 1;
  context.setLineDash([5, 5]);
  context.beginPath();
  for (const [from, to] of shape.lines) {
    context.moveTo(...toScreen(...from));
    context.lineTo(...toScreen(...to));
  }
  context.stroke();
}

/** Lines every 1, 2 or 5 times a power of ten metres: without bounds nothing else shows that the view moves. */
function grid(context, colour) {
  const wish = 90 / place.scale, power = 10 ** Math.floor(Math.log10(wish));
  const space = power * [1, 2, 5, 10].find((m) => m * power >= wish);
  const [left, top] = toWorld(0, 0), [right, bottom] = toWorld(innerWidth, innerHeight);
  context.strokeStyle = colour("--grid");
  context.fillStyle = colour("--soft");
  context.lineWidth = 1;
  context.beginPath();
  for (let k = Math.ceil(left / space); k * space <= right; k++) {
    const x = toScreen(k * space, 0)[0];
    context.moveTo(x, 0);
    context.lineTo(x, innerHeight);
  }
  for (let k = Math.ceil(bottom / space); k * space <= top; k++) {
    const y = toScreen(0, k * space)[1];
    context.moveTo(0, y);
    context.lineTo(innerWidth, y);
    context.fillText(`${Number((k * space).toPrecision(9))} m`, 8, y - 4);
  }
  context.stroke();
}

const toScreen = (x, y) => [place.left + (x - place.view[0]) * place.scale, place.top + (place.view[3] - y) * place.scale];
const toWorld = (left, top) => [place.view[0] + (left - place.left) / place.scale, place.view[3] - (top - place.top) / place.scale];

// -- colours ----------------------------------------------------------------------------------------------------------

const colourBy = () => document.querySelector("[name=colour]:checked").value;
let usualSpeed = 0;

function paint() {
  lut = palette(colourBy(), darkness.matches);
  const n = colours.length;
  for (let i = 0; i < n; i++) {
    const [own, count] = panels.within(i, n);
    colours[i] = shade(colourBy() === "origin" ? Math.floor((own * STEPS) / count) : 0, own);
  }
  backdropKey = "";
}

/** Speeds are read off two pictures: nothing more need travel. */
function paintSpeed(a, b) {
  const elapsed = b.status.time - a.status.time;
  if (!(elapsed > 0) || a.grid.length !== b.grid.length) return;
  const sx = (b.view[2] - b.view[0]) / GRID_MAX, sy = (b.view[3] - b.view[1]) / GRID_MAX;
  const ax = (a.view[2] - a.view[0]) / GRID_MAX, ay = (a.view[3] - a.view[1]) / GRID_MAX;
  const ox = b.view[0] - a.view[0], oy = b.view[1] - a.view[1];
  const full = (STEPS - 1) / Math.max(3 * usualSpeed, 0.05 * (b.view[2] - b.view[0])) / elapsed;
  let sum = 0;
  for (let i = 0; i < colours.length; i++) {
    const dx = b.grid[2 * i] * sx - a.grid[2 * i] * ax + ox, dy = b.grid[2 * i + 1] * sy - a.grid[2 * i + 1] * ay + oy;
    const distance = Math.sqrt(dx * dx + dy * dy);
    sum += distance;
    colours[i] = shade(Math.min(STEPS - 1, (distance * full) | 0), i);
  }
  usualSpeed += 0.05 * (sum / Math.max(colours.length, 1) / elapsed - usualSpeed);
}

// -- numbers ----------------------------------------------------------------------------------------------------------

function numbers(now) {
  const { status } = frame;
  drawn = drawn.filter((time) => now - time <= 1000);
  const rate = drawn.length > 1 ? (1000 * (drawn.length - 1)) / (drawn.at(-1) - drawn[0]) : 0;
  write("fps", status.paused || status.error || !rate ? "–" : rate.toFixed(0));
  write("physics-ms", status.physics_median_ms.toFixed(2));
  show("physics-ms").parentElement.classList.toggle("over", status.physics_median_ms > shape.budgetMs);
  show("physics-ms").parentElement.title = `median of the last frames; 95 % took less than ${status.physics_p95_ms.toFixed(2)} ms`;
  write("particles", String(status.particles));
  write("time", status.time.toFixed(3));
  write("dropped", String(status.dropped));
  write("energy", joules(status.energy));
  write("kinetic", joules(status.kinetic));
  energyChart.push(status.energy);
  energyChart.draw();
  physicsChart.draw();
  panels.push(status.energies);
  panels.draw();

  $("pause").textContent = status.paused ? "Resume" : "Pause";
  if (socket.readyState === WebSocket.OPEN) link(status.error ? "lost" : status.paused ? "held" : "live", status.error ? "stopped" : status.paused ? "paused" : "live");
  $("notice").hidden = !status.error;
  if (status.error) $("notice").textContent = `${status.error}. Reset starts over.`;
  follow("gravity", -status.gravity[1]);
  follow("substeps", status.substeps);
}

const joules = (value) => (value === null ? "–" : value.toFixed(Math.abs(value) < 100 ? 2 : 0).replace(/^-0(\.0*)?$/, "0$1"));

/** Write a number with its thousands set apart by style only, so that the text stays a plain number. */
function write(name, text) {
  const element = show(name);
  if (element.textContent === text) return;
  const [, sign, whole, rest] = text.match(/^(-?)(\d*)(.*)$/);
  const groups = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, " ").split(" ") : [whole];
  element.replaceChildren(sign + groups[0], ...groups.slice(1).map((digits) => Object.assign(document.createElement("span"), { className: "group", textContent: digits })), rest);
}

function startOver() {
  energyChart.clear();
  physicsChart.clear();
  panels.clear();
}

// -- controls ---------------------------------------------------------------------------------------------------------

const held = new Set(); // sliders in the user's hand do not follow the server
const first = {};

/** Show a slider's value as the server has it: another tab may have moved it. */
function follow(id, value) {
  const slider = $(id);
  first[id] ??= value;
  if (!held.has(id)) {
    if (value > Number(slider.max)) slider.max = Math.ceil(value);
    if (value < Number(slider.min)) slider.min = Math.floor(value);
    slider.value = value;
  }
  label(id);
}

function label(id) {
  const value = Number($(id).value);
  $(`${id}-value`).textContent = id === "gravity" ? Math.abs(value).toFixed(2) : value;
  if (id === "gravity") $("gravity-arrow").textContent = value > 0 ? "↓" : value < 0 ? "↑" : " ";
}

const setters = {
  gravity: (value) => send("gravity", { x: frame?.status.gravity[0] ?? 0, y: -value || 0 }),
  substeps: (value) => send("substeps", { value: Math.round(value) }),
};
for (const [id, set] of Object.entries(setters)) {
  let release = 0;
  const change = (value) => {
    held.add(id);
    clearTimeout(release);
    release = setTimeout(() => held.delete(id), 400);
    set(value);
    label(id);
  };
  $(id).addEventListener("input", () => change(Number($(id).value)));
  $(id).addEventListener("dblclick", () => {
    $(id).value = first[id];
    change(first[id]);
  });
}

const actions = {
  pause: () => send("pause", { on: !frame?.status.paused }),
  step: () => send("step"),
  reset: () => send("reset"),
};
for (const [id, act] of Object.entries(actions)) {
  $(id).addEventListener("click", (event) => {
    act();
    if (event.detail) $(id).blur(); // after a click with the mouse, space is pause again and not this button
  });
}
for (const radio of document.getElementsByName("colour")) {
  radio.addEventListener("change", () => {
    paint();
    drawStage();
    radio.blur();
  });
}
addEventListener("keydown", (event) => {
  document.body.classList.toggle("shift", event.shiftKey);
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("button, [type=radio]")) return;
  const action = { " ": "pause", ".": "step", r: "reset", R: "reset" }[event.key];
  if (!action || (event.repeat && action !== "step")) return;
  event.preventDefault();
  actions[action]();
});
addEventListener("keyup", (event) => document.body.classList.toggle("shift", event.shiftKey));

// -- the mouse in the world -------------------------------------------------------------------------------------------

let hand = null; // "drag" or "poke" while the button is down

function point(event) {
  if (!place) return;
  const [x, y] = toWorld(event.clientX, event.clientY);
  send(hand, hand === "drag" ? { x, y, reach: REACH_PX / place.scale } : { x, y });
  const across = 2 * shape.pokeRadius * Math.max(place.width, place.height);
  Object.assign($("poke").style, { left: `${event.clientX}px`, top: `${event.clientY}px`, width: `${across}px`, height: `${across}px` });
}

function letGo() {
  if (hand) send("release");
  hand = null;
  $("poke").hidden = true;
  document.body.classList.remove("holding");
}

backdrop.addEventListener("pointerdown", (event) => {
  if (event.button !== 0 || hand || !frame) return;
  backdrop.setPointerCapture(event.pointerId);
  hand = event.shiftKey ? "poke" : "drag";
  $("poke").hidden = hand !== "poke";
  document.body.classList.toggle("holding", hand === "drag");
  point(event);
});
backdrop.addEventListener("pointermove", (event) => {
  document.body.classList.toggle("shift", event.shiftKey);
  if (hand) point(event);
});
for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) backdrop.addEventListener(end, letGo);
addEventListener("blur", letGo);

addEventListener("resize", () => {
  layout();
  drawStage();
});
darkness.addEventListener("change", () => {
  paint();
  layout();
  drawStage();
});

/** For the console and the tests: where particle `i` is on screen, CSS pixels, and in the world, metres. */
window.pyverlet = {
  where(i) {
    const x = place.view[0] + ((place.view[2] - place.view[0]) * frame.grid[2 * i]) / GRID_MAX;
    const y = place.view[1] + ((place.view[3] - place.view[1]) * frame.grid[2 * i + 1]) / GRID_MAX;
    const [left, top] = toScreen(x, y);
    return { x, y, left, top };
  },
};

connect();
requestAnimationFrame(tick);
