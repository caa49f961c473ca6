"""Makes the runs of a study on any executor: single runs, tasks of some of them, and their distribution to workers."""

import math
import os
import pickle
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from dataclasses import replace
from functools import lru_cache
from multiprocessing import get_context, parent_process
from threading import Thread
from time import perf_counter
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.errors import InputError, Interrupted, PyverletError
from pyverlet.common.threads import max_threads
from pyverlet.data.settings_json import to_json
from pyverlet.data.sweep_plan import Plan, Run, bare, made_by

Row = dict[str, Any]
Task = list[Run]

_TASK_S = 0.5  # duration of a task, s: distributing them costs little in comparison, and a lost worker loses little
_AHEAD = 4  # tasks per worker that are submitted in advance
_TRIES = 2  # times that a run alone may end its process before it counts as failed

_ALLOWED = "allowed are functions of a module, and processes=1"

ENDED = "its process ended"


def one(plan: Plan, run: Run) -> Row:
    """Make a run; its row contains any exception."""
    row: Row = _blank(run)
    try:
        world = plan.world(run)
        row["start"] = world.state_hash()
        for _ in range(plan.frames or 0):
            world.step(plan.dt)
        row["values"] = _values(plan.measure(world))
        row["end"] = world.state_hash()
    except Exception as error:  # of the scene or the measure, the user's code
        row |= {"values": None, "end": None, "error": f"{type(error).__name__}: {' '.join(str(error).split())}"}
    return row


def _blank(run: Run) -> Row:
    empty: Row = {"start": None, "end": None, "values": None, "error": None}
    return {"key": run.key, "settings": to_json(run.settings), **empty, "made_by": made_by()}


def _values(measured: Any) -> dict[str, Any]:
    given = measured if isinstance(measured, Mapping) else {"value": measured}
    values = {}
    for name, value in given.items():
        number = value.item() if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0) else value
        if number is not None and not isinstance(number, bool | int | float | str):
            raise InputError(f"measure returned {type(value).__name__} for {name!r}; allowed are numbers, text and None")
        if isinstance(number, float) and not math.isfinite(number):
            raise InputError(f"measure returned {number} for {name!r}; allowed are finite numbers, and None where there is none")
        values[str(name)] = number
    return values


@lru_cache(4)
def _plan(sent: bytes) -> Plan:
    plan = pickle.loads(sent)
    assert isinstance(plan, Plan)
    return plan


def work(sent: bytes | Plan, task: Task) -> list[tuple[Row, float]]:
    """Make some runs of a plan in any process: their rows, and the seconds of each."""
    plan, made = _plan(sent) if isinstance(sent, bytes) else sent, []
    for run in task:
        begin = perf_counter()
        row = one(plan, run)
        made.append((row, perf_counter() - begin))
    return made


def _packed(plan: Plan) -> bytes:
    """The pickled plan: functions by name, or by value if cloudpickle is installed, as with Dask and loky."""
    plan = replace(plan, scene=bare(plan.scene))
    try:
        try:
            import cloudpickle
        except ImportError:
            return pickle.dumps(plan)
        packed: bytes = cloudpickle.dumps(plan)
        return packed
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InputError(f"scene or measure cannot be sent to other processes ({error}); {_ALLOWED}") from None


class Here(Executor):
    """An executor that runs tasks at once, in this process."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def make(
    plan: Plan, runs: Sequence[Run], executor: Executor | None, *, processes: int | None, workers: int | None
) -> Iterator[tuple[Row, float]]:
    """Rows as they arrive, and the seconds of each."""
    if not runs:
        return
    own = executor is None
    if executor is None:
        count = checks.integer("processes", max_threads() if processes is None else processes)
        # Not forked, as threads of a parallel kernel do not survive that.
        makes: Any = Here if count == 1 else lambda: ProcessPoolExecutor(count, get_context("spawn"), _watch_parent)
        workers = count
    else:
        if not callable(getattr(executor, "submit", None)):
            raise InputError(f"executor is {executor!r}; allowed is a concurrent.futures.Executor, and None")
        makes, workers = (lambda: executor), workers or getattr(executor, "_max_workers", None) or 4 * (os.cpu_count() or 1)
    yield from _Dispatcher(plan, runs, makes, checks.integer("workers", workers), own=own).rows()


def _watch_parent() -> None:
    """End when the parent process ends, even if it is killed."""

    def end_with_parent() -> None:
        parent = parent_process()
        assert parent is not None
        parent.join()
        os._exit(1)

    Thread(target=end_with_parent, daemon=True).start()


class _Dispatcher:
    """Submits tasks to an executor, and yields the rows of finished ones.

    When a process dies, the executor cannot say which run killed it. All pending tasks are then repeated alone, one after the
    other: a run that ends its process twice gets a row that says so.
    """

    def __init__(self, plan: Plan, runs: Sequence[Run], makes: Any, workers: int, *, own: bool) -> None:
        self._sent = plan if makes is Here else _packed(plan)
        self._makes, self._own, self._workers = makes, own, workers
        self._waiting, self._suspects = deque(runs), deque[Task]()
        self._out: dict[Future[Any], Task] = {}
        self._tries: dict[str, int] = {}
        self._made, self._took = 0, 0.0

    def rows(self) -> Iterator[tuple[Row, float]]:
        self._executor: Any = self._makes()
        try:
            while self._waiting or self._suspects or self._out:
                self._hand_out()
                for future in wait(self._out, return_when=FIRST_COMPLETED).done if self._out else ():
                    if future in self._out:
                        yield from self._done(future, self._out.pop(future))
        except KeyboardInterrupt:
            raise Interrupted(f"interrupted; {self._made} rows of this time are kept, and it goes on from there") from None
        finally:
            for future in self._out:
                future.cancel()
            if self._own:
                self._executor.shutdown(wait=True, cancel_futures=True)

    def _hand_out(self) -> None:
        if self._suspects:
            if not self._out:
                self._submit(self._suspects.popleft())
            return
        while self._waiting and len(self._out) < _AHEAD * self._workers and not self._suspects:
            size = 1  # small at the start and at the end, so that all workers are busy
            if self._made:
                usual, share = _TASK_S * self._made / max(self._took, 1e-9), len(self._waiting) / (2 * self._workers)
                size = max(1, min(int(usual), math.ceil(share)))
            self._submit([self._waiting.popleft() for _ in range(min(size, len(self._waiting)))])
            if self._makes is Here:
                return

    def _submit(self, task: Task) -> None:
        try:
            future = self._executor.submit(work, self._sent, task)
        except BrokenExecutor:
            future = Future()
            future.set_exception(BrokenExecutor())
        self._out[future] = task

    def _done(self, future: Future[Any], task: Task) -> Iterator[tuple[Row, float]]:
        alone = not self._out
        try:
            made = future.result()
        except CancelledError as error:
            raise PyverletError("the executor has cancelled runs; the rows there are have been kept, start it again") from error
        except BrokenExecutor as error:
            yield from self._broken(task, error, alone=alone)
        except (AttributeError, ImportError, pickle.UnpicklingError) as error:
            raise InputError(f"scene or measure cannot be read in another process ({error}); {_ALLOWED}") from None
        except Exception:  # other tasks continue if an executor gives up on one, as Dask does after its workers died
            yield from self._blame(task)
        else:
            for row, took in made:
                self._made += 1
                self._took += took
                yield row, took

    def _broken(self, task: Task, error: BaseException, *, alone: bool) -> Iterator[tuple[Row, float]]:
        """Handle the end of a process, and of the executor with it."""
        if not self._own:
            raise PyverletError("the executor broke; the rows there are have been kept, start it again") from error
        if not self._made and self._tries.get("", 0) > _TRIES:
            raise PyverletError(
                "processes end as soon as they start; a script that runs a study needs `if __name__ == '__main__':` around that"
            ) from error
        self._tries[""] = self._tries.get("", 0) + 1
        self._executor.shutdown(wait=True, cancel_futures=True)
        whole = {future: kept for future, kept in self._out.items() if not future.cancelled() and future.exception() is None}
        others = [kept for future, kept in self._out.items() if future not in whole]
        self._out = whole
        self._executor = self._makes()
        self._suspects.extend(others)
        if alone:
            yield from self._blame(task)
        else:
            self._suspects.append(task)

    def _blame(self, task: Task) -> Iterator[tuple[Row, float]]:
        """Find the run in a task that ends its process."""
        if len(task) > 1:
            self._suspects.extend([run] for run in task)
            return
        (run,) = task
        self._tries[run.key] = self._tries.get(run.key, 0) + 1
        if self._tries[run.key] < _TRIES:
            self._suspects.append(task)
        else:
            yield _blank(run) | {"error": ENDED}, 0.0
