"""What it costs to change a world in every frame, and what idle obstacles cost: `python -m benchmarks changes`.

Each world is stepped with and without the change, in turns; a ratio of medians, on one thread and on two. Substeps, spread of
radii and overlap of each are printed, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count

import numpy as np

import pyverlet as pv
from benchmarks.engines import DT
from benchmarks.own import Row, heap, in_turn, stepping, told
from pyverlet.common.threads import max_threads

FRAMES = 24


def pile(particles: int, *large: float) -> pv.World:
    """Discs of radius 0.5 at rest in a box half as high as wide, and larger ones on top of them."""
    side = round(np.sqrt(2 * particles))
    world = pv.World(boundary=pv.Box((0, 0), (1.03 * side, 4 * side)))
    row, column = np.divmod(np.arange(particles), side)
    shaken = np.random.default_rng(0).uniform(0, 0.02, (particles, 2))
    world.add(position=np.column_stack((0.6 + 1.02 * column, 0.6 + 1.02 * row)) + shaken, radius=0.5)
    for radius in large:
        world.add(position=(0.5 * side, 1.02 * particles / side + radius + 1), radius=radius, mass=4 * radius**2)
    world.run(seconds=10, dt=DT)
    return world


def peg_board(pegs: int, discs: int) -> pv.World:
    """Discs that fall onto pegs."""
    side = round(np.sqrt(pegs))
    world = pv.World(boundary=pv.Box((-2, -2), (side + 2, side + 60 + discs // side)))
    row, column = np.divmod(np.arange(pegs), side)
    world.obstacles.extend([pv.Disc((x + 0.5 * (y % 2), y), 0.1) for x, y in zip(column.tolist(), row.tolist(), strict=True)])
    row, column = np.divmod(np.arange(discs), side - 4)
    world.add(position=np.column_stack((column + 2.0, side + 2.0 + row)), radius=0.3)
    world.run(seconds=1, dt=DT)
    return world


def tile_map() -> pv.World:
    """500 discs that fall onto the floors and posts of a map of 10,000 tiles, and lie there."""
    world = pv.World(boundary=pv.Box((-2, -2), (102, 102)))
    for x, y in np.ndindex(100, 50):
        world.obstacles.extend([pv.Segment((x, 2 * y), (x + 1, 2 * y)), pv.Segment((x, 2 * y), (x, 2 * y + 0.6))])
    world.add(position=np.random.default_rng(1).uniform(1, 99, (500, 2)), radius=0.2)
    world.run(seconds=2, dt=DT)
    return world


def changes() -> Iterator[tuple[str, float, pv.World, Callable[[pv.World, int], object]]]:
    """Name, how many times a plain frame is allowed, world, and what happens in each frame k."""
    rng, many, boards = np.random.default_rng(1), pile(100_000), [peg_board(5_000, discs) for discs in (5_000, 1_000)]
    over = 0.9 * (many.boundary.extent() or (0, 0, 0, 0))[3]
    yield "one of 100,000 removed", 1.3, many, lambda world, k: world.remove(int(rng.integers(len(world))))
    yield "one emitted among 100,000", 1.3, many, lambda world, k: world.add(position=(5.0 + k % 300, over), radius=0.5)
    for board in boards:
        falling = f"{len(board):,} discs fall"
        yield f"one of 5,000 pegs moved, {falling}", 1.2, board, move_a_peg
        yield f"one added to 5,000 pegs, {falling}", 1.2, board, add_a_peg
        yield f"friction of one of them changed, {falling}", 1.2, board, rub_a_peg
        yield f"one of them removed, {falling}", 10 if len(board) > 1_000 else 20, board, remove_a_peg
    some = pile(5_000)
    yield "velocity of one of 5,000 set", 1.2, some, set_a_velocity
    pinned = some.add(position=(-3.0, -3.0), radius=0.1, mass=np.inf)
    yield "one pinned one moved beside 5,000", 1.2, some, lambda world, k: pinned.position.__setitem__(0, (-3.0, -3.0 - 0.1 * k))
    rope = some.add(position=np.column_stack((np.arange(50) + 1.0, np.full(50, 300.0))), radius=0.3)
    rod = some.links.append(pv.Spring(rope, range(49), range(1, 50), stiffness=1e3))
    yield "one link changed beside 5,000", 1.2, some, lambda world, k: setattr(rod, "stiffness", 1e3 + k)


def move_a_peg(world: pv.World, k: int) -> None:
    """One of the pegs goes where nobody is."""
    world.obstacles[k % 5_000].pivot = (-1.0, 60.0 + 0.1 * k)


def add_a_peg(world: pv.World, k: int) -> None:
    """Another peg there."""
    world.obstacles.append(pv.Disc((-1.0, 50.0 + 0.1 * k), 0.1))


def rub_a_peg(world: pv.World, k: int) -> None:
    """One of them becomes rougher."""
    world.obstacles[k % 5_000].friction = 0.1 + 1e-4 * k


def remove_a_peg(world: pv.World, k: int) -> None:
    """One in the middle goes."""
    del world.obstacles[2_000]


def set_a_velocity(world: pv.World, k: int) -> None:
    """A push, such as a game gives what it steers."""
    world.velocity[k % 5_000] = (0.1, 0.0)


def rows(threads: int) -> Iterator[Row]:
    """All of them on so many threads."""
    for name, most, world, change in changes():
        world.threads = threads
        numbers = count()

        def plain(world: pv.World = world) -> None:
            world.step(DT)

        def changed(
            world: pv.World = world, change: Callable[[pv.World, int], object] = change, numbers: Iterator[int] = numbers
        ) -> None:
            change(world, next(numbers))
            world.step(DT)

        without, with_it = in_turn([plain, changed], FRAMES)
        yield beside(name, most, without, with_it, world)
    small, large, tiles = pile(5_000), pile(5_000, 20.0), tile_map()
    for world in (small, large, tiles):
        world.threads = threads
    without, with_it = in_turn([stepping(small, threads), stepping(large, threads)], FRAMES)
    yield beside("a disc 40 times as large on 5,000", 1.5, without, with_it, large)
    (took,) = in_turn([stepping(tiles, threads)], FRAMES)
    yield Row("500 discs on 10,000 tiles", "<= 1 ms", f"{took:.2f} ms on {threads} threads; {heap(tiles)}", took <= 1.0)


def beside(name: str, most: float, without: float, with_it: float, world: pv.World) -> Row:
    """A frame with something, ms, beside one without."""
    what = f"{with_it / without:.2f} times, {with_it:.2f} ms on {world.threads} threads; {heap(world)}"
    return Row(name, f"<= {most:g} times a frame without", what, with_it <= most * without)


def main() -> bool:
    """Print a line for each; returns whether all hold."""
    return told(row for threads in sorted({1, max_threads()}) for row in rows(threads))
