"""What is saved, restored or copied goes on with the same bits, whatever else a world has seen in between."""

import copy

import numpy as np
import pytest
from tests.worlds import each_frame, grid

import pyverlet as pv


def test_how_large_arrays_have_become_changes_no_bit() -> None:
    # A list of pairs that is made again because places of surfaces were missing made its skin adapt twice. When the same frames
    # come again there are places enough: the pairs were sorted otherwise, and the bricks fell up to 1.3 m elsewhere.
    world, chance = pv.scenes.get("wrecking-ball").world(), np.random.default_rng(9)
    start = world.save()
    clock = chance.choice([1 / 240, 1 / 60, 1 / 30, 0.2], 150, p=[0.3, 0.4, 0.25, 0.05])[:23]
    sliders = chance.choice([8, 8, 8, 4, 2, 16], 150)[:23]

    def play() -> list[str]:
        hashes = []
        for dt, world.substeps in zip(clock, map(int, sliders), strict=True):
            world.step(float(dt))
            hashes.append(world.state_hash())
        return hashes

    first = play()
    world.restore(start)
    assert play() == first


@pytest.mark.parametrize("force", ["gravitation", "drag"])
def test_what_forces_were_in_the_last_frame_belongs_to_the_state(force: str) -> None:
    # How fast springs become stiffer depends on whether particles move, by what forces were: a copy did not know, and took all
    # that moved at all for moving, so that what lay still in both was not pressed alike.
    world = pv.World(gravity=(0, -9.81 if force == "drag" else 0), boundary=pv.Box((-4, -4), (4, 8)))
    discs = world.add(position=grid(10, 8, 0.6, (-2.7, -3.7)), radius=0.3)
    world.forces.append(pv.Drag(linear=0.5) if force == "drag" else pv.Gravitation(discs, strength=0.5, softening=0.1))
    list(each_frame(world, 240))
    list(each_frame(world, 150, 1 / 240))  # for more than half a second springs could have been stiffer
    twin = copy.deepcopy(world)
    for _ in each_frame(world, 8, 1 / 240):
        twin.step(1 / 240)
        assert twin.state_hash() == world.state_hash()
