// Shortcuts, and the sheet that lists them: one table for both.

import { make } from "./text.js";

/** [keys, what the sheet says, what it does]; `act` has a function for each name. */
const SHORTCUTS = [
  [[" "], "pause, go on", "pause"],
  [["."], "one frame", "step", "repeats"],
  [["r"], "back to the start", "reset"],
  [["s"], "slow motion, slower, real time", "slower"],
  [["ArrowLeft", "ArrowRight"], "turn gravity", "turn", "repeats"],
  [["0"], "no gravity, gravity again", "weightless"],
  [["1", "2", "3", "4", "5", "6"], "drag, poke, pin, add, erase, move", "tool"],
  [["c"], "next colouring", "colour"],
  [["v"], "velocities", "velocities"],
  [["t"], "contacts", "contacts"],
  [["n"], "forces between circles", "forces"],
  [["+", "-"], "nearer, farther", "zoom", "repeats"],
  [["f"], "show all", "fit"],
  [["d"], "dark, light", "theme"],
  [["l"], "copy a link with the settings", "copy"],
  [["p"], "save a picture", "still"],
  [["m"], "film, and save it", "film"],
  [["?", "h"], "this sheet", "help"],
];
const UNDERSTOOD = ["?", "Tab", "Escape", "Shift", "Control", "Alt", "Meta", "Enter"]; // never for a program of the user's own
const GESTURES = [
  ["drag", "what the tool says: pull a circle, poke, pin, add, erase"],
  ["shift drag", "push circles away"],
  ["right button, alt drag, two fingers", "move the view"],
  ["wheel, pinch", "zoom"],
  ["ctrl z, ctrl shift z", "undo, redo what was done by hand"],
  ["double-click a slider", "where it was"],
];
const FILMED = { turn: "a second back, on", slower: "faster, slow motion", reset: "from the start" };
const WRITTEN = { " ": "space", ArrowLeft: "←", ArrowRight: "→" };

/** Handle the keyboard wherever `target` gets it. */
export function listen(target, root, act, own) {
  target.addEventListener("keydown", (event) => {
    root.classList.toggle("shift", event.shiftKey);
    const field = event.composedPath()[0];
    if (field.matches?.("[type=number], select, textarea, [contenteditable]")) return;
    if (event.ctrlKey || event.metaKey) return again(event, act);
    if (event.altKey) return;
    if (field.matches?.("button, summary, [type=checkbox]") && (event.key === " " || event.key === "Enter")) return;
    if (field.matches?.("[type=radio], [type=range]") && event.key.startsWith("Arrow")) return;
    if (!UNDERSTOOD.includes(event.key) && own(event.key, event.repeat)) return event.preventDefault();
    const found = SHORTCUTS.find(([keys]) => keys.includes(event.key.length === 1 ? event.key.toLowerCase() : event.key));
    if (!found || !act[found[2]]) return;
    const [, , name, repeats] = found;
    event.preventDefault();
    event.stopPropagation(); // a notebook has shortcuts of its own
    if (!event.repeat || repeats) act[name](event.key);
  });
  target.addEventListener("keyup", (event) => root.classList.toggle("shift", event.shiftKey));
}

/** Undo and redo, as everywhere. */
function again(event, act) {
  const key = event.key.toLowerCase(), name = key === "z" && !event.shiftKey ? "undo" : key === "y" || key === "z" ? "redo" : null;
  if (!name || !act[name]) return;
  event.preventDefault();
  event.stopPropagation();
  act[name]();
}

/** Fill the sheet with what there is; `film`: whether that is one. */
export function fillSheet(body, act, film) {
  const row = (keys, text) => {
    const line = body.insertRow(), cell = line.insertCell();
    cell.append(...keys.map((key) => make("kbd", {}, WRITTEN[key] ?? key)));
    line.insertCell().textContent = text;
  };
  for (const [keys, text, name] of SHORTCUTS) if (act[name]) row(keys, (film && FILMED[name]) ?? text);
  for (const [gesture, text] of film ? [["drag", "move the view"], GESTURES[3]] : GESTURES) row([gesture], text);
}
