"""How fast the live page is, and what it costs the physics: `python -m benchmarks page`.

A server as `pyverlet run` starts it and a Chromium without a screen, WebGL off, both on this machine's cores. A world starts
anew for every line and runs once unwatched and once with the page open, for the same time. A picture counts once it is drawn.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-3d-apis", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1000,700",
]  # fmt: skip

OPENING_S = 2.0
"""The page gets this long to be loaded and compiled."""

INPUTS = 12
"""How often gravity is turned to see when a picture says so."""

COUNT_ACKS = """{
    window.acks = [];
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (text) {
        if (text.startsWith('{"type":"ack"')) window.acks.push(performance.now());
        return send.call(this, text);
    };
}"""
"""The page acknowledges every picture it has drawn."""

TURN_GRAVITY = """(degrees) => new Promise((told) => {
    const slider = document.getElementById("angle"), began = performance.now(), before = window.pyverlet.status().gravity.join();
    slider.value = degrees;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    const watch = () => {
        if (window.pyverlet.status().gravity.join() === before) requestAnimationFrame(watch);
        else told(performance.now() - began);
    };
    requestAnimationFrame(watch);
})"""


class Served:
    """A scene on the air, in a process of its own."""

    def __init__(self, scene: str, particles: int) -> None:
        command = [sys.executable, "-m", "pyverlet", "run", scene, "--particles", str(particles), "--port", "0", "--no-open"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        found = None
        while not found:
            line = self.process.stdout.readline()
            if not line:
                raise RuntimeError("the server has not started")
            found = re.search(r"http://\S+", line)
        self.address = found[0]

    def ask(self, *messages: dict[str, Any]) -> dict[str, Any]:
        """Say this; the numbers of the newest picture."""
        from websockets.sync.client import connect

        with connect(self.address.replace("http", "ws") + "socket", max_size=None, compression=None) as socket:
            # A small picture costs next to nothing.
            look = {"type": "look", "part": None, "width": 16, "height": 16, "colour": "order", "dark": True, "velocity": False}
            for message in (look, *messages):
                socket.send(json.dumps(message))
            while True:
                data = socket.recv()
                assert isinstance(data, bytes)
                head: dict[str, Any] = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
                if head["kind"] in ("frame", "picture"):
                    status: dict[str, Any] = head["status"]
                    return status

    def start_anew(self) -> None:
        """Reset, and wait until it is done: a million circles first end their frame."""
        before = self.ask()["time"]
        self.ask({"type": "reset"})
        while before > 0.0 and self.ask()["time"] >= before:
            time.sleep(0.05)

    def end(self) -> None:
        """Ctrl-C."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(30)


class Tab:
    """The page, open in a browser of its own. Not through Playwright, which has the browser send it a copy of every message."""

    def __init__(self, address: str) -> None:
        from websockets.sync.client import connect

        found = os.environ.get("PYVERLET_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
        if found is None:
            sys.exit("no Chromium found; set PYVERLET_CHROMIUM to one")
        self._folder = tempfile.TemporaryDirectory()
        command = [found, *FLAGS, "--remote-debugging-port=0", f"--user-data-dir={self._folder.name}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = Path(self._folder.name) / "DevToolsActivePort"
        while not (port.exists() and port.read_text().count("\n")):
            time.sleep(0.05)
        where, path = port.read_text().split()
        self._socket = connect(f"ws://127.0.0.1:{where}{path}", max_size=None)
        self._said, self._session = 0, ""
        target = self._say("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._say("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self._say("Page.enable")
        self._say("Page.addScriptToEvaluateOnNewDocument", source=COUNT_ACKS)
        self._say("Page.navigate", url=address)
        while not self.evaluate("Boolean(window.pyverlet?.status?.())"):
            time.sleep(0.05)

    def _say(self, method: str, **parameters: Any) -> Any:
        self._said += 1
        session = {"sessionId": self._session} if self._session else {}
        self._socket.send(json.dumps({"id": self._said, "method": method, "params": parameters, **session}))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == self._said:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def evaluate(self, script: str) -> Any:
        """The value of a JavaScript expression, once a promise is kept."""
        result = self._say("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{script}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def picture(self) -> bytes:
        """A PNG of the window."""
        return base64.b64decode(self._say("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        """End the browser."""
        self._say("Browser.close")
        self._process.wait(30)
        self._socket.close()
        self._folder.cleanup()


def processor_ms(server: int) -> dict[str, float]:
    """Milliseconds of processor time so far of the server and, by kind, of the browser's processes. Linux only, else empty."""
    if sys.platform != "linux":
        return {}
    tick = 1000.0 / os.sysconf("SC_CLK_TCK")
    parent, spent, kinds = {}, {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            kinds[int(folder.name)] = (folder / "cmdline").read_text()
        except OSError:
            continue  # it has just ended
        parent[int(folder.name)] = int(fields[1])
        spent[int(folder.name)] = tick * (int(fields[11]) + int(fields[12]))
    total: dict[str, float] = {}
    for pid, ms in spent.items():
        above = pid
        while above > 1 and above != os.getpid():
            above = parent.get(above, 0)
        found = re.search(r"--type=([a-z]+)", kinds[pid])
        if pid == server:
            total["server"] = total.get("server", 0.0) + ms
        elif above == os.getpid() and pid != above and "chrom" in kinds[pid]:
            name = found[1] if found else "browser"
            total[name] = total.get(name, 0.0) + ms
    return total


def measure(scene: str, particles: int, seconds: float) -> None:
    """Print a few lines: unwatched and watched."""
    served = Served(scene, particles)
    try:
        time.sleep(1.0)
        print(f"{particles:>9,}  {'unwatched':<10}{passed(served, seconds)}")
        tab = Tab(served.address)
        try:
            time.sleep(OPENING_S)
            watch(served, tab, particles, seconds)
        finally:
            tab.close()
    finally:
        served.end()


def passed(served: Served, seconds: float) -> str:
    """A world starts anew and runs for so long."""
    served.start_anew()
    time.sleep(seconds / 4)
    began, before = time.perf_counter(), served.ask()
    spent = processor_ms(served.process.pid)
    time.sleep(seconds)
    after, ended = served.ask(), time.perf_counter()
    server = processor_ms(served.process.pid).get("server", 0.0) - spent.get("server", 0.0)
    return pace(before, after, ended - began) + f"   server {server / (10 * (ended - began)):.0f} % of a core"


def pace(before: dict[str, Any], after: dict[str, Any], wall: float) -> str:
    """How fast the world goes."""
    frames = max(after["frames"] - before["frames"], 1)
    speed = (after["time"] - before["time"]) / wall
    return f"{speed:6.3f} s a second, physics {after['physics_median_ms']:7.2f} ms, a frame every {1000 * wall / frames:6.1f} ms"


def watch(served: Served, tab: Tab, particles: int, seconds: float) -> None:
    """The same with the page open."""
    served.start_anew()
    time.sleep(seconds / 4)
    began, before = time.perf_counter(), tab.evaluate("window.pyverlet.status()")
    spent = processor_ms(served.process.pid)
    opened = tab.evaluate("(window.acks = [], performance.now())")
    time.sleep(seconds)
    closed, acks = tab.evaluate("[performance.now(), window.acks]")
    after, ended = tab.evaluate("window.pyverlet.status()"), time.perf_counter()
    now = processor_ms(served.process.pid)
    gaps = [b - a for a, b in pairwise(acks)]
    rate = 1000.0 * len(acks) / (closed - opened)  # by the page's own clock: asking it takes time too
    slowest = min((sum(a <= ack < a + 1000.0 for ack in acks) for a in acks if a + 1000.0 <= closed), default=0)
    worst = statistics.quantiles(gaps, n=20)[-1] if len(gaps) > 1 else float("nan")
    costs = ", ".join(f"{what} {(ms - spent.get(what, 0.0)) / max(len(acks), 1):.1f}" for what, ms in sorted(now.items()))
    print(f"{particles:>9,}  {'watched':<10}{pace(before, after, ended - began)}")
    print(f"{'':>11}{rate:.1f} pictures a second, {slowest} in the slowest (95 % of the gaps under {worst:.0f} ms)")
    print(f"{'':>11}processor ms a picture: {costs}")
    late = sorted(tab.evaluate(f"({TURN_GRAVITY})({degrees})") for degrees in range(5, 5 + 5 * INPUTS, 5))
    print(f"{'':>11}input to picture {statistics.median(late):.0f} ms (worst of {INPUTS}: {late[-1]:.0f})", flush=True)


def main(scene: str, particles: list[int], seconds: float) -> None:
    """A line for each number of circles."""
    for count in particles:
        measure(scene, count, seconds)
