"""Problems for measuring integrators: four motions with an exact solution, and user-defined equations.

Units are SI, the mass is 1 kg.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.lab.solver import Acceleration, Solution, solve
from pyverlet.laws.forces import Attractor, Drag, PointSpring
from pyverlet.laws.integrators import RK4, Integrator
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State
from pyverlet.world.world import World

Phase = tuple[Floats, Floats]
"""Position (2,) in m and velocity (2,) in m/s."""

FINER = 4
"""Reference steps per tested step: the error of the reference is then 4^4 = 256 times smaller than that of RK4 itself."""

ROUNDING, ROUNDING_OF_REFERENCE = 1e-13, 1e-12
"""Smaller errors are rounding, and left out of a fit: of a step, and relative to a reference with many steps."""


@dataclass(frozen=True)
class Problem:
    """One particle, its force, and its exact motion.

    Attributes:
        name: in tables.
        law: its equation of motion.
        force: on the particle; a new one for each world.
        exact: of t in s: position and velocity.
        gravity: (x, y), m/s^2.
        seconds: duration of the measurement.
    """

    name: str
    law: str
    force: Callable[[], Any]
    exact: Callable[[float], Phase]
    gravity: tuple[float, float] = (0.0, 0.0)
    seconds: float = 1.0
    rounding: ClassVar[float] = ROUNDING

    def world(self, integrator: Integrator) -> World:
        """The particle at time 0, with one substep per frame, in float64."""
        world = World(gravity=self.gravity, integrator=integrator, collisions=None, substeps=1, dtype=np.float64)
        position, velocity = self.exact(0.0)
        world.add(position=position, velocity=velocity, mass=1.0)
        world.forces.append(self.force())
        return world

    def motion(self, integrator: Integrator, dts: Floats) -> Solution:
        """The numerical solution by an integrator, after each of these steps (n,), s."""
        world = self.world(integrator)
        found = [(0.0, *self.exact(0.0))]
        for dt in dts:
            world.step(dt)
            found.append((world.time, world.position[0].copy(), world.velocity[0].copy()))
        return Solution(*map(np.array, zip(*found, strict=True)))

    def solution(self, times: Floats) -> tuple[Floats, Floats]:
        """(n, 2) exact positions and velocities at these times (n,)."""
        return _stacked(self.exact, times)


@dataclass(frozen=True)
class Equation:
    """A user-defined equation x'' = F(t, x, x') for measuring integrators: `pyverlet order --problem module:name`.

    Attributes:
        F: as for `pyverlet.lab.solve`.
        x0: as there, at time 0.
        v0: as there.
        exact: of t in s: position and velocity in the shape of x0. None: the result of `RK4` with four times as many steps,
            accurate enough for methods up to order 4.
        seconds: duration of the measurement.
        name: in tables.
        law: above figures.
    """

    F: Acceleration
    x0: ArrayLike
    v0: ArrayLike = 0.0
    exact: Callable[[float], tuple[ArrayLike, ArrayLike]] | None = None
    seconds: float = 1.0
    name: str = "equation"
    law: str = "x'' = F(t, x, x')"

    @property
    def rounding(self) -> float:
        """See ROUNDING."""
        return ROUNDING if self.exact is not None else ROUNDING_OF_REFERENCE

    def motion(self, integrator: Integrator, dts: Floats) -> Solution:
        """The numerical solution by an integrator, after each of these steps (n,), s."""
        return solve(self.F, x0=self.x0, v0=self.v0, h=dts, integrator=integrator)

    def solution(self, times: Floats) -> tuple[Floats, Floats]:
        """Exact or reference positions and velocities at these times (n,) from 0."""
        if self.exact is not None:
            positions, velocities = _stacked(self.exact, times)
            wanted = (len(times), *np.shape(self.x0))
            if not positions.shape == velocities.shape == wanted:
                shapes = f"{positions.shape[1:]} and {velocities.shape[1:]}"
                raise InputError(f"exact returns shapes {shapes}; allowed are two of the shape of x0, {wanted[1:]}")
            return positions, velocities
        fine = solve(self.F, x0=self.x0, v0=self.v0, h=np.repeat(np.diff(times) / FINER, FINER), integrator=RK4())
        return fine.positions[::FINER], fine.velocities[::FINER]


def _stacked(exact: Callable[[float], tuple[ArrayLike, ArrayLike]], times: Floats) -> tuple[Floats, Floats]:
    positions, velocities = zip(*(exact(float(t)) for t in times), strict=True)
    return np.array(positions, np.float64), np.array(velocities, np.float64)


def _upright(y: float, v: float) -> Phase:
    return np.array([0.0, y]), np.array([0.0, v])


# ---- oscillator: y'' = -w^2 y ----

FREQUENCY = 3.0
"""w, rad/s."""


def oscillation(t: float) -> Phase:
    """y = cos w t + (v0 / w) sin w t with v0 = 0.5 m/s."""
    w, v0 = FREQUENCY, 0.5
    return _upright(np.cos(w * t) + v0 / w * np.sin(w * t), -w * np.sin(w * t) + v0 * np.cos(w * t))


# ---- free fall with linear drag: v' = g - c v ----

G = -9.81
DRAG = 1.5
"""c, 1/s."""


def fall_with_drag(t: float) -> Phase:
    """v = v_t + (v0 - v_t) exp(-c t) with the terminal speed v_t = g / c and v0 = 4 m/s."""
    terminal, v0 = G / DRAG, 4.0
    decay = np.exp(-DRAG * t)
    return _upright(terminal * t + (v0 - terminal) * (1 - decay) / DRAG, terminal + (v0 - terminal) * decay)


# ---- pendulum: theta'' = -(g / L) sin theta; the coordinate y is the angle in radians ----

SWING = 2.0
"""Initial angle, rad: far from where sin theta is theta."""

LENGTH = 1.0
"""L, m."""


class Pendulum:
    """F = -m (g / L) sin y on the coordinate y, which is an angle."""

    velocity_dependent = False

    def apply(self, state: SortedState, t: float) -> None:
        state.force[:, 1] += state.mass * (G / LENGTH) * np.sin(state.position[:, 1])

    def potential(self, state: State) -> float:
        """m (g / L) (1 - cos y) for every particle, J."""
        return float(np.sum(state.mass * (-G / LENGTH) * (1 - np.cos(state.position[:, 1].astype(np.float64)))))


def jacobi(u: float, k: float) -> tuple[float, float, float]:
    """Jacobi's elliptic functions sn, cn, dn of modulus k, by the arithmetic-geometric mean (Abramowitz, Stegun 16.4)."""
    a, b, c = [1.0], [float(np.sqrt(1 - k * k))], [k]
    while c[-1] > 1e-16:
        a, b, c = [*a, (a[-1] + b[-1]) / 2], [*b, float(np.sqrt(a[-1] * b[-1]))], [*c, (a[-1] - b[-1]) / 2]
    phi = 2.0 ** (len(a) - 1) * a[-1] * u
    for n in range(len(a) - 1, 0, -1):
        phi = (phi + float(np.arcsin(c[n] / a[n] * np.sin(phi)))) / 2
    sn = float(np.sin(phi))
    return sn, float(np.cos(phi)), float(np.sqrt(1 - (k * sn) ** 2))


def swing(t: float) -> Phase:
    """sin(theta / 2) = k cn / dn of w t, k = sin(theta_0 / 2), w^2 = g / L, released at rest."""
    k, w = float(np.sin(SWING / 2)), float(np.sqrt(-G / LENGTH))
    sn, cn, dn = jacobi(w * t, k)
    return _upright(2 * np.arcsin(k * cn / dn), -2 * k * w * np.sqrt(1 - k * k) * sn / dn)


# ---- Kepler's orbit: x'' = -x / |x|^3, semi-major axis 1, period 2 pi ----

ECCENTRICITY = 0.3


def orbit(t: float) -> Phase:
    """From the perihelion: x = (cos E - e, sqrt(1 - e^2) sin E) with Kepler's E - e sin E = t, solved by Newton's method."""
    e, anomaly = ECCENTRICITY, t
    for _ in range(50):
        step = (anomaly - e * np.sin(anomaly) - t) / (1 - e * np.cos(anomaly))
        anomaly -= step
        if abs(step) < 1e-15 * max(1.0, abs(t)):
            break
    across, speed = np.sqrt(1 - e * e), 1 / (1 - e * np.cos(anomaly))
    return (
        np.array([np.cos(anomaly) - e, across * np.sin(anomaly)]),
        np.array([-np.sin(anomaly) * speed, across * np.cos(anomaly) * speed]),
    )


PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (
        Problem("oscillator", "y'' = -ω² y", lambda: PointSpring(stiffness=FREQUENCY**2), oscillation),
        Problem("pendulum", "θ'' = -(g/L) sin θ", Pendulum, swing),
        Problem("kepler orbit", "x'' = -x / |x|³", lambda: Attractor(strength=1.0), orbit),
        Problem("fall with drag", "v' = g - c v", lambda: Drag(linear=DRAG), fall_with_drag, gravity=(0.0, G)),
    )
}
