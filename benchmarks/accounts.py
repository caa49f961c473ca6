"""Who has had the processor, and who has waited for it: a server's threads and a browser's processes. Linux only."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

TICK_MS = 1000.0 / os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 10.0


@dataclass(frozen=True)
class Account:
    """Milliseconds so far.

    Attributes:
        ran: by who it was: "physics" is the thread that steps the world, "workers" those that help it, "web" and "renderer" the
            server's others; "renderer", "gpu-process", "utility" and "browser" are Chromium's processes.
        queued: of the server's threads, ready to run while others had the cores.
        idle: of all cores together.
    """

    ran: Mapping[str, float] = field(default_factory=dict)
    queued: Mapping[str, float] = field(default_factory=dict)
    idle: float = 0.0

    def __sub__(self, before: Account) -> Account:
        return Account(_less(self.ran, before.ran), _less(self.queued, before.queued), self.idle - before.idle)

    @property
    def page(self) -> float:
        """What the server's threads that do no physics, and the browser, have had."""
        return sum(ms for who, ms in self.ran.items() if who not in ("physics", "workers"))


def account(server: int, names: Mapping[int, str]) -> Account:
    """Up to now, of a server and of the browsers that this process has started.

    Args:
        server: the number of its process; its main thread does the physics.
        names: of its threads that Python knows, by number. The others are workers.
    """
    if sys.platform != "linux":
        return Account()
    ran: dict[str, float] = {}
    queued: dict[str, float] = {}
    for thread, text in _texts(Path(f"/proc/{server}/task"), "schedstat"):
        who = "physics" if thread == server else _plain(names.get(thread, "workers"))
        nanoseconds = [int(each) for each in text.split()]
        ran[who] = ran.get(who, 0.0) + nanoseconds[0] / 1e6
        queued[who] = queued.get(who, 0.0) + nanoseconds[1] / 1e6
    for kind, ms in _browsers():
        ran[kind] = ran.get(kind, 0.0) + ms
    idle = [int(each) for each in Path("/proc/stat").read_text().split("\n", 1)[0].split()[4:6]]
    return Account(ran, queued, TICK_MS * sum(idle))


def _browsers() -> Iterator[tuple[str, float]]:
    """Kind of each process below this one that belongs to a browser, and its time."""
    fields = {number: text.rpartition(")")[2].split() for number, text in _texts(Path("/proc"), "stat")}
    commands = dict(_texts(Path("/proc"), "cmdline"))
    for number, values in fields.items():
        above = number
        while above > 1 and above != os.getpid():
            above = int(fields[above][1]) if above in fields else 0
        if above == os.getpid() != number and "chrom" in commands.get(number, ""):
            found = re.search(r"--type=([a-z-]+)", commands[number])
            yield found[1] if found else "browser", TICK_MS * (int(values[11]) + int(values[12]))


def _texts(folder: Path, name: str) -> Iterator[tuple[int, str]]:
    """What stands in a file of this name, of every process or thread there is."""
    for each in folder.glob("[0-9]*"):
        try:
            yield int(each.name), (each / name).read_text()
        except OSError:
            continue  # it has just ended


def _plain(name: str) -> str:
    return name.removeprefix("pyverlet-").partition("_")[0]


def _less(now: Mapping[str, float], before: Mapping[str, float]) -> dict[str, float]:
    return {who: ms - before.get(who, 0.0) for who, ms in now.items()}
