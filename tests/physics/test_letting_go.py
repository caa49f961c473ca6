"""What is held and is let go falls as from rest: y = -g t^2 / 2, whatever held it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import FRAME, G, bits_after, each_frame, grid, worst_rise

import pyverlet as pv

Change = Callable[[pv.World], None]


def on_a_floor(**options: object) -> tuple[pv.World, pv.Segment]:
    world = pv.World(boundary=pv.Open(), **options)  # type: ignore[arg-type]
    world.obstacles.append(floor := pv.Segment((-5, 0), (5, 0)))
    world.add(position=(0, 0.5), radius=0.5)
    return world, floor


def floor_removed(**options: object) -> tuple[pv.World, Change]:
    world, floor = on_a_floor(**options)
    return world, lambda world: world.obstacles.remove(floor)


def floor_passable(**options: object) -> tuple[pv.World, Change]:
    world, floor = on_a_floor(**options)
    return world, lambda _: setattr(floor, "mask", 0)


def mask_changed(**options: object) -> tuple[pv.World, Change]:
    world, _ = on_a_floor(**options)
    return world, lambda world: world.mask.__setitem__(0, 0)


def lower_removed(**options: object) -> tuple[pv.World, Change]:
    world = pv.World(boundary=pv.Open(), **options)  # type: ignore[arg-type]
    world.add(position=[(0, 0.5), (0, -0.5)], radius=0.5).pin(1)
    return world, lambda world: world.remove(1)


def cut(link: Callable[[pv.Group], Any], **options: object) -> tuple[pv.World, Change]:
    world = pv.World(boundary=pv.Open(), **options)  # type: ignore[arg-type]
    group = world.add(position=[(0, 0.5), (0, 2.5)], radius=0.1)
    group.pin(1)
    joined = world.links.append(link(group))
    return world, lambda world: world.links.remove(joined)


def room_opened(**options: object) -> tuple[pv.World, Change]:
    world = pv.World(boundary=pv.Box((-5, 0), (5, 10)), **options)  # type: ignore[arg-type]
    world.add(position=(0, 0.5), radius=0.5)
    return world, lambda world: setattr(world, "boundary", pv.Open())


HELD: dict[str, Callable[..., tuple[pv.World, Change]]] = {
    "floor removed": floor_removed,
    "floor passable": floor_passable,
    "mask": mask_changed,
    "lower removed": lower_removed,
    "stick": lambda **options: cut(lambda group: pv.Stick(group, 0, 1), **options),
    "rope": lambda **options: cut(lambda group: pv.Rope(group, 0, 1), **options),
    "pin": lambda **options: cut(lambda group: pv.Pin(group, 0), **options),
    "room opened": room_opened,
}


@pytest.mark.parametrize("how", HELD)
@pytest.mark.parametrize(
    "integrator", [pv.TimeCorrectedVerlet(), pv.VelocityVerlet(), pv.RK4()], ids=lambda it: type(it).__name__
)
@pytest.mark.parametrize("options", [{}, {"collisions": pv.Collisions(friction=0.5)}, {"sleep": True}, {"events": True}])
def test_what_is_let_go_falls_as_from_rest(how: str, integrator: pv.Integrator, options: dict[str, object]) -> None:
    # Each of these fell g h / 2 too fast: half of the impulse that had held it was taken back, as if it went on. All methods are
    # exact under gravity: what is left is rounding.
    world, change = HELD[how](dtype=np.float64, integrator=integrator, **options)
    world.run(seconds=1)
    begin = world.position[0].copy()
    change(world)
    for number in each_frame(world, 60):
        t = (number + 1) * FRAME
        assert world.position[0] - begin == pytest.approx([0.0, -0.5 * G * t * t], abs=1e-12)


@pytest.mark.parametrize("how", HELD)
def test_a_world_taken_up_before_it_knows_goes_on_with_the_same_bits(how: str) -> None:
    world, change = HELD[how]()
    world.run(seconds=1)
    change(world)
    saved = world.save()
    bits = bits_after(world, 0.5)
    world.restore(saved)
    assert bits_after(world, 0.5) == bits


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
