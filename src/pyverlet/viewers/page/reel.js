// A film, as record/_reel.py wrote it: blocks in the page's own elements, unpacked when they are wanted.

import { copiesOf, nearest, periods } from "./copies.js";
import { GRID_MAX } from "./draw.js";
import { opened, unpack } from "./wire.js";

const KEPT = 4; // chunks that stay unpacked
const SHORT = 32767; // the largest of 16 bits with a sign

/** The blocks of a kind that are whole: a film that was cut short ends in one that is not. */
const blocks = (kind) => [...document.querySelectorAll(`script[type="application/x-pyverlet-${kind}"]`)].filter(({ dataset, textContent }) => Number(dataset.size) === textContent.length);

async function content(element) {
  const text = atob(element.textContent), bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
}

/** Frames by their number, from 0 to `length` - 1. */
export class Reel {
  constructor() {
    this.elements = blocks("chunk");
    this.firsts = this.elements.map(({ dataset }) => Number(dataset.first));
    this.length = this.elements.length ? this.firsts.at(-1) + Number(this.elements.at(-1).dataset.count) : 0;
    this.shapes = new Map(blocks("shape").map((element) => [Number(element.dataset.id), element]));
    this.open = new Map(); // chunks that are unpacked, or about to be, the last used last
  }

  /** The shape of this number, as the live page gets it. */
  async shape(id) {
    return unpack(await content(this.shapes.get(id)));
  }

  /** {chunk, row} of frame k once it is unpacked; until then null, and `then` is called when it is. */
  find(k, then) {
    const at = this.firsts.findLastIndex((first) => first <= k), known = this.open.get(at);
    if (!known) {
      const entry = { chunk: null };
      this.open.set(at, entry);
      while (this.open.size > KEPT) this.open.delete(this.open.keys().next().value);
      content(this.elements[at]).then((data) => {
        entry.chunk = chunk(data, Number(this.elements[at].dataset.count), Number(this.elements[at].dataset.shape));
        then();
      });
      return null;
    }
    this.open.delete(at);
    this.open.set(at, known);
    return known.chunk && { chunk: known.chunk, row: k - this.firsts[at] };
  }
}

/** Undo what `Reel._chunk` did: positions in steps of the grid, velocities in units. */
function chunk(data, count, shape) {
  const { head, take, left } = opened(data);
  for (const frame of head.frames) frame.pairs = frame.joined ? take(Uint32Array, 2 * frame.links) : null;
  head.frames.forEach((frame, k) => (frame.pairs ??= head.frames[k - 1].pairs));
  for (const frame of head.frames) frame.strain = take(Uint8Array, frame.links);
  const [places, ways] = head.planes, n = left() / (2 * count * (places + ways));
  const bend = unfold(take(Uint8Array, 2 * places * count * n), places, count * n);
  const turn = unfold(take(Uint8Array, 2 * ways * count * n), ways, count * n);
  const position = new Int32Array(2 * count * n), velocity = new Int32Array(2 * count * n);
  for (let axis = 0; axis < 2; axis++) {
    for (let i = 0; i < n; i++) {
      let place = 0, way = 0;
      for (let f = 0; f < count; f++) {
        const from = axis * count * n + f * n + i, to = 2 * (f * n + i) + axis;
        way = f < 2 ? bend[from] : way + bend[from];
        place += way;
        position[to] = place;
        velocity[to] = turn[from] + (f ? head.ratio * way : 0);
      }
    }
  }
  return { ...head, shape, count, n, position, velocity };
}

/** Numbers of either sign from the planes of their bytes, the lowest first, x and y apart. */
function unfold(bytes, planes, size) {
  const values = new Int32Array(2 * size);
  for (let axis = 0; axis < 2; axis++) {
    for (let plane = 0; plane < planes; plane++) {
      const from = (axis * planes + plane) * size, to = axis * size;
      for (let i = 0; i < size; i++) values[to + i] |= bytes[from + i] << (8 * plane);
    }
  }
  for (let i = 0; i < values.length; i++) values[i] = (values[i] >>> 1) ^ -(values[i] & 1);
  return values;
}

/**
 * A frame message, as the live page gets it. part: of the plane, or null. after: {chunk, row} of the next frame and share: how much
 * of the way there, for what is between two frames. shape: of these circles.
 */
export function message({ chunk, row }, seq, part, after, share, shape) {
  const { n, step, unit } = chunk, head = chunk.frames[row], [x0, y0, x1, y1] = part ?? head.room;
  const between = after?.chunk.n === n && after.chunk.shape === chunk.shape ? share : 0;
  const now = chunk.position.subarray(2 * row * n, 2 * (row + 1) * n);
  const next = between ? after.chunk.position.subarray(2 * after.row * n, 2 * (after.row + 1) * n) : now;
  const grid = new Uint16Array(2 * n), low = [x0, y0], scale = [GRID_MAX / (x1 - x0), GRID_MAX / (y1 - y0)];
  const period = periods(shape?.periodicities, n), metres = (i) => (now[i] + between * nearest(next[i] - now[i], period?.[i] / step)) * step;
  const onGrid = (value, axis) => Math.min(Math.max(Math.round((value - low[axis]) * scale[axis]), 0), GRID_MAX);
  for (let i = 0; i < 2 * n; i++) grid[i] = onGrid(metres(i), i & 1);
  const { owner, places } = period ? copiesOf(shape, (i) => metres(2 * i), (i) => metres(2 * i + 1)) : { owner: [] };
  const copies = owner.length ? { owner: Uint32Array.from(owner), places: Uint16Array.from(places, (value, k) => onGrid(value, k & 1)) } : null;
  let most = 1;
  const units = chunk.velocity.subarray(2 * row * n, 2 * (row + 1) * n);
  for (const value of units) most = Math.max(most, Math.abs(value));
  const coarse = Math.ceil(most / SHORT), velocity = Int16Array.from(units, (value) => value / coarse);
  const time = head.status.time + between * (between && after.chunk.frames[after.row].status.time - head.status.time);
  return {
    kind: "frame", seq, view: part ?? head.room, room: head.room, obstacles: head.obstacles, drawing: head.drawing, status: { ...head.status, time },
    grid, copies, velocity, unit: unit * coarse, links: head.links, joined: head.pairs, strain: head.strain,
  };
}
