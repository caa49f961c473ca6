"""A heat bath."""

from __future__ import annotations

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.checked import Checked
from pyverlet.ground.shown import Shown
from pyverlet.laws.forces._base import Substep
from pyverlet.state.slots import Slots


class Langevin(Shown):
    """A heat bath: friction slows every free particle, and random kicks warm it to the temperature (Langevin 1908).

    dv = -friction v dt + sqrt(2 friction temperature / m) dW. Each direction of motion comes to hold temperature / 2 on average,
    whatever the mass, the forces and the room. Spins are left alone. The part of friction and kicks is solved exactly over a
    substep of any length (Ornstein-Uhlenbeck): v' = c v + sqrt((1 - c^2) temperature / m) N, with c = exp(-friction h), N normal.
    With the position Verlet methods positions are then distributed as the temperature says to order 2 in h, and exactly in a
    harmonic well (Leimkuhler and Matthews 2013: the kick stands in the middle of the drift).

    The random numbers are a function of the seed, the number of the frame and of the substep, and the particle's own number
    (SplitMix64): a run repeated, saved and restored, or with other threads has the same bits. Between systems the last bits of
    logarithms and sines may differ. What the bath gives and takes is in
    the ledger's `thermostat`. Nothing sleeps in a heat bath. Collisions with a restitution below 1 take heat for ever.

    Args:
        temperature: k T, J; 0 leaves the friction alone.
        friction: 1/s; the velocity is forgotten after about 1 / friction. 0 does nothing.
        seed: a whole number of at least 0, of which 64 bits count; another one for each heat bath of a world.
    """

    _shows = ("temperature", "friction", "seed")

    velocity_dependent = False
    account = "thermostat"

    temperature = Checked(checks.number, least=0.0)
    friction = Checked(checks.number, least=0.0)
    seed = Checked(checks.whole, least=0)

    def __init__(self, *, temperature: float, friction: float, seed: int = 0) -> None:
        self.temperature, self.friction, self.seed = temperature, friction, seed

    def apply(self, state: Slots, t: float) -> None:
        """No force: all is done once for each substep."""

    def end_substep(self, state: Slots, at: Substep) -> float:
        """Kick each free particle; returns what that has given, J."""
        keeps = float(np.exp(-self.friction * at.h))
        when, law = ((self.seed + 2**63) % 2**64 - 2**63, at.frame, at.step), (keeps, self.temperature, at.lag)
        return float(
            state.motion.thermalize(state.velocity, state.position, state.inverse_mass, state.particle, at.number, when, *law)
        )
