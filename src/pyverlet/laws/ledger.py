"""Energy accounts of a world: `Ledger` holds the sums, `EnergyLedger` updates them while the world steps."""

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
    """Changes of a world's energy since it was built, J, by account: positive is gained, negative lost.

    An empty world has zero energy, so the sum of all accounts is `world.energy().total`, up to rounding. Energy from moving
    obstacles is in restitution and projection.

    Attributes:
        restitution: lost in impacts: (1 - e^2) of the energy along the normal. Resting contacts are impacts with e = 0.
        friction: lost to Coulomb friction.
        rolling: lost to rolling resistance.
        drag: work of forces whose `account` is "drag".
        forces: work of all other forces without a potential, such as user-defined ones and the mouse.
        motors: work of motors.
        thermostat: work of heat baths, `pyverlet.Langevin`; negative if their friction prevails.
        links: lost in links, by damping and by stiff ones.
        projection: gained by separating overlapping circles, where contacts together gained more than they took in a frame.
        limiter: removed by the energy limiter: what contacts had gained in a frame beyond the limit.
        walls: work of a room that turns.
        outside: changes between frames: particles added, removed or written to, gravity changed.
        seam: m g L of each particle that fell through a periodic boundary, and is at the top again.
        residual: the rest: the error of the integrator and, with forces without a potential, of the trapezoidal rule for their
            work.
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
        """The accounts by name."""
        return asdict(self)

    def __repr__(self) -> str:
        return line("Ledger", **{name: joules or None for name, joules in self.as_dict().items()})


class _Instant(NamedTuple):
    """Energy of the world, J; power of forces without potential by account, W."""

    energy: float
    power: dict[str, float]


class EnergyLedger:
    """Updates a ledger from frame to frame."""

    def __init__(self) -> None:
        self.ledger = Ledger()
        self._energy = 0.0  # at the end of the last frame
        # J of friction, rolling resistance and motors in the last substep, as contained in velocities then
        self._held = 0.0, 0.0, 0.0

    def copy(self) -> EnergyLedger:
        """An independent copy."""
        other = EnergyLedger()
        other.ledger, other._energy, other._held = replace(self.ledger), self._energy, self._held
        return other


class FrameLedger:
    """The ledger of one frame; called at the end of each stage, and passes the calls on to the profile.

    Energy changes by contacts are recorded by the core (`core.work`); the work of forces without a potential is summed by the
    trapezoidal rule; the rest is the integrator's. At the end of a frame velocities contain half of the last substep's contact
    impulses, as if given evenly: that energy is booked when a frame ends, and removed when the next one begins.
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
        self._begun = self._risen = 0.0  # J at the start of the frame; by crossing the periodic boundary at its end
        self._engine: Any = None
        # J by impacts, friction, rolling resistance, walls, motors, and by all contacts and links in this frame
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
        """Start of the substeps; velocities contain `share` of the last contact impulses."""
        engine.record_work(True)
        # Tangential parts as the last frame found them, since contact lists may have been remade.
        friction, rolled, driven = self._held if share else (0.0, 0.0, 0.0)
        self._engine, self._sums = engine, [0.0, -friction, -rolled, 0.0, -driven, -engine.energy_of_last(share)[0]]

    def moved(self, lag: float, gave: Any, kick: float, *, leaps: bool = False) -> None:
        """End of a substep; velocities are `lag` s old; contacts gave `gave` (n, 2) m/s in it.

        leaps: a heat bath has changed velocities since, so for `lag` s drag acts on the new ones.
        """
        self._t += 0.0 if leaps else self._state.h
        if not self._working:
            return
        acceleration = self._state.acceleration.copy()
        self._state.acceleration += gave * self._state.real(1.0 / kick)
        self._work(self._power(lag), *((-lag, lag) if leaps else 2 * (0.5 * self._state.h,)))
        self._state.acceleration[:] = acceleration

    def gained(self, account: str, joules: float) -> None:
        """Book energy given between two substeps."""
        setattr(self._entries, account, getattr(self._entries, account) + joules)
        self._entries.residual -= joules

    def _work(self, power: dict[str, float], before: float, after: float) -> None:
        """Book work for so many seconds at the previous power, and at the current one."""
        for account, now in power.items():
            self.gained(account, before * self._now.power[account] + after * now)
        self._now = self._now._replace(power=power)

    def confined(self, confine: Any, *about: float) -> None:
        """Call user-defined walls to confine particles, and book the work."""
        before = self._look(about[1], works=False).energy
        confine(self._state, *about)
        self._sums[5] += self._look(about[1], works=False).energy - before

    def end(self, share: float) -> None:
        """End of the substeps; velocities are current, with `share` of the last contact impulses."""
        whole, *held = self._engine.energy_of_last(share)
        self._held = resting, rolled, driven = tuple(held)
        (impacts, friction, walls, places, rolling, motors), contacts = self._engine.record_work(False)
        more = impacts, friction + resting, rolling + rolled, walls, motors + driven, contacts + places + whole
        self._sums = [had + now for had, now in zip(self._sums, more, strict=True)]

    def close(self, limiter: float) -> None:
        """Close the page after a successful frame; limiter: J by the energy limiter, negative."""
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
        """Potential energy of particles relative to their images inside a periodic room, J."""
        s = self._state
        if not s.periodic or not ((g := np.array(self._gravity)) * s.periodic.period).any():
            return 0.0
        free = np.isfinite(s.mass)
        beyond = s.position[free].astype(float) - s.periodic.wrapped(s.position[free])
        return -float(s.mass[free].astype(float) @ (beyond @ g))

    def _look(self, lag: float, *, works: bool = True) -> _Instant:
        """Energy and power now, with velocities that are `lag` seconds old. works: whether to evaluate the power of forces."""
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
        """Power by account, with velocities at the time of the positions."""
        s = self._state
        carried = s.velocity.copy()
        if lag:
            s.velocity += s.real(lag) * s.acceleration
        power: dict[str, float] = {}
        free = np.isfinite(s.mass)
        for force in self._working:
            s.force[:] = 0
            getattr(force, "dissipate", force.apply)(s, self._t)  # also the dissipative part of forces with a potential
            soften(s, self._gravity)
            account = getattr(force, "account", "forces")
            work = np.einsum("ij,ij", s.force[free].astype(np.float64), s.velocity[free].astype(np.float64))
            power[account] = power.get(account, 0.0) + float(work)
        s.velocity[:] = carried
        return power
