"""A process that serves a scene, `benchmarks.served`, and what it answers."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from typing import Any


class Server:
    """So many circles of a scene on the air, with these options of `pyverlet run`."""

    def __init__(self, scene: str, particles: int, *options: str) -> None:
        command = [sys.executable, "-m", "benchmarks.served", "run", scene, "--particles", str(particles), "--no-open", *options]
        self.process = subprocess.Popen([*command, "--port", "0"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.address: str = re.findall(r"http://\S+", self._line("http://"))[0]

    def _line(self, holding: str) -> str:
        """The next line that holds this."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if holding in line:
                return line
        raise RuntimeError("the server has ended")

    def ask(self, wish: str = "") -> dict[str, Any]:
        """What it says of itself; "reset" has it start anew first."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{wish}\n")
        self.process.stdin.flush()
        said: dict[str, Any] = json.loads(self._line('"threads"'))
        return said

    def end(self) -> None:
        """Ctrl-C."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(30)
