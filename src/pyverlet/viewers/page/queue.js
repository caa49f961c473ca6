// Pictures that have come and are not drawn yet. A server sends no more than three before it hears of them.

const MOST = 3;
const LONG = 600; // ticks: ten seconds of most screens

export class Queue {
  constructor() {
    this.waiting = [];
    this.drawn = 0;
    this.least = Infinity; // so many waited longer, at least, in each of the last ticks
  }

  get length() {
    return this.waiting.length;
  }

  put(message) {
    this.waiting.push(message);
    if (this.length > MOST) this.#skip();
  }

  /**
   * The next to be drawn. On a page as `quick` as its screen, two that came between two ticks are drawn in two, and none is missed.
   * Some that always wait make up for nothing, though: they only come late.
   */
  next(quick) {
    while (this.length > 1 && !quick) this.#skip();
    this.least = Math.min(this.least, this.length - 1);
    if (++this.drawn >= LONG) {
      if (this.least > 0) this.#skip();
      this.drawn = 0;
      this.least = Infinity;
    }
    return this.waiting.shift();
  }

  clear() {
    while (this.length) this.#skip();
  }

  #skip() {
    this.waiting.shift().bitmap?.close();
  }
}
