"""What a world's energy and momentum are."""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.core import unit
from pyverlet.laws.forces import has_potential
from pyverlet.state.state import State, spin_radius


class Energy(NamedTuple):
    """Energy of a world, J. Pinned particles have none. Gravity's potential is 0 at the origin."""

    kinetic: float
    spin: float
    potential: float
    links: float

    @property
    def total(self) -> float:
        """kinetic + potential + links; spin is part of kinetic."""
        return self.kinetic + self.potential + self.links


def energy(state: State, gravity: tuple[float, float], forces: list[Any], links: float) -> Energy:
    """Energy of a state under gravity and those forces that have a potential."""
    energies = unit("engine", state.position.dtype).energies
    motion, spin, potential = energies(state.position, state.velocity, state.spin, spin_radius(state), state.mass, *gravity)
    potential += sum(force.potential(state) for force in forces if has_potential(force))
    return Energy(kinetic=motion + spin, spin=spin, potential=potential, links=links)
