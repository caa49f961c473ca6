// What the user's own program draws over the picture, see protocol.py: lines and areas in metres, and texts.

import { trace } from "./backdrop.js";

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

/** Draw marks, in their order; returns how many. `usual`: the colour of those that have none. */
export function drawMarksOf(context, drawing, camera, usual) {
  context.lineCap = context.lineJoin = "round";
  for (const mark of drawing) {
    const colour = mark[3] ?? usual;
    if (typeof mark[0] === "number") {
      const [x, y, text, , size] = mark, [left, top] = camera.toScreen(x, y);
      context.fillStyle = colour;
      context.font = `${size}px ${FONT}`;
      context.textBaseline = "middle";
      const lines = text.split("\n"), first = top - (0.6 * size * (lines.length - 1));
      lines.forEach((line, k) => context.fillText(line, left, first + 1.2 * size * k));
      continue;
    }
    const [points, closed, filled, , width] = mark;
    trace(context, points, camera);
    if (closed) context.closePath();
    context.fillStyle = context.strokeStyle = colour;
    context.lineWidth = width;
    if (filled) context.fill();
    else context.stroke();
  }
  context.lineCap = "butt";
  return drawing.length;
}
