// Where the world is on screen: fitted into the free part of the page, or where the user has zoomed and moved to.

const CLOSEST = 400, FARTHEST = 0.2; // limits of zoom, in terms of the fitted view

export class Camera {
  constructor() {
    this.free = { left: 0, top: 0, width: 1, height: 1 }; // part of the page left to the world, CSS pixels
    this.room = null; // what the server would show, [x0, y0, x1, y1] in metres
    this.bounded = true; // all of the room is on show: nothing is beyond it
    this.parted = false; // only a part of the room is: what is beside it may as well be seen
    this.own = null; // {x, y, scale}: the centre in metres and CSS pixels a metre, once the user has moved
  }

  get fitted() {
    const [x0, y0, x1, y1] = this.room, { width, height } = this.free;
    return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: Math.max(Math.min(width / (x1 - x0), height / (y1 - y0)), 1e-9) };
  }

  get now() {
    return this.own ?? this.fitted;
  }

  get scale() {
    return this.now.scale;
  }

  fit() {
    this.own = null;
  }

  toScreen(x, y) {
    const now = this.now, { left, top, width, height } = this.free;
    return [left + width / 2 + (x - now.x) * now.scale, top + height / 2 - (y - now.y) * now.scale];
  }

  toWorld(left, top, now = this.now) {
    const free = this.free;
    return [now.x + (left - free.left - free.width / 2) / now.scale, now.y - (top - free.top - free.height / 2) / now.scale];
  }

  /** Where a rectangle of the world is, CSS pixels. */
  place([x0, y0, x1, y1]) {
    const [left, top] = this.toScreen(x0, y1);
    return { left, top, width: (x1 - x0) * this.scale, height: (y1 - y0) * this.scale };
  }

  /** Whether a place on the screen is inside one of these closed lines, [[x, y], ...] in metres, when all is fitted. */
  encloses(lines, left, top) {
    const [x, y] = this.toWorld(left, top, this.fitted);
    const crosses = ([x0, y0], [x1, y1]) => y0 > y !== y1 > y && x < x0 + ((y - y0) / (y1 - y0)) * (x1 - x0);
    return lines.some((line) => line.filter((point, k) => crosses(line.at(k - 1), point)).length % 2);
  }

  /** Zoom about a point of the screen, which stays where it is. */
  zoom(factor, left, top) {
    const [x, y] = this.toWorld(left, top), least = this.fitted.scale, now = this.now;
    const scale = Math.min(Math.max(now.scale * factor, FARTHEST * least), CLOSEST * least);
    this.own = this.#near({ x: x + ((now.x - x) * now.scale) / scale, y: y + ((now.y - y) * now.scale) / scale, scale });
  }

  /** Move the picture by so many CSS pixels. */
  move(dx, dy) {
    const { x, y, scale } = this.now;
    this.own = this.#near({ x: x - dx / scale, y: y + dy / scale, scale });
  }

  /** The part of the world to ask for, metres, behind the title too; null leaves it to the server. */
  get part() {
    if (!this.room || (!this.own && !this.parted)) return null;
    const { left, top, width, height } = this.free, [x0, y1] = this.toWorld(left, 0), [x1, y0] = this.toWorld(left + width, top + height);
    if (!this.bounded) return [x0, y0, x1, y1];
    const [rx0, ry0, rx1, ry1] = this.room;
    return [Math.max(x0, rx0), Math.max(y0, ry0), Math.min(x1, rx1), Math.min(y1, ry1)];
  }

  /** The centre stays within the room: the view cannot leave it. */
  #near(own) {
    if (!this.bounded) return own;
    const [x0, y0, x1, y1] = this.room, inside = (value, low, high) => Math.min(Math.max(value, low), high);
    return { x: inside(own.x, x0, x1), y: inside(own.y, y0, y1), scale: own.scale };
  }
}
