"""The processes of `Worlds`: a `Worker` has some of the worlds, a `ProcessPool` has one worker per process.

Processes are started directly and not by `multiprocessing`, which would run the user's script again in each. They receive orders
on standard input, and share the particles in a memory-mapped file.
"""

import contextlib
import mmap
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from pyverlet import core
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError, PyverletError
from pyverlet.data.sweep_plan import bare
from pyverlet.scenes import Scene
from pyverlet.world.saved import Saved
from pyverlet.world.world import World

_ALIGNED = 64
_ROWS = {"position": 2, "velocity": 2, "spin": 1, "radius": 1, "mass": 1}


@dataclass(frozen=True)
class Plan:
    """Data for all workers: how each world is built, their number, the initial particles and dtype of each, and the number of
    threads per worker.
    """

    scene: Scene
    settings: dict[str, Any]
    seed: int
    count: int
    particles: int
    dtype: str
    threads: int

    def _arrays(self, memory: mmap.mmap | None) -> tuple[dict[str, Array], int]:
        """(count, ...) consecutive arrays in this memory, and their size in bytes; without memory, separate arrays."""
        real, arrays, at = np.dtype(self.dtype), {}, 0
        shapes = {name: ((self.particles, 2)[:width], real) for name, width in _ROWS.items()}
        kinds: dict[str, Any] = shapes | {
            "gravity": ((2,), np.dtype("f8")),
            "time": ((), np.dtype("f8")),
            "count": ((), np.dtype("i8")),
        }
        for name, (shape, dtype) in kinds.items():
            inner = np.empty(shape, dtype)
            stride = _aligned(inner.nbytes) if name in shapes else inner.nbytes  # aligned as in a single world
            if memory is not None:
                arrays[name] = np.ndarray((self.count, *shape), dtype, memory, at, (stride, *inner.strides))
            at += _aligned(stride * self.count)
        return arrays, max(at, 1)

    @property
    def size(self) -> int:
        """Size of the file in bytes."""
        return self._arrays(None)[1]

    def open(self, path: Path) -> dict[str, Array]:
        """(count, ...) arrays shared by all processes with this file."""
        with path.open("r+b") as file:
            return self._arrays(mmap.mmap(file.fileno(), self.size))[0]


def _aligned(size: int) -> int:
    return -(-size // _ALIGNED) * _ALIGNED


class Worker:
    """Worlds `first` to `stop` - 1 of a plan, with their particles in the arrays `shared` of all worlds."""

    def __init__(self, plan: Plan, first: int, stop: int, shared: dict[str, Array]) -> None:
        from pyverlet.data.worlds import seed_of

        self._first, self._shared, self._particles = first, shared, plan.particles
        self.worlds = [plan.scene.world(**plan.settings, seed=seed_of(plan.seed, k)) for k in range(first, stop)]
        self._views = [{name: shared[name][k] for name in _ROWS} for k in range(first, stop)]
        self._saved: dict[int, list[Saved]] = {}
        self._plain: Any = core.unit("engine", np.dtype(plan.dtype)).PlainWorlds(plan.threads)
        self._gravity, self._time = shared["gravity"][first:stop], shared["time"][first:stop]
        self._had = np.zeros_like(self._gravity)
        for number, world in enumerate(self.worlds):
            self._note(number, world)

    def _note(self, number: int, world: World) -> None:
        """After a change: move the particles of a world to the shared arrays, if they fit, and store their number."""
        state, views, shared, k = world._state, self._views[number], self._shared, self._first + number
        if len(world) == self._particles and state._store["mass"] is not views["mass"]:
            for name, view in views.items():
                view[...] = state.shown[name]
            state.shared = True
            state.live_in(state._store | views, len(world))
        shared["time"][k], shared["count"][k] = world.time, len(world)
        if tuple(self._had[number]) != world.gravity:
            self._had[number] = self._gravity[number] = world.gravity

    def step(self, dt: float, frames: int = 1) -> None:
        """Step all worlds; the first error is raised after all have been stepped."""
        failed: PyverletError | None = None
        for number in np.flatnonzero((self._gravity != self._had).any(axis=1)).tolist():
            self.worlds[number].gravity = self._gravity[number].tolist()
            self._had[number] = self._gravity[number]
        made, errors, far = self._plain.step(self.worlds, dt, frames, self._time)
        for number in far:
            self.worlds[number]._precision.look(self.worlds[number], dt / self.worlds[number].substeps)
        for number in np.flatnonzero(made < frames).tolist():
            world = self.worlds[number]
            try:
                if number in errors:
                    raise errors[number]
                for _ in range(frames - made[number]):
                    world.step(dt)
            except PyverletError as error:
                if failed is None:
                    error.args = (f"world {self._first + number}: {error}", *error.args[1:])
                    failed = error
            self._note(number, world)
        if failed:
            raise failed

    def save(self, token: int) -> None:
        """Save all worlds under this token."""
        self._saved[token] = [world.save() for world in self.worlds]

    def restore(self, token: int, which: list[int]) -> None:
        """Restore those of `which` that are here."""
        saved = self._saved[token]
        for k in which:
            number = k - self._first
            if 0 <= number < len(self.worlds):
                self.worlds[number].restore(saved[number])
                self._note(number, self.worlds[number])

    def drop(self, token: int) -> None:
        """Discard a saved state."""
        self._saved.pop(token, None)

    def file(self, k: int) -> bytes:
        """The contents of a file of world k."""
        from pyverlet.data import snapshot

        return snapshot.to_bytes(self.worlds[k - self._first])


class ProcessPool:
    """Processes with workers for the worlds in `ranges`, which share the file at `path`."""

    def __init__(self, plan: Plan, ranges: Sequence[tuple[int, int]], path: Path) -> None:
        try:
            sent = pickle.dumps(replace(plan, scene=bare(plan.scene)))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise InputError(
                f"scene cannot be sent to other processes ({error}); allowed is one of a module, or processes=1"
            ) from None
        command = [sys.executable, "-c", "from pyverlet.data.process_pool import main; main()"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self._processes = [
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment) for _ in ranges
        ]
        try:
            for process, (first, stop) in zip(self._processes, ranges, strict=True):
                _send(process.stdin, (sent, first, stop, str(path)))
            _results([_receive(process.stdout) for process in self._processes])
        except BaseException:
            self.close()
            raise

    def run(self, *order: Any, part: int | None = None) -> list[Any]:
        """Run an order on all workers, or on that of one part; returns their results."""
        processes = self._processes if part is None else [self._processes[part]]
        with self._alive():
            for process in processes:
                _send(process.stdin, order)
            return _results([_receive(process.stdout) for process in processes])

    @contextlib.contextmanager
    def _alive(self) -> Iterator[None]:
        try:
            yield
        except (OSError, EOFError, ValueError, pickle.UnpicklingError) as error:
            if isinstance(error, InputError):
                raise
            self.close()
            raise PyverletError("a process that had some of the worlds has ended; they are lost, build them anew") from None

    def close(self) -> None:
        for process in self._processes:
            assert process.stdin
            with contextlib.suppress(OSError):
                process.stdin.close()
        for process in self._processes:
            assert process.stdout
            process.wait()
            process.stdout.close()


def _results(replies: list[Any]) -> list[Any]:
    """The results of all replies, all of which are read before an error is raised: leftovers would be taken for later replies."""
    for error, _ in replies:
        if error is not None:
            raise error
    return [value for _, value in replies]


def _send(file: IO[bytes] | None, message: Any) -> None:
    assert file is not None
    pickle.dump(message, file)
    file.flush()


def _receive(file: IO[bytes] | None) -> Any:
    """Read a reply; EOFError at the end."""
    assert file is not None
    return pickle.load(file)


def main() -> None:
    """Run a worker with orders from standard input, until that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles it
    orders = sys.stdin.buffer
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of scenes must not mix with replies
    worker: Worker | None = None
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            order = _receive(orders)
            error, value = None, None
            try:
                if worker is None:
                    sent, first, stop, path = order
                    plan: Plan = _unpickled(sent)
                    worker = Worker(plan, first, stop, plan.open(Path(path)))
                else:
                    value = getattr(worker, order[0])(*order[1:])
            except PyverletError as raised:
                error = raised
            except Exception as raised:  # of the scene's own code
                error = PyverletError(f"{type(raised).__name__}: {raised}")
            _send(replies, (error, value))


def _unpickled(sent: bytes) -> Any:
    try:
        return pickle.loads(sent)
    except (AttributeError, ImportError) as error:
        raise InputError(
            f"scene cannot be read in another process ({error}); allowed is one of a module, or processes=1"
        ) from None
