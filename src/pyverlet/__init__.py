"""pyverlet: real-time 2D particle physics on NumPy arrays."""

from __future__ import annotations

from typing import Any

from pyverlet import _loading  # noqa: F401  (first: all that follows takes a second)

# isort: split
from pyverlet import builders, errors, forces, integrators, scenes
from pyverlet.actors import Actor, Emitter, Sink
from pyverlet.bounds import Boundary, Box, Circle, Open
from pyverlet.broadphase import BruteForce, Fast
from pyverlet.builders import bridge, chain, cloth, net, rope, soft_body
from pyverlet.clock import Clock, FrameBudget
from pyverlet.collisions import Collisions, Overlap
from pyverlet.energy import Energy
from pyverlet.errors import InputError, NonFiniteError, PyverletError
from pyverlet.events import Events
from pyverlet.forces import Attractor, ConstantForce, Drag, Gravitation, PointSpring, Wind, force
from pyverlet.group import Group
from pyverlet.integrators import (
    RK4,
    ExplicitEuler,
    Integrator,
    PositionVerlet,
    SemiImplicitEuler,
    TimeCorrectedVerlet,
    VelocityVerlet,
    Yoshida4,
)
from pyverlet.ledger import Ledger
from pyverlet.links import Angle, Area, Pin, Rope, Spring, Stick
from pyverlet.naive import ClampAndFlip, ProjectOnly
from pyverlet.obstacles import Capsule, Chain, Disc, Obstacle, Polygon, Segment
from pyverlet.panels import Panel, Panels
from pyverlet.warmup import warm_up
from pyverlet.world import World

__version__ = "0.1.0"

__all__ = [
    "RK4", "Actor", "Angle", "Area", "Attractor", "Boundary", "Box", "BruteForce", "Capsule", "Chain", "Circle", "ClampAndFlip",
    "Clock", "Collisions", "ConstantForce", "Disc", "Drag", "Emitter", "Energy", "Events", "ExplicitEuler", "Fast", "FrameBudget",
    "Gravitation", "Group", "InputError", "Integrator", "Ledger", "NonFiniteError", "Obstacle", "Open", "Overlap", "Panel",
    "Panels", "Pin", "PointSpring", "Polygon", "PositionVerlet", "ProjectOnly", "PyverletError", "Rope", "Segment",
    "SemiImplicitEuler", "Sink", "Spring", "Stick", "TimeCorrectedVerlet", "VelocityVerlet", "Wind", "World", "Yoshida4",
    "bridge", "builders", "chain", "cloth", "errors", "force", "forces", "integrators", "net", "rope", "scenes", "soft_body",
    "view", "warm_up", "widget",
]  # fmt: skip


def view(world: World | Panels, **options: Any) -> None:
    """Show a world, or several side by side, on a live page until Ctrl-C; see `pyverlet.viewers.view` for the options."""
    from pyverlet.viewers import view as view_page

    view_page(world, **options)


def widget(world: World | Panels, **options: Any) -> Any:
    """Show a world in a cell of a notebook; see `pyverlet.viewers.widget` for the options."""
    from pyverlet.viewers import widget as make

    return make(world, **options)
