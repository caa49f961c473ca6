"""J5 to J7: claims about the formula itself."""

from __future__ import annotations

import numpy as np

from pyverlet.lab import order
from pyverlet.lab.problems import FREQUENCY, PROBLEMS, oscillation
from pyverlet.lab.truth._claim import G, H, Number, experiment
from pyverlet.laws.integrators import PositionVerlet, TimeCorrectedVerlet
from pyverlet.world.world import World

OSCILLATOR = PROBLEMS["oscillator"]


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
            # The first step starts at rest: x_prev = x + a h^2 / 2, with the very same error in a.
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
    """Orders and errors under jitter."""
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
