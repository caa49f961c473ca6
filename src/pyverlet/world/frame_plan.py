"""How a frame is made: the number and length of its substeps, and whether the core moves the particles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pyverlet.laws.gains import undriven
from pyverlet.laws.integrators import PositionVerlet
from pyverlet.laws.ledger import FrameLedger
from pyverlet.laws.limiter import EnergyLimiter, holds
from pyverlet.world.free_steps import OwnWalls, kicks
from pyverlet.world.long_frames import parts_of
from pyverlet.world.materials import knows
from pyverlet.world.stiffness import pieces_of


class FramePlan:
    """The plan of a frame of `dt` seconds.

    Attributes:
        substeps, h: number and length, s; pieces: substeps made of each usual one because contact springs are too stiff for it.
        half: fraction of a substep by which velocities lag behind positions between frames.
        before: length of the substep before the frame, s; 0 if unknown.
        by_core: whether the core makes substeps by itself; alone: whether it needs no call in between.
        own_walls: the room, if it is of a user-defined class.
        keeps_way: whether the displacement of the last substep is kept, instead of the velocity, as the step length changes.
        limited: whether the frame must not gain energy; may_limit: whether that is known already; limiter: enforces it.
        gravity: m/s^2, at the start of the frame.
        on_stage_end: called with the name of each stage; ledger: the page of a ledger, if that is it.
    """

    __slots__ = (
        "before", "by_core", "dt", "gravity", "h", "half", "keeps_way", "ledger", "limited", "limiter", "may_limit",
        "on_stage_end", "own_walls", "pieces", "substeps", "uninterrupted",
    )  # fmt: skip

    def __init__(self, world: Any, held: Any, dt: float, on_stage_end: Callable[[str], None]) -> None:
        forces, integrator = world._force_sum.forces, world.integrator
        usual, pairs = world.substeps * parts_of(world, dt), bool(world.collisions and len(world) > 1)
        self.pieces = pieces_of(held, dt / usual) if pairs else 1  # only contacts between particles have springs
        self.substeps = usual * self.pieces
        self.dt, self.h, self.gravity = dt, dt / self.substeps, world.gravity
        self.by_core = kicks(integrator)
        self.half: float = integrator.velocity_lag if self.by_core else 0.5
        self.before: float = held.h if held.kick else 0.0
        self.own_walls = None if knows(world.boundary) else OwnWalls(world.boundary)
        self.uninterrupted = self.by_core and not (forces or self.own_walls)
        same_count = held.steps in (0, self.substeps)
        self.keeps_way = isinstance(integrator, PositionVerlet) and self.before not in (0.0, self.h) and same_count
        # A method that raises the energy by itself (plain Verlet with a changing step) says nothing about contacts.
        self.limited = (pairs or world._obstacle_arrays.solid) and not self.keeps_way
        # For worlds without drive and stored energy the check is made after the frame.
        self.may_limit = self.limited and (not (forces or world.links) or undriven(world))
        self.limiter = EnergyLimiter(world, dt) if self.may_limit and holds(world) else None
        self.on_stage_end = on_stage_end
        self.ledger = on_stage_end if isinstance(on_stage_end, FrameLedger) else None
