// A still picture and a film of what is on the page, made here and saved as files; nothing leaves the machine.

import { make } from "./text.js";

const FILMS = ["video/webm;codecs=vp8", "video/webm", "video/mp4"]; // the first that the browser can write; quick to encode comes first
const BITS = 8_000_000; // a second

export class Capture {
  /** `compose(context, width, height, ratio)` paints the page's picture at once. */
  constructor(button, compose) {
    this.button = button;
    this.compose = compose;
    this.recorder = null;
    this.kind = window.MediaRecorder && HTMLCanvasElement.prototype.captureStream ? FILMS.find((kind) => MediaRecorder.isTypeSupported(kind)) : undefined;
    button.hidden = !this.kind;
    this.bytes = 0; // of the film so far
    this.last = null; // {name, size} of the file saved last
  }

  /** Save what is on show as a PNG. */
  still(title, size, ratio) {
    const canvas = this.#canvas(size, ratio);
    this.compose(canvas.getContext("2d"), size, ratio);
    return new Promise((done) => canvas.toBlob((blob) => done(this.#save(blob, `${title}.png`)), "image/png"));
  }

  /** Begin a film, or end it and save it. */
  film(title, size, ratio) {
    if (this.recorder) return this.recorder.stop();
    const canvas = this.#canvas(size, ratio), parts = [];
    const recorder = new MediaRecorder(canvas.captureStream(60), { mimeType: this.kind, videoBitsPerSecond: BITS });
    Object.assign(this, { recorder, canvas, size, ratio });
    this.bytes = 0;
    recorder.ondataavailable = ({ data }) => (parts.push(data), (this.bytes += data.size));
    recorder.onstop = () => {
      this.recorder = null;
      this.#label();
      this.#save(new Blob(parts, { type: this.kind }), `${title}.${this.kind.includes("mp4") ? "mp4" : "webm"}`);
    };
    this.frame();
    recorder.start(500);
    this.#label();
  }

  /** The picture has changed. */
  frame() {
    if (this.recorder) this.compose(this.canvas.getContext("2d"), this.size, this.ratio);
  }

  #label() {
    this.button.textContent = this.recorder ? "Stop" : "Film";
    this.button.setAttribute("aria-pressed", String(Boolean(this.recorder)));
  }

  #canvas({ width, height }, ratio) {
    const even = (value) => Math.max(2, 2 * Math.round((value * ratio) / 2)); // what encoders want
    return make("canvas", { width: even(width), height: even(height) });
  }

  #save(blob, name) {
    const link = make("a", { href: URL.createObjectURL(blob), download: name.replace(/[^\w.-]+/g, "-") });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
    this.last = { name: link.download, size: blob.size };
  }
}
