"""Draws a world on a pygame surface, over its contents, directly into the surface's pixels."""

import numpy as np
import pygame

from pyverlet.common.errors import InputError
from pyverlet.picture import DARK, ByOrigin, Colouring, Theme, View, periodic_images
from pyverlet.picture.colour import Packed, by_force
from pyverlet.picture.raster import paint
from pyverlet.viewers.frames import outline
from pyverlet.world.world import World

__all__ = ["draw"]

WALL = (128, 140, 152)  # R, G, B


def draw(
    surface: pygame.Surface, world: World, view: View, *, colour: Colouring | None = None, theme: Theme = DARK, walls: bool = True
) -> None:
    """Draw `world` on `surface`: circles with smooth rims and a mark once one has turned, and the lines of its bounds.

    Args:
        surface: of 32 bits per pixel, as displays are; its alpha, if any, becomes 255 under circles.
        world: only read.
        view: with `y_up=False`, of the surface's size; see `pyverlet.draw.fit`.
        colour: the colouring; by default the initial position of each circle.
        theme: whether the colours are for a dark or a light background.
        walls: draw the bounds too.

    Raises:
        InputError: the surface has another depth, or the view another size.
    """
    if surface.get_bitsize() != 32:
        raise InputError(f"surface has {surface.get_bitsize()} bits a pixel; allowed are 32, as surface.convert_alpha() has")
    if (view.width, view.height) != surface.get_size() or view.y_up:
        raise InputError(f"view is {view}; allowed is one of the surface's size, {surface.get_size()}, with y_up=False")
    if walls:
        for line in outline(world.boundary):
            pygame.draw.aalines(surface, WALL, True, view.to_screen(line).tolist())
    shifts = surface.get_shifts()[:3]
    if shifts not in ((0, 8, 16), (16, 8, 0)):
        raise InputError(f"surface has its red, green and blue at bits {shifts}; allowed are (0, 8, 16) and (16, 8, 0)")
    swap = _red_and_blue_swapped if shifts == (16, 8, 0) else np.asarray
    colours = swap((ByOrigin() if colour is None else colour).colours(world, theme))
    own = pygame.surfarray.pixels2d(surface).T  # a view of the surface's memory
    alpha = own & np.uint32(0xFF000000)
    pixels = np.bitwise_and(own, np.uint32(0x00FFFFFF), dtype=np.uint32)  # the raster stores the coverage in the upper bits
    ground = pixels.copy()
    position, radius, angle, colours = periodic_images.circles(world, colours)
    links = periodic_images.links(world)
    lines = links and (links[0], swap(by_force(links[1], theme)))
    paint(pixels, ground, position, radius, angle, colours, lines, view)
    if surface.get_masks()[3]:
        np.maximum(pixels, alpha | (pixels & np.uint32(0x00FFFFFF)), out=pixels)
    own[:] = pixels


def _red_and_blue_swapped(colours: Packed) -> Packed:
    low, high = np.uint32(0xFF), np.uint32(16)
    return np.asarray(((colours & low) << high) | (colours & np.uint32(0xFF00)) | (colours >> high) & low, dtype=np.uint32)
