"""Where a world's energy has gone: `Ledger` holds the accounts, `EnergyLedger` keeps them while the world steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from pyverlet.common.shown import line
from pyverlet.laws.forces import has_potential, soften
from pyverlet.laws.links import Links
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import spin_radius


@dataclass(repr=False)
class Ledger:
    """What has changed a world's energy since it was built, J: positive is gained, negative lost.

    An empty world has none, so that the sum of all accounts is `world.energy().total`, to rounding. What moving obstacles bring
    or take is under restitution and projection.

    Attributes:
        restitution: taken by impacts: (1 - e^2) of the energy along the normal. Contacts at rest are impacts with e = 0.
        friction: taken by Coulomb friction.
        rolling: taken by rolling resistance.
        drag: work of forces whose `account` is "drag".
        forces: work of all other forces without a potential, such as a user's own and the mouse.
        motors: work of motors.
        thermostat: brought by heat baths, `pyverlet.Langevin`; negative where their friction takes more.
        links: taken by links: damping, and what stiff ones do not give back.
        projection: put in by moving overlapping circles apart, where contacts together gained more than they took in a frame.
        limiter: taken back by the energy limiter: what contacts had gained in a frame beyond what they may.
        walls: work of a room that turns.
        outside: brought by what was done between frames: particles added, removed or written to, gravity changed.
        seam: m g L of each that fell through the boundary of a periodic room, and is up again.
        residual: what is left over: the error of the integrator and, with forces that have no potential, of the trapezoidal rule
            their work is summed by.
    """

    restitution: float = 0.0
    friction: float = 0.0
    rolling: float = 0.0
    drag: float = 0.0
    forces: float = 0.0
    motors: float = 0.0
    thermostat: float = 0.0
    links: float = 0.0
    projection: float = 0.0
    limiter: float = 0.0
    walls: float = 0.0
    outside: float = 0.0
    seam: float = 0.0
    residual: float = 0.0

    @property
    def total(self) -> float:
        """Sum of all accounts, J."""
        return sum(self.as_dict().values())

    def as_dict(self) -> dict[str, float]:
        """Account by name."""
        return asdict(self)

    def __repr__(self) -> str:
        return line("Ledger", **{name: joules or None for name, joules in self.as_dict().items()})


class _Instant(NamedTuple):
    """Energy of the world, J; power of forces without potential by account, W."""

    energy: float
    power: dict[str, float]


class EnergyLedger:
    """Keeps a ledger from frame to frame."""

    def __init__(self) -> None:
        self.ledger = Ledger()
        self._energy = 0.0  # at the end of the last frame
        # J of friction, against rolling and by motors, that velocities shown then held of the last substep
        self._held = 0.0, 0.0, 0.0

    def copy(self) -> EnergyLedger:
        """Another one with the same accounts."""
        other = EnergyLedger()
        other.ledger, other._energy, other._held = replace(self.ledger), self._energy, self._held
        return other


class FrameLedger:
    """The ledger of one frame of a world, to be told of each stage; it passes on what it is told to the profile.

    What contacts change is what the core has noted of them (`core.work`); the work of forces without a potential is summed by the
    trapezoidal rule; the rest is the integrator's. At the end of a frame velocities hold half of what contacts gave in the last
    substep, as if evenly: what that is worth is counted when a frame ends, and taken back when the next one begins.
    """

    def __init__(self, world: Any) -> None:
        self._energy_ledger: EnergyLedger = world._energy_ledger
        self._state: SortedState = world._sorted
        self._links: Links = world.links
        self._on_stage_end: Callable[[str], None] = world.profile.mark
        self._gravity, self._t, forces, kept = world.gravity, world.time, world._force_sum, self._energy_ledger
        self._holding = [force for force in forces.forces if has_potential(force)]
        self._working = [force for force in forces.forces if hasattr(force, "dissipate") or not has_potential(force)]
        self._entries, self._held = Ledger(**vars(kept.ledger)), kept._held
        self._now = _Instant(0.0, {})
        self._begun = self._risen = 0.0  # J when the frame began; of those at its end, of who is beyond the periodic boundary
        self._engine: Any = None
        # J by impacts, by friction, against rolling, by walls, by motors, and by all contacts and links in this frame
        self._sums = [0.0] * 6

    def __call__(self, stage: str) -> None:
        self._on_stage_end(stage)
        if stage == "gather":
            self._now = self._look(0.0)
            self._begun, risen = self._now.energy, self._lifted_by_wrapping()
            self._entries.outside += self._begun - risen - self._energy_ledger._energy
            self._entries.seam += risen
        elif stage == "finish":
            self._now, self._risen = self._look(0.0, works=False), self._lifted_by_wrapping()
            self._entries.residual += self._now.energy - self._begun
        else:
            return
        self._on_stage_end("ledger")

    def begin(self, engine: Any, share: float) -> None:
        """Substeps begin; of what contacts gave in the last one, velocities hold `share`."""
        engine.record_work(True)
        # Along tangents as the last frame has found it: lists of contacts may be made anew since.
        friction, rolled, driven = self._held if share else (0.0, 0.0, 0.0)
        self._engine, self._sums = engine, [0.0, -friction, -rolled, 0.0, -driven, -engine.energy_of_last(share)[0]]

    def moved(self, lag: float, gave: Any, kick: float, *, leaps: bool = False) -> None:
        """A substep is over, and velocities are those of `lag` s ago; contacts gave `gave` (n, 2) m/s in it.

        leaps: a heat bath has changed velocities since: in `lag` s drag takes of what they are now, not of what they were.
        """
        self._t += 0.0 if leaps else self._state.h
        if not self._working:
            return
        acceleration = self._state.acceleration.copy()
        self._state.acceleration += gave * self._state.real(1.0 / kick)
        self._work(self._power(lag), *((-lag, lag) if leaps else 2 * (0.5 * self._state.h,)))
        self._state.acceleration[:] = acceleration

    def gained(self, account: str, joules: float) -> None:
        """So much was given between two substeps."""
        setattr(self._entries, account, getattr(self._entries, account) + joules)
        self._entries.residual -= joules

    def _work(self, power: dict[str, float], before: float, after: float) -> None:
        """For so many s at the power of before, and at this one."""
        for account, now in power.items():
            self.gained(account, before * self._now.power[account] + after * now)
        self._now = self._now._replace(power=power)

    def confined(self, confine: Any, *about: float) -> None:
        """Let walls that the core does not know confine particles."""
        before = self._look(about[1], works=False).energy
        confine(self._state, *about)
        self._sums[5] += self._look(about[1], works=False).energy - before

    def end(self, share: float) -> None:
        """Substeps are over, and velocities those of now, with `share` of what contacts gave in the last one."""
        whole, *held = self._engine.energy_of_last(share)
        self._held = resting, rolled, driven = tuple(held)
        (impacts, friction, walls, places, rolling, motors), contacts = self._engine.record_work(False)
        more = impacts, friction + resting, rolling + rolled, walls, motors + driven, contacts + places + whole
        self._sums = [had + now for had, now in zip(self._sums, more, strict=True)]

    def close(self, limiter: float) -> None:
        """The frame has gone well; limiter: J that the energy limiter has given, negative."""
        impacts, friction, rolling, walls, motors, contacts = self._sums
        rest, entries = contacts - impacts - friction - rolling - walls - motors, self._entries
        entries.restitution += impacts + min(rest, 0.0)
        entries.friction += friction
        entries.rolling += rolling
        entries.projection += max(rest, 0.0)
        entries.walls += walls
        entries.motors += motors
        entries.limiter += limiter
        entries.residual -= contacts + limiter
        entries.seam -= self._risen
        self._energy_ledger.ledger = entries
        self._energy_ledger._energy, self._energy_ledger._held = self._now.energy - self._risen, self._held

    def _lifted_by_wrapping(self) -> float:
        """J by which particles are higher where a frame has them than where their images inside a periodic room are."""
        s = self._state
        if not s.periodic or not ((g := np.array(self._gravity)) * s.periodic.period).any():
            return 0.0
        free = np.isfinite(s.mass)
        beyond = s.position[free].astype(float) - s.periodic.wrapped(s.position[free])
        return -float(s.mass[free].astype(float) @ (beyond @ g))

    def _look(self, lag: float, *, works: bool = True) -> _Instant:
        """Now, with velocities that are `lag` seconds behind. works: whether the power of forces is asked for."""
        s = self._state
        energy: float = s.engine.total_energy(
            s.position, s.velocity, s.acceleration, lag, s.spin, spin_radius(s.inertia, s.radius, s.mass), s.mass, *self._gravity
        )  # fmt: skip
        held = self._links.energy(s.where()) if self._links and self._links.pool.gives else 0.0
        if self._holding:
            state = s.in_users_order()
            state.periodic.wrap(state.position)  # as they will be: rounded anew
            held += sum(force.potential(state) for force in self._holding)
        return _Instant(energy + held, self._power(lag) if works and self._working else {})

    def _power(self, lag: float) -> dict[str, float]:
        """Power by account, at velocities of the time of the positions."""
        s = self._state
        carried = s.velocity.copy()
        if lag:
            s.velocity += s.real(lag) * s.acceleration
        power: dict[str, float] = {}
        free = np.isfinite(s.mass)
        for force in self._working:
            s.force[:] = 0
            getattr(force, "dissipate", force.apply)(s, self._t)  # of one with a potential, too, the part that takes energy
            soften(s, self._gravity)
            account = getattr(force, "account", "forces")
            work = np.einsum("ij,ij", s.force[free].astype(np.float64), s.velocity[free].astype(np.float64))
            power[account] = power.get(account, 0.0) + float(work)
        s.velocity[:] = carried
        return power
