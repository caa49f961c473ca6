"""The `Fluid` force, which makes particles a weakly compressible fluid."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet import core
from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.checked import Checked
from pyverlet.common.shown import Shown
from pyverlet.laws.boundaries import Box, Circle, Periodic
from pyverlet.state.group import Group, checked_group, members
from pyverlet.state.neighbours import check_range
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import EVERYONE, State

FLUID = 1 << 31
"""Category of fluid particles, which do not collide with each other; the second fluid of a world uses half of it, and so on."""

SUPPORT = 2.6
"""Interaction range, in spacings at rest."""

MIRRORED = 1.0
"""Radius from which on discs are mirrors, in spacings."""

MEASURED = 0.96
"""Force per length over stiffness (rho - rest_density): 0.954 in a square and 0.968 in a triangular lattice with this support, by
the virial -sum r W'(r) / 2 over (sum W(r))^2. Density sums exceed the mass per area by 1 %."""

SWIFTEST = 1.2
"""Distance that sound may travel per substep, in spacings. A tank at rest allows 2; impacts compress it and need a margin."""

THICKEST = 0.07
"""Most of viscosity times substep, in squares of the spacing. From 0.1 on it is unstable."""


class Fluid(Shown):
    """Particles as a weakly compressible fluid, by smoothed particle hydrodynamics (Monaghan 1994; kernel: Wendland 1995).

    The density of a particle is a sum over those within SUPPORT spacings, rho_i = sum m_j W(r_ij); the spacing is
    sqrt(mean mass / rest_density). Its pressure is p_i = stiffness max(rho_i - rest_density, 0): there is no tension. Two
    particles exert forces along the line of centres, for x = x_i - x_j and v = v_i - v_j,

        F_ij = m_i m_j ((p_i / rho_i^2 + p_j / rho_j^2) - 8 viscosity / rest_density (v . x) / (r^2 + R^2 / 400)) (-W'(r) / r) x

    so that momentum and angular momentum are conserved up to rounding. The pressure has a potential; viscous dissipation is
    booked under drag in a world's ledger. Pinned particles are not fluid.

    The speed of sound is c = sqrt(stiffness): the fluid is compressed by p / (c^2 rho), which is below 1 % if c is ten times the
    flow speed. In a substep of h seconds sound may travel 1.2 spacings, c h <= 1.2 s, and viscosity h <= 0.07 s^2: frames with
    longer substeps are divided, at the corresponding cost.

    Fluid particles do not collide with each other, but with walls, obstacles and all else, also with another fluid: those of
    `group` get the category `FLUID` (bit 31; for a world's second fluid bit 30, and so on) and a mask without it, unless they
    have others. Their radius should be half a spacing, without friction and restitution. They never fall asleep.

    Args:
        group: the fluid particles; None for all, in which case the world should have `collisions=None`.
        rest_density: kg/m^2, of the fluid without pressure.
        stiffness: square of the speed of sound, m^2/s^2.
        viscosity: kinematic, m^2/s.

    Attributes:
        density, pressure: (n,) float64 of the particles of the group, in kg/m^2 and N/m (in two dimensions a pressure is a force
            per length), at the end of the last frame. NaN for pinned ones.

    Raises:
        InputError: in a step, if a periodic room is too narrow, or a frame would take more substeps than worlds may have.
    """

    _shows = ("group", "rest_density", "stiffness", "viscosity")

    velocity_dependent = True
    account = "drag"
    in_any_order = True  # its potential does not depend on the order of particles
    is_drag = True  # evaluated once at the velocity in the middle of the substep, without iteration

    group = Checked(checked_group)
    rest_density = Checked(checks.number, above=0.0)
    stiffness = Checked(checks.number, above=0.0)
    viscosity = Checked(checks.number, least=0.0)

    def __init__(self, group: Group | None = None, *, rest_density: float, stiffness: float, viscosity: float = 0.0) -> None:
        self.group, self.rest_density, self.stiffness, self.viscosity = group, rest_density, stiffness, viscosity
        self.density, self.pressure = np.zeros((2, 0))
        self._last: tuple[Array, ...] = ()
        self._held: tuple[Any, ...] = None, None, 0.0
        self._known: tuple[Any, ...] = (None,)
        self._work: list[Array] = []
        if group is not None and (group.category == 1).all() and (group.mask == EVERYONE).all():
            own = FLUID
            while (group.world.category & own).any():
                own //= 2
            group.category, group.mask = own, EVERYONE & ~own

    def among(self, state: SortedState | State) -> Array:
        """Rows of particles whose mutual forces sum to zero."""
        which = np.arange(len(state))[members(self.group)]
        return np.asarray(state.sorted_index(which) if isinstance(state, SortedState) else which, np.int32)

    def apply(self, state: SortedState, t: float) -> None:
        which = self._members(state)[0]
        if len(state.sleep_timer):
            state.sleep_timer[which] = 0
        self.density, self.pressure = self._flow(state, state.force, (self.stiffness, self.viscosity))
        self.pressure *= MEASURED

    def dissipate(self, state: SortedState, t: float) -> None:
        """As `apply`, with the viscous forces alone."""
        self._flow(state, state.force, (0.0, self.viscosity))

    def potential(self, state: SortedState | State) -> float:
        density, law = self._flow(state, None, (0.0, 0.0))[0], (self.rest_density, self.stiffness)
        if density is not self._held[0] or law != self._held[1]:  # a frame begins where the last one ended
            mass = self._members(state)[1]
            self._held = density, law, float(core.unit("motion", mass.dtype).energy_of_fluid(density, mass, *law))
        return float(self._held[2])

    def _flow(self, state: SortedState | State, force: Array | None, law: tuple[float, float]) -> tuple[Array, Array]:
        """Add to `force`, unless it is None; returns densities and pressures (n,), NaN for particles that are not fluid."""
        which, mass, pinned, spacing, discs = self._members(state)
        density, pressure = whole = found = np.empty((2, len(which)))
        motion, flows, reach = core.unit("motion", state.dtype), None, SUPPORT * spacing
        if pinned or not motion.all_finite(state.position, state.position):
            flows = np.isfinite(mass) & np.isfinite(state.position[which]).all(axis=1)
            whole.fill(np.nan)
            which, mass, found = which[flows], mass[flows], np.empty((2, np.count_nonzero(flows)))
            discs = discs[np.isfinite(state.position[discs]).all(axis=1)]
        if not len(which):
            return density, pressure
        check_range(reach, state.periodic)
        about = state.position[discs], state.radius[discs], np.zeros((len(discs), 2)), state.velocity[discs], discs
        mirrors = np.concatenate((_walls(state.boundary), np.column_stack(about)))
        given = mass, mirrors[:, :5], np.array([reach, *state.periodic])
        if force is None and self._last:  # where the last frame ended
            *before, place, there, known = self._last
            here = state.position
            if which is not there:
                here, place = here.take(which, axis=0), place.take(there, axis=0)
            if all(map(np.array_equal, (*given, here), (*before, place))):
                return known, pressure
        motion.flow_of_fluid(
            force, state.position, state.velocity, mass, which, mirrors, state.periodic, reach, self.rest_density, *law,
            *getattr(state, "thread_team", (0, 1)), *found, self._work,
        )  # fmt: skip
        if found is not whole:
            density[flows], pressure[flows] = found
        self._last = *given, state.position.copy(), which, density
        return density, pressure

    def _members(self, state: SortedState | State) -> tuple[Array, Array, bool, float, Array]:
        """Rows, masses, whether some are pinned, the spacing; in the user's order rows of particles that are mirrors: see
        `core.fluid_images`. Constant within a frame.
        """
        given = getattr(state, "particle", None), getattr(state, "revision", None), self.group, self.rest_density
        if given[0] is None or given[0] is not self._known[0] or given[1:] != self._known[1]:
            which = self.among(state)
            mass = state.mass.take(which)
            flows = np.isfinite(mass)
            spacing = float(np.sqrt(mass[flows].sum(dtype=float) / max(np.count_nonzero(flows), 1) / self.rest_density))
            large = state.radius >= MIRRORED * spacing
            if large.any() and len(which):
                large[which] = False
                if len(state.category):
                    large &= (state.category & state.mask[which[0]] > 0) & (state.mask & state.category[which[0]] > 0)
            discs = np.flatnonzero(large)
            discs = discs if given[0] is None else discs[np.argsort(given[0][discs])]
            self._known = given[0], given[1:], which, mass, not flows.all(), spacing, discs
        return self._known[2:]

    def longest_substep(self, state: SortedState) -> float:
        """The longest substep by stiffness and viscosity, s; longer frames are divided."""
        spacing = self._members(state)[3]
        if spacing == 0.0:  # no fluid particle is left
            return np.inf
        thick = THICKEST * spacing**2 / self.viscosity if self.viscosity else np.inf
        return float(min(SWIFTEST * spacing / np.sqrt(self.stiffness), thick))

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_last": (), "_held": (None, None, 0.0), "_work": []}


def _walls(boundary: Any) -> Array:
    """(w, 8) mirrors of a room's walls for `core.fluid_images`."""
    walls = [(*boundary.center, -boundary.radius, 0, 0)] if isinstance(boundary, Circle) else []
    if isinstance(boundary, Box | Periodic):
        sides = (*boundary.lower, 0, 1, 0), (*boundary.upper, 0, -1, 0), (*boundary.lower, 0, 0, 1), (*boundary.upper, 0, 0, -1)
        walls = [side for side, axis in zip(sides, "xxyy", strict=True) if axis not in getattr(boundary, "axes", "")]
    return np.array([(*wall, 0, 0, -1) for wall in walls], float).reshape(-1, 8)
