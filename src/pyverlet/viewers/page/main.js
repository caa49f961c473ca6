// The page on its own: the element it lives in, and a WebSocket that comes back when the server does.

import { mount } from "./page.js";

const RETRY_MS = 1000;

/** Calls `receive(buffer)` with each message and `state(open)` as the connection comes and goes; returns what sends. */
function connect({ receive, state }) {
  let socket = null;
  const open = () => {
    socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => state(true);
    socket.onmessage = ({ data }) => receive(data);
    socket.onclose = () => {
      state(false);
      setTimeout(open, RETRY_MS);
    };
  };
  open();
  return (message) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
}

const page = mount(document.getElementById("pyverlet"), connect, { address: location, renderer: new URLSearchParams(location.search).get("renderer") ?? "auto" });

/** For the console and the tests. */
window.pyverlet = page;
