"""Rules of a user's own for circles that are about to touch."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import pyverlet as pv


def row(**settings: Any) -> pv.World:
    """One flies at 3 m/s towards one that is a little aside, and one behind it."""
    laws = pv.Collisions(restitution=1.0)
    world = pv.World(**{"gravity": (0, 0), "collisions": laws, "dtype": np.float64, **settings})
    world.add(position=[(0, 0), (5, 0.3), (9, 0)], velocity=[(3, 0), (0, 0), (0, 0)], radius=0.5)
    return world


def test_a_contact_that_is_ignored_changes_nothing() -> None:
    world, told = row(), []

    @pv.contact_rule
    def ghost(world: pv.World, new: pv.NewContacts) -> Any:
        if new.meets.any():
            told.append((world.time, new.a.tolist(), new.b.tolist(), *new.speed, *new.point.ravel(), *new.normal.ravel()))
        return new.b == 1

    world.actors.append(ghost)
    world.run(seconds=4)
    # Straight through the second: 4 m and then 0.5 m beyond it to the third, which it gives all it has.
    assert world.velocity == pytest.approx(np.array([(0, 0), (0, 0), (3, 0)]), abs=1e-12)
    assert world.position[:, 0] == pytest.approx([8, 5, 9 + 3 * (4 - 8 / 3)])
    (t, a, b, speed, x, y, nx, ny), (*_, second, _, _, _, _) = told
    lean = np.sqrt(1 - 0.09)  # the centres are 1 m from each other, 0.3 m of that across
    assert (a, b) == ([0], [1])
    assert t <= (5 - lean) / 3 <= t + 1 / 60
    assert (speed, x, y, nx, ny) == pytest.approx((3 * lean, 5 - lean / 2, 0.15, lean, 0.3))
    assert second == pytest.approx(3)


def test_without_an_answer_all_is_as_if_there_were_no_rule() -> None:
    hashes = set()
    for rule in (None, lambda world, new: None, lambda world, new: False):
        world = row(events=True)
        if rule:
            world.actors.append(pv.contact_rule(rule))
        world.run(seconds=4)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_ignored_contacts_are_those_of_filters(dtype: Any) -> None:
    """A gas in a periodic room, half of which ignores the other half: to the bit as with masks."""
    rng = np.random.default_rng(4)
    x, y = np.meshgrid(np.arange(8) + 0.5, np.arange(8) + 0.5)
    kind = (np.arange(64) % 2 + 1).astype(np.uint32)
    velocity = rng.normal(0, 2, (64, 2))
    ends = []
    for by_mask in (True, False):
        world = pv.World(
            gravity=(0, 0), boundary=pv.Periodic((0, 0), (8, 8)), dtype=dtype,
            collisions=pv.Collisions(restitution=1.0, method=pv.BruteForce()),
        )  # fmt: skip
        marks = kind if by_mask else np.full(64, 1, np.uint32)
        world.add(position=np.column_stack((x.ravel(), y.ravel())), velocity=velocity, radius=0.2, category=marks, mask=marks)
        world.actors.append(pv.contact_rule(lambda world, new: kind[new.a] != kind[new.b]))
        world.run(seconds=2)
        ends.append(world.position.copy())
    # Chaos multiplies rounding, which the order of pairs changes, by some 10 for each of a dozen collisions.
    assert ends[0] == pytest.approx(ends[1], abs=1e-4 if dtype == np.float64 else 0.5)


def test_a_rule_may_merge_and_break() -> None:
    world = row()

    @pv.contact_rule
    def merge(world: pv.World, new: pv.NewContacts) -> None:
        if not new.meets.any():
            return
        a, b = int(new.a[0]), int(new.b[0])
        m, n = world.mass[a], world.mass[b]
        world.add(
            position=(m * world.position[a] + n * world.position[b]) / (m + n),
            velocity=(m * world.velocity[a] + n * world.velocity[b]) / (m + n),
            radius=float(np.hypot(world.radius[a], world.radius[b])),
            mass=float(m + n),
        )
        world.remove([a, b])

    world.actors.append(merge)
    before = world.momentum()
    world.run(seconds=5)
    assert len(world) == 1
    assert world.momentum() == pytest.approx(before)
    assert world.velocity[0] == pytest.approx([1, 0])


def test_it_goes_on_after_restore_and_in_copies() -> None:
    world = row()
    world.actors.append(pv.contact_rule(lambda world, new: new.b == 1))
    world.run(seconds=1.5)  # inside each other
    saved, twin = world.save(), copy.deepcopy(world)
    world.run(seconds=2)
    there = world.state_hash()
    twin.run(seconds=2)
    assert twin.state_hash() == there
    world.run(seconds=1)
    world.restore(saved)
    world.run(seconds=2)
    assert world.state_hash() == there


def test_others_may_be_removed_meanwhile() -> None:
    world = row()
    extra = world.add(position=(-20, -20))
    world.position[:] = world.position[[3, 0, 1, 2]]
    world.velocity[:] = world.velocity[[3, 0, 1, 2]]
    del extra
    world.actors.append(pv.contact_rule(lambda world, new: True))
    world.run(seconds=1.5)
    world.remove(0)
    world.run(seconds=2)
    assert world.velocity == pytest.approx(np.array([(3, 0), (0, 0), (0, 0)]))


@pytest.mark.parametrize("answer", ["yes", [True, False], 1.0, [0]])
def test_a_wrong_answer_gets_a_sentence(answer: Any) -> None:
    world = row()
    world.actors.append(pv.contact_rule(lambda world, new: answer))
    with pytest.raises(pv.InputError, match="allowed are None, and 1 bools: which of the contacts to ignore"):
        world.run(seconds=3)
    with pytest.raises(pv.InputError, match="function is 3; allowed is a function of the world and its new contacts"):
        pv.contact_rule(3)  # type: ignore[arg-type]
