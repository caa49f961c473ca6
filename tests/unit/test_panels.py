"""Several worlds as one: stepped, saved and hashed together."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv


def ball(height: float) -> pv.World:
    world = pv.World(collisions=None, dtype=np.float64)
    world.add(position=(0, height))
    return world


def test_one_world_is_itself() -> None:
    world = ball(3)
    panels = pv.Panels.of(world)
    assert pv.Panels.of(panels) is panels
    panels.step(0.1)
    assert (len(panels), panels.worlds, panels.time, panels.frames) == (1, [world], 0.1, 1)
    assert panels.state_hash() == world.state_hash()


def test_pace_says_what_a_frame_of_the_screen_does() -> None:
    def every_second(world: pv.World, frame: int, dt: float) -> None:
        if frame % 2 == 0:
            world.step(2 * dt)

    panels = pv.Panels([pv.Panel("fast", ball(3)), pv.Panel("slow", ball(3), every_second)])
    for _ in range(3):
        panels.step(0.1)
    assert [world.frames for world in panels.worlds] == [3, 1]
    assert [world.time for world in panels.worlds] == pytest.approx([0.3, 0.2])
    assert panels.time == pytest.approx(0.3)


def test_restore_brings_back_the_bits_and_the_pace() -> None:
    panels = pv.Panels([pv.Panel("a", ball(3)), pv.Panel("b", ball(4))])
    panels.step(0.1)
    saved, before = panels.save(), panels.state_hash()
    panels.step(0.1)
    after = panels.state_hash()
    panels.restore(saved)
    assert panels.state_hash() == before != after
    assert [panel.frames for panel in panels] == [1, 1]
    panels.step(0.1)
    assert panels.state_hash() == after


def test_the_hash_depends_on_every_world() -> None:
    def hashed(*heights: float) -> str:
        return pv.Panels([pv.Panel("", ball(height)) for height in heights]).state_hash()

    assert len({hashed(1, 2), hashed(2, 1), hashed(1, 3), hashed(1)}) == 4


def test_no_panel_is_refused() -> None:
    with pytest.raises(pv.InputError, match="panels is empty"):
        pv.Panels([])
