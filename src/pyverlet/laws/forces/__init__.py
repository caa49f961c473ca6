"""Forces besides gravity: objects with `apply(state, t)`, which add newtons to `state.force`.

`state` is the engine's working copy (`state.state.SortedState`): arrays in the engine's order, `state.particle` naming the user's
index at each sorted index. A force that looks at the velocity says so by `velocity_dependent = True`, so that integrators
keep their order. A conservative force adds `potential(state)` in joules, and the world's energy includes it. The work of any
other is on the world's ledger, under `forces` or the name in the force's `account`. Forces between particles within a range
derive from `PairForce`, those that act once a substep have `end_substep(state, at)`.

To add one: a class with `apply`, and a test against its closed form. Or no class: a function with `@pyverlet.force`.
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
