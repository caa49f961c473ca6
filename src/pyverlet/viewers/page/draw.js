// Draws circles: WebGL2 points where hardware serves them, otherwise a raster of our own into an ImageData.
// Measured in headless Chromium without a GPU, 640 x 640 pixels: raster 2 ms at 20,000 circles and 6 ms at 100,000;
// cached sprites through drawImage 15 and 300 ms; software WebGL worse still.

export const GRID_MAX = 65535; // see frames.py: 0 and GRID_MAX mean outside the view
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

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

/** Canvas2D: rows of pixels written straight into an ImageData, edges anti-aliased by coverage. */
class Raster {
  name = "canvas";

  constructor(context) {
    this.context = context;
  }

  resize(width, height) {
    this.image = this.context.createImageData(width, height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.discs = new DiscCache(width);
  }

  /** grid: 2n of 16 bits; radius: n in pixels; tint: n of 0xBBGGRR. */
  draw(grid, radius, tint) {
    const { width, height } = this.image;
    const pixels = this.pixels.fill(0);
    const sx = width / GRID_MAX, sy = height / GRID_MAX;
    for (let i = 0; i < radius.length; i++) {
      const u = grid[2 * i], v = grid[2 * i + 1];
      if (u === 0 || v === 0 || u === GRID_MAX || v === GRID_MAX) continue;
      // A circle thinner than a pixel is drawn a pixel wide, else it would flicker.
      const x = u * sx - 0.5, y = height - v * sy - 0.5, r = radius[i] > 0.5 ? radius[i] : 0.5;
      const reach = r + 2; // of its stamp, and a little more
      if (r > SMALL || x < reach || y < reach || x >= width - reach - 1 || y >= height - reach - 1) circle(pixels, width, height, x, y, r, tint[i]);
      else this.discs.put(pixels, x, y, r, tint[i]);
    }
    this.context.putImageData(this.image, 0, 0);
  }
}

const SMALL = 6; // radius in pixels up to which circles are stamped
const FINE = 16; // places within a pixel, and radii within one, that are told apart

/** Small circles, worked out beforehand: which pixels each covers, and how much of them. Half the time of `circle`. */
class DiscCache {
  constructor(width) {
    this.width = width;
    this.made = []; // by radius, for each place of the centre within its pixel: where its pixels begin in the two lists
  }

  put(pixels, x, y, r, colour) {
    const step = (r * FINE + 0.5) | 0, left = x | 0, top = y | 0;
    const { first, rim, offset, cover } = (this.made[step] ??= this.#make(step / FINE));
    const place = (((y - top) * FINE) | 0) * FINE + (((x - left) * FINE) | 0), at = top * this.width + left;
    const solid = colour | 0xff000000, inner = rim[place], end = first[place + 1];
    let k = first[place];
    for (; k < inner; k++) pixels[at + offset[k]] = solid;
    for (; k < end; k++) blend(pixels, at + offset[k], colour, cover[k]);
  }

  #make(radius) {
    const first = new Int32Array(FINE * FINE + 1), rim = new Int32Array(FINE * FINE), offset = [], cover = [];
    const reach = Math.ceil(radius + 0.5);
    for (let place = 0; place < FINE * FINE; place++) {
      const cx = ((place % FINE) + 0.5) / FINE, cy = (Math.floor(place / FINE) + 0.5) / FINE, parts = [];
      for (let y = -reach; y <= reach + 1; y++) {
        for (let x = -reach; x <= reach + 1; x++) {
          const part = Math.min(255, (255 * (radius + 0.5 - Math.hypot(x - cx, y - cy))) | 0);
          if (part === 255) offset.push(y * this.width + x), cover.push(part);
          else if (part > 0) parts.push([y * this.width + x, part]);
        }
      }
      rim[place] = offset.length; // the pixels wholly inside come first, then those of the rim
      for (const [at, part] of parts) offset.push(at), cover.push(part);
      first[place + 1] = offset.length;
    }
    return { first, rim, offset: Int32Array.from(offset), cover: Uint8Array.from(cover) };
  }
}

/** Cover a part of a pixel, of 255, with a colour. */
function blend(pixels, at, colour, cover) {
  const under = pixels[at], alpha = under >>> 24;
  if (alpha === 0 || cover === 255) {
    pixels[at] = colour | (cover << 24);
    return;
  }
  // Two touching rims share a pixel: mix their colours by coverage and add the coverages up.
  const share = ((cover * 256) / (cover + alpha + 1)) | 0;
  const rb = under & 0xff00ff, g = under & 0x00ff00;
  const mixed = ((rb + ((((colour & 0xff00ff) - rb) * share) >> 8)) & 0xff00ff) | ((g + ((((colour & 0x00ff00) - g) * share) >> 8)) & 0x00ff00);
  pixels[at] = mixed | (Math.min(255, alpha + cover) << 24);
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
      blend(pixels, row + x, colour, Math.min(255, (255 * (outer - Math.sqrt((x - cx) * (x - cx) + dy2))) | 0));
    }
  }
}

const VERTEX = `#version 300 es
in vec2 place; in float radius; in vec4 tint;
out vec3 colour; out float reach;
void main() {
  bool outside = any(equal(place, vec2(0.0))) || any(equal(place, vec2(1.0)));
  gl_Position = outside ? vec4(2.0, 2.0, 0.0, 1.0) : vec4(place * 2.0 - 1.0, 0.0, 1.0);
  reach = max(radius, 0.5);
  gl_PointSize = 2.0 * reach + 2.0;
  colour = tint.rgb;
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
      tint: this.#attribute(program, "tint", 4, gl.UNSIGNED_BYTE, true),
    };
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

  draw(grid, radius, tint) {
    const gl = this.gl;
    for (const [name, array] of [["place", grid], ["radius", radius], ["tint", tint]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.attributes[name]);
      gl.bufferData(gl.ARRAY_BUFFER, array, gl.STREAM_DRAW);
    }
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArrays(gl.POINTS, 0, radius.length);
  }
}
