"""`pyverlet` that answers questions about what it serves: `python -m benchmarks.served run cage`.

For each line it is given it prints one of JSON: how far the world is, what its frames took, the slowest of them since the line
before by the clock and by its thread's processor time, and what its threads are called.
The line "reset" has the world start anew before.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

from pyverlet.cli import main
from pyverlet.viewers import launch
from pyverlet.viewers.commands import Reset
from pyverlet.viewers.session import Session

sessions: list[Known] = []


class Known(Session):
    """A session that can be found."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.slowest = 0.0, 0.0
        sessions.append(self)

    def _advance(self) -> None:
        began, worked = time.perf_counter(), time.thread_time()
        super()._advance()
        self.slowest = max(self.slowest, (1e3 * (time.perf_counter() - began), 1e3 * (time.thread_time() - worked)))


def answer() -> None:
    """Until the lines end."""
    with open(0, "rb", buffering=0, closefd=False) as lines:
        for line in lines:
            session = sessions[-1]
            if line.strip() == b"reset":
                session.submit(Reset())
            status = session.latest.status
            said = {name: getattr(status, name) for name in ("time", "frames", "physics_median_ms")}
            threads = {thread.native_id: thread.name for thread in threading.enumerate()}
            slowest, session.slowest = session.slowest, (0.0, 0.0)
            print(json.dumps({**said, "threads": threads, "slowest_ms": slowest}), flush=True)


if __name__ == "__main__":
    launch.Session = Known  # type: ignore[attr-defined]
    threading.Thread(target=answer, name="answers", daemon=True).start()
    sys.exit(main())
