// What a scene measures, as bars, and what theory says, as a curve: see `Graph` of scenes/_scene.py.

import { setPixels, tell } from "./text.js";

const FOOT_PX = 14; // below the axis, for its numbers

/** Fill `figure` with a graph, null hides it. */
export function fillGraph(figure, graph) {
  figure.hidden = !graph;
  if (!graph) return;
  const [caption, canvas, note] = figure.children;
  tell(caption, graph.title);
  tell(note, graph.note);
  const ratio = Math.min(window.devicePixelRatio || 1, 2), width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (!width || !height) return;
  setPixels(canvas, width, height);
  const context = canvas.getContext("2d"), style = getComputedStyle(canvas), foot = FOOT_PX * ratio;
  const { bars, curve, most, axis } = graph, top = 1.1 * Math.max(...bars, ...curve, 1e-12), y = (value) => (height - foot) * (1 - value / top);
  context.clearRect(0, 0, width, height);
  context.fillStyle = style.getPropertyValue("--kinetic");
  bars.forEach((value, k) => context.fillRect((k / bars.length) * width + 0.5 * ratio, y(value), width / bars.length - ratio, height - foot - y(value)));
  context.strokeStyle = style.getPropertyValue("--text");
  context.lineWidth = 1.6 * ratio;
  context.lineJoin = "round";
  context.beginPath();
  curve.forEach((value, k) => context.lineTo((k / (curve.length - 1)) * width, y(value)));
  context.stroke();
  context.fillStyle = style.getPropertyValue("--soft");
  context.font = `${10 * ratio}px ${style.fontFamily}`;
  context.textBaseline = "bottom";
  for (let x = 0; x <= most; x++) {
    context.textAlign = x === 0 ? "left" : x === most ? "right" : "center";
    context.fillText(String(x), (x / most) * width, height);
  }
  context.textAlign = "right";
  context.textBaseline = "top";
  context.fillText(axis, width, 0);
}
