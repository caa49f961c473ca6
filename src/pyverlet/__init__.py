"""pyverlet: real-time 2D particle physics on NumPy arrays."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pyverlet.common import loading, versions  # noqa: F401  (first: all that follows takes a second)

# isort: split
from pyverlet import core  # noqa: F401  (next: it may be missing, or made for another Python)

# isort: split
from pyverlet import scenes
from pyverlet.common import errors
from pyverlet.common.errors import CoarseCoordinatesWarning, CoarseStepsWarning, InputError, NonFiniteError, PyverletError
from pyverlet.common.submodules import lazily
from pyverlet.laws import forces, integrators
from pyverlet.laws.boundaries import Boundary, Box, Circle, Open, Periodic
from pyverlet.laws.collisions import BruteForce, Collisions, Fast, Overlap
from pyverlet.laws.events import Events
from pyverlet.laws.forces import (
    Attractor,
    Cohesion,
    ConstantForce,
    Drag,
    Fluid,
    Gravitation,
    Langevin,
    LennardJones,
    PairForce,
    PairLaw,
    PointSpring,
    SoftRepulsion,
    Wind,
    Yukawa,
    force,
    pair_force,
)
from pyverlet.laws.integrators import (
    RK4,
    ExplicitEuler,
    Integrator,
    PositionVerlet,
    SemiImplicitEuler,
    TimeCorrectedVerlet,
    VelocityVerlet,
    Yoshida4,
)
from pyverlet.laws.ledger import Ledger
from pyverlet.laws.links import Angle, AngleLimit, Area, Motor, Pin, Rope, Spring, Stick
from pyverlet.laws.obstacles import Capsule, Chain, Disc, Obstacle, Polygon, Segment
from pyverlet.laws.textbook import ClampAndFlip, ProjectOnly
from pyverlet.scenes.sliders import Slider, slider
from pyverlet.state.group import Group, Particle
from pyverlet.world import builders
from pyverlet.world.actors import Actor, Emitter, Sink
from pyverlet.world.builders import bridge, chain, cloth, fill, net, rope, soft_body
from pyverlet.world.clock import Clock, FrameBudget
from pyverlet.world.contact_rules import ContactRule, NewContacts, contact_rule
from pyverlet.world.measures import Energy
from pyverlet.world.panels import Panel, Panels
from pyverlet.world.world import World

if TYPE_CHECKING:
    from pyverlet import data as data
    from pyverlet import draw, lab, picture, viewers
    from pyverlet import record as record
    from pyverlet.data.snapshot import load, save
    from pyverlet.data.sweep import sweep
    from pyverlet.data.trajectory import Trajectory, read_trajectory
    from pyverlet.data.worlds import Worlds
    from pyverlet.viewers import view, widget

__version__ = "0.2.0"

_LATER = {
    "Trajectory": "pyverlet.data.trajectory",
    "Worlds": "pyverlet.data.worlds",
    "load": "pyverlet.data.snapshot",
    "read_trajectory": "pyverlet.data.trajectory",
    "save": "pyverlet.data.snapshot",
    "sweep": "pyverlet.data.sweep",
    "view": "pyverlet.viewers",
    "widget": "pyverlet.viewers",
}

__all__ = [
    "RK4", "Actor", "Angle", "AngleLimit", "Area", "Attractor", "Boundary", "Box", "BruteForce", "Capsule", "Chain", "Circle",
    "ClampAndFlip", "Clock", "CoarseCoordinatesWarning", "CoarseStepsWarning", "Cohesion", "Collisions", "ConstantForce",
    "ContactRule", "Disc", "Drag", "Emitter", "Energy", "Events", "ExplicitEuler", "Fast", "Fluid", "FrameBudget",
    "Gravitation", "Group", "InputError", "Integrator", "Langevin", "Ledger", "LennardJones", "Motor", "NewContacts",
    "NonFiniteError", "Obstacle", "Open", "Overlap", "PairForce", "PairLaw", "Panel", "Panels", "Particle", "Periodic", "Pin",
    "PointSpring", "Polygon", "PositionVerlet", "ProjectOnly", "PyverletError", "Rope", "Segment", "SemiImplicitEuler",
    "Sink", "Slider", "SoftRepulsion", "Spring", "Stick", "TimeCorrectedVerlet", "Trajectory", "VelocityVerlet", "Wind",
    "World", "Worlds", "Yoshida4", "Yukawa", "bridge", "builders", "chain", "cloth", "contact_rule", "draw", "errors", "fill",
    "force", "forces", "integrators", "lab", "load", "net", "pair_force", "picture", "read_trajectory", "rope", "save",
    "scenes", "slider", "soft_body", "sweep", "view", "viewers", "widget",
]  # fmt: skip


_submodule, __dir__ = lazily(__name__, lambda: list(_LATER))


def __getattr__(name: str) -> Any:
    # Rarely used names are loaded on first use.
    if name not in _LATER:
        return _submodule(name)
    value = getattr(import_module(_LATER[name]), name)
    globals()[name] = value
    return value
