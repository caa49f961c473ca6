// A link that carries the scene and its settings, after the #: opening it gives the same, whatever is on show there.

const VIEW = ["colour", "theme"]; // of this tab; the others belong to the world

/** The settings as text, such as "scene=cage&particles=500&gravity=0,-9.81"; those in which panels differ are the scene's. */
export function written(shape, status, view) {
  const fields = new URLSearchParams(), differing = new Set(shape.differing);
  const add = (name, value) => value !== null && value !== undefined && !differing.has(name) && fields.set(name, value);
  if (shape.scene) {
    add("scene", shape.scene);
    add("particles", Math.round(status.particles / Math.max(shape.panels.length, 1)));
  }
  add("gravity", status.gravity.map((value) => Number(value.toFixed(6))).join());
  for (const name of ["substeps", "restitution", "friction"]) add(name, status[name] === null ? null : Number(status[name].toFixed(6)));
  if (shape.integrators.includes(status.integrator)) add("integrator", status.integrator);
  if (status.speed !== 1) add("speed", status.speed);
  for (const name of VIEW) if (view[name] !== { colour: "order", theme: "auto" }[name]) add(name, view[name]);
  return fields.toString().replaceAll("%2C", ",");
}

/** The messages [type, fields] that bring what is on show to what the text says, and the view's part of it. */
export function read(text, shape, status) {
  const wanted = new URLSearchParams(text), messages = [];
  const number = (name) => (wanted.has(name) && wanted.get(name) !== "" && Number.isFinite(Number(wanted.get(name))) ? Number(wanted.get(name)) : null);
  const scene = shape.scenes.some(([name]) => name === wanted.get("scene")) ? wanted.get("scene") : null;
  const particles = number("particles");
  const present = Math.round(status.particles / Math.max(shape.panels.length, 1));
  const build = shape.scenes.length && ((scene && scene !== shape.scene) || (particles && particles !== present));
  if (build) messages.push(["build", { scene: scene ?? shape.scene, ...(particles ? { particles: Math.round(particles) } : {}) }]);
  const gravity = wanted.get("gravity")?.split(",").map(Number);
  if (gravity?.length === 2 && gravity.every(Number.isFinite) && (build || String(gravity) !== String(status.gravity))) messages.push(["gravity", { x: gravity[0], y: gravity[1] }]);
  for (const name of ["substeps", "restitution", "friction", "speed"]) {
    const value = number(name);
    if (value !== null && (build || value !== status[name])) messages.push([name, { value }]);
  }
  const integrator = wanted.get("integrator");
  if (integrator && (build || integrator !== status.integrator)) messages.push(["integrator", { value: integrator }]);
  return { messages, view: Object.fromEntries(VIEW.filter((name) => wanted.has(name)).map((name) => [name, wanted.get(name)])) };
}
