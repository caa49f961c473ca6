// Draws circles: WebGL2 points where hardware serves them, otherwise a raster of our own into an ImageData.
// Measured in headless Chromium without a GPU, 700 x 700 pixels: raster 2 ms at 5,000 circles and 7 ms at 100,000;
// cached sprites through drawImage 15 and 300 ms; software WebGL worse still.

const GRID_MAX = 65535; // see frames.py: 0 and GRID_MAX mean outside the view
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
const TONES = 4; // neighbours of one colour differ a little in lightness, so that each circle can be told
export const STEPS = 64; // colours along a palette

/** A renderer for `canvas`: "auto", "webgl2" or "canvas". */
export function makeRenderer(canvas, wanted = "auto") {
  if (wanted === "webgl2" || (wanted === "auto" && hardwareName())) {
    const gl = canvas.getContext("webgl2", { alpha: true, antialias: false, premultipliedAlpha: true });
    if (gl) return new Points(gl);
  }
  return new Raster(canvas.getContext("2d"));
}

/** Name of the graphics hardware behind WebGL2, or "" where there is none or only software that imitates it. */
export function hardwareName() {
  const gl = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
  if (!gl) return "";
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name) ? "" : name;
}

/** 256 colours as 0xBBGGRR: STEPS along a path through OKLCH, each in TONES shades. */
export function palette(kind, dark) {
  const lut = new Uint32Array(STEPS * TONES);
  for (let step = 0; step < STEPS; step++) {
    const t = step / (STEPS - 1);
    let [light, chroma, hue] = [dark ? 0.74 : 0.68, 0.135, 25 + 300 * t];
    if (kind === "speed") [light, chroma, hue] = dark ? [0.5 + 0.4 * t, 0.12 + 0.03 * t, 275 - 185 * t] : [0.8 - 0.28 * t, 0.1 + 0.08 * t, 250 + 120 * t];
    for (let tone = 0; tone < TONES; tone++) lut[step * TONES + tone] = oklch(light + 0.035 * (tone - (TONES - 1) / 2), chroma, hue);
  }
  return lut;
}

/** The palette index of step `step` for particle `i`. */
export const shade = (step, i) => step * TONES + ((Math.imul(i, 0x9e3779b1) >>> 16) & (TONES - 1));

function oklch(l, c, degrees) {
  const a = c * Math.cos((degrees * Math.PI) / 180), b = c * Math.sin((degrees * Math.PI) / 180);
  const [L, M, S] = [l + 0.3963377774 * a + 0.2158037573 * b, l - 0.1055613458 * a - 0.0638541728 * b, l - 0.0894841775 * a - 1.291485548 * b].map((v) => v ** 3);
  const linear = [4.0767416621 * L - 3.3077115913 * M + 0.2309699292 * S, -1.2684380046 * L + 2.6097574011 * M - 0.3413193965 * S, -0.0041960863 * L - 0.7034186147 * M + 1.707614701 * S];
  const [r, g, blue] = linear.map((v) => Math.round(255 * Math.min(1, Math.max(0, v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055))));
  return r | (g << 8) | (blue << 16);
}

/** Canvas2D: rows of pixels written straight into an ImageData, edges anti-aliased by coverage. */
class Raster {
  name = "canvas";

  constructor(context) {
    this.context = context;
  }

  resize(width, height) {
    this.image = this.context.createImageData(width, height);
    this.pixels = new Uint32Array(this.image.data.buffer);
  }

  /** grid: 2n of 16 bits; radius: n in pixels; index: n of 8 bits into lut. */
  draw(grid, radius, index, lut) {
    const { width, height } = this.image;
    const pixels = this.pixels.fill(0);
    const sx = width / GRID_MAX, sy = height / GRID_MAX;
    for (let i = 0; i < radius.length; i++) {
      const u = grid[2 * i], v = grid[2 * i + 1];
      if (u === 0 || v === 0 || u === GRID_MAX || v === GRID_MAX) continue;
      // A circle thinner than a pixel is drawn a pixel wide, else it would flicker.
      circle(pixels, width, height, u * sx - 0.5, height - v * sy - 0.5, Math.max(radius[i], 0.5), lut[index[i]]);
    }
    this.context.putImageData(this.image, 0, 0);
  }
}

function circle(pixels, width, height, cx, cy, radius, colour) {
  const outer = radius + 0.5, inner = radius - 0.5;
  const outer2 = outer * outer, inner2 = inner * inner;
  const solid = colour | 0xff000000;
  const top = Math.max(0, Math.ceil(cy - outer)), bottom = Math.min(height - 1, Math.floor(cy + outer));
  for (let y = top; y <= bottom; y++) {
    const dy2 = (y - cy) * (y - cy);
    const half = Math.sqrt(outer2 - dy2);
    const left = Math.max(0, Math.ceil(cx - half)), right = Math.min(width - 1, Math.floor(cx + half));
    const row = y * width;
    let from = right + 1, to = right; // the run of pixels wholly inside, if there is one
    if (dy2 < inner2) {
      const core = Math.sqrt(inner2 - dy2);
      const first = Math.max(left, Math.ceil(cx - core)), last = Math.min(right, Math.floor(cx + core));
      if (first <= last) [from, to] = [first, last];
      for (let x = first; x <= last; x++) pixels[row + x] = solid;
    }
    for (let x = left; x <= right; x++) {
      if (x === from) x = to + 1;
      if (x > right) break;
      const at = row + x;
      const cover = Math.min(255, (255 * (outer - Math.sqrt((x - cx) * (x - cx) + dy2))) | 0);
      const under = pixels[at];
      const alpha = under >>> 24;
      if (alpha === 0) {
        pixels[at] = colour | (cover << 24);
      } else {
        // Two touching rims share a pixel: mix their colours by coverage and add the coverages up.
        const share = ((cover * 256) / (cover + alpha + 1)) | 0;
        const rb = under & 0xff00ff, g = under & 0x00ff00;
        const mixed = ((rb + ((((colour & 0xff00ff) - rb) * share) >> 8)) & 0xff00ff) | ((g + ((((colour & 0x00ff00) - g) * share) >> 8)) & 0x00ff00);
        pixels[at] = mixed | (Math.min(255, alpha + cover) << 24);
      }
    }
  }
}

const VERTEX = `#version 300 es
in vec2 place; in float radius; in float index;
uniform vec2 size; uniform sampler2D lut;
out vec3 colour; out float reach;
void main() {
  bool outside = any(equal(place, vec2(0.0))) || any(equal(place, vec2(1.0)));
  gl_Position = outside ? vec4(2.0, 2.0, 0.0, 1.0) : vec4(place * 2.0 - 1.0, 0.0, 1.0);
  reach = max(radius, 0.5);
  gl_PointSize = 2.0 * reach + 2.0;
  colour = texture(lut, vec2((index + 0.5) / 256.0, 0.5)).rgb;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 colour; in float reach; out vec4 pixel;
void main() {
  float distance = length(gl_PointCoord - 0.5) * (2.0 * reach + 2.0);
  float cover = clamp(reach + 0.5 - distance, 0.0, 1.0);
  if (cover <= 0.0) discard;
  pixel = vec4(colour * cover, cover);
}`;

/** WebGL2: one point a circle. */
class Points {
  name = "webgl2";

  constructor(gl) {
    this.gl = gl;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    this.attributes = {
      place: this.#attribute(program, "place", 2, gl.UNSIGNED_SHORT, true),
      radius: this.#attribute(program, "radius", 1, gl.FLOAT, false),
      index: this.#attribute(program, "index", 1, gl.UNSIGNED_BYTE, false),
    };
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  #attribute(program, name, count, type, normalized) {
    const gl = this.gl, buffer = gl.createBuffer(), where = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, count, type, normalized, 0, 0);
    return buffer;
  }

  resize(width, height) {
    this.gl.viewport(0, 0, width, height);
  }

  draw(grid, radius, index, lut) {
    const gl = this.gl;
    for (const [name, array] of [["place", grid], ["radius", radius], ["index", index]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.attributes[name]);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STREAM_DRAW);
    }
    if (lut !== this.lut) {
      this.lut = lut;
      const rgba = new Uint8Array(new Uint32Array(lut).buffer);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, lut.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    }
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArrays(gl.POINTS, 0, radius.length);
  }
}
