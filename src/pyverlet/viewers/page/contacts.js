// Which circles touch, found here from where they are: an overlay costs the physics nothing.

const TOUCH = 0.004; // of the contact distance: circles at rest are that near, and the 16-bit grid is no finer

/** Pairs [i0, j0, i1, j1, ...] of circles that touch; x, y, r in one unit, NaN where a circle is out of sight. */
export function touching(x, y, r) {
  const order = Uint32Array.from(r, (_, i) => i).filter((i) => x[i] === x[i]);
  const left = Float64Array.from(r, (radius, i) => x[i] - radius * (1 + TOUCH));
  order.sort((a, b) => left[a] - left[b]);
  const pairs = [];
  for (let a = 0; a < order.length; a++) {
    const i = order[a], right = x[i] + r[i] * (1 + TOUCH);
    for (let b = a + 1; b < order.length && left[order[b]] <= right; b++) {
      const j = order[b], dx = x[i] - x[j], dy = y[i] - y[j], reach = (r[i] + r[j]) * (1 + TOUCH);
      if (dx * dx + dy * dy <= reach * reach) pairs.push(i, j);
    }
  }
  return pairs;
}
