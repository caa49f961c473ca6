"""Forces besides gravity: objects whose `apply(state, t)` adds newtons to `state.force`.

`state` is the engine's working copy, a `SortedState`: arrays in the engine's order, with the user's index of each row in
`state.particle`. A force that depends on velocity sets `velocity_dependent = True`, so that integrators keep their order. A
conservative force has `potential(state)` in joules, which the world's energy includes. The work of other forces is booked in the
world's ledger, under `forces` or the name in the force's `account`. Forces between particles within a range derive from
`PairForce`; those that act once per substep have `end_substep(state, at)`.

To add one: a class with `apply`, and a test against its closed form; or a function with `@pyverlet.force`.
"""

from __future__ import annotations

from pyverlet.laws.forces._base import Conservative, Force, ForceList, ForceSum, Numbered, Substep, has_potential, soften
from pyverlet.laws.forces.drag import Drag, Langevin, Wind
from pyverlet.laws.forces.external import Attractor, ConstantForce, PointSpring
from pyverlet.laws.forces.fluid import Fluid
from pyverlet.laws.forces.function import FunctionForce, force
from pyverlet.laws.forces.mouse import Grip, Push
from pyverlet.laws.forces.pair import PairForce, PairFunctionForce, PairLaw, pair_force
from pyverlet.laws.forces.pair_laws import Cohesion, Gravitation, LennardJones, SoftRepulsion, Yukawa

__all__ = [
    "Attractor", "Cohesion", "Conservative", "ConstantForce", "Drag", "Fluid", "Force", "ForceList", "ForceSum", "FunctionForce",
    "Gravitation", "Grip", "Langevin", "LennardJones", "Numbered", "PairForce", "PairFunctionForce", "PairLaw", "PointSpring",
    "Push", "SoftRepulsion", "Substep", "Wind", "Yukawa", "force", "has_potential", "pair_force", "soften",
]  # fmt: skip
