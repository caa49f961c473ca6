"""A served page for long, and whether anything grows: `python -m benchmarks soak --minutes 60`. Linux, whose /proc is read.

Tabs come, draw, stall, vanish in the middle of a frame, send nonsense and floods; scenes change, and films are recorded.
Each minute has a line: memory, open files and threads of the server, and its frames; the slowest by the clock and by processor
time, and beside it the longest that a process that only sleeps was kept waiting in that minute: a stall of the machine.
"""

from __future__ import annotations

import contextlib
import json
import random
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from benchmarks.server import Server

TABS = 6
SCENES = ("cage", "box", "cloth", "rope-bridge", "galton", "soft-bodies", "newton-cradle")
SETTLED_MINUTES = 5
GROWTH = 0.03
"""Part of its memory after SETTLED_MINUTES that the server may have more at the end."""
SLOWEST_MS = 250.0
"""What no frame may take beyond what the machine stood still."""


@dataclass(frozen=True)
class Minute:
    """The server, at the end of a minute."""

    minute: int
    memory_mb: float
    files: int
    threads: int
    median_ms: float
    frames: int
    slowest_ms: float
    worked_ms: float
    stalled_ms: float


class Idle:
    """A process that sleeps for 5 ms at a time and notes how late it wakes."""

    LOOP = """
import sys, threading, time
late = [0.0]
def answer():
    for _ in sys.stdin:
        print(1e3 * late[0], flush=True)
        late[0] = 0.0
threading.Thread(target=answer, daemon=True).start()
while True:
    began = time.perf_counter()
    time.sleep(0.005)
    late[0] = max(late[0], time.perf_counter() - began - 0.005)
"""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", self.LOOP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def latest_ms(self) -> float:
        """The longest it was kept waiting since it was last asked."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def end(self) -> None:
        """It would go on for ever."""
        self._process.kill()
        self._process.wait()


class Watched(Server):
    """A scene on the air, and what its process has."""

    def memory_mb(self) -> float:
        """What it has in memory that no other process has."""
        text = Path(f"/proc/{self.process.pid}/smaps_rollup").read_text()
        return sum(int(n) for n in re.findall(r"^Private_(?:Clean|Dirty):\s+(\d+)", text, re.MULTILINE)) / 1024

    def files(self) -> int:
        """Files and sockets that are open."""
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


class Tab(threading.Thread):
    """Comes, behaves for some seconds in one of five ways, and goes; again and again until told to stop."""

    def __init__(self, port: int, seed: int, stop: threading.Event) -> None:
        super().__init__(daemon=True)
        self._address, self._rng, self._stop_it = f"ws://127.0.0.1:{port}/socket", random.Random(seed), stop
        self.largest_gap = 0.0

    def run(self) -> None:
        """Until told to stop."""
        while not self._stop_it.is_set():
            behave = self._rng.choice([self._draw, self._draw, self._stall, self._vanish, self._nonsense, self._flood])
            gone = contextlib.suppress(ConnectionClosed, TimeoutError, OSError)
            with gone, connect(self._address, close_timeout=0.5) as connection:
                behave(connection)
            self._stop_it.wait(self._rng.uniform(0, 2))

    def _draw(self, connection: ClientConnection) -> None:
        until, last = time.monotonic() + self._rng.uniform(2, 20), time.monotonic()
        while time.monotonic() < until and not self._stop_it.is_set():
            data = connection.recv(10.0)
            assert isinstance(data, bytes)
            head = json.loads(data[4 : 4 + struct.unpack_from("<I", data)[0]])
            if "seq" in head and head["kind"] in ("frame", "picture"):
                now = time.monotonic()
                self.largest_gap, last = max(self.largest_gap, now - last), now
                connection.send(json.dumps({"type": "ack", "seq": head["seq"]}))
            if self._rng.random() < 0.02:
                where = {"x": self._rng.uniform(-5, 5), "y": self._rng.uniform(-5, 5)}
                connection.send(json.dumps({"type": self._rng.choice(["poke", "drag", "spawn"]), "reach": 1.0, **where}))

    def _stall(self, connection: ClientConnection) -> None:
        self._stop_it.wait(self._rng.uniform(2, 15))

    def _vanish(self, connection: ClientConnection) -> None:
        connection.recv(10.0)
        connection.socket.close()

    def _nonsense(self, connection: ClientConnection) -> None:
        for text in ("", "{", '{"type": "no"}', '{"type": "drag", "x": 1e999}', "[]" * 900, '{"type": "ack", "seq": -1}'):
            connection.send(text)
        connection.recv(10.0)

    def _flood(self, connection: ClientConnection) -> None:
        for _ in range(2000):
            connection.send(json.dumps({"type": "gravity", "x": 0.0, "y": self._rng.uniform(-12, -8)}))


def change_scene(port: int, scene: str) -> None:
    """Another scene of another size, for all."""
    with contextlib.suppress(ConnectionClosed, OSError, TimeoutError), connect(f"ws://127.0.0.1:{port}/socket") as connection:
        connection.send(json.dumps({"type": "build", "scene": scene}))
        connection.recv(10.0)


def record(folder: Path) -> None:
    """A film of some frames, by another process."""
    command = [sys.executable, "-m", "pyverlet", "record", "box", "--particles", "100", "--seconds", "1"]
    subprocess.run([*command, str(folder / "film.gif")], check=False, capture_output=True, timeout=300)


def main(minutes: float) -> bool:
    """Print a line a minute; whether nothing has grown."""
    served, idle, stop, rng = Watched("cage", 1000), Idle(), threading.Event(), random.Random(0)
    port = int(served.address.rstrip("/").rpartition(":")[2])
    tabs = [Tab(port, seed, stop) for seed in range(TABS)]
    for tab in tabs:
        tab.start()
    rows: list[Minute] = []
    print(
        f"{'minute':>6}{'memory, MB':>12}{'files':>7}{'threads':>9}{'median, ms':>12}{'frames':>8}{'slowest, ms':>13}"
        f"{'of that work':>14}{'machine stood still':>21}{'longest gap, ms':>17}",
        flush=True,
    )
    try:
        with tempfile.TemporaryDirectory() as folder:
            begin, before = time.monotonic(), served.ask()["frames"]
            for minute in range(1, max(round(minutes), 1) + 1):
                # All of them at first: what a scene loads stays in memory.
                scenes = list(SCENES[2 * minute - 2 : 2 * minute])
                if not scenes and minute % 3 == 0:
                    scenes = [rng.choice(SCENES)]
                if minute % 4 == 1:
                    record(Path(folder))
                asked = [served.ask()]
                while time.monotonic() < begin + 60 * minute:
                    if scenes and time.monotonic() > begin + 60 * minute - 30 * len(scenes):
                        change_scene(port, scenes.pop(0))
                    time.sleep(2)
                    asked.append(served.ask())
                said = asked[-1]
                slowest, worked = max(each["slowest_ms"] for each in asked)
                gap, frames = max(1e3 * tab.largest_gap for tab in tabs), said["frames"]
                for tab in tabs:
                    tab.largest_gap = 0.0
                median = statistics.median(each["physics_median_ms"] for each in asked)
                made = frames - before if frames >= before else frames  # a scene begins at 0
                held = (served.memory_mb(), served.files(), len(said["threads"]))
                row = Minute(minute, *held, median, made, slowest, worked, idle.latest_ms())
                before = frames
                rows.append(row)
                print(
                    f"{row.minute:>6}{row.memory_mb:>12.1f}{row.files:>7}{row.threads:>9}{row.median_ms:>12.2f}"
                    f"{row.frames:>8}{row.slowest_ms:>13.0f}{row.worked_ms:>14.0f}{row.stalled_ms:>21.0f}{gap:>17.0f}",
                    flush=True,
                )  # fmt: skip
    finally:
        stop.set()
        for tab in tabs:
            tab.join(20)
        served.end()
        idle.end()
    return verdict(rows)


def verdict(rows: list[Minute]) -> bool:
    """Whether the server ends as small as it was after SETTLED_MINUTES, by medians of some minutes, and no frame was slow."""
    if len(rows) < 2 * SETTLED_MINUTES:
        print(f"too short to tell: at least {2 * SETTLED_MINUTES} minutes")
        return True
    early, end = rows[SETTLED_MINUTES - 2 : SETTLED_MINUTES + 1], rows[-3:]
    memory = [statistics.median(row.memory_mb for row in part) for part in (early, end)]
    files = [max(row.files for row in part) for part in (early, end)]
    growth = memory[1] / memory[0] - 1
    late = [row for row in rows if row.slowest_ms - row.stalled_ms > SLOWEST_MS]
    print(
        f"memory {growth:+.1%} since minute {SETTLED_MINUTES}, files {files[0]} and {files[1]}; "
        f"slowest frame {max(row.slowest_ms for row in rows):.0f} ms; minutes with one over {SLOWEST_MS} ms that no stall of the "
        f"machine explains: {[row.minute for row in late]}"
    )
    return growth <= GROWTH and files[1] <= files[0] + 2 * TABS and not late
