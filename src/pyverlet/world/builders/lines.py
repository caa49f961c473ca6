"""Particles in a line: chains, ropes, and bridges of planks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.laws.links import Rope, Stick
from pyverlet.world.builders._built import Built, Point, add, ends

if TYPE_CHECKING:
    from pyverlet.world.world import World


def chain(
    world: World,
    start: Point,
    end: Point,
    *,
    links: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """Particles from `start` to `end`, joined by sticks; `chain.group.pin(0)` hangs it up.

    Args:
        world: gets the particles and the sticks.
        start: (x, y) of the first particle, m.
        end: (x, y) of the last one, m.
        links: how many sticks.
        mass: of all particles together, kg.
        radius: of each, m; by default they all but touch.
        compliance: of each stick, m/N.
        breaking_force: at which a stick breaks, N.
        particles: category, friction and all else that `World.add` takes.
    """
    count = checks.whole("links", links)
    a, b, apart = ends(start, end)
    group = add(world, a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a), apart / count, radius, mass, **particles)
    k = np.arange(count)
    stick = Stick(group, k, k + 1, compliance=compliance, breaking_force=breaking_force, collide=False)
    return Built(group, (world.links.append(stick),))


def rope(
    world: World,
    start: Point,
    end: Point,
    *,
    length: float | None = None,
    links: int = 20,
    mass: float = 1.0,
    radius: float | None = None,
    compliance: float = 0.0,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """Particles from `start` to `end`, joined by ropes; `rope.group.pin([0, -1])` hangs it up at both ends.

    Args:
        world: gets the particles and the ropes.
        start: (x, y) of the first particle, m.
        end: (x, y) of the last one, m.
        length: of the whole rope, m; more than the ends are apart makes it sag. None takes their distance.
        links: how many pieces.
        mass: of all particles together, kg.
        radius: of each, m; by default they all but touch.
        compliance: of each piece, m/N.
        breaking_force: at which a piece breaks, N.
        particles: category, friction and all else that `World.add` takes.
    """
    count = checks.whole("links", links)
    a, b, apart = ends(start, end)
    whole = apart if length is None else checks.number("length", length)
    if whole < apart * (1 - 1e-6):
        raise InputError(f"length is {whole:g} m; allowed is at least the distance from start to end, {apart:g} m")
    group = add(world, a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a), apart / count, radius, mass, **particles)
    k = np.arange(count)
    piece = Rope(group, k, k + 1, length=whole / count, compliance=compliance, breaking_force=breaking_force, collide=False)
    return Built(group, (world.links.append(piece),))


def bridge(
    world: World,
    start: Point,
    end: Point,
    *,
    slack: float = 0.03,
    planks: int = 20,
    mass: float = 10.0,
    radius: float | None = None,
    breaking_force: float = np.inf,
    **particles: Any,
) -> Built:
    """A deck of circles on a rope whose ends are immovable: what falls on it stays on it.

    Args:
        world: gets the particles and the links.
        start: (x, y) where it is fixed, m.
        end: (x, y) of its other end, m.
        slack: part by which the deck is longer than the way, 0 or more. Without, the pull at its ends is enormous.
        planks: how many.
        mass: of all planks together, kg.
        radius: of each, m; by default they all but touch.
        breaking_force: at which the deck tears between two planks, N.
        particles: category, friction and all else that `World.add` takes.
    """
    checks.number("slack", slack, least=0.0)
    apart = float(np.hypot(*(np.subtract(checks.vector("end", end), checks.vector("start", start)))))
    built = rope(
        world, start, end, length=(1 + slack) * apart, links=checks.whole("planks", planks) + 1, mass=mass, radius=radius,
        breaking_force=breaking_force, **particles,
    )  # fmt: skip
    built.group.pin([0, -1])
    return built
