// The circles on their two canvases: drawn here, or as the server's pictures.

import { withCopies } from "./copies.js";
import { makeRenderer } from "./draw.js";
import { setBox, setPixels } from "./text.js";

export class Circles {
  constructor(stage, photo, wanted) {
    this.stage = stage;
    this.photo = photo;
    this.renderer = makeRenderer(stage, wanted);
    this.photographs = photo.getContext("bitmaprenderer");
    this.radius = new Float32Array(0); // in pixels of the stage
    this.radiusFor = 0; // at how many pixels a metre
    this.placed = "";
  }

  /** A new shape: other radii. `photos`: whether the server draws. */
  forget(photos) {
    this.radiusFor = 0;
    this.stage.hidden = photos;
    this.photo.hidden = !photos;
  }

  /** Draw a frame, onto a canvas just as large as the part of the world that it shows. */
  draw(frame, shape, camera, ratio, tint) {
    if (frame.bitmap) {
      const { width, height } = frame.bitmap;
      setPixels(this.photo, width, height);
      if (width) this.photographs.transferFromImageBitmap(frame.bitmap);
      return;
    }
    if (!frame.grid || frame.grid.length !== 2 * shape.radius.length) return;
    const { width, height } = camera.place(frame.view), { stage, renderer } = this;
    const [across, down] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
    if (setPixels(stage, across, down) || !renderer.ready) {
      renderer.resize(across, down);
      renderer.ready = true;
    }
    const pixels = camera.scale * ratio;
    if (this.radiusFor !== pixels) {
      this.radiusFor = pixels;
      this.radius = shape.radius.map((metres) => metres * pixels);
    }
    renderer.draw(...withCopies(frame, this.radius, tint));
  }

  /** Bring the canvases to their place on the page, CSS pixels. */
  place(place) {
    const there = Object.values(place).join();
    if (there === this.placed) return; // what did not change costs nothing: this runs with every frame
    this.placed = there;
    for (const canvas of [this.stage, this.photo]) setBox(canvas, place);
  }
}
