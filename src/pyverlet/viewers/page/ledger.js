// Where the energy has gone: a row for each account of the ledger, its bar to the left for a loss, to the right for a gain.

import { make } from "./text.js";

const MEANS = {
  restitution: "taken by impacts and by contacts at rest",
  friction: "taken by friction",
  drag: "taken or brought by drag and wind",
  forces: "brought by forces without a potential, such as the mouse",
  thermostat: "brought by heat baths, less what their friction takes",
  links: "taken by links: damping, and what stiff ones do not give back",
  projection: "put in by moving overlapping circles apart",
  limiter: "taken back by the energy limiter, of what contacts had gained too much",
  walls: "brought by a room that turns",
  outside: "what the circles had at the start, and what was done between frames",
  seam: "of circles that fell through the periodic boundary of a periodic room, and are up again",
  residual: "left over: the error of the integrator",
};

/** Fill `element` with the accounts in joules that are not empty, null hides it; `text` writes a number. */
export function fillLedger(element, accounts, text) {
  element.hidden = !accounts;
  if (!accounts) return;
  const shown = Object.entries(accounts).filter(([name, joules]) => joules || name === "residual");
  // What was there at the start is no size to compare losses with.
  const most = Math.max(...shown.map(([name, joules]) => (name === "outside" ? 0 : Math.abs(joules))), Number.MIN_VALUE);
  while (element.rows.length > shown.length) element.deleteRow(-1);
  for (const [k, [name, joules]] of shown.entries()) {
    const row = element.rows[k] ?? newRow(element), share = Math.min(Math.abs(joules ?? 0) / most, 1);
    row.dataset.account = name;
    row.title = MEANS[name] ?? "";
    row.cells[0].textContent = name;
    row.cells[1].firstChild.style.cssText = `width: ${(50 * share).toFixed(1)}%; ${joules < 0 ? "right" : "left"}: 50%`;
    row.cells[1].firstChild.className = joules < 0 ? "lost" : "gained";
    row.cells[2].textContent = text(joules);
  }
}

function newRow(element) {
  const row = element.insertRow();
  for (let k = 0; k < 3; k++) row.insertCell();
  row.cells[1].append(make("i"));
  return row;
}
