"""J1 to J4: where the energy of the bouncing sketches goes."""

from __future__ import annotations

import numpy as np

from pyverlet.lab.truth._claim import FLIP, HEIGHT, MINUTE, OPEN, RADIUS, G, H, Number, experiment, path, tops
from pyverlet.laws.integrators import ExplicitEuler, PositionVerlet, SemiImplicitEuler


@experiment(
    "J1",
    claim="Semi-implicit Euler loses energy.",
    mathematics="""
        With v' = v - g h and y' = y + v' h, the quantity E' = v²/2 + g y - (h/2) g v is the same before and after the
        step: put them in and every term cancels. The method is symplectic, its energy swings by (h/2) g v and comes back.
        Clamp-and-flip, having found the ball a depth d below the wall with speed w, changes E' by g d - g h w, which is
        never a gain.
    """,
    setting="""
        One ball thrown up at 1 m/s, 60 steps a second, for a minute: without walls, then over a floor with
        clamp-and-flip, e = 1.
    """,
    verdict="Wrong. In flight nothing is lost; all of the loss is the wall's.",
)
def loses() -> list[Number]:
    """E' in free flight, and its loss at the wall against the sum over the bounces."""
    y, v, _ = path(SemiImplicitEuler(), OPEN, MINUTE, speed=1.0)
    flight = v**2 / 2 + G * y - H / 2 * G * v
    spread = np.ptp(flight) / np.abs(G * y).max()
    y, v, _ = path(SemiImplicitEuler(), FLIP, MINUTE, speed=1.0)
    modified = v**2 / 2 + G * y - H / 2 * G * v
    w = -(v[:-1] - G * H)
    depth = RADIUS - (y[:-1] - w * H)
    hits = depth > 0
    summed = float(np.sum(G * (depth - H * w)[hits]))
    return [
        Number("spread of E' in a minute of free flight, relative", float(spread), below=1e-12),
        Number("change of E' in a minute over the floor", float(modified[-1] - modified[0]), "J", summed, digits=3),
        Number("bounces in that minute", int(np.count_nonzero(hits)), above=30),
    ]


@experiment(
    "J2",
    claim="Released from rest, semi-implicit Euler conserves the energy.",
    mathematics="""
        From rest every speed is a whole multiple of g h. The first clamp puts the ball on the floor, so that all heights
        above it are g h² n (n + 1) / 2, and each later fall ends exactly on the floor. That is no hit yet; a step later d
        = w h, and the loss g (w h - d) of J1 is 0. Any other speed, floor or rounding breaks it.
    """,
    setting="""
        The ball over clamp-and-flip for a minute, from rest and from 0.1 m/s, with g h² = 2857 / 2²⁰ m, so that nothing
        is rounded.
    """,
    verdict="A coincidence of g h with the wall, not a property of the method.",
)
def from_rest() -> list[Number]:
    """Tops of the path from rest and from a little speed."""
    exact = 2857 / 2**20 / H**2
    rest = tops(path(SemiImplicitEuler(), FLIP, MINUTE, gravity=exact)[0])
    moving = tops(path(SemiImplicitEuler(), FLIP, MINUTE, gravity=exact, speed=0.1)[0])
    # The first fall passes the floor in step n, where n (n + 1) / 2 of g h^2 exceed it; n - 1 steps of the way up remain.
    n = int(np.ceil((np.sqrt(1 + 8 * (HEIGHT - RADIUS) / (exact * H**2)) - 1) / 2))
    lattice = RADIUS + exact * H**2 * n * (n - 1) / 2
    return [
        Number("first top from rest", float(rest[0]), "m", lattice),
        Number("highest minus lowest top from rest", float(np.ptp(rest)), "m", below=1e-14),
        Number("first top from 0.1 m/s", float(moving[0]), "m"),
        Number("last top from 0.1 m/s", float(moving[-1]), "m", digits=3),
        Number("lost height from 0.1 m/s", float(moving[0] - moving[-1]), "m", digits=3, above=0.1),
    ]


@experiment(
    "J3",
    claim="Verlet conserves the energy much better than semi-implicit Euler.",
    mathematics="""
        Call V = (x - x_prev) / h. Verlet's x' = 2 x - x_prev + a h² reads V' = V + a h, x' = x + V' h: semi-implicit
        Euler, letter by letter. What differs is which velocity is reported: V belongs to the middle of the step, v = V +
        a h / 2 to its end. An energy made with V swings by m g h V / 2 about the one made with v, on the same path.
    """,
    setting="Both from the same V over clamp-and-flip for a minute, thrown up at 0.1 m/s.",
    verdict="Wrong. They are one method; from the same start the tops agree to rounding.",
)
def one_method() -> list[Number]:
    """Heights, tops and energies of the two."""
    verlet_y, _, verlet_energy = path(PositionVerlet(naive_start=True), FLIP, MINUTE, speed=0.1)
    euler_y, euler_v, euler_energy = path(SemiImplicitEuler(), FLIP, MINUTE, speed=0.1)
    swing = (euler_v**2 - (euler_v - G * H / 2) ** 2) / 2
    difference = (euler_energy - verlet_energy)[1:]
    largest = int(np.argmax(np.abs(difference)))
    return [
        Number("tops compared", len(tops(euler_y)), above=30),
        Number("largest difference of two tops", float(np.abs(tops(verlet_y) - tops(euler_y)).max()), "m", below=1e-9),
        Number("largest difference of the heights", float(np.abs(verlet_y - euler_y).max()), "m", below=1e-9),
        Number("largest difference of the energies", float(difference[largest]), "J", float(swing[1:][largest]), 1e-6, digits=3),
    ]


@experiment(
    "J4",
    claim="Explicit Euler gains energy, somehow.",
    mathematics="""
        With y' = y + v h and v' = v - g h: E' - E = m (v'² - v²) / 2 + m g (y' - y) = m g² h² / 2. The velocity drops
        out: the gain is the same in every step of free flight, on the way up as on the way down.
    """,
    setting="One ball of 1 kg in free flight, 600 steps of 1/60 s.",
    verdict="True, and exactly how much is known.",
)
def gains() -> list[Number]:
    """The gain of every step."""
    gain = np.diff(path(ExplicitEuler(), OPEN, 600, speed=40.0)[2])
    paper = G**2 * H**2 / 2
    return [
        Number("mean gain of a step", float(gain.mean()), "J", paper),
        Number("largest deviation of a step from it, relative", float(np.abs(gain / paper - 1).max()), below=1e-9),
    ]
