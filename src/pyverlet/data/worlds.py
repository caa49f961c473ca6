"""Many worlds of one scene behind one set of arrays: for training, statistics and tuning."""

import itertools
import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.common.threads import max_threads
from pyverlet.data import snapshot
from pyverlet.data.atomic_file import Closing
from pyverlet.data.process_pool import Plan, ProcessPool, Worker
from pyverlet.data.trajectory import Column
from pyverlet.scenes import Scene, get
from pyverlet.world.world import World

_WORTH_A_PROCESS = 8  # least worlds per process, as a process takes a second to start

_tokens = itertools.count()


@dataclass(frozen=True)
class Start:
    """The saved state of `Worlds`, which stays in the processes, so that restoring is fast. Opaque."""

    owner: Any
    token: int


class Worlds(Shown, Closing):
    """Worlds of one scene that differ in their seeds, stepped together on all cores.

    The arrays are those of the worlds themselves: reading copies nothing, and what is written is used in the next frame. Each
    world has the same bits as alone, for any number of worlds and processes. Close them when done, or use them in a `with` block.

    Args:
        scene: its name, or a `pyverlet.scenes.Scene`.
        n: number of worlds.
        seed: of all of them: world k has `seed_of(seed, k)`.
        processes: number of processes; 1 is this one alone, whose threads share worlds that need no Python. None is one per core,
            if there are enough worlds.
        settings: of the scene, as for `Scene.settings`.

    Raises:
        InputError: the scene or a setting is unknown, or the scene cannot be sent to another process.
    """

    _shows = ("scene", "seed")

    def __init__(self, scene: str | Scene, n: int, *, seed: int = 0, processes: int | None = None, **settings: Any) -> None:
        self.scene = get(scene) if isinstance(scene, str) else scene
        self._count = checks.integer("n", n)
        self.seed = checks.integer("seed", seed, least=0)
        settings = {"threads": 1} | settings
        if processes is None:
            processes = max(min(max_threads(), self._count // _WORTH_A_PROCESS), 1)
        processes = checks.integer("processes", processes, most=self._count, most_is=", one for each world")
        first = self.scene.world(**settings, seed=seed_of(self.seed, 0))
        threads = max(max_threads() // processes, 1)
        plan = Plan(self.scene, settings, self.seed, self._count, len(first), first.dtype.str, threads)
        in_ram = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # a folder in memory, if available
        folder = Path(tempfile.mkdtemp(prefix="pyverlet-", dir=in_ram))
        self._workers: Sequence[Worker] = ()
        self._dropped: list[int] = []
        try:
            path = folder / "worlds"
            with path.open("wb") as file:
                file.truncate(plan.size)
            cuts = np.linspace(0, self._count, processes + 1).astype(int).tolist()
            ranges = list(itertools.pairwise(cuts))
            self._shared = plan.open(path)
            if processes == 1:
                self._pool: ProcessPool | None = None
                self._workers = [Worker(plan, 0, self._count, self._shared)]
            else:
                self._pool = ProcessPool(plan, ranges, path)
        finally:
            shutil.rmtree(folder, ignore_errors=True)  # it exists until all processes have closed it
        self._first = [begin for begin, _ in ranges]
        self._finalizer = weakref.finalize(self, self._pool.close) if self._pool else None

    def step(self, dt: float) -> None:
        """Advance each world by one frame of dt seconds.

        Raises:
            InputError: dt is not a number greater than 0.
            NonFiniteError: a world turned NaN or infinite; it has its last good frame, the others have advanced.
        """
        self._tell("step", checks.number("dt", dt, above=0.0))

    def run(self, *, seconds: float, dt: float = 1 / 60) -> None:
        """Advance by the number of frames of dt that is nearest to `seconds`, without synchronising processes between frames."""
        frames = round(checks.number("seconds", seconds, least=0.0) / checks.number("dt", dt, above=0.0))
        self._tell("step", dt, frames)

    def save(self) -> Start:
        """A copy of the state of all worlds, for `restore`. It stays in the processes."""
        start = Start(weakref.ref(self), next(_tokens))
        self._tell("save", start.token)
        weakref.finalize(start, self._dropped.append, start.token)  # without the object it cannot be restored
        return start

    def restore(self, saved: Start, which: ArrayLike | None = None) -> None:
        """Go back to what `save` returned.

        Args:
            saved: of these worlds.
            which: an index, several, or (n,) bool; None for all.

        Raises:
            InputError: it belongs to other worlds, or there is no such world.
        """
        if getattr(saved, "owner", lambda: None)() is not self:
            raise InputError("saved is none of these worlds'; allowed is what save() of them returned")
        chosen = np.arange(self._count) if which is None else checks.indices("which", which, self._count)
        self._tell("restore", saved.token, chosen.tolist())

    def _tell(self, what: str, *arguments: Any) -> None:
        while self._dropped:  # filled by the garbage collector at any time, sent between two orders
            self._order("drop", self._dropped.pop())
        self._order(what, *arguments)

    def _order(self, what: str, *arguments: Any) -> None:
        if self._pool is not None:
            self._pool.run(what, *arguments)
        for worker in self._workers:
            getattr(worker, what)(*arguments)

    def close(self) -> None:
        """End the processes of the worlds, which can then no longer be stepped."""
        if self._finalizer is not None:
            self._finalizer()

    def _column(self, name: str) -> Array:
        counts = self._shared["count"]
        if (counts != self._shared[name].shape[1]).any():
            raise InputError(
                f"the worlds have {int(counts.min())} to {int(counts.max())} particles; allowed is {name} of worlds that have "
                "equally many, as they began; many[k] is a world by itself"
            )
        return self._shared[name]

    position = Column("(n, k, 2) centres of the k particles of each world, m.")
    velocity = Column("(n, k, 2) m/s.")
    spin = Column("(n, k) rad/s.")
    radius = Column("(n, k) m.")
    mass = Column("(n, k) kg.")

    @property
    def gravity(self) -> Array:
        """(n, 2) gravity of each world, m/s^2."""
        return self._shared["gravity"]

    @property
    def time(self) -> Array:
        """(n,) simulated seconds of each world; a copy."""
        return self._shared["time"].copy()

    @property
    def counts(self) -> NDArray[np.int64]:
        """(n,) particles in each world; a copy."""
        return self._shared["count"].copy()

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, k: int) -> World:
        """A copy of world k, to view and to continue independently of these."""
        if not -self._count <= k < self._count:
            raise IndexError(f"world {k} of {self._count}")
        k %= self._count
        part = int(np.searchsorted(self._first, k, side="right")) - 1
        raw = self._pool.run("file", k, part=part)[0] if self._pool else self._workers[0].file(k)
        return snapshot.from_bytes(raw)

    def __iter__(self) -> Iterator[World]:
        return (self[k] for k in range(self._count))


def seed_of(seed: int, k: int) -> int:
    """The seed of world or run k: independent of all others, and of the process."""
    return int(np.random.SeedSequence((seed, k)).generate_state(1, np.uint64)[0])
