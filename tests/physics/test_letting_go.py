"""What is held and is let go falls as from rest: y = -g t^2 / 2, whatever held it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G, bits_after, each_frame, grid, worst_rise

import pyverlet as pv


def floor(world: pv.World) -> pv.Segment:
    return world.obstacles.append(pv.Segment((-5, 0), (5, 0)))


def hung(make: Callable[[Any, Any], Any]) -> Callable[[pv.World], Any]:
    """From a pinned circle, by a link."""

    def hang(world: pv.World) -> Any:
        world.add(position=(0, 2.5), radius=0.1).pin()
        return world.links.append(make((world.groups[0], 0), (world.groups[1], 0)))

    return hang


# What holds a circle of radius 0.5 m at (0, 0.5), and what lets go of it.
HELD: dict[str, tuple[Callable[[pv.World], Any], Callable[[pv.World, Any], object]]] = {
    "floor removed": (floor, lambda world, it: world.obstacles.remove(it)),
    "floor passable": (floor, lambda world, it: setattr(it, "mask", 0)),
    "mask": (floor, lambda world, it: world.mask.__setitem__(0, 0)),
    "category": (floor, lambda world, it: setattr(it, "mask", ~1 & 0xFFFFFFFF)),
    "lower removed": (lambda world: world.add(position=(0, -0.5), radius=0.5).pin(), lambda world, it: world.remove(1)),
    "stick": (hung(pv.Stick), lambda world, it: world.links.remove(it)),
    "rope": (hung(pv.Rope), lambda world, it: world.links.remove(it)),
    "pin": (lambda world: world.links.append(pv.Pin(world.groups[0], 0)), lambda world, it: world.links.remove(it)),
    "room opened": (
        lambda world: setattr(world, "boundary", pv.Box((-5, 0), (5, 10))),
        lambda world, it: setattr(world, "boundary", pv.Open()),
    ),
}


@pytest.mark.parametrize("how", HELD)
@pytest.mark.parametrize(
    "integrator", [pv.TimeCorrectedVerlet(), pv.VelocityVerlet(), pv.RK4()], ids=lambda it: type(it).__name__
)
@pytest.mark.parametrize("options", [{}, {"collisions": pv.Collisions(friction=0.5)}, {"sleep": True}, {"events": True}])
def test_what_is_let_go_falls_as_from_rest(how: str, integrator: pv.Integrator, options: dict[str, object]) -> None:
    # Each of these fell g h / 2 too fast: half of the impulse that had held it was taken back, as if it went on. All methods are
    # exact under gravity: what is left is rounding. A world that is taken up before it knows goes on with the same bits.
    world = pv.World(dtype=np.float64, integrator=integrator, **options)  # type: ignore[arg-type]
    world.add(position=(0, 0.5), radius=0.5)
    hold, let_go = HELD[how]
    held = hold(world)
    world.run(seconds=1)
    begin = world.position[0].copy()
    let_go(world, held)
    saved = world.save()
    for number in each_frame(world, 60):
        t = (number + 1) * FRAME
        assert world.position[0] - begin == pytest.approx([0.0, -0.5 * G * t * t], abs=1e-12)
    bits = world.state_hash()
    world.restore(saved)
    assert bits_after(world, 1) == bits


def test_a_heap_of_which_one_is_removed_in_each_frame_stays_calm() -> None:
    # Every frame begins without a substep before. Energy of those left may fall, and rise by 1e-5 m g R (as under varying dt).
    world = pv.World(boundary=pv.Box((0, 0), (8, 20)), collisions=pv.Collisions(friction=0.3, restitution=0.5), dtype=np.float64)
    heap = world.add(position=grid(19, 20, 0.41, (0.3, 0.3)), radius=0.2)
    world.add(position=np.column_stack((np.linspace(1, 7, 60), np.full(60, 19.0))), radius=0.1, mask=0, mass=np.inf)
    world.run(seconds=10)
    for _ in range(60):
        before = world.energy().total
        world.remove(len(world) - 1)
        world.step(FRAME)
        assert world.energy().total - before < 1e-5 * len(heap) * G * 8
    assert np.hypot(*heap.velocity.T).max() < 5e-3
    assert worst_rise(world, 30) < 1e-5 * len(heap) * G * 8
