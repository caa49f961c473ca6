"""The nine claims: J1 to J4 on the energy of bouncing sketches, J5 to J7 on Verlet's formula, J8 and J9 on contacts."""

import numpy as np

from pyverlet.lab import order
from pyverlet.lab.problems import FREQUENCY, PROBLEMS, oscillation
from pyverlet.lab.truth._claim import FLIP, HEIGHT, MINUTE, OPEN, RADIUS, G, H, Number, experiment, path, tops
from pyverlet.laws.boundaries import Box
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import ExplicitEuler, PositionVerlet, SemiImplicitEuler, TimeCorrectedVerlet
from pyverlet.laws.textbook import ProjectOnly
from pyverlet.world.world import World

OSCILLATOR = PROBLEMS["oscillator"]


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
    """E' in free flight, and the loss at the wall compared with the sum over the bounces."""
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
    """Maxima of the path from rest and with a small initial speed."""
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
    """Heights, maxima and energies of both methods."""
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
    """The energy gain of every step."""
    gain = np.diff(path(ExplicitEuler(), OPEN, 600, speed=40.0)[2])
    paper = G**2 * H**2 / 2
    return [
        Number("mean gain of a step", float(gain.mean()), "J", paper),
        Number("largest deviation of a step from it, relative", float(np.abs(gain / paper - 1).max()), below=1e-9),
    ]


@experiment(
    "J5",
    claim="The Verlet update is x' = 2 x - x_prev + F h².",
    mathematics="""
        Newton's law is F = m a, so the last term is (F / m) h². The weight is F = m g in newtons, g itself is in m/s².
        Without the division a mass of 5 kg falls five times as far, and only at 1 kg is it not noticed.
    """,
    setting="1 kg and 5 kg fall from rest for a second, by the update without the division, and in pyverlet.",
    verdict="Wrong by the factor m.",
)
def mass() -> list[Number]:
    """Distances fallen."""
    fallen = {}
    for kilograms in (1.0, 5.0):
        x_prev = x = 0.0
        for step in range(60):
            # The first step starts at rest: x_prev = x + a h^2 / 2, with the same error in a.
            x, x_prev = (x - kilograms * G * H**2 / 2, x) if step == 0 else (2 * x - x_prev - kilograms * G * H**2, x)
        fallen[kilograms] = -x
    world = World(collisions=None, substeps=1, dtype=np.float64)
    both = world.add(position=[(0, 0), (5, 0)], mass=[1.0, 5.0])
    world.run(seconds=1.0, dt=H)
    paper = G / 2
    return [
        Number("1 kg without the division", fallen[1.0], "m", paper),
        Number("5 kg without the division", fallen[5.0], "m", 5 * paper, digits=5),
        Number("1 kg in pyverlet", -float(both.position[0, 1]), "m", paper),
        Number("5 kg in pyverlet", -float(both.position[1, 1]), "m", paper),
    ]


@experiment(
    "J6",
    claim="x' = 2 x - x_prev + a h² also serves with the time of the last frame as h.",
    mathematics="""
        x - x_prev was made in the step h_prev before. Walked again in a step h it is a velocity wrong by the factor h /
        h_prev, whatever the mean step. Right is x' = x + (x - x_prev) h / h_prev + a h (h + h_prev) / 2, which is order 2
        for any h.
    """,
    setting="An oscillator for a second in 80 to 640 steps, each up to 30 % longer or shorter than the mean.",
    verdict="Wrong. The plain formula does not converge at all, the corrected one keeps order 2.",
)
def varying_step() -> list[Number]:
    """Orders and errors with a varying step."""
    plain = order.measure(PositionVerlet(), OSCILLATOR, jitter=order.JITTER)
    corrected = order.measure(TimeCorrectedVerlet(), OSCILLATOR, jitter=order.JITTER)
    return [
        Number("order of the plain formula", plain.order or 0.0, below=0.5),
        Number("its largest error in 640 steps, in phase space", float(plain.error[-1]), above=0.1, digits=2),
        Number("order of the corrected formula", corrected.order or 0.0, expected=2.0, within=0.05, digits=2),
        Number("its largest error in 640 steps, in phase space", float(corrected.error[-1]), digits=2),
    ]


@experiment(
    "J7",
    claim="Verlet's error is O(h⁴), so it is a fourth-order method.",
    mathematics="""
        x(t + h) = 2 x(t) - x(t - h) + a h² + x'''' h⁴ / 12 + ...: h⁴ is the error of one step. A second difference adds
        such errors up twice: after t / h steps they come to (t / h)² h⁴ = t² h². The order of a method is that of the
        error at a given time.
    """,
    setting="An oscillator: one step from exact positions, and a whole second, in steps of 1/80 to 1/640 s.",
    verdict="A mix-up. Locally 4, globally 2.",
)
def local_and_global() -> list[Number]:
    """The two slopes."""
    h = 1 / np.array(order.FRAMES)

    def y(t: float) -> float:
        return float(oscillation(t)[0][1])

    start = 0.3
    local = [abs(y(start + s) - (2 * y(start) - y(start - s) - FREQUENCY**2 * y(start) * s * s)) for s in h]
    slope = float(np.polyfit(np.log(h), np.log(local), 1)[0])
    whole = order.measure(PositionVerlet(), OSCILLATOR)
    return [
        Number("order of the error of one step", slope, expected=4.0, within=0.02, digits=3),
        Number("order of the error after a second", whole.order or 0.0, expected=2.0, within=0.02, digits=3),
    ]


@experiment(
    "J8",
    claim="Verlet takes the bouncing into account by itself: put the position back, and the velocity follows.",
    mathematics="""
        After the projection x is on the wall and x_prev above it: the ball still moves down. A step later both are on the
        wall and x - x_prev = 0: it rests. That is a restitution of exactly 0. A bounce needs a stated e, and then rises
        to e² of the drop.
    """,
    setting="A ball falls 2.75 m on a floor: one that only projects, for 10 s, and pyverlet's with e = 0.5.",
    verdict="Wrong. Projection alone never bounces.",
)
def bouncing() -> list[Number]:
    """Height after the first contact."""
    y, _, _ = path(PositionVerlet(), ProjectOnly(Box((-5, 0), (5, 50))), 600)
    after = y[int(np.argmax(y <= RADIUS)) :]
    y, v, _ = path(PositionVerlet(), Box((-5, 0), (5, 50), restitution=0.5), 60)
    rising = int(np.flatnonzero((v[:-1] < 0) & (v[1:] > 0))[0]) + 1
    rebound = float(y[rising] - RADIUS + v[rising] ** 2 / (2 * 9.81))
    return [
        Number("rise after the fall, projection alone", float(after.max() - RADIUS), "m", below=1e-12),
        Number("rise after the fall, e = 0.5", rebound, "m", 0.25 * (HEIGHT - RADIUS)),
    ]


@experiment(
    "J9",
    claim="Overlapping circles are to be pushed apart, half the overlap each.",
    mathematics="""
        Verlet's velocity is (x - x_prev) / h: a position moved by d / 2 is a velocity of d / (2 h) more, for each of the
        two. In a pile, where weight makes new overlaps in every step, this feeds it without end: gooey heaps that boil.
        What was put in must be taken out again: pyverlet's contacts push with a speed of their own, which is taken back at
        the end of the substep.
    """,
    setting="Two circles of radius 0.5 m at rest, 0.05 m deep in each other, no gravity: a step of 1/60 s; in pyverlet 1 s.",
    verdict="Only half of it: by position alone it injects a velocity of overlap / h.",
)
def pushing() -> list[Number]:
    """Speed at which the two separate."""
    overlap, reach = 0.05, 1.0
    x = np.array([-(reach - overlap) / 2, (reach - overlap) / 2])
    x_prev = x.copy()
    depth = reach - (x[1] - x[0])
    x += np.array([-depth / 2, depth / 2])
    apart = float((x[1] - x_prev[1] - x[0] + x_prev[0]) / H)
    world = World(gravity=(0, 0), collisions=Collisions(), dtype=np.float64)
    pair = world.add(position=[(-(reach - overlap) / 2, 0), ((reach - overlap) / 2, 0)], radius=reach / 2)
    world.run(seconds=1.0, dt=H)
    speed = float(pair.velocity[1, 0] - pair.velocity[0, 0])
    return [
        Number("speed of parting, projection alone", apart, "m/s", overlap / H),
        Number("speed of parting in pyverlet", speed, "m/s", below=1e-12),
        Number("overlap left in pyverlet", float(world.overlap().max), below=1e-9),
    ]
