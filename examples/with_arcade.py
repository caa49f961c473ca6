"""A heap of balls in arcade: click for another, escape ends.

pip install pyverlet arcade
python examples/with_arcade.py
"""

from __future__ import annotations

import arcade
import numpy as np

import pyverlet as pv
from pyverlet import draw
from pyverlet.draw.arcade import Circles


def make_world() -> pv.World:
    """2,000 balls above the floor of a box 9 m wide."""
    world = pv.World(boundary=pv.Box((0, 0), (9, 6)), collisions=pv.Collisions(restitution=0.2))
    x, y = np.meshgrid(np.linspace(0.3, 8.7, 50), np.linspace(1.0, 5.8, 40))
    shaken = np.random.default_rng(1).uniform(-0.01, 0.01, (x.size, 2))
    world.add(position=np.column_stack((x.ravel(), y.ravel())) + shaken, radius=0.05, mass=0.01)
    return world


class Window(arcade.Window):
    """Steps the world in real time and draws it."""

    def __init__(self) -> None:
        super().__init__(900, 600, "pyverlet in arcade")
        self.world = make_world()
        self.camera = draw.fit(self.world, (900, 600), y_up=True)
        self.circles = Circles(self.world)
        self.pacer = pv.Clock(dt=1 / 60)

    def on_update(self, delta_time: float) -> None:
        """Make the frames that are due."""
        for _ in range(self.pacer.advance(delta_time)):
            self.world.step(self.pacer.dt)

    def on_draw(self) -> None:
        """Show the world as it is."""
        self.clear()
        self.circles.draw(self.camera, pixel_ratio=self.get_pixel_ratio())

    def on_mouse_press(self, x: int, y: int, button: int, modifiers: int) -> None:
        """Another ball, where the mouse is."""
        self.world.add(position=self.camera.to_world((x, y)), radius=0.2, mass=0.16)

    def on_key_press(self, symbol: int, modifiers: int) -> None:
        """Escape ends."""
        if symbol == arcade.key.ESCAPE:
            arcade.exit()


if __name__ == "__main__":
    Window()
    arcade.run()
