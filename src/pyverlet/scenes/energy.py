"""Verlet beside semi-implicit Euler from the same start, with 1 and with 10 substeps."""

from __future__ import annotations

from pyverlet.laws.integrators import PositionVerlet, SemiImplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings, Variant
from pyverlet.world.world import World


def build(settings: Settings) -> World:
    """Left: position Verlet. Right: semi-implicit Euler. Both start from x_prev = x - v h and meet clamp-and-flip walls.

    The articles: Verlet conserves energy much better. They are the same method: with V = (x - x_prev) / h the two balls move
    alike to rounding and reach the same heights. Only the energy is read differently: Verlet's velocity here belongs to the
    time of the position, semi-implicit Euler's lags half a step behind, which makes its curve swing by m g v h / 2 about the
    same level. More substeps make everything smaller by as much, for both.
    """
    return _drop.drop(settings)


def _scene(substeps: int) -> Scene:
    return Scene(
        f"energy-{substeps}-substep{'s' if substeps > 1 else ''}",
        f"Verlet beside semi-implicit Euler, {substeps} substep{'s' if substeps > 1 else ''} a frame",
        build,
        _drop.settings(PositionVerlet(naive_start=True), substeps=substeps),
        variants=(
            Variant("position Verlet", {"integrator": PositionVerlet(naive_start=True)}),
            Variant("semi-implicit Euler", {"integrator": SemiImplicitEuler()}),
        ),
        line=_drop.HEIGHT,
    )


ONE_SUBSTEP, TEN_SUBSTEPS = _scene(1), _scene(10)
