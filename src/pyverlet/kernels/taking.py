"""Energy is taken back from clusters that have gained too much in a frame: what `laws.limiter` says, in that order.

Sums over the members of a cluster are taken on one thread, in the order of the slots, so that they never depend on threads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest


class Bodies(NamedTuple):
    """Circles at a moment, as `State` has them."""

    position: Any
    velocity: Any
    spin: Any
    radius: Any
    mass: Any


class About(NamedTuple):
    """What else is known of them, by slot but for the last two, which are in the user's order.

    root: (n,) of the cluster of each; pull: (n, 2) N, what forces with a potential do to each beside gravity now, or empty. hits:
    as in `Slots`. order: (n,) the user's index. inside: (n,) whether it was above the wall that gravity points to; share: (n,) J
    that links hold more of than at the start, or empty.
    """

    root: Any
    pull: Any
    hits: Any
    order: Any
    inside: Any
    share: Any


class Limits(NamedTuple):
    """surplus: J to be taken; dt: s; gravity: m/s^2. forced: whether there are forces beside gravity; kept: with a potential.
    rounded: what counts as a push, of what momenta come to; grain: 1/s, of a place, the velocity it is rounded by, over rounded.
    """

    surplus: Any
    dt: Any
    gravity: Any
    period_x: Any
    period_y: Any
    forced: Any
    kept: Any
    rounded: Any
    grain: Any


_COLUMNS = 24

(
    _COUNT, _HIT, _GAIN, _MASS, _X, _Y, _PX, _PY, _PUSH_X, _PUSH_Y, _SCALE, _TURN, _INERTIA, _WITHIN, _AS_ONE, _ALONG, _LIFT,
    _DRIFT_X, _DRIFT_Y, _SLOW_WITHIN, _SLOWER, _ACROSS, _LEFT, _PUSHED,
) = range(_COLUMNS)  # fmt: skip
"""What is known of a cluster. Of momenta, places and so on first sums, then means. _WITHIN: J of its motion beside that as a
whole, _AS_ONE: J of that but for its drift across what has pushed it, _ALONG: J of that. _LEFT: J still to be taken."""


@kernel
def _slowed(taken, energy):
    """What velocities are multiplied with to lose so much of their energy, or all."""
    return np.sqrt(1.0 - min(taken / energy, 1.0)) if energy > 0.0 else 1.0


@kernel
def _free(mass):
    """kg; of who is pinned none."""
    return np.float64(mass) if mass < np.inf else 0.0


@kernel
def _kinetic(bodies, i, m):
    """J."""
    vx, vy = np.float64(bodies.velocity[i, 0]), np.float64(bodies.velocity[i, 1])
    rim = np.float64(bodies.radius[i]) * np.float64(bodies.spin[i])
    return 0.5 * m * (vx * vx + vy * vy) + 0.25 * m * rim * rim


@kernel
def _number_clusters(root):
    """((n,) number of the cluster of each, how many): roots are the lowest of their clusters."""
    cluster, count = np.empty(root.shape[0], np.int64), 0
    for k in range(root.shape[0]):
        if root[k] == k:
            cluster[k] = count
            count += 1
        else:
            cluster[k] = cluster[root[k]]
    return cluster, count


@kernel
def _pull(pull, k, m, limits):
    """N, of gravity and of forces, if there are any that have a potential."""
    fx, fy = m * limits.gravity[0], m * limits.gravity[1]
    if pull.shape[0] > 0 and m > 0.0:
        fx, fy = fx + pull[k, 0], fy + pull[k, 1]
    return fx, fy


@kernel
def raised(then, now, order, before, pull, limits, lift, moved):
    """lift: (n,) J, the work of each against gravity and forces in this frame, by the trapezoidal rule; moved: (n, 2) m.

    before, pull: as `About.pull`, at the start of the frame and now.
    """
    for k in range(lift.shape[0]):
        i, m = order[k], _free(now.mass[k])
        for axis in range(2):
            period = limits.period_x if axis == 0 else limits.period_y
            moved[k, axis] = nearest(np.float64(now.position[k, axis]) - np.float64(then.position[i, axis]), period)
        ax, ay = _pull(before, k, m, limits)
        bx, by = _pull(pull, k, m, limits)
        lift[k] = -0.5 * ((ax + bx) * moved[k, 0] + (ay + by) * moved[k, 1])


@kernel
def _sum_up(then, now, about, limits, cluster, lift, place, of):
    """What each cluster has gained, how it moves, what has pushed it. place: (n, 2) m, across the seam where the others are."""
    for k in range(cluster.shape[0]):
        i, m, to = about.order[k], _free(now.mass[k]), of[cluster[k]]
        r = about.root[k]
        for axis in range(2):
            period = limits.period_x if axis == 0 else limits.period_y
            origin = np.float64(now.position[r, axis])
            place[k, axis] = origin + nearest(np.float64(now.position[k, axis]) - origin, period)
        to[_COUNT] += 1.0
        to[_HIT] += 1.0 if about.hits[k] >= 0 else 0.0
        to[_GAIN] += _kinetic(now, k, m) - _kinetic(then, i, _free(then.mass[i])) + lift[k]
        if about.share.shape[0] > 0:
            to[_GAIN] += about.share[i]
        vx, vy = np.float64(now.velocity[k, 0]), np.float64(now.velocity[k, 1])
        gone_x, gone_y = m * (vx - np.float64(then.velocity[i, 0])), m * (vy - np.float64(then.velocity[i, 1]))
        to[_MASS] += m
        to[_X] += m * place[k, 0]
        to[_Y] += m * place[k, 1]
        to[_PX] += m * vx
        to[_PY] += m * vy
        to[_PUSH_X] += gone_x - limits.dt * m * limits.gravity[0]
        to[_PUSH_Y] += gone_y - limits.dt * m * limits.gravity[1]
        to[_SCALE] += m * np.sqrt(vx * vx + vy * vy) + np.sqrt(gone_x * gone_x + gone_y * gone_y)
        to[_SCALE] += m * limits.grain * max(abs(np.float64(now.position[k, 0])), abs(np.float64(now.position[k, 1])))


@kernel
def _share_out(limits, of):
    """How much is to be taken from each cluster: of its gain the same part, never more than that."""
    total = 0.0
    for c in range(of.shape[0]):
        own = of[c]
        own[_GAIN] = max(own[_GAIN], 0.0)
        if limits.forced and own[_COUNT] <= 1.0 and own[_HIT] == 0.0:
            own[_GAIN] = 0.0  # what has touched nobody has its gain from the integrator
        total += own[_GAIN]
        if own[_MASS] > 0.0:
            for column in (_X, _Y, _PX, _PY):
                own[column] /= own[_MASS]
    # Energy that forces and links hold may be more than they ever give: it is not answered alone.
    part = min(limits.surplus / max(total, 1e-300), 2.0)
    for c in range(of.shape[0]):
        of[c, _LEFT] = of[c, _GAIN] * part


@kernel
def _take_within(now, cluster, place, velocity, of):
    """1. Slow down what moves within a cluster. velocity: (n, 2) becomes that of now, m/s."""
    for k in range(cluster.shape[0]):
        own, m = of[cluster[k]], _free(now.mass[k])
        x, y = place[k, 0] - own[_X], place[k, 1] - own[_Y]
        vx, vy = np.float64(now.velocity[k, 0]), np.float64(now.velocity[k, 1])
        own[_TURN] += m * (x * (vy - own[_PY]) - y * (vx - own[_PX]))
        own[_INERTIA] += m * (x * x + y * y)
    for c in range(of.shape[0]):
        of[c, _TURN] = of[c, _TURN] / of[c, _INERTIA] if of[c, _INERTIA] > 0.0 else 0.0
    for k in range(cluster.shape[0]):
        own = of[cluster[k]]
        # Beside the rigid motion that has the cluster's momentum and angular momentum.
        velocity[k, 0] = np.float64(now.velocity[k, 0]) - (own[_PX] - own[_TURN] * (place[k, 1] - own[_Y]))
        velocity[k, 1] = np.float64(now.velocity[k, 1]) - (own[_PY] + own[_TURN] * (place[k, 0] - own[_X]))
        own[_WITHIN] += 0.5 * _free(now.mass[k]) * (velocity[k, 0] * velocity[k, 0] + velocity[k, 1] * velocity[k, 1])
    for c in range(of.shape[0]):
        of[c, _SLOW_WITHIN] = _slowed(of[c, _LEFT], of[c, _WITHIN])
        of[c, _LEFT] = max(of[c, _LEFT] - of[c, _WITHIN], 0.0)
    for k in range(cluster.shape[0]):
        own = of[cluster[k]]
        velocity[k, 0] = own[_PX] - own[_TURN] * (place[k, 1] - own[_Y]) + own[_SLOW_WITHIN] * velocity[k, 0]
        velocity[k, 1] = own[_PY] + own[_TURN] * (place[k, 0] - own[_X]) + own[_SLOW_WITHIN] * velocity[k, 1]


@kernel
def _find_drift(limits, of):
    """Where clusters drift to across what has pushed them: that is not taken, as long as there is something else."""
    for c in range(of.shape[0]):
        own = of[c]
        size = np.sqrt(own[_PUSH_X] * own[_PUSH_X] + own[_PUSH_Y] * own[_PUSH_Y])
        own[_DRIFT_X], own[_DRIFT_Y] = own[_PX], own[_PY]
        if size > limits.rounded * own[_SCALE]:
            ax, ay = own[_PUSH_X] / size, own[_PUSH_Y] / size
            along = own[_PX] * ax + own[_PY] * ay
            own[_PUSHED] = 1.0
            own[_DRIFT_X], own[_DRIFT_Y] = own[_PX] - along * ax, own[_PY] - along * ay
            if limits.kept:
                own[_DRIFT_X] = own[_DRIFT_Y] = 0.0


@kernel
def _take_as_a_whole(now, about, limits, cluster, velocity, lift, of):
    """2. Slow down the rest; and, where it is not enough, what drifts."""
    for k in range(cluster.shape[0]):
        own, m = of[cluster[k]], _free(now.mass[k])
        vx, vy = velocity[k, 0] - own[_DRIFT_X], velocity[k, 1] - own[_DRIFT_Y]
        rim = np.float64(now.radius[k]) * np.float64(now.spin[k])
        own[_AS_ONE] += 0.5 * m * (vx * vx + vy * vy) + 0.25 * m * rim * rim
        own[_ALONG] += 0.5 * m * (own[_DRIFT_X] * own[_DRIFT_X] + own[_DRIFT_Y] * own[_DRIFT_Y])
        if about.hits[k] >= 0 and not about.inside[about.order[k]]:
            lift[k] = 0.0  # a wall has raised it, and would again
        lift[k] = max(lift[k], 0.0)
        own[_LIFT] += lift[k]
    falls = limits.gravity[0] != 0.0 or limits.gravity[1] != 0.0
    for c in range(of.shape[0]):
        own = of[c]
        own[_SLOWER] = _slowed(own[_LEFT], own[_AS_ONE])
        own[_LEFT] = max(own[_LEFT] - own[_AS_ONE], 0.0)
        rest = max(own[_LEFT] - own[_LIFT], 0.0) if own[_PUSHED] > 0.0 or falls else 0.0
        own[_ACROSS] = _slowed(rest, own[_ALONG])


@kernel
def take(then, now, about, limits, lift, moved, lower, part):
    """Take what is too much: from velocities and spins at once, and the rest as the `part` (n,) of what they have been raised by
    which circles are to be lowered: to `lower`, (n, 2) m. (n,) bool: of whom there was more than motion could give.
    """
    cluster, clusters = _number_clusters(about.root)
    of, velocity, more = np.zeros((clusters, _COLUMNS)), np.empty_like(moved), np.zeros(cluster.shape[0], np.bool_)
    place = lower
    _sum_up(then, now, about, limits, cluster, lift, place, of)
    _share_out(limits, of)
    _take_within(now, cluster, place, velocity, of)
    _find_drift(limits, of)
    _take_as_a_whole(now, about, limits, cluster, velocity, lift, of)
    real = now.velocity.dtype.type
    for k in range(cluster.shape[0]):
        own, m = of[cluster[k]], _free(now.mass[k])
        now.spin[k] *= real(own[_SLOWER])
        if own[_GAIN] > 0.0 and m > 0.0:
            x, y = own[_DRIFT_X], own[_DRIFT_Y]
            now.velocity[k, 0] = real(own[_ACROSS] * x + own[_SLOWER] * (velocity[k, 0] - x))
            now.velocity[k, 1] = real(own[_ACROSS] * y + own[_SLOWER] * (velocity[k, 1] - y))
        # 3. How far they are lowered, along what pulls at them.
        fx, fy = _pull(about.pull, k, m, limits)
        strength, way = np.sqrt(fx * fx + fy * fy), np.sqrt(moved[k, 0] * moved[k, 0] + moved[k, 1] * moved[k, 1])
        part[k] = min(own[_LEFT] / own[_LIFT], 1.0) if own[_LIFT] > 0.0 else 0.0
        # Near where a spring pulls to it is no further than the way.
        drop = part[k] * min(lift[k] / strength, way) / strength if strength > 0.0 else 0.0
        lower[k, 0], lower[k, 1] = np.float64(now.position[k, 0]) + drop * fx, np.float64(now.position[k, 1]) + drop * fy
        more[k] = own[_LEFT] > 0.0 and m > 0.0 and strength > 0.0
    return more
