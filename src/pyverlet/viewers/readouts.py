"""Numbers shown beside the picture."""

import time
from collections import deque
from typing import Any

from pyverlet.viewers import controls
from pyverlet.viewers.frames import Status
from pyverlet.viewers.view_state import ViewState
from pyverlet.world.clock import FrameBudget

SLOW_STATUS_S = 0.1  # interval of slow readouts (energy, percentiles), which read every particle or many frames
PACE_S = 1.0  # averaging time of the measured speed


class Readouts:
    """Reads the numbers of a `ViewState`. Used by the physics thread only.

    Attributes:
        budget: frame time statistics.
    """

    def __init__(self) -> None:
        self.budget = FrameBudget()
        self._due = 0.0
        self._passed: deque[tuple[float, float]] = deque()

    def passed(self, time_of_world: float) -> None:
        """Called after each frame; time_of_world in s."""
        now = time.perf_counter()
        self._passed.append((now, time_of_world))
        while len(self._passed) > 2 and now - self._passed[1][0] >= PACE_S:
            self._passed.popleft()

    def held(self) -> None:
        """Called when the world pauses, which does not count."""
        self._passed.clear()

    @property
    def pace(self) -> float | None:
        """Simulated seconds per wall-clock second, averaged over the last `PACE_S`."""
        if len(self._passed) < 2:
            return None
        (began, start), (ended, end) = self._passed[0], self._passed[-1]
        return (end - start) / max(ended - began, 1e-9)

    def read(self, view_state: ViewState, *, at_once: bool, complaint: str | None = None, **session: Any) -> Status:
        """The current numbers. Slow ones may be slightly older, unless `at_once`; `session`: fields from the session."""
        now = time.perf_counter()
        if now >= self._due or at_once:
            self._due = now + SLOW_STATUS_S
            self._read_slow(view_state)
        stages: dict[str, float] = {}
        for world in view_state.worlds:
            for name, ms in world.profile.stages.items():
                stages[name] = stages.get(name, 0.0) + ms
        ledgers = [world.ledger.as_dict() for world in view_state.worlds if world.keeps_ledger]
        all_keep = len(ledgers) == len(view_state.worlds)
        return Status(
            time=float(view_state.panels.time),
            frames=int(view_state.panels.frames),
            particles=len(view_state),
            physics_ms=float(self.budget.last_ms),
            stages=stages,
            ledger={account: sum(each[account] for each in ledgers) for account in ledgers[0]} if all_keep else None,
            **self._slow,
            **controls.read(view_state.worlds[0]),
            pace=self.pace,
            graph=view_state.presentation.graph and view_state.presentation.graph(view_state.worlds[0]),
            complaint=complaint or view_state.complaint,
            sliders=view_state.sliders(),
            undo=view_state.history.depth,
            **session,
        )

    def _read_slow(self, view_state: ViewState) -> None:
        energies = [each.energy() for each in view_state.worlds]
        totals = tuple(float(energy.total) for energy in energies)
        self._slow: dict[str, Any] = {
            **{name: sum(float(getattr(each, name)) for each in energies) for name in ("kinetic", "potential", "links")},
            "energy": sum(totals),
            "energies": totals,
            "physics_median_ms": float(self.budget.median_ms),
            "physics_p95_ms": float(self.budget.p95_ms),
            "watched": view_state.watched(),
        }
