// Periodic rooms: circles that reach through a periodic boundary are drawn once more, on the other side, and links through it from both ends.

/** Grid, radii and tints of all circles of a frame, and behind them those of its copies. */
export function withCopies({ grid, copies }, radius, tint) {
  if (!copies) return [grid, radius, tint];
  const { owner, places } = copies;
  return [joined(grid, places), joined(radius, radius.constructor.from(owner, (i) => radius[i])), joined(tint, tint.constructor.from(owner, (i) => tint[i]))];
}

function joined(one, other) {
  const all = new one.constructor(one.length + other.length);
  all.set(one);
  all.set(other, one.length);
  return all;
}

/** As the server finds them: circles at (x(i), y(i)) metres that reach through the periodicities of a shape. */
export function copiesOf({ periodicities, radius }, x, y) {
  const owner = [], places = [];
  for (const [first, count, [lowX, lowY, periodX, periodY]] of periodicities) {
    for (let i = first; i < first + count; i++) {
      const dx = side(x(i), radius[i], lowX, periodX), dy = side(y(i), radius[i], lowY, periodY);
      const moves = dx && dy ? [[dx, 0], [0, dy], [dx, dy]] : dx || dy ? [[dx, dy]] : [];
      for (const [mx, my] of moves) {
        owner.push(i);
        places.push(x(i) + mx, y(i) + my);
      }
    }
  }
  return { owner, places };
}

/** Which way, and how far, a circle is to be moved that reaches over one of the two ends; else 0. */
function side(at, radius, low, period) {
  if (!period) return 0;
  return at - low < radius ? period : low + period - at < radius ? -period : 0;
}

/** The image of a difference that is nearest to 0. */
export const nearest = (difference, period) => (period ? difference - period * Math.round(difference / period) : difference);

const known = new WeakMap();

/** Periods in x and y of each of n circles, metres: (2n,), or null without a period. */
export function periods(periodicities, n) {
  if (!periodicities?.length) return null;
  if (known.get(periodicities)?.length !== 2 * n) {
    const all = new Float64Array(2 * n);
    for (const [first, count, [, , x, y]] of periodicities) for (let i = first; i < first + count; i++) [all[2 * i], all[2 * i + 1]] = [x, y];
    known.set(periodicities, all);
  }
  return known.get(periodicities);
}
