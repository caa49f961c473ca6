// What a circle's colour says. Palettes run through OKLCH, as those of picture/colour.py do.

const STEPS = 64; // colours along a palette
const TONES = 4; // neighbours of one colour differ a little in lightness, so that each circle can be told
const USUAL_MULTIPLE = 3; // the end of the palette, in terms of what is usual
const GOLDEN = (Math.sqrt(5) - 1) / 2;
const FOLLOW_S = 1 / 3; // seconds of the world over which the scale follows what is usual: no flicker

/** Colours as 0xBBGGRR: STEPS along a path through OKLCH, each in TONES shades. */
function palette(heat, dark) {
  const lut = new Uint32Array(STEPS * TONES);
  for (let step = 0; step < STEPS; step++) {
    const t = step / (STEPS - 1);
    let [light, chroma, hue] = [dark ? 0.74 : 0.68, 0.135, 25 + 300 * t];
    if (heat) [light, chroma, hue] = dark ? [0.5 + 0.4 * t, 0.12 + 0.03 * t, 275 - 185 * t] : [0.8 - 0.28 * t, 0.1 + 0.08 * t, 250 + 120 * t];
    for (let tone = 0; tone < TONES; tone++) lut[step * TONES + tone] = oklch(light + 0.035 * (tone - (TONES - 1) / 2), chroma, hue);
  }
  return lut;
}

/** `count` colours of the palette from cold to hot, for CSS. */
export function heat(count, dark) {
  const lut = palette(true, dark), css = [];
  for (let k = 0; k < count; k++) {
    const bgr = lut[Math.round((k * (STEPS - 1)) / (count - 1)) * TONES];
    css.push(`rgb(${bgr & 255} ${(bgr >> 8) & 255} ${bgr >> 16})`);
  }
  return css;
}

const shade = (step, i) => step * TONES + ((Math.imul(i, 0x9e3779b1) >>> 16) & (TONES - 1));

export function oklch(l, c, degrees) {
  const a = c * Math.cos((degrees * Math.PI) / 180), b = c * Math.sin((degrees * Math.PI) / 180);
  const [L, M, S] = [l + 0.3963377774 * a + 0.2158037573 * b, l - 0.1055613458 * a - 0.0638541728 * b, l - 0.0894841775 * a - 1.291485548 * b].map((v) => v ** 3);
  const linear = [4.0767416621 * L - 3.3077115913 * M + 0.2309699292 * S, -1.2684380046 * L + 2.6097574011 * M - 0.3413193965 * S, -0.0041960863 * L - 0.7034186147 * M + 1.707614701 * S];
  const [r, g, blue] = linear.map((v) => Math.round(255 * Math.min(1, Math.max(0, v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055))));
  return r | (g << 8) | (blue << 16);
}

/** Whether this colouring looks at velocities. */
export const isLively = (colouring) => colouring === "speed" || colouring === "energy";

/** The colours of all circles, kept up to date: `tint`, n numbers 0xBBGGRR. */
export class Tints {
  constructor() {
    this.tint = new Uint32Array(0);
  }

  /** Colours that stay: after a new shape, another colouring or another theme. `within(i)`: [its number among those alike, how many these are]. */
  begin(colouring, shape, within, dark) {
    const { radius, mass, rgb } = shape, n = radius.length;
    this.colouring = colouring === "picture" && !rgb ? "order" : colouring;
    if (this.tint.length !== n) this.tint = new Uint32Array(n);
    this.lut = palette(this.colouring !== "order" && this.colouring !== "group", dark);
    this.mass = mass;
    this.usual = 0;
    this.time = -Infinity;
    const tint = this.tint;
    if (this.colouring === "picture") {
      for (let i = 0; i < n; i++) tint[i] = rgb[3 * i] | (rgb[3 * i + 1] << 8) | (rgb[3 * i + 2] << 16);
    } else if (this.colouring === "mass") {
      this.#byMass();
    } else if (this.colouring === "group") {
      this.#byGroup(shape.groups);
    } else {
      for (let i = 0; i < n; i++) {
        const [own, count] = within(i);
        tint[i] = this.lut[shade(this.colouring === "order" ? Math.floor((own * STEPS) / count) : 0, own)];
      }
    }
  }

  /** Steps of the golden ratio: however many groups there are, or come later, each is far from those before it. */
  #byGroup(groups) {
    let i = 0;
    for (const [number, count] of groups) {
      const step = Math.floor(((number * GOLDEN) % 1) * STEPS);
      for (const end = i + count; i < end; i++) this.tint[i] = this.lut[shade(step, i)];
    }
  }

  /** From light to heavy, over equal ratios; pinned circles stand at the end. */
  #byMass() {
    const logarithm = Float32Array.from(this.mass, Math.log);
    let low = Infinity, high = -Infinity;
    for (const value of logarithm) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
    const scale = high > low ? (STEPS - 1) / (high - low) : 0;
    for (let i = 0; i < logarithm.length; i++) this.tint[i] = this.lut[shade(scale ? Math.min((logarithm[i] - low) * scale, STEPS - 1) | 0 : 0, i)];
  }

  /** By what each circle is pushed with, of all it touches; a frame without forces leaves the colours as they are. */
  byForce({ touching, pushes }) {
    if (this.colouring !== "force" || !pushes?.length) return;
    const { tint, lut } = this, load = new Float32Array(tint.length);
    for (let k = 0; k < pushes.length; k++) {
      load[touching[2 * k]] += pushes[k];
      if (touching[2 * k] !== touching[2 * k + 1]) load[touching[2 * k + 1]] += pushes[k];
    }
    let sum = 0;
    for (const value of load) sum += value;
    const full = (STEPS - 1) / (USUAL_MULTIPLE * (sum / tint.length) || Infinity);
    for (let i = 0; i < tint.length; i++) tint[i] = lut[shade(Math.min(STEPS - 1, (load[i] * full) | 0), i)];
  }

  /** Colours that change with every frame: (n, 2) velocities in whole `unit` m/s, at this time in s. */
  follow(velocity, unit, time) {
    if (!isLively(this.colouring) || !velocity) return;
    const { tint, lut, mass } = this, n = tint.length, energies = this.colouring === "energy", unit2 = unit * unit;
    const full = (STEPS - 1) / (USUAL_MULTIPLE * this.usual || Infinity);
    let sum = 0;
    for (let i = 0; i < n; i++) {
      const u = velocity[2 * i], v = velocity[2 * i + 1], square = (u * u + v * v) * unit2;
      const amount = energies ? (mass[i] === Infinity ? 0 : 0.5 * mass[i] * square) : Math.sqrt(square);
      sum += amount;
      tint[i] = lut[shade(Math.min(STEPS - 1, (amount * full) | 0), i)];
    }
    const passed = time - this.time, mean = sum / Math.max(n, 1), first = this.usual === 0;
    this.usual += (mean - this.usual) * (passed >= 0 ? 1 - Math.exp(-passed / FOLLOW_S) : 1);
    this.time = time;
    if (first && this.usual > 0) this.follow(velocity, unit, time); // the first picture has its scale at once
  }
}
