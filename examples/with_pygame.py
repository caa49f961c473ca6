"""A heap of balls in pygame: drag them with the mouse, click with the right button for another, escape ends.

    pip install "pyverlet[window]"
    python examples/with_pygame.py

Those who know pymunk will know the shape of it: make a space, add bodies, step, draw. See docs/coming-from.md.
"""

from __future__ import annotations

import numpy as np
import pygame

import pyverlet as pv
from pyverlet import draw
from pyverlet.draw.pygame import draw as draw_world

SIZE = (900, 600)
GRIP_HZ = 4.0


def make_world() -> pv.World:
    """300 balls above the floor of a box 9 m wide."""
    world = pv.World(
        boundary=pv.Box((0, 0), (9, 6), restitution=0.4, friction=0.2),
        collisions=pv.Collisions(restitution=0.4, friction=0.2),
    )
    x, y = np.meshgrid(np.linspace(0.5, 8.5, 25), np.linspace(1.0, 5.0, 12))
    radius = np.random.default_rng(1).uniform(0.08, 0.15, x.size)
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=radius, mass=radius**2)
    return world


def main() -> None:
    """Open the window and run until it is closed."""
    pygame.init()
    screen = pygame.display.set_mode(SIZE)
    pygame.display.set_caption("pyverlet in pygame")
    world = make_world()
    view = draw.fit(world, SIZE)
    clock, pacer = pygame.time.Clock(), pv.Clock(dt=1 / 60)
    grip: pv.forces.Grip | None = None
    elapsed = 0.0
    while True:
        for event in pygame.event.get():
            if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE):
                pygame.quit()
                return
            if event.type == pygame.MOUSEBUTTONDOWN and event.button == 3 and world.is_free(view.to_world(event.pos)):
                world.add(position=view.to_world(event.pos), radius=0.2, mass=0.04)
            if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
                particle = view.pick(world, event.pos)
                if particle is not None:
                    x, y = view.to_world(event.pos)
                    grip = pv.forces.Grip(particle, target=(x, y), frequency=GRIP_HZ)
                    world.forces.append(grip)
            if event.type == pygame.MOUSEMOTION and grip:
                x, y = view.to_world(event.pos)
                grip.target = (x, y)
            if event.type == pygame.MOUSEBUTTONUP and event.button == 1 and grip:
                world.forces.remove(grip)
                grip = None
        for _ in range(pacer.advance(elapsed)):
            world.step(pacer.dt)
        screen.fill((20, 24, 30))
        draw_world(screen, world, view)
        pygame.display.flip()
        elapsed = clock.tick(60) / 1000


if __name__ == "__main__":
    main()
