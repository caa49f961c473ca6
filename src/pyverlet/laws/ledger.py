"""Where a world's energy has gone: `Ledger` holds the accounts, `Bookkeeper` keeps them while the world steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from pyverlet.laws.forces import ForceSum, has_potential, soften
from pyverlet.laws.links import Links
from pyverlet.state.slots import Slots


@dataclass
class Ledger:
    """What has changed a world's energy since it was built, J: positive is gained, negative lost.

    An empty world has none, so that the sum of all accounts is `world.energy().total`, to rounding. What moving obstacles bring
    or take is under restitution and projection.

    Attributes:
        restitution: taken by impacts: (1 - e^2) of the energy along the normal. Contacts at rest are impacts with e = 0.
        friction: taken by Coulomb friction.
        drag: work of forces whose `account` is "drag".
        forces: work of all other forces without a potential, such as a user's own and the mouse.
        links: taken by links: damping, and what stiff ones do not give back.
        projection: put in by moving overlapping circles apart, where contacts together gained more than they took in a frame.
        limiter: taken back by the energy limiter: what contacts had gained in a frame beyond what they may.
        walls: work of a room that turns.
        outside: brought by what was done between frames: particles added, removed or written to, gravity changed.
        seam: m g L of each that fell through the seam of a periodic room, and is up again.
        residual: what is left over: the error of the integrator and, with forces that have no potential, of the trapezoidal rule
            their work is summed by.
    """

    restitution: float = 0.0
    friction: float = 0.0
    drag: float = 0.0
    forces: float = 0.0
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


class _Instant(NamedTuple):
    """Energy of the world, J; the part of it that links and forces hold; power of forces without potential by account, W."""

    energy: float
    held: float
    power: dict[str, float]


class Bookkeeper:
    """Keeps a ledger: looks at the energy after each integration and after the contacts of each substep.

    What the integration changes is the work of forces, the rest its error; what contacts change is told by their kernels, as far
    as impacts and friction go, and the rest is restitution where it is a loss, projection where it is a gain.
    """

    def __init__(self) -> None:
        self.ledger = Ledger()
        self._energy = 0.0  # at the end of the last frame
        self._resting = 0.0  # what it lacked then of that between substeps: users see who rests without what carries its weight

    def copy(self) -> Bookkeeper:
        """Another one with the same accounts."""
        other = Bookkeeper()
        other.ledger, other._energy, other._resting = replace(self.ledger), self._energy, self._resting
        return other


class Page:
    """The books of one frame, to be told of each stage; it passes on what it is told to `done`."""

    def __init__(
        self, books: Bookkeeper, state: Slots, forces: ForceSum, links: Links, t: float, h: float, lag: float,
        done: Callable[[str], None],
    ) -> None:  # fmt: skip
        self._books, self._state, self._links, self._done = books, state, links or None, done
        self._gravity, self._t, self._h, self._lag = forces.gravity, t, h, lag
        self._holding = [force for force in forces.forces if has_potential(force)]
        self._working = [force for force in forces.forces if not has_potential(force)]
        self._open = replace(books.ledger)
        self._contacts, self._resting = 0.0, books._resting
        self._now = _Instant(0.0, 0.0, {})
        self._settled = False  # whether positions are final in this substep
        self._risen = 0.0

    def __call__(self, stage: str) -> None:
        self._done(stage)
        self._book(stage)

    @property
    def plain(self) -> bool:
        """Whether energies are all there is to know after each stage."""
        return not (self._working or self._holding or (self._links and self._links.give))

    def read(self, energies: Any, substep: int, reached: int, *, opens: bool) -> None:
        """Stages have gone by since the integration of `substep`, with it if it `opens`, up to the end of that before `reached`.

        energies: (substeps, LOOKS) J, as in `kernels.frame.Services`.
        """
        page, contacts, now = self._open, self._contacts, self._now.energy
        for k, (integrated, touched, joined, stilled, pulled) in enumerate(energies[substep:reached].tolist()):
            if opens or k > 0:
                self._t += self._h
                # The first integration gives back what the last frame has left out.
                page.residual += integrated - now + self._resting
                contacts -= self._resting
                self._resting, now = 0.0, integrated
            if self._links:
                contacts += touched - now
                page.links += joined - touched
                now = joined
            contacts += stilled - now
            now = stilled
            if self._links:
                page.links += pulled - now
                now = pulled
        self._contacts, self._now, self._settled = contacts, _Instant(now, 0.0, {}), True

    def _book(self, stage: str) -> None:
        if stage == "gather":
            self._state.keep_account()
            self._now = self._look(0.0)
            risen = self._beyond_seam()
            self._open.outside += self._now.energy - risen - self._books._energy
            self._open.seam += risen
        elif stage == "integrate":
            self._t += self._h
            self._settled = False
            before, self._now = self._now, self._look(self._lag)
            gained = self._now.energy - before.energy
            for account, power in self._now.power.items():
                work = 0.5 * self._h * (before.power[account] + power)
                setattr(self._open, account, getattr(self._open, account) + work)
                gained -= work
            # The first integration gives back what the last frame has left out.
            self._open.residual += gained + self._resting
            self._contacts -= self._resting
            self._resting = 0.0
        elif stage == "links":
            # Before the contacts they move what they join; after them they are but part of the acceleration.
            before, self._now = self._now, self._look(self._lag, moved=not self._settled, works=self._settled)
            self._open.links += self._now.energy - before.energy
        elif stage == "velocities" or (stage == "contacts" and self._links):
            self._settled = stage == "velocities"
            before, self._now = self._now, self._look(self._lag, works=self._settled and not self._links)
            self._contacts += self._now.energy - before.energy
        elif stage == "finish":
            # Velocities as users see them: those of circles at rest without what carries their weight.
            before, self._now = self._now, self._look(0.0)
            self._resting = self._now.energy - before.energy
            self._contacts += self._resting
            self._risen = self._beyond_seam()
        else:
            return
        self._done("ledger")

    def close(self, spent: tuple[float, float, float, float]) -> None:
        """The frame has gone well; `spent` is what impacts, friction, the energy limiter and the room say they have given, J."""
        restitution, friction, limiter, walls = spent
        rest = self._contacts - restitution - friction - limiter - walls
        self._open.restitution += restitution + min(rest, 0.0)
        self._open.friction += friction
        self._open.projection += max(rest, 0.0)
        self._open.limiter += limiter
        self._open.seam -= self._risen
        self._open.walls += walls
        self._books.ledger, self._books._resting = self._open, self._resting - limiter
        self._books._energy = self._now.energy - self._risen

    def _beyond_seam(self) -> float:
        """J by which particles are higher where a frame has them than where their images inside a periodic room are."""
        s = self._state
        if not s.seam or not ((g := np.array(self._gravity)) * s.seam.period).any():
            return 0.0
        free = np.isfinite(s.mass)
        beyond = s.position[free].astype(float) - s.seam.wrapped(s.position[free])
        return -float(s.mass[free].astype(float) @ (beyond @ g))

    def _look(self, lag: float, *, moved: bool = True, works: bool = True) -> _Instant:
        """Now. moved: whether positions may have changed since `_now`. works: whether the power of forces is asked for."""
        s, held = self._state, self._now.held
        energy: float = s.motion.total_energy(
            s.position, s.velocity, s.acceleration, lag, s.spin, s.radius, s.mass, *self._gravity
        )  # fmt: skip
        if moved:
            held = self._links.stored(s) if self._links else 0.0
            if self._holding:
                state = s.in_users_order()
                held += sum(force.potential(state) for force in self._holding)
        return _Instant(energy + held, held, self._power(lag) if works and self._working else {})

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
            force.apply(s, self._t)
            soften(s, self._gravity)
            account = getattr(force, "account", "forces")
            work = np.einsum("ij,ij", s.force[free].astype(np.float64), s.velocity[free].astype(np.float64))
            power[account] = power.get(account, 0.0) + float(work)
        s.velocity[:] = carried
        return power
