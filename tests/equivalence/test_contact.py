"""Contacts eight pairs at a time against one pair after the other: the same pairs, and the same bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.compile.lanes import LANES
from pyverlet.ground.constants import DEEP, DEEP_PART, DEEP_SWEEPS, FED, GRIP, LARGEST_PUSH, PUSHED
from pyverlet.kernels import frame
from pyverlet.kernels.bounds import impact_time
from pyverlet.kernels.tables import Law
from pyverlet.laws.contacts.broadphase import start
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.slots import Slots

H = 1 / 480


def crowd(seed: int, n: int, spread: float, dtype: Any, *, varied: bool = False) -> Slots:
    """A random crowd with overlaps, some of it pinned; of materials of their own if `varied`."""
    rng = np.random.default_rng(seed)
    world = pv.World(dtype=dtype)
    room = 0.6 * np.sqrt(n)
    world.add(
        position=rng.uniform(-room, room, (n, 2)),
        velocity=rng.normal(0, 1, (n, 2)),
        radius=0.5 * spread ** rng.uniform(-1, 0, n),
        mass=np.where(rng.random(n) < 0.1, np.inf, rng.uniform(1, 3, n)) if spread > 1 else 1.0,
    )
    if varied:
        world.restitution[:] = rng.choice([-1.0, 0.0, 0.3, 1.0], n)
        world.friction[:] = rng.choice([-1.0, 0.0, 0.7], n)
    slots = Slots(np.dtype(dtype))
    slots.gather(world._state)
    return slots


def packed(slots: Slots, method: Fast | BruteForce, restitution: float = 0.0, friction: float = 0.0) -> tuple[Any, Wide]:
    phase = start(method, slots.dtype)
    phase.update(slots)
    wide = Wide(slots.dtype, restitution, friction)
    wide.take(phase.list, phase.built, slots.radius)
    return phase.list, wide


cases = given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 400),
    spread=st.sampled_from([1.0, 4.0, 50.0]),
    dtype=st.sampled_from([np.float32, np.float64]),
    method=st.sampled_from([Fast(), BruteForce()]),
    material=st.sampled_from([(0.0, 0.0), (0.3, 0.0), (0.0, 0.5), (0.5, 0.5), "varied"]),
)


@settings(max_examples=40, deadline=None)
@cases
def test_packs_hold_every_pair_and_share_no_particle(
    seed: int, n: int, spread: float, dtype: Any, method: Any, material: Any
) -> None:
    pairs, packs = packed(crowd(seed, n, spread, dtype), method)
    lanes = packs.pairs()
    assert set(map(tuple, lanes.tolist())) == set(map(tuple, pairs.pairs().tolist()))
    for pack in lanes.reshape(-1, LANES, 2):
        alone = np.unique(pack, axis=0)  # a pair repeated to fill a pack writes the same twice
        assert len(np.unique(alone)) == alone.size


class OneByOne:
    """docs/design/contact-law.md pair after pair, in NumPy's scalars of the same dtype: what the kernels are compared with."""

    def __init__(self, slots: Slots, wide: Wide, memory: dict[tuple[int, int], Any]) -> None:
        self.slots, self.wide, self.law, self.real = slots, wide, Law(*wide.law), slots.real
        self.slip = memory
        strips = [range(a, a + n) for a, n in zip(wide.begin, wide.lanes, strict=False)]
        self.strips = [*strips[::2], *strips[1::2]]
        lanes = [(k, wide.lane_i[k], wide.lane_j[k]) for strip in self.strips for k in strip]
        self.lanes = [lane for a, lane in enumerate(lanes) if a % LANES == 0 or lane[1:] != lanes[a - 1][1:]]
        self.moved = slots.position - wide.origin
        self.carries = (slots.fed & 1).astype(slots.dtype)
        self.turned, self.slid = np.zeros(len(slots), slots.dtype), np.zeros_like(slots.position)
        self.normal: dict[int, Any] = {}
        self.depth: dict[int, Any] = {}
        self.held: dict[int, Any] = {}

    def made_of(self, i: int, j: int) -> tuple[Any, Any, Any]:
        """Restitution, friction, and the share of i."""
        s = self.slots
        (e, mu), zero = (self.real(value) for value in self.wide._settings), self.real(0)
        own = [(s.restitution[k] if s.restitution[k] >= 0 else e, s.friction[k] if s.friction[k] >= 0 else mu) for k in (i, j)]
        given = s.friction[i] >= zero or s.friction[j] >= zero
        w = s.inverse_mass
        return max(own[0][0], own[1][0]), np.sqrt(own[0][1] * own[1][1]) if given else mu, w[i] / (w[i] + w[j])

    def gap(self, k: int, i: int, j: int) -> Any:
        return self.wide.gap[:, k] + (self.moved[j] - self.moved[i])

    def carry(self, i: int, by: Any) -> None:
        to = self.slots.position[i] + by
        origin = self.wide.origin[i]
        self.moved[i] += (to - origin) - (self.slots.position[i] - origin)
        self.slots.position[i] = to

    def bounce(self, i: int, j: int, d: Any, reach: Any, e: Any, mu: Any) -> bool:
        s, law, real = self.slots, self.law, self.real
        a, w = s.acceleration[j] - s.acceleration[i], s.inverse_mass
        v = s.velocity[j] - s.velocity[i] + law.lag * a
        time = impact_time.function(*d, *v, *a, reach, law.h)  # type: ignore[attr-defined]
        d = (d - time * (v - real(0.5) * time * a)).astype(np.float64)
        n = d / np.sqrt(d[0] * d[0] + d[1] * d[1])
        v = s.velocity[j].astype(np.float64) - s.velocity[i] + (np.float64(law.lag) - time) * a
        hit = -(v[0] * n[0] + v[1] * n[1])
        if not hit > law.rest_speed:
            return False
        wide = np.float64(w[i]) + w[j]
        kick = (hit + e * hit) / wide
        p = kick * n
        if mu > 0:
            slides = v[0] * n[1] - v[1] * n[0] + np.float64(s.spin[i]) * s.radius[i] + np.float64(s.spin[j]) * s.radius[j]
            rub = max(min(-slides / (3.0 * wide), mu * kick), -mu * kick)
            p = np.array([p[0] + rub * n[1], p[1] - rub * n[0]])
            s.spin[i] += 2.0 * rub * w[i] / s.radius[i]
            s.spin[j] += 2.0 * rub * w[j] / s.radius[j]
        for circle, by in ((i, -p * w[i]), (j, p * w[j])):
            before = s.velocity[circle].copy()
            s.velocity[circle] = (before + by).astype(s.dtype)
            self.carry(circle, time * (s.velocity[circle] - before))
        return True

    def make_room(self, i: int, j: int, d: Any, reach: Any) -> None:
        s, law = self.slots, self.law
        distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
        depth, v = reach - distance, s.velocity[j] - s.velocity[i]
        if not (depth > 0 and distance > 0):
            return
        leaving = (d[0] * v[0] + d[1] * v[1]) / distance
        if self.carries[i] + self.carries[j] > 0 or (law.weight and leaving * law.h < depth) or not v.any():
            w = s.inverse_mass
            by = min(depth, law.most * reach) / ((w[i] + w[j]) * distance) * d
            self.carry(i, -by * w[i])
            self.carry(j, by * w[j])

    def meets(self, k: int, i: int, j: int, reach: Any, e: Any, mu: Any) -> bool:
        """Whether a touching pair is no contact at rest, and has been seen to."""
        s, law = self.slots, self.law
        d = self.gap(k, i, j)
        distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
        u = s.velocity[j] - s.velocity[i]
        closing = -(d[0] * u[0] + d[1] * u[1])
        free = self.real(1) - self.carries[i] * self.carries[j]
        bounces = not law.weight and e > 0
        meeting = (e > 0 or mu > 0) if (i, j) not in self.slip else e > 0 and (mu == 0 or not law.weight)
        if not (reach > distance and meeting and (bounces or free * abs(closing) > law.rest_speed * distance)):
            return False
        v = u + law.lag * (s.acceleration[j] - s.acceleration[i])
        along = d[0] * v[0] + d[1] * v[1]
        if along < 0:
            if not self.bounce(i, j, d, reach, e, mu):
                return False
        elif not along > law.rest_speed * distance and not bounces:
            return False
        self.make_room(i, j, self.gap(k, i, j), reach)
        return True

    def push(self) -> None:
        s, real, deep = self.slots, self.real, set()
        for k, i, j in self.lanes:
            e, mu, share = self.made_of(i, j)
            reach = s.size[i] + s.size[j]
            done = self.wide.asks and self.meets(k, i, j, reach, e, mu)
            d = self.gap(k, i, j)
            distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
            depth = real(0) if done else min(max(reach - distance, real(0)), real(LARGEST_PUSH) * reach)
            if done:
                self.slip[(i, j)] = real(0)
            elif not depth > 0:
                self.slip.pop((i, j), None)
            n = d * (real(1) / distance)
            c = n * (real(PUSHED) * depth)
            if mu > 0:
                slip, cone = self.slip.get((i, j), real(0)), mu * (real(PUSHED) * depth)
                rub = max(min(real(-GRIP * PUSHED / (3.0 * FED)) * slip, cone), -cone)
                slide = np.array([rub * n[1], -(rub * n[0])], s.dtype)
                self.slid[i] -= slide * share
                self.slid[j] += slide * (real(1) - share)
                self.turned[i] += rub * share * (real(2) / s.radius[i])
                self.turned[j] += rub * (real(1) - share) * (real(2) / s.radius[j])
                self.held[k] = rub
            self.moved[i] = self.moved[i] - c * share
            self.moved[j] = self.moved[j] + c * (real(1) - share)
            self.normal[k], self.depth[k] = n if depth > 0 else 0 * n, depth
            if depth > real(DEEP) * reach:
                deep.add(k)
        for strip in self.strips:
            self.refine([range(k, k + LANES) for k in strip[::LANES] if deep & set(range(k, k + LANES))])
        self.arrive()

    def refine(self, deep: list[range]) -> None:
        real, s = self.real, self.slots
        for sweep in range(DEEP_SWEEPS):
            left = []
            for pack in deep[::-1] if sweep % 2 else deep:
                pushes = []
                for k, i, j in [lane for lane in self.lanes if lane[0] in pack]:
                    d, reach = self.gap(k, i, j), s.size[i] + s.size[j]
                    distance = np.sqrt(d[0] * d[0] + d[1] * d[1])
                    excess = max((real(1) - real(DEEP)) * reach - distance, real(0))
                    if distance <= real(1 - LARGEST_PUSH) * reach:
                        excess, distance = real(0), reach
                    pushes.append((i, j, d * (real(DEEP_PART * PUSHED) * excess / distance), self.made_of(i, j)[2], excess))
                if any(excess > 0 for *_, excess in pushes):
                    left.append(pack)
                    for i, j, c, share, _ in pushes:
                        self.moved[i] = self.moved[i] - c * share
                        self.moved[j] = self.moved[j] + c * (real(1) - share)
            if sweep == 0:
                deep = left

    def arrive(self) -> None:
        s, law = self.slots, self.law
        by = self.moved - (s.position - self.wide.origin)
        if self.wide.rubs:
            by = by + self.slid
        s.position += by
        fed = law.feed * by
        s.velocity += fed
        if self.wide.asks:
            self.carries = (fed[:, 0] * fed[:, 0] + fed[:, 1] * fed[:, 1] > law.carried * law.carried).astype(s.dtype)
        if self.wide.rubs:
            self.turn = law.h * s.spin + self.turned
            s.spin += law.feed * self.turned

    def relax(self) -> None:
        s, law, real = self.slots, self.law, self.real
        since, v = s.position - s.start if self.wide.rubs else self.moved, s.velocity
        for k, i, j in self.lanes:
            e, mu, share = self.made_of(i, j)
            n, u = self.normal[k], v[j] - v[i]
            speed, depth = u[0] * n[0] + u[1] * n[1], self.depth[k]
            if self.wide.asks and e > 0 and -speed > law.rest_speed and not self.carries[i] * self.carries[j] > 0:
                speed = depth = real(0)  # it has been struck since it was found at rest, and bounces in the next substep
            c = speed * n
            if mu > 0 and self.depth[k] > 0:
                slides = u[0] * n[1] - u[1] * n[0] + s.spin[i] * s.radius[i] + s.spin[j] * s.radius[j]
                cone = mu * max(depth * (law.feed * real(PUSHED)) - max(speed, real(0)), real(0))
                given = self.held[k] * law.feed
                rub = max(min(given - real(1) / real(3) * slides, cone), -cone) - given
                c = np.array([c[0] - rub * n[1], c[1] + rub * n[0]], s.dtype)
                s.spin[i] += rub * share * (real(2) / s.radius[i])
                s.spin[j] += rub * (real(1) - share) * (real(2) / s.radius[j])
                moved = since[j] - since[i]
                slipped = self.slip.get((i, j), real(0)) + moved[0] * n[1] - moved[1] * n[0]
                slipped = slipped + (self.turn[i] * s.radius[i] + self.turn[j] * s.radius[j])
                most = cone * (real(3) * law.h / real(GRIP))
                self.slip[(i, j)] = max(min(slipped, most), -most) if (i, j) in self.slip else real(0)
                if not depth > 0:
                    del self.slip[(i, j)]
            v[i], v[j] = v[i] + c * share, v[j] - c * (real(1) - share)


@settings(max_examples=25, deadline=None)
@cases
def test_eight_at_once_are_one_by_one(seed: int, n: int, spread: float, dtype: Any, method: Any, material: Any) -> None:
    rng = np.random.default_rng(seed)
    slots = crowd(seed, n, spread, dtype, varied=material == "varied")
    settings_of = (0.4, 0.5) if material == "varied" else material
    _, wide = packed(slots, method, *settings_of)
    slots.position += rng.normal(0, 0.01, slots.position.shape).astype(dtype)
    slots.acceleration[:] = np.where(slots.inverse_mass[:, None] > 0, np.array((0, -9.81), dtype), 0)
    slots.spin[:] = rng.normal(0, 1, n)
    slots.fed[:] = rng.random(n) < 0.5
    slots.start = (slots.position - slots.velocity * slots.real(H)).astype(dtype)
    other = Slots(slots.dtype)
    for name in (
        "position",
        "velocity",
        "acceleration",
        "spin",
        "radius",
        "inverse_mass",
        "restitution",
        "friction",
        "fed",
        "start",
    ):
        setattr(other, name, getattr(slots, name).copy())
    other.size = other.radius
    strongest = rng.choice([0.0, 9.81])
    wide.set_up(slots, H, 0.5 * H, strongest, 4 * strongest * H, False, None)
    pairs = [(int(i), int(j)) for i, j in wide.pairs()]
    memory = {pair: slots.real(rng.normal(0, 1e-3)) for pair in dict.fromkeys(pairs) if rng.random() < 0.7}
    if wide.rubs:
        wide.hold_slips()
        where = np.concatenate([np.arange(a, a + k) for a, k in zip(wide.begin, wide.lanes, strict=False)])
        wide.slip[where] = [memory.get(pair, np.inf) for pair in pairs]
        wide.set_up(slots, H, 0.5 * H, strongest, 4 * strongest * H, False, None)
    reference = OneByOne(other, wide, memory)
    wide.cut()
    wide.do(frame.TOUCHED, slots)
    reference.push()
    for name in ("position", "velocity", "spin"):
        assert getattr(slots, name).tobytes() == getattr(other, name).tobytes(), name
    wide.do(frame.STILLED, slots)
    reference.relax()
    for name in ("velocity", "spin"):
        assert getattr(slots, name).tobytes() == getattr(other, name).tobytes(), name
    if wide.rubs:
        mu = [reference.made_of(i, j)[1] for i, j in pairs]
        expected = [memory.get(pair, np.inf) if m > 0 else None for pair, m in zip(pairs, mu, strict=True)]
        found = [s if m > 0 else None for s, m in zip(wide.slip[where], mu, strict=True)]
        assert found == expected


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_coincident_centres_part(dtype: Any) -> None:
    slots = crowd(0, 2, 1.0, dtype)
    slots.position[:] = 3.0
    slots.velocity[:] = 0.0
    _, packs = packed(slots, Fast())
    packs.set_up(slots, H, 0.0, 0.0, 0.0, False, None)
    packs.do(frame.TOUCHED, slots)
    # LARGEST_PUSH of the contact distance at most is seen, PUSHED of it is taken.
    parted = np.hypot(*(slots.position[1] - slots.position[0]))
    assert parted == pytest.approx(PUSHED * LARGEST_PUSH, rel=1e-5)


def test_a_circle_with_hundreds_of_neighbours() -> None:
    # More pairs than a set of colours has bits: 300 small circles around a large one.
    slots = Slots(np.dtype(np.float32))
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    world = pv.World()
    world.add(position=np.vstack(([0, 0], 10.04 * np.column_stack((np.cos(angle), np.sin(angle))))), radius=[10, *[0.05] * 300])
    slots.gather(world._state)
    pairs, packs = packed(slots, Fast())
    lanes = packs.pairs()
    assert set(map(tuple, lanes.tolist())) == set(map(tuple, pairs.pairs().tolist()))
    for pack in lanes.reshape(-1, LANES, 2):
        alone = np.unique(pack, axis=0)
        assert len(np.unique(alone)) == alone.size
