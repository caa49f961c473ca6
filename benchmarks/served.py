"""`pyverlet` that answers questions about what it serves: `python -m benchmarks.served run cage`.

For each line it is given it prints one of JSON: how far the world is, what its frames took, and what its threads are called.
The line "reset" has the world start anew before.
"""

from __future__ import annotations

import json
import sys
import threading
from typing import Any

from pyverlet.cli import main
from pyverlet.viewers import launch
from pyverlet.viewers.commands import Reset
from pyverlet.viewers.session import Session

sessions: list[Session] = []


class Known(Session):
    """A session that can be found."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        sessions.append(self)


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
            print(json.dumps({**said, "threads": threads}), flush=True)


if __name__ == "__main__":
    launch.Session = Known  # type: ignore[attr-defined]
    threading.Thread(target=answer, name="answers", daemon=True).start()
    sys.exit(main())
