// A film on its own: the live page, fed from the blocks that came with it in place of a server.

import { mount } from "./page.js";
import { message, Reel } from "./reel.js";
import { tell } from "./text.js";

const JUMP_S = 1; // of the arrow keys
const ABSENT = { weightless: null, tool: null, copy: null, undo: null, redo: null }; // what is done to a world, or with a server
const FASTER = [2, 4, 8]; // times real time

/** Plays a reel: where it is, how fast it goes, and what it tells the page. */
class Player {
  constructor(reel, fps, onMessage, moved) {
    Object.assign(this, { reel, fps, onMessage, moved, at: 0, speed: 1, paused: false, part: null });
    this.shape = null; // number of the shape the page has
    this.sent = ""; // what is on the page
    this.seq = 0;
    this.busy = false; // a shape is being unpacked
    this.last = null;
  }

  get end() {
    return this.reel.length - 1;
  }

  go(at) {
    this.at = Math.min(Math.max(at, 0), this.end);
    this.show();
  }

  /** With each picture of the screen. */
  tick(now) {
    const passed = this.last === null ? 0 : Math.min(now - this.last, 250) / 1000;
    this.last = now;
    if (this.paused || this.waits) return this.show();
    this.at = Math.min(this.at + passed * this.speed * this.fps, this.end);
    if (this.at === this.end) this.paused = true;
    this.show();
  }

  play(on) {
    if (on && this.at === this.end) this.at = 0;
    this.paused = !on;
    this.show();
  }

  /** Where the film is, on the page; or as soon as it is unpacked. */
  show() {
    const k = Math.floor(this.at), again = () => this.show(), here = this.reel.find(k, again);
    this.waits = !here;
    const next = k < this.end ? this.reel.find(Math.min(k + 1, this.end), () => {}) : null;
    if (!here || this.busy) return;
    if (here.chunk.shape !== this.shape) {
      this.busy = true;
      this.reel.shape(here.chunk.shape).then((shape) => {
        this.busy = false;
        this.shape = here.chunk.shape;
        this.about = shape;
        this.sent = "";
        this.onMessage(shape);
        this.show();
      });
      return;
    }
    const share = this.paused ? 0 : this.at - k, fine = this.speed < 1 || this.fps < 50 ? Math.round(share * 16) / 16 : 0;
    const wish = [k, fine, this.part, this.paused, this.speed].join();
    this.moved(this);
    if (wish === this.sent) return;
    this.sent = wish;
    const frame = message(here, ++this.seq, this.part, next, fine, this.about);
    frame.status = { ...frame.status, paused: this.paused, speed: this.speed, pace: this.paused ? null : this.speed };
    this.onMessage(frame);
  }
}

/** Bring the film to life in `root`, which has the page's markup. */
function play(root) {
  const $ = (id) => root.querySelector(`#${id}`), reel = new Reel(), { fps, colour, theme } = root.dataset;
  root.classList.add("film");
  $("theme").value = theme;
  $("colour").value = colour;
  for (const times of FASTER) $("speed").prepend(new Option(`${times} ×`, times));
  $("speed").value = "1";
  root.querySelector("[name=tool][value=move]").checked = true;
  root.dataset.tool = "move";
  if (!reel.length || !window.DecompressionStream) {
    tell($("link").lastElementChild, reel.length ? "this browser is too old to unpack the film" : "the film is empty");
    return null;
  }

  let player = null;
  const moved = ({ at, end }) => {
    $("seek").max = end;
    $("seek").value = at;
    tell($("clock"), `${(at / fps).toFixed(1)} of ${(end / fps).toFixed(1)} s`);
  };
  const orders = {
    pause: ({ on }) => player.play(!on),
    step: () => ((player.paused = true), player.go(Math.floor(player.at) + 1)),
    reset: () => (player.go(0), player.play(true)),
    speed: ({ value }) => ((player.speed = value), player.show()),
    look: ({ part }) => ((player.part = part), player.show()),
  };
  const page = mount(root, ({ receive, state }) => {
    player = new Player(reel, Number(fps), receive, moved);
    state(true);
    return ({ type, ...fields }) => orders[type]?.(fields);
  }, { film: { ...ABSENT, turn: (key) => player.go(player.at + (key === "ArrowLeft" ? -1 : 1) * JUMP_S * fps) } });
  $("seek").addEventListener("input", () => player.go(Number($("seek").value)));
  const tick = (now) => {
    player.tick(now);
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
  root.focus();
  return { ...page, player };
}

window.pyverlet = play(document.getElementById("pyverlet"));
