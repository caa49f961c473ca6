"""Pairs that meet or part faster than a contact at rest does: one by one, for hardly any does."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import LANES, larger, pick
from pyverlet.ground.constants import LOAN_S
from pyverlet.kernels.bounds import impact_time
from pyverlet.kernels.tables import MU, R_I, R_J, E


@kernel
def _carry(circles, i, x, y):
    """Move circle i by (x, y), which is no push and feeds nobody: `moved` gets what `position - origin` gets, rounded alike."""
    from_x, from_y = circles.position[i, 0], circles.position[i, 1]
    to_x, to_y = from_x + x, from_y + y
    circles.moved[i, 0] += (to_x - circles.origin[i, 0]) - (from_x - circles.origin[i, 0])
    circles.moved[i, 1] += (to_y - circles.origin[i, 1]) - (from_y - circles.origin[i, 1])
    circles.position[i, 0], circles.position[i, 1] = to_x, to_y


@kernel
def _kick(circles, i, x, y, time):
    """The velocity of circle i changes by (x, y), m/s, `time` ago: what it has become has carried the circle since."""
    vx, vy = circles.velocity[i, 0], circles.velocity[i, 1]
    circles.velocity[i, 0] = vx + x
    circles.velocity[i, 1] = vy + y
    _carry(circles, i, time * (circles.velocity[i, 0] - vx), time * (circles.velocity[i, 1] - vy))


@kernel
def _own(circles, i, x, y, turn):
    """An impact, which changes the velocity of circle i by (x, y) and its spin by `turn`, goes by its own mass: `kernels.balance`
    need not make up for it. It lends and borrows nothing for a while.
    """
    circles.before[i, 0] += x
    circles.before[i, 1] += y
    circles.spin_before[i] += turn
    circles.lent[i] = 0
    circles.busy[i] = LOAN_S
    circles.inertia[i, 1] = -1


@kernel
def _slow(circles, i, j, law):
    """Slower than this i and j meet, or part, as contacts at rest do, m/s."""
    if circles.calm.shape[0] > 0:
        return max(law.rest_speed, max(circles.calm[i], circles.calm[j]))
    return law.rest_speed


@kernel
def slow_lanes(calm, lane_i, lane_j, k, rest):
    """`_slow` of the eight pairs from k on; rest: `law.rest_speed` in every lane."""
    if calm.shape[0] > 0:
        return larger(rest, larger(pick(calm, lane_i, k), pick(calm, lane_j, k)))
    return rest


@kernel
def _bounce(i, j, dx, dy, reach, e, mu, ri, rj, circles, law, spent):
    """An overlapping pair that meets faster than a contact at rest: back to when and where it met, and on from there.

    At the time t ago at which their distance was `reach` they met at the speed v_n along n. They part with e v_n; the impulse
    (1 + e) v_n / W, W = w_i + w_j, keeps the momentum, for e = 1 the energy too, and what was gained in velocity has carried them
    for the time t. Friction takes the slip v_t of the rims, as far as mu times the impulse goes: a disc has I = m r^2 / 2, so
    that the rims have the inverse mass 3 W along the tangent (n_y, -n_x). Returns v_n; 0 if they have not met in this substep.
    """
    zero = law.h - law.h
    half = law.h / (law.h + law.h)
    v, a, w = circles.velocity, circles.acceleration, circles.inverse_mass
    wi, wj = w[i], w[j]
    ax, ay = a[j, 0] - a[i, 0], a[j, 1] - a[i, 1]
    vx, vy = v[j, 0] - v[i, 0] + law.lag * ax, v[j, 1] - v[i, 1] + law.lag * ay
    time = impact_time(dx, dy, vx, vy, ax, ay, reach, law.h)
    dx -= time * (vx - half * time * ax)
    dy -= time * (vy - half * time * ay)
    # From here on in float64, so that velocities are rounded once. Rounded in float32 a normal is longer than 1 or shorter, for a
    # given distance always alike: it heats a gas, or cools it, by up to 3e-8 of its energy an impact.
    distance = np.sqrt(np.float64(dx) * dx + np.float64(dy) * dy)
    if not distance > 0.0:
        return 0.0
    nx, ny = dx / distance, dy / distance
    ux = np.float64(v[j, 0]) - v[i, 0] + (np.float64(law.lag) - time) * ax
    uy = np.float64(v[j, 1]) - v[i, 1] + (np.float64(law.lag) - time) * ay
    hit = -(ux * nx + uy * ny)
    if not hit > _slow(circles, i, j, law):
        return 0.0
    kick = (hit + e * hit) / (np.float64(wi) + wj)
    px, py, turn_i, turn_j = kick * nx, kick * ny, 0.0, 0.0
    if spent.shape[0] > 0:
        spent[0] -= 0.5 * hit * hit * (1.0 - np.float64(e) * e) / (np.float64(wi) + wj)
        spent[2] += kick * reach
    if mu > zero:
        slip = ux * ny - uy * nx + np.float64(circles.spin[i]) * ri + np.float64(circles.spin[j]) * rj
        most = mu * kick
        rub = max(min(-slip / (3.0 * (np.float64(wi) + wj)), most), -most)
        px += rub * ny
        py -= rub * nx
        turn_i, turn_j = 2.0 * rub * wi / ri, 2.0 * rub * wj / rj
        circles.spin[i] += turn_i
        circles.spin[j] += turn_j
        if spent.shape[0] > 0:
            spent[1] += rub * (slip + 1.5 * (np.float64(wi) + wj) * rub)
    if circles.lent.shape[0] > 0:
        _own(circles, i, -px * wi, -py * wi, turn_i)
        _own(circles, j, px * wj, py * wj, turn_j)
    _kick(circles, i, -px * wi, -py * wi, time)
    _kick(circles, j, px * wj, py * wj, time)
    return hit


@kernel
def _make_room(i, j, dx, dy, reach, circles, law):
    """A pair on its way apart goes to where it no longer overlaps, without being thrown apart any faster.

    Without weight, one that parts by itself within the substep is left alone: moving it changes its angular momentum, unless both
    move alike.
    """
    distance = np.sqrt(dx * dx + dy * dy)
    depth = reach - distance
    if not (depth > 0 and distance > 0):
        return
    vx = circles.velocity[j, 0] - circles.velocity[i, 0]
    vy = circles.velocity[j, 1] - circles.velocity[i, 1]
    leaving = (dx * vx + dy * vy) / distance
    carries = circles.carries[i] + circles.carries[j] > 0
    if carries or (law.weight != 0 and leaving * law.h < depth) or (vx == 0 and vy == 0):
        wi, wj = circles.inverse_mass[i], circles.inverse_mass[j]
        by = min(depth, law.most * reach) / ((wi + wj) * distance)
        _carry(circles, i, -by * dx * wi, -by * dy * wi)
        _carry(circles, j, by * dx * wj, by * dy * wj)


@kernel
def _apart(i, j, k, circles, pairs):
    """From i to j, the pair of lane k, m."""
    dx = pairs.gap[0, k] + (circles.moved[j, 0] - circles.moved[i, 0])
    return dx, pairs.gap[1, k] + (circles.moved[j, 1] - circles.moved[i, 1])


@kernel
def treat(bits, k, at, circles, pairs, law, spent):
    """Pairs of a pack, by bits, that meet or part faster than a contact at rest: one by one, for hardly any does.

    Returns those that are done with: the others turn out to rest.
    """
    done = 0
    v, a, m = circles.velocity, circles.acceleration, pairs.made_of
    for lane in range(LANES):
        if (bits >> lane) & 1:
            i, j = pairs.lane_i[k + lane], pairs.lane_j[k + lane]
            if lane > 0 and i == pairs.lane_i[k + lane - 1] and j == pairs.lane_j[k + lane - 1]:
                done |= ((done >> (lane - 1)) & 1) << lane  # a pair repeated to fill the pack
                continue
            dx, dy = _apart(i, j, k + lane, circles, pairs)
            one, reach = at + lane * law.mixed, pairs.reach[(k + lane) * law.sized]
            vx = v[j, 0] - v[i, 0] + law.lag * (a[j, 0] - a[i, 0])
            vy = v[j, 1] - v[i, 1] + law.lag * (a[j, 1] - a[i, 1])
            along = dx * vx + dy * vy
            if along < 0:
                hit = _bounce(i, j, dx, dy, reach, m[E, one], m[MU, one], m[R_I, one], m[R_J, one], circles, law, spent)
                if not hit > 0.0:
                    continue
                if pairs.bounced.shape[0] > 0 and m[E, one] * hit > _slow(circles, i, j, law):  # as of walls
                    pairs.bounced[k + lane] += np.uint8(1)
                dx, dy = _apart(i, j, k + lane, circles, pairs)
            elif not along > _slow(circles, i, j, law) * np.sqrt(dx * dx + dy * dy) and not (law.weight == 0 and m[E, one] > 0):
                continue
            _make_room(i, j, dx, dy, reach, circles, law)
            done |= 1 << lane
    return done
