"""What energies may differ by without breaking a promise: what rounding and steps explain, and links show and cannot give."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.integrators import Yoshida4
from pyverlet.world.world import World


def stored(world: World, h: float) -> tuple[float, float]:
    """J that links hold, and the sum of their stiffness, N/m: none counts as stiffer than what it gives back in a substep of h.

    What it measures, C, then goes back to 0, and its particles, of inverse masses w, have C^2 / (2 h^2 sum(w |grad C|^2)) J.
    A link much stiffer than substeps can follow shows more, where a wall or a pinned circle has stretched it after links were
    solved, and never gives that back.
    """
    place, held, stiff = world.position.astype(float), 0.0, 0.0
    with np.errstate(divide="ignore"):
        weight = 1.0 / world.mass.astype(float)
    for pool in world.links._kept:
        energy, soft = pool.energies(place, world._state.seam), np.isfinite(pool.rows["stiffness"])
        stiffness = np.where(soft, pool.rows["stiffness"], 0.0)
        part = 1.0 / np.maximum(stiffness * pool.mobility(place, weight, world._state.seam) * h * h, 1.0)
        energy, stiffness = energy * part, stiffness * part
        held, stiff = held + float(energy.sum()), stiff + float(stiffness.sum())
    return held, stiff


def rounded(world: World, held: float, stiff: float) -> float:
    """J that springs gain where places are rounded: those of stiffness k, stretched by C, k C d and k d^2 / 2."""
    d = 4.0 * float(np.finfo(world.dtype).eps * np.abs(world.position).max(initial=0.0))
    return float(np.sqrt(2.0 * held * stiff)) * d + 0.5 * stiff * d * d


def rolled(world: World, h: float) -> float:
    """J a frame, of circles that roll along a wall: a step of order 2 moves them freely, and friction corrects only the velocity.

    By a third of a h^2 / 2 too far for a disc that rolls, along a: measured is 0.21 m (a h)^2 a substep with what friction takes.
    """
    if world.integrator.velocity_lag:
        return 0.0
    gx, gy = world.gravity
    return 0.25 * _free_mass(world) * (gx * gx + gy * gy) * h * h * world.substeps


def of_rounding(world: World, dt: float) -> float:
    """J, the energy of particles that move by a rounding error of their position in a frame; some methods round it more often."""
    slowest = float(np.finfo(world.dtype).eps * np.abs(world.position).max(initial=0.0)) / dt  # m/s
    times = 6 if isinstance(world.integrator, Yoshida4) else 1  # errors that have nothing to do with each other: squares add up
    return 0.5 * times * _free_mass(world) * slowest**2


def _free_mass(world: World) -> float:
    """kg, of the last frame and of those pinned since."""
    return float(np.where(np.isfinite(world.mass), world.mass, 0.0).sum(dtype=float)) + float(np.isinf(world.mass).sum())
