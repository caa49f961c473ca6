// What is drawn over the circles: how they have turned, lines of the scene, what moves in it, pins, velocities, contacts.

import { drawObstacles, resizeCanvas } from "./backdrop.js";
import { heat } from "./colour.js";
import { touching } from "./contacts.js";
import { nearest, periods } from "./copies.js";
import { GRID_MAX } from "./draw.js";
import { drawMarksOf } from "./drawing.js";

export const MOST_CONTACTS = 20000; // circles whose contacts are searched for: beyond, it would cost frames
export const MOST_FORCES = 20000; // circles, see forces.py
const LINK_PX = 1.6;
const LOADS = 12; // shades that links are drawn in: a stroke for each
const MARKED_PX = 4; // radius from which on a circle has a mark that shows how it has turned, as in pictures and films
const MOST_ARROWS = 4000; // of more circles, every so many has one
const ARROW_S = 0.08; // a velocity is drawn as the way of so many seconds

export class Overlay {
  constructor(canvas) {
    this.canvas = canvas;
    this.clean = canvas.hidden = true; // else the browser would lay it over every picture
    this.contacts = 0; // pairs on show
    this.links = 0;
    this.arrows = 0;
    this.marks = 0;
    this.forces = 0;
    this.drawn = 0; // marks of the user's own program
  }

  /** `wants`: {velocities, contacts}; `colour(name)` is that of a custom property. */
  draw(shape, frame, camera, size, ratio, wants, colour, dark) {
    const pinned = frame.grid ? pins(shape.mass) : [];
    const busy = shape.lines.length || frame.obstacles.length || frame.links || frame.turned || frame.drawing?.length || pinned.length || wants.velocities || wants.contacts || wants.forces;
    this.contacts = this.arrows = this.links = this.marks = 0;
    if (!busy && this.clean) return;
    this.clean = this.canvas.hidden = !busy;
    resizeCanvas(this.canvas, size, ratio);
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    dashes(context, shape.lines, camera, colour("--soft"));
    drawObstacles(context, frame.obstacles, camera, colour);
    if (!frame.grid) return void (this.drawn = drawMarksOf(context, frame.drawing ?? [], camera, colour("--text")));
    const place = camera.place(frame.view);
    const { grid } = frame, { x, y, seen } = scaled(grid, place);
    const n = grid.length / 2;
    if (frame.turned) {
      this.marks = drawMarks(context, frame.turned, shape.radius, camera.scale, { x, y, seen });
      if (frame.copies) this.marks += drawMarks(context, ...copied(frame, shape.radius), camera.scale, scaled(frame.copies.places, place));
    }
    this.links = drawLinks(context, frame, { x, y, seen }, dark, periods(shape.periodicities, n)?.map((metres) => metres * camera.scale));
    this.forces = wants.forces ? drawForces(context, frame, shape.radius, camera.scale, { x, y, seen }, dark) : 0;
    if (wants.contacts && n <= MOST_CONTACTS) {
      context.beginPath();
      const xs = new Float64Array(n), ys = new Float64Array(n), rs = new Float64Array(n);
      for (let i = 0; i < n; i++) [xs[i], ys[i], rs[i]] = [seen(i) ? x(i) : NaN, y(i), shape.radius[i] * camera.scale];
      const pairs = touching(shape, xs, ys, rs);
      for (let k = 0; k < pairs.length; k += 2) {
        context.moveTo(xs[pairs[k]], ys[pairs[k]]);
        context.lineTo(xs[pairs[k + 1]], ys[pairs[k + 1]]);
      }
      this.contacts = pairs.length / 2;
      setStroke(context, colour("--text"), 1.2);
    }
    if (wants.velocities && frame.velocity) {
      context.beginPath();
      const metre = frame.unit * ARROW_S * camera.scale;
      for (let i = 0; i < n; i += Math.ceil(n / MOST_ARROWS)) {
        if (!seen(i)) continue;
        const dx = frame.velocity[2 * i] * metre, dy = -frame.velocity[2 * i + 1] * metre, length = Math.hypot(dx, dy);
        if (length < 1) continue;
        arrow(context, x(i), y(i), dx, dy, Math.min(5, 0.4 * length) / length);
        this.arrows++;
      }
      setStroke(context, colour("--text"), 1.2);
    }
    context.fillStyle = colour("--text");
    context.beginPath();
    for (const i of pinned) {
      if (!seen(i)) continue;
      const radius = Math.max(1.5, Math.min(4, 0.35 * shape.radius[i] * camera.scale));
      context.moveTo(x(i) + radius, y(i));
      context.arc(x(i), y(i), radius, 0, 2 * Math.PI);
    }
    context.fill();
    this.drawn = drawMarksOf(context, frame.drawing ?? [], camera, colour("--text"));
  }
}

/** Where the circles of a grid are on the screen, and which are in sight; `place`: where the grid is. */
function scaled(grid, place) {
  const sx = place.width / GRID_MAX, sy = place.height / GRID_MAX;
  return {
    seen: (i) => grid[2 * i] && grid[2 * i + 1] && grid[2 * i] !== GRID_MAX && grid[2 * i + 1] !== GRID_MAX,
    x: (i) => place.left + grid[2 * i] * sx,
    y: (i) => place.top + place.height - grid[2 * i + 1] * sy,
  };
}

/** How the copies of a frame have turned, and their radii. */
const copied = ({ turned, copies }, radius) => [Uint8Array.from(copies.owner, (i) => turned[i]), Float32Array.from(copies.owner, (i) => radius[i])];

/** Links as lines in the colour of their pull; returns how many. `at`: where a circle is on the screen; `period`: (2n,) or undefined. */
function drawLinks(context, { joined, strain }, at, dark, period) {
  return shaded(context, strain, joined, at, dark, () => LINK_PX, (k, a, b) => {
    const dx = at.x(b) - at.x(a), dy = at.y(b) - at.y(a), nx = nearest(dx, period?.[2 * a]), ny = nearest(dy, period?.[2 * a + 1]);
    context.moveTo(at.x(a), at.y(a));
    context.lineTo(at.x(a) + nx, at.y(a) + ny);
    if (nx !== dx || ny !== dy) {
      context.moveTo(at.x(b), at.y(b));
      context.lineTo(at.x(b) - nx, at.y(b) - ny);
    }
  });
}

/** Contacts as lines as wide as what pushes, through the middles of the circles; returns how many. */
function drawForces(context, { touching, pushes, normals }, radius, scale, at, dark) {
  if (!pushes?.length) return 0;
  let usual = 0;
  for (let k = 0; k < pushes.length; k++) usual += radius[touching[2 * k]] / pushes.length;
  context.lineCap = "round";
  const width = (load) => Math.max(0.5, (1.6 * usual * scale * (load + 0.5)) / LOADS);
  const drawn = shaded(context, pushes, touching, at, dark, width, (k, a, b) => {
    const angle = (normals[k] * Math.PI) / 128, reach = radius[a] * scale;
    context.moveTo(at.x(a), at.y(a));
    if (a === b) context.lineTo(at.x(a) + reach * Math.cos(angle), at.y(a) - reach * Math.sin(angle));
    else context.lineTo(at.x(b), at.y(b));
  });
  context.lineCap = "butt";
  return drawn;
}

/** Pairs of circles in the colours of their loads, 0 to 255, as `path(k, a, b)` draws each; returns how many are in sight. */
function shaded(context, loads, pairs, at, dark, width, path) {
  if (!loads?.length) return 0;
  const shades = heat(LOADS, dark), groups = shades.map(() => []);
  loads.forEach((load, k) => groups[(load * LOADS) >> 8].push(k));
  let drawn = 0;
  for (const [load, group] of groups.entries()) {
    const shown = group.filter((k) => at.seen(pairs[2 * k]) && at.seen(pairs[2 * k + 1]));
    context.beginPath();
    for (const k of shown) path(k, pairs[2 * k], pairs[2 * k + 1]);
    setStroke(context, shades[load], width(load));
    drawn += shown.length;
  }
  return drawn;
}

/** A line from centre to rim on each circle that is large enough; returns how many. `turned`: 1/256 of a turn. */
function drawMarks(context, turned, radius, scale, at) {
  let drawn = 0;
  context.beginPath();
  for (let i = 0; i < turned.length; i++) {
    const reach = radius[i] * scale, angle = (turned[i] * Math.PI) / 128;
    if (reach < MARKED_PX || !at.seen(i)) continue;
    context.moveTo(at.x(i), at.y(i));
    context.lineTo(at.x(i) + reach * Math.cos(angle), at.y(i) - reach * Math.sin(angle));
    drawn++;
  }
  setStroke(context, "rgb(0 0 0 / 50%)", 1.4);
  return drawn;
}

const pinsOf = new WeakMap();

/** Numbers of the pinned circles: those of infinite mass. */
function pins(mass) {
  if (!pinsOf.has(mass)) pinsOf.set(mass, Array.from(mass.keys()).filter((i) => mass[i] === Infinity));
  return pinsOf.get(mass);
}

function dashes(context, lines, camera, colour) {
  context.setLineDash([5, 5]);
  context.beginPath();
  for (const [from, to] of lines) {
    context.moveTo(...camera.toScreen(...from));
    context.lineTo(...camera.toScreen(...to));
  }
  setStroke(context, colour, 1);
  context.setLineDash([]);
}

function arrow(context, x, y, dx, dy, head) {
  context.moveTo(x, y);
  context.lineTo(x + dx, y + dy);
  context.lineTo(x + dx - head * (dx + 0.5 * dy), y + dy - head * (dy - 0.5 * dx));
  context.moveTo(x + dx, y + dy);
  context.lineTo(x + dx - head * (dx - 0.5 * dy), y + dy - head * (dy + 0.5 * dx));
}

function setStroke(context, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}
