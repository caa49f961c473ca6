"""The books of one frame under the contact law: what contacts change is summed by the core, the rest is the integrator's."""

from __future__ import annotations

from typing import Any

from pyverlet.laws.ledger import Page


class ImpulsePage(Page):
    """What the core has noted of contacts (`core.work`), and the trapezoidal rule for forces without a potential.

    At the end of a frame velocities hold half of what contacts gave in the last substep, as if evenly: what that is worth is
    counted when a frame ends, and taken back when the next one begins.
    """

    _engine: Any = None
    _begun = 0.0  # energy, J
    _sums = (0.0, 0.0, 0.0, 0.0)  # J by impacts, by friction, by walls, and by all contacts in this frame

    def begin(self, engine: Any, share: float) -> None:
        """Substeps begin; of what contacts gave in the last one, velocities hold `share`."""
        engine.book(True)
        # Along tangents as the last frame has found it: lists of contacts may be made anew since.
        self._engine, self._sums = engine, (0.0, -self._resting if share else 0.0, 0.0, -engine.energy_of_last(share)[0])

    def moved(self, lag: float, gave: Any, kick: float) -> None:
        """A substep is over, and velocities are those of `lag` s ago; contacts gave `gave` (n, 2) m/s in it."""
        self._t += self._state.h
        if not self._working:
            return
        acceleration = self._state.acceleration.copy()
        self._state.acceleration += gave * self._state.real(1.0 / kick)
        self._work(self._power(lag))
        self._state.acceleration[:] = acceleration

    def _work(self, power: dict[str, float]) -> None:
        for account, now in power.items():
            work = 0.5 * self._state.h * (self._now.power[account] + now)
            setattr(self._open, account, getattr(self._open, account) + work)
            self._open.residual -= work
        self._now = self._now._replace(power=power)

    def confined(self, confine: Any, *about: float) -> None:
        """Let walls that the core does not know confine particles."""
        before = self._look(about[1], works=False).energy
        confine(self._state, *about)
        self._add(0.0, 0.0, 0.0, self._look(about[1], works=False).energy - before)

    def end(self, share: float) -> None:
        """Substeps are over, and velocities those of now, with `share` of what contacts gave in the last one."""
        whole, self._resting = self._engine.energy_of_last(share)
        self._engine.book(False)
        impacts, friction, walls, places = self._engine.arrays["work"].sum(axis=0).tolist()
        self._add(impacts, friction + self._resting, walls, float(self._engine.arrays["gained"].sum()) + places + whole)

    def _add(self, *more: float) -> None:
        self._sums = tuple(a + b for a, b in zip(self._sums, more, strict=True))  # type: ignore[assignment]

    def _book(self, stage: str) -> None:
        if stage == "gather":
            super()._book(stage)
            self._begun = self._now.energy
        elif stage == "finish":
            self._now, self._risen = self._look(0.0, works=False), self._beyond_seam()
            self._open.residual += self._now.energy - self._begun
            self._done("ledger")

    def close(self, spent: tuple[float, float, float, float]) -> None:
        """The frame has gone well; the energy limiter says what it has given."""
        impacts, friction, walls, contacts = self._sums
        rest, limiter = contacts - impacts - friction - walls, spent[2]
        page = self._open
        page.restitution += impacts + min(rest, 0.0)
        page.friction += friction
        page.projection += max(rest, 0.0)
        page.walls += walls
        page.limiter += limiter
        page.residual -= contacts + limiter
        page.seam -= self._risen
        self._books.ledger, self._books._resting = page, self._resting
        self._books._energy = self._now.energy - self._risen
