// Which circles touch, found here from where they are and which categories collide: an overlay costs the physics nothing.

const TOUCH = 0.004; // of the contact distance: circles at rest are that near, and the 16-bit grid is no finer

const apartOf = new WeakMap();

/** Whether two circles of a shape collide at all: neither links nor categories keep them from it, nor are both pinned. */
function collide({ mass, apart, kinds, count }, i, j) {
  if (mass[i] === Infinity && mass[j] === Infinity) return false;
  if (kinds && !((kinds[2 * i] & kinds[2 * j + 1]) && (kinds[2 * j] & kinds[2 * i + 1]))) return false;
  if (!apart.length) return true;
  if (!apartOf.has(apart)) {
    const pairs = new Set();
    for (let k = 0; k < apart.length; k += 2) pairs.add(apart[k] * count + apart[k + 1]);
    apartOf.set(apart, pairs);
  }
  return !apartOf.get(apart).has(Math.min(i, j) * count + Math.max(i, j));
}

/** Pairs [i0, j0, i1, j1, ...] of circles of a shape that touch; x, y, r in one unit, NaN where a circle is out of sight. */
export function touching(shape, x, y, r) {
  const order = Uint32Array.from(r, (_, i) => i).filter((i) => x[i] === x[i]);
  const left = Float64Array.from(r, (radius, i) => x[i] - radius * (1 + TOUCH));
  order.sort((a, b) => left[a] - left[b]);
  const pairs = [];
  for (let a = 0; a < order.length; a++) {
    const i = order[a], right = x[i] + r[i] * (1 + TOUCH);
    for (let b = a + 1; b < order.length && left[order[b]] <= right; b++) {
      const j = order[b], dx = x[i] - x[j], dy = y[i] - y[j], reach = (r[i] + r[j]) * (1 + TOUCH);
      if (dx * dx + dy * dy <= reach * reach && collide(shape, i, j)) pairs.push(i, j);
    }
  }
  return pairs;
}
