// What is behind the circles: the ground, the room and its walls, or a grid where there are none.

import { setBox, setPixels } from "./text.js";

const WALL_PX = 4; // the circles cover its inner half
const LINE_PX = 3; // of an obstacle that has no thickness
const GRID_PX = 90; // least distance of grid lines

/** The canvas behind everything; drawn anew only when something about it has changed. */
export class Backdrop {
  constructor(canvas) {
    this.canvas = canvas;
    this.key = "";
  }

  /** `colour(name)` is that of a custom property, which the `theme` decides; `size` the page's in CSS pixels. */
  draw(shape, camera, size, ratio, theme, colour) {
    const now = camera.now, free = camera.free;
    const key = [now.x, now.y, now.scale, free.left, free.top, free.width, free.height, size.width, size.height, ratio, theme].join();
    if (key === this.key && shape === this.shape) return;
    this.key = key;
    this.shape = shape;
    resizeCanvas(this.canvas, size, ratio);
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colour("--ground");
    context.fillRect(0, 0, size.width, size.height);
    if (!shape.bounded) ruled(context, camera, size, colour);
    for (const outline of shape.outlines) {
      trace(context, outline, camera);
      context.closePath();
      context.fillStyle = colour("--inside");
      context.strokeStyle = colour("--wall");
      context.lineWidth = WALL_PX;
      context.lineJoin = "round";
      context.stroke();
      context.fill();
    }
    drawObstacles(context, shape.obstacles, camera, colour);
  }
}

/** Solid shapes and lines, see sketch.py. */
export function drawObstacles(context, obstacles, camera, colour) {
  context.fillStyle = context.strokeStyle = colour("--obstacle");
  context.lineWidth = LINE_PX;
  context.lineCap = context.lineJoin = "round";
  for (const [points, solid] of obstacles) {
    trace(context, points, camera);
    if (solid) context.fill();
    else context.stroke();
  }
}

/** Give a canvas so many CSS pixels, and `ratio` times as many of its own. */
export function resizeCanvas(canvas, { width, height }, ratio) {
  setPixels(canvas, Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio)));
  setBox(canvas, { width, height });
}

/** Have a context's path go through points, [[x, y], ...] in metres. */
export function trace(context, points, camera) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(...camera.toScreen(x, y));
}

/** Lines every 1, 2 or 5 times a power of ten metres: without bounds nothing else shows that the view moves. */
function ruled(context, camera, { width, height }, colour) {
  const wish = GRID_PX / camera.scale, power = 10 ** Math.floor(Math.log10(wish));
  const space = power * [1, 2, 5, 10].find((m) => m * power >= wish);
  const [left, top] = camera.toWorld(0, 0), [right, bottom] = camera.toWorld(width, height);
  context.strokeStyle = colour("--grid");
  context.fillStyle = colour("--soft");
  context.lineWidth = 1;
  context.beginPath();
  for (let k = Math.ceil(left / space); k * space <= right; k++) {
    const x = camera.toScreen(k * space, 0)[0];
    context.moveTo(x, 0);
    context.lineTo(x, height);
  }
  for (let k = Math.ceil(bottom / space); k * space <= top; k++) {
    const y = camera.toScreen(0, k * space)[1];
    context.moveTo(0, y);
    context.lineTo(width, y);
    context.fillText(`${Number((k * space).toPrecision(9))} m`, 8, y - 4);
  }
  context.stroke();
}
