// The page in a cell of a notebook, as anywidget shows it. STYLE and MARKUP come with it, see bundle.py.
// Nothing runs in the kernel unless asked: each message of the page makes the world catch up and is answered with what is new.

import { mount } from "./page.js";

const IDLE_MS = 40; // between questions while nothing changes

/** Show the world of a widget in `el`. */
function render({ model, el }) {
  const host = document.createElement("div");
  const shadow = host.attachShadow({ mode: "open" }); // the notebook's styles stay out, ours stay in
  shadow.innerHTML = `<style>${STYLE}</style>${MARKUP}`;
  const root = shadow.querySelector("#pyverlet");
  root.style.height = `${model.get("height")}px`;
  root.style.borderRadius = "8px";
  el.append(host);

  const view = Math.random().toString(36).slice(2); // the same widget may be on show twice
  let waiting = false, words = [], deaf = false, timer = 0;
  let heard = () => {};

  const ask = () => {
    if (waiting || deaf) return;
    waiting = true;
    model.send({ view, words });
    words = [];
  };
  const answered = (content, buffers) => {
    if (content.view !== view) return;
    waiting = false;
    for (const { buffer, byteOffset, byteLength } of buffers) heard(buffer.slice(byteOffset, byteOffset + byteLength));
    clearTimeout(timer);
    if (buffers.length || words.length) requestAnimationFrame(ask);
    else timer = setTimeout(() => requestAnimationFrame(ask), IDLE_MS);
  };

  const page = mount(root, ({ receive, state }) => {
    heard = receive;
    model.on("msg:custom", answered);
    state(true);
    requestAnimationFrame(ask);
    return (message) => {
      words.push(JSON.stringify(message));
      if (!waiting) requestAnimationFrame(ask);
    };
  });
  host.pyverlet = page; // for the console and the tests
  return () => {
    deaf = true;
    page.stop();
    model.off("msg:custom", answered);
    model.send({ view, gone: true });
  };
}

export default { render };
