"""Particles that are a fluid."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.ground.shown import Shown
from pyverlet.laws.rooms import Box
from pyverlet.state.group import Group
from pyverlet.state.neighbours import check_range
from pyverlet.state.seam import Seam
from pyverlet.state.slots import Slots
from pyverlet.state.state import EVERYONE, State

Array = NDArray[Any]

FLUID = 1 << 31
"""Category of the particles of fluids, which do not collide with each other."""

SUPPORT = 2.6
"""How far particles feel each other, in spacings at rest."""

MEASURED = 0.97
"""Force per length over stiffness (rho - rest_density): 0.964 in a square and 0.977 in a triangular lattice with this support, by
the virial -sum r W'(r) / 2 over sum W(r)."""

SWIFTEST = 1.2
"""How far sound may come in a substep, in spacings. A tank at rest allows 2; what crashes is pressed together, and needs room."""

THICKEST = 0.07
"""What viscosity times a substep may be, in squares of the spacing. From 0.1 on it throws particles about."""


class Fluid(Shown):
    """Particles that are a weakly compressible fluid, by smoothed particle hydrodynamics (Monaghan 1994; kernel: Wendland 1995).

    The density of a particle is a sum over those within SUPPORT spacings, rho_i = sum m_j W(r_ij); the spacing is
    sqrt(mean mass / rest_density). Its pressure is p_i = stiffness max(rho_i - rest_density, 0): nothing pulls where the fluid
    comes apart. Between two particles act, along the line of centres, for x = x_i - x_j and v = v_i - v_j,

        F_ij = m_i m_j ((p_i / rho_i^2 + p_j / rho_j^2) - 8 viscosity / rest_density (v . x) / (r^2 + R^2 / 400)) (-W'(r) / r) x

    so that momentum and angular momentum are kept to rounding. The pressure has a potential; what viscosity takes is under drag
    in a world's ledger. Pinned particles are no fluid.

    Sound travels at c = sqrt(stiffness): the fluid is compressed by p / (c^2 rho), which is below 1 % if c is ten times what it
    flows with. A substep of h seconds allows sound to come 1.2 spacings, c h <= 1.2 s, and viscosity h <= 0.07 s^2: for a
    stiffer fluid take more substeps.

    Particles of a fluid do not collide with each other, but with walls, obstacles and all else: those of `group` get the category
    `FLUID` (bit 31) and a mask without it, unless they have others. Give them half a spacing as radius, and neither friction nor
    restitution. They never fall asleep.

    Args:
        group: which particles; None is all, and then `collisions=None` is for the world to say.
        rest_density: kg/m^2, of the fluid where nothing presses it.
        stiffness: square of the speed of sound, m^2/s^2.
        viscosity: kinematic, m^2/s.

    Attributes:
        density, pressure: (n,) float64 of the particles of the group, in kg/m^2 and N/m (a pressure in two dimensions is a force
            per length), when they were last asked for: at the end of a frame. NaN of pinned ones.

    Raises:
        InputError: in a step, if a substep is too long for the stiffness or the viscosity, or a periodic room too narrow.
    """

    _shows = ("group", "rest_density", "stiffness", "viscosity")

    velocity_dependent = True
    is_drag = True  # the velocity at the middle of the substep is asked for once, not by iteration

    def __init__(self, group: Group | None = None, *, rest_density: float, stiffness: float, viscosity: float = 0.0) -> None:
        self.group = group
        self.rest_density = checks.number("rest_density", rest_density, above=0.0)
        self.stiffness = checks.number("stiffness", stiffness, above=0.0)
        self.viscosity = checks.number("viscosity", viscosity, least=0.0)
        self.density, self.pressure = np.zeros((2, 0))
        self.dissipation = Viscosity(self)
        self._last: tuple[Array, ...] = ()
        self._energy = 0.0
        self._work: Any = None
        if group is not None and (group.category == 1).all() and (group.mask == EVERYONE).all():
            group.category, group.mask = FLUID, EVERYONE & ~FLUID

    def among(self, state: Slots | State) -> Array:
        """Slots of those whose forces on each other add up to nothing."""
        who = np.arange(len(state)) if self.group is None else self.group.index if len(self.group) else np.zeros(0, int)
        return np.asarray(state.slots_of(who) if isinstance(state, Slots) else who, np.int32)

    def apply(self, state: Slots, t: float) -> None:
        who = self.among(state)
        if len(state.calm):
            state.calm[who] = 0
        self.density, self.pressure = np.full((2, len(who)), np.nan)
        self._flow(state, who, state.force, state.velocity, (self.stiffness, self.viscosity), self.density, self.pressure)
        self.pressure *= MEASURED

    def potential(self, state: State) -> float:
        who = self.among(state)
        given = state.position, state.mass, state.radius, np.array([self.stiffness, self.rest_density])
        if not self._last or not all(map(np.array_equal, given, self._last)):  # a frame begins where the last one has ended
            spare = np.empty((2, len(who)))
            self._energy = self._flow(state, who, None, state.velocity, (self.stiffness, 0.0), *spare)
            self._last = tuple(map(np.copy, given))
        return self._energy

    def _flow(
        self, state: Slots | State, who: Array, force: Array | None, velocity: Array, law: tuple[float, float],
        density: Array, pressure: Array,
    ) -> float:  # fmt: skip
        """Add to `force`, if there is one, and fill density and pressure; else return the energy of compression, J."""
        where, mass = state.position.take(who, axis=0), state.mass.take(who)
        total, motion = float(mass.sum(dtype=float)), core.unit("motion", where.dtype)
        flows = None
        if not (np.isfinite(total) and motion.all_finite(where, where)):
            flows = np.isfinite(mass) & np.isfinite(where).all(axis=1)
            who, where, total = who[flows], where[flows], float(mass[flows].sum(dtype=float))
        if not len(who):
            return 0.0
        spacing = float(np.sqrt(total / len(who) / self.rest_density))
        if force is not None:
            self._check(spacing, state.h)  # type: ignore[union-attr]
        images = _Images(where, velocity.take(who, axis=0), state.seam, SUPPORT * spacing)
        images.beyond_walls(state.room)
        discs = self._discs(state, who, SUPPORT * spacing)
        for disc in discs:
            images.in_disc(state.position[disc].astype(float), velocity[disc].astype(float), float(state.radius[disc]))
        where, moving, owner = images.all()
        found = (density, pressure) if flows is None else np.empty((2, len(who)))
        threads, numbers = getattr(state, "thread_team", (0, 1)), (SUPPORT * spacing, self.rest_density, *law)
        pushed = np.empty((len(owner) - len(who), 2), where.dtype)
        energy = motion.flow_of_fluid(
            force, where, moving, state.mass, who, owner, *numbers, *threads, *found, pushed, self._room(len(owner), where.dtype)
        )
        if force is not None:  # what presses on images in a disc presses on it
            stop = len(pushed)
            for disc, count in zip(discs[::-1], images.counts[::-1], strict=False):
                force[disc] += pushed[stop - count : stop].sum(axis=0, dtype=float)
                stop -= count
        if flows is not None:
            density[flows], pressure[flows] = found
        return float(energy)

    def _room(self, count: int, dtype: Any) -> Any:
        """Arrays for the kernel, kept from one evaluation to the next."""
        if self._work is None or len(self._work[0]) < count + 8 or self._work[0].dtype != dtype:
            self._work = core.unit("motion", dtype).fluid_work(count * 5 // 4, dtype)
        return self._work

    def _discs(self, state: Slots | State, who: Array, reach: float) -> Array:
        """Those of other particles that are large enough to be walls, and collide with these."""
        large = state.radius >= reach
        if not large.any():
            return np.zeros(0, np.int64)
        large[who] = False
        if len(state.category):
            large &= (state.category & state.mask[who[0]] > 0) & (state.mask & state.category[who[0]] > 0)
        return np.flatnonzero(large & np.isfinite(state.position).all(axis=1))

    def _check(self, spacing: float, h: float) -> None:
        most = (SWIFTEST * spacing / h) ** 2 if h else np.inf, THICKEST * spacing**2 / h if h else np.inf
        for name, value, limit, unit in zip(("stiffness", "viscosity"), (self.stiffness, self.viscosity), most,
                                            ("m^2/s^2", "m^2/s"), strict=True):  # fmt: skip
            if value > limit:
                raise InputError(
                    f"{name} of the fluid is {value:g}; allowed is at most {limit:g} {unit} for particles {spacing:g} m apart "
                    f"and a substep of {h:g} s: take more substeps, or fewer and larger particles"
                )

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_last": (), "_work": None}


class Viscosity:
    """What a fluid's viscosity does, for ledgers: the force of it alone, in N."""

    account = "drag"

    def __init__(self, fluid: Fluid) -> None:
        self._fluid = fluid

    def apply(self, state: Slots, t: float) -> None:
        who = self._fluid.among(state)
        self._fluid._flow(state, who, state.force, state.velocity, (0.0, self._fluid.viscosity), *np.empty((2, len(who))))


class _Images:
    """Particles of a fluid, and their images not farther than `reach` m: places and velocities (k, 2), and whose each is (k,).

    Walls of the room and large discs are mirrors, along which the fluid flows freely. Images of a periodic room are beyond its
    seam.

    Attributes:
        counts: how many images the last ones asked for have, of each disc.
    """

    def __init__(self, position: Array, velocity: Array, seam: Seam, reach: float) -> None:
        self._reach, self._seam, self._owner = reach, seam, np.arange(len(position), dtype=np.int32)
        self._rows = [(seam.wrapped(position), velocity, self._owner)]
        self.counts: list[int] = []
        if seam:
            check_range(reach, seam)
            low, period, inside = np.array(seam[:2]), np.array(seam.period), self._rows[0][0]
            for way in seam.images()[1:]:
                place = inside + way.astype(position.dtype)
                near = (((place > low - reach) & (place < low + period + reach)) | (period == 0)).all(axis=1)
                self._rows.append((place[near], velocity[near], self._owner[near]))

    def _mirror(self, which: Array, *mirrors: tuple[Array, Array], velocity: Array | float = 0.0) -> None:
        """Add the images of these in walls, one after the other: (distance, normal out of the wall) of each."""
        position, moves, _ = self._rows[0]
        place, relative = position[which].astype(float), moves[which] - velocity
        for gap, normal in mirrors:
            place -= 2 * gap[:, None] * normal
            relative = relative - 2 * (relative * normal).sum(axis=1)[:, None] * normal
        velocities = (relative + velocity).astype(position.dtype)
        self._rows.append((place.astype(position.dtype), velocities, self._owner[which]))

    def beyond_walls(self, room: Any) -> None:
        """Add those in the walls and corners of a room."""
        position, reach = self._rows[0][0], self._reach
        near: Array = self._owner
        if isinstance(room, Box):  # few are near its walls
            (x0, y0), (x1, y1), (x, y) = room.lower, room.upper, position.T
            near = np.flatnonzero((x < x0 + reach) | (x > x1 - reach) | (y < y0 + reach) | (y > y1 - reach))
        faced = room.facing(position[near]) if room is not None and len(near) else None
        if faced is None:
            return
        gaps, normals = faced
        close = (gaps > 0) & (gaps < reach)
        walls = [int(k) for k in np.flatnonzero(close.any(axis=0))]
        for k in walls:
            rows = np.flatnonzero(close[:, k])
            self._mirror(near[rows], (gaps[rows, k], normals[rows, k]))
        for k, other in itertools.combinations(walls, 2):
            across = np.abs((normals[:, k] * normals[:, other]).sum(axis=1)) < 0.5
            rows = np.flatnonzero(close[:, k] & close[:, other] & across)
            self._mirror(near[rows], *((gaps[rows, wall], normals[rows, wall]) for wall in (k, other)))

    def in_disc(self, center: Array, velocity: Array, radius: float) -> None:
        """Add those in a disc."""
        position = self._rows[0][0]
        far = radius + self._reach
        which = np.flatnonzero((np.abs(self._seam.nearest(position - center.astype(position.dtype))) < far).all(axis=1))
        way = self._seam.nearest(position[which] - center)
        distance = np.hypot(*way.T)
        close = (distance > radius) & (distance < far)
        normal = way[close] / distance[close, None]
        self._mirror(which[close], (distance[close] - radius, normal), velocity=velocity)
        self.counts.append(int(close.sum()))

    def all(self) -> tuple[Array, Array, NDArray[np.int32]]:
        """Places, velocities and owners; particles first."""
        if len(self._rows) == 1:
            return self._rows[0]
        position, velocity, owner = (np.concatenate(column) for column in zip(*self._rows, strict=True))
        return position, velocity, owner
