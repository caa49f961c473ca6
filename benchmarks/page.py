"""How fast the live page is, and what it costs the physics: `python -m benchmarks page`.

A server as `pyverlet run` starts it and a Chromium without a screen, WebGL off, both on this machine's cores. A world starts
anew and is watched for so long, then starts anew and goes the same way unwatched. A picture counts once it is drawn.
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.accounts import Account, account
from benchmarks.server import Server

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-3d-apis", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1000,700",
]  # fmt: skip

POLL_S = 0.02
"""Between two looks at how far a world is."""

OPENING_S = 2.0
"""The page gets this long to be loaded."""

INPUTS = 12
"""How often gravity is turned to see when a picture says so."""

COUNT_ACKS = """{
    window.acks = [], window.came = [];
    const set = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage").set;
    Object.defineProperty(WebSocket.prototype, "onmessage", { set(receive) {
        set.call(this, (event) => (window.came.push(performance.now()), receive(event)));
    } });
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


@dataclass(frozen=True)
class Moment:
    """How far a world is, and who has had the processor by then."""

    wall: float
    time: float
    frames: int
    physics_ms: float
    spent: Account


class Served(Server):
    """A scene on the air, in a process of its own."""

    def __init__(self, scene: str, particles: int, threads: int | None) -> None:
        super().__init__(scene, particles, *(["--threads", str(threads)] if threads else []))

    def now(self, wish: str = "") -> Moment:
        """How far it is; "reset" has it start anew first."""
        said = self.ask(wish)
        spent = account(self.process.pid, {int(number): name for number, name in said["threads"].items()})
        return Moment(time.perf_counter(), said["time"], said["frames"], said["physics_median_ms"], spent)

    def start_anew(self) -> None:
        """Reset, and wait until it is done: a million circles first end their frame."""
        before = self.now("reset").time
        while before > 0.0 and self.now().time >= before:
            time.sleep(POLL_S)

    def when(self, moment: float) -> Moment:
        """As soon as the world is so far, s."""
        while (now := self.now()).time < moment:
            time.sleep(POLL_S)
        return now


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


def measure(scene: str, particles: int, seconds: float, threads: int | None) -> None:
    """Print a few lines: watched, and the same stretch of the world's time unwatched."""
    served = Served(scene, particles, threads)
    try:
        tab = Tab(served.address)
        try:
            time.sleep(OPENING_S)
            began, ended, lines = watch(served, tab, seconds)
        finally:
            tab.close()
        served.start_anew()
        alone = (served.when(began.time), served.when(ended.time))
    finally:
        served.end()
    print(f"{particles:>9,}  unwatched  {pace(*alone)}")
    print(f"{particles:>9,}  watched    {pace(began, ended)}")
    for line in lines:
        print(f"{'':>11}{line}", flush=True)


def pace(began: Moment, ended: Moment) -> str:
    """How fast the world went, and what became of the time of a frame."""
    frames, wall, spent = max(ended.frames - began.frames, 1), ended.wall - began.wall, ended.spent - began.spent
    speed = (ended.time - began.time) / wall
    line = f"{speed:.3f} s a second, physics {ended.physics_ms:.2f} ms, a frame every {1000 * wall / frames:.2f}"
    if not spent.ran:
        return line
    parts = []
    for who in ("physics", "workers"):
        ran, queued = spent.ran.get(who, 0.0), spent.queued.get(who, 0.0)
        waited = f", waited {(1000 * wall - ran - queued) / frames:.2f}" if who == "physics" else ""
        parts.append(f"{who} ran {ran / frames:.2f}, queued {queued / frames:.2f}{waited}")
    return f"{line}\n{'':>11}ms a frame: {'; '.join(parts)}; {spent.idle / (10 * wall):.0f} % of a core idle"


def watch(served: Served, tab: Tab, seconds: float) -> tuple[Moment, Moment, list[str]]:
    """Start anew and watch for so long: from when to when, and what there is to say of the page."""
    served.start_anew()
    time.sleep(seconds / 4)
    tab.evaluate("window.acks = [], window.came = []")
    began = served.now()
    time.sleep(seconds)
    ended = served.now()
    acks, came = tab.evaluate("[window.acks, window.came]")
    late = sorted(tab.evaluate(f"({TURN_GRAVITY})({degrees})") for degrees in range(5, 5 + 5 * INPUTS, 5))
    spent, wall = ended.spent - began.spent, ended.wall - began.wall
    costs = ", ".join(f"{who} {ms / len(acks):.1f}" for who, ms in spent.ran.items() if who not in ("physics", "workers"))
    rate = 1000.0 * (len(acks) - 1) / (acks[-1] - acks[0])
    lines = [
        f"{rate:.1f} pictures a second, {slowest(acks)} in the slowest; {spread('drawn', acks)}; {spread('came', came)}",
        f"processor ms a picture: {costs}: in all {spent.page / len(acks):.1f}, {spent.page / (10 * wall):.0f} % of a core",
        f"input to picture {statistics.median(late):.0f} ms (worst of {INPUTS}: {late[-1]:.0f})",
    ]
    return began, ended, lines


def slowest(acks: list[float]) -> int:
    """Pictures in the second that had the fewest."""
    return min((sum(a <= ack < a + 1000.0 for ack in acks) for a in acks if a + 1000.0 <= acks[-1]), default=0)


def spread(what: str, times: list[float]) -> str:
    """How even these are."""
    gaps = sorted(b - a for a, b in pairwise(times))
    shares = [gaps[min(int(share * len(gaps)), len(gaps) - 1)] for share in (0.5, 0.95, 0.99)]
    return f"{what} {shares[0]:.1f} ms apart, 95 % under {shares[1]:.0f}, 99 % {shares[2]:.0f}, all {gaps[-1]:.0f}"


def main(scene: str, particles: list[int], seconds: float, threads: int | None) -> None:
    """Some lines for each number of circles."""
    for count in particles:
        measure(scene, count, seconds, threads)
