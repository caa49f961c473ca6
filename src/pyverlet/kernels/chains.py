"""Chains of distances, each solved at once: a light rope carries a heavy ball in one go.

A run is rows a to b whose neighbours share a particle: row r joins nodes r - a and r - a + 1. The moves dx of its nodes satisfy

    m dx = sum of the pulls of both links,   pull of a link on its far node = d lam - bow P (dx_far - dx_near)

with lam = (right - n (dx_far - dx_near)) / give, the direction n of the link, the one d its force acts along (kernels.links), and
P = 1 - n n^T. `bow` is the tension over the length: as a string under tension does, the link resists being turned. Without it a
taut light rope would be thrown sideways by its own tension as soon as the substeps are too long for its fastest swing.

So each link is a 2 x 2 matrix B = d n^T / give + bow P, and the run is block tridiagonal: eliminated from its first node on. X is
what the nodes so far put against a move of the present one; beyond the link that is X (X + B)^-1 B, as for springs in series: a
form that loses no digits.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import LINK_COLOURS, LINK_ROUNDS, LINK_TAUT, LINK_TURN
from pyverlet.kernels.seam import nearest
from pyverlet.kernels.shapes import measure_distance

_SWEEPS = 4


@kernel
def _eliminate(a, b, node, first, particle, weight, gradient, along, active, give, bow, right, inverse, carried, move, step):
    """The moves of the nodes, and the steps of lam, of the run a to b; its nodes are `node` and following."""
    x00 = x01 = x10 = x11 = 0.0
    gx = gy = 0.0
    for r in range(a, b):
        e = first[r]
        w = weight[particle[e]]
        k = node + r - a
        nx, ny, dx, dy = gradient[e + 1, 0], gradient[e + 1, 1], along[e + 1, 0], along[e + 1, 1]
        stiff, across = (1.0 / give[r], bow[r]) if active[r] else (0.0, 0.0)
        b00, b01 = stiff * dx * nx + across * (1.0 - nx * nx), stiff * dx * ny - across * nx * ny
        b10, b11 = stiff * dy * nx - across * nx * ny, stiff * dy * ny + across * (1.0 - ny * ny)
        carried[k, 0], carried[k, 1] = gx, gy
        push = stiff * right[r]
        if w == 0.0:
            inverse[k, 0] = inverse[k, 1] = inverse[k, 2] = inverse[k, 3] = 0.0
            x00, x01, x10, x11 = b00, b01, b10, b11
            gx, gy = dx * push, dy * push
            continue
        x00 += 1.0 / w
        x11 += 1.0 / w
        d00, d01, d10, d11 = x00 + b00, x01 + b01, x10 + b10, x11 + b11
        over = 1.0 / (d00 * d11 - d01 * d10)
        i00, i01, i10, i11 = d11 * over, -d01 * over, -d10 * over, d00 * over
        inverse[k, 0], inverse[k, 1], inverse[k, 2], inverse[k, 3] = i00, i01, i10, i11
        # What is carried over the link: X D^-1 d right / give + B D^-1 g
        px, py = i00 * dx * push + i01 * dy * push, i10 * dx * push + i11 * dy * push
        qx, qy = i00 * gx + i01 * gy, i10 * gx + i11 * gy
        gx, gy = x00 * px + x01 * py + b00 * qx + b01 * qy, x10 * px + x11 * py + b10 * qx + b11 * qy
        # X becomes X D^-1 B.
        m00, m01 = i00 * b00 + i01 * b10, i00 * b01 + i01 * b11
        m10, m11 = i10 * b00 + i11 * b10, i10 * b01 + i11 * b11
        x00, x01, x10, x11 = x00 * m00 + x01 * m10, x00 * m01 + x01 * m11, x10 * m00 + x11 * m10, x10 * m01 + x11 * m11
    last = node + b - a
    w = weight[particle[first[b] - 1]]
    move[last, 0] = move[last, 1] = 0.0
    if w > 0.0:
        x00 += 1.0 / w
        x11 += 1.0 / w
        over = 1.0 / (x00 * x11 - x01 * x10)
        move[last, 0], move[last, 1] = (x11 * gx - x01 * gy) * over, (x00 * gy - x10 * gx) * over
    for r in range(b - 1, a - 1, -1):
        e = first[r]
        k = node + r - a
        nx, ny, dx, dy = gradient[e + 1, 0], gradient[e + 1, 1], along[e + 1, 0], along[e + 1, 1]
        stiff, across = (1.0 / give[r], bow[r]) if active[r] else (0.0, 0.0)
        mx, my = move[k + 1, 0], move[k + 1, 1]
        out = nx * mx + ny * my
        fx = carried[k, 0] + stiff * dx * (out - right[r]) + across * (mx - nx * out)
        fy = carried[k, 1] + stiff * dy * (out - right[r]) + across * (my - ny * out)
        move[k, 0] = inverse[k, 0] * fx + inverse[k, 1] * fy
        move[k, 1] = inverse[k, 2] * fx + inverse[k, 3] * fy
        step[r] = stiff * (right[r] - out + nx * move[k, 0] + ny * move[k, 1])


@kernel
def _slack_changes(a, b, node, first, gradient, upper, intact, active, right, move, step, lam):
    """A rope pulls or does nothing: let go of rows that would push, take up those the others stretch; whether any changed."""
    changed = False
    for r in range(a, b):
        if upper[r] == np.inf or not intact[r]:
            continue
        if active[r]:
            if lam[r] + step[r] > upper[r]:
                active[r] = 0
                changed = True
        else:
            e, k = first[r], node + r - a
            out = gradient[e + 1, 0] * (move[k + 1, 0] - move[k, 0]) + gradient[e + 1, 1] * (move[k + 1, 1] - move[k, 1])
            if out > right[r]:
                active[r] = 1
                changed = True
    return changed


@kernel
def _sweep(a, b, position, period_x, period_y, first, particle, weight, rest, upper, intact, offset, give, lam):
    """One link after the other, back and forth: less exact, but safe when links turn too far to be solved as straight ones."""
    for sweep in range(_SWEEPS):
        for s in range(a, b):
            r = s if sweep % 2 == 0 else a + b - 1 - s
            if not intact[r]:
                continue
            i, j = particle[first[r]], particle[first[r] + 1]
            dx = nearest(position[j, 0] - position[i, 0], period_x)
            dy = nearest(position[j, 1] - position[i, 1], period_y)
            length = np.sqrt(dx * dx + dy * dy)
            ww = weight[i] + weight[j]
            if length == 0.0 or ww == 0.0:
                continue
            step = min(-(length - rest[r] + offset[r] + give[r] * lam[r]) / (ww + give[r]), upper[r] - lam[r])
            lam[r] += step
            dx, dy = dx * (step / length), dy * (step / length)
            position[i, 0] -= weight[i] * dx
            position[i, 1] -= weight[i] * dy
            position[j, 0] += weight[j] * dx
            position[j, 1] += weight[j] * dy


@kernel
def _solve_one(r, position, first, particle, weight, upper, along, gradient, give, active, right, lam):
    """A run of a single link: one equation."""
    if not active[r]:
        return
    e = first[r]
    i, j = particle[e], particle[e + 1]
    dx, dy = along[e + 1, 0], along[e + 1, 1]
    ww = (weight[i] + weight[j]) * (gradient[e + 1, 0] * dx + gradient[e + 1, 1] * dy)
    step = min(right[r] / (ww + give[r]), upper[r] - lam[r])
    lam[r] += step
    dx, dy = dx * step, dy * step
    if weight[i] > 0.0:
        position[i, 0] -= weight[i] * dx
        position[i, 1] -= weight[i] * dy
    if weight[j] > 0.0:
        position[j, 0] += weight[j] * dx
        position[j, 1] += weight[j] * dy


@kernel
def _solve_run(
    a, b, node, position, period_x, period_y, first, particle, weight, rest, upper, intact, value, gradient, along, turn, bend,
    bow, give, offset, active, right, inverse, carried, move, step, lam,
):  # fmt: skip
    one_sided = False
    for r in range(a, b):
        measure_distance(r, first[r], position, period_x, period_y, particle, rest, value, gradient, bend)
        e = first[r] + 1
        nx, ny = gradient[e, 0], gradient[e, 1]
        along[e, 0] += turn[r] * (nx - along[e, 0])
        along[e, 1] += turn[r] * (ny - along[e, 1])
        if nx * along[e, 0] + ny * along[e, 1] < 0.5:  # by 60 degrees in a substep: the old direction says nothing any more
            along[e, 0], along[e, 1] = nx, ny
        right[r] = -(value[r] + offset[r] + give[r] * lam[r])
        active[r] = intact[r] and give[r] > 0.0
        if upper[r] < np.inf:
            one_sided = True
            active[r] &= right[r] < LINK_TAUT * rest[r]
    if b - a == 1:
        _solve_one(a, position, first, particle, weight, upper, along, gradient, give, active, right, lam)
        return
    for _ in range(LINK_ROUNDS):
        _eliminate(a, b, node, first, particle, weight, gradient, along, active, give, bow, right, inverse, carried, move, step)
        if not one_sided or not _slack_changes(a, b, node, first, gradient, upper, intact, active, right, move, step, lam):
            break
    trusted = True
    for r in range(a, b):
        e, k = first[r], node + r - a
        mx, my = move[k + 1, 0] - move[k, 0], move[k + 1, 1] - move[k, 1]
        trusted &= abs(gradient[e + 1, 0] * my - gradient[e + 1, 1] * mx) * bend[r] < LINK_TURN
    if not trusted:
        _sweep(a, b, position, period_x, period_y, first, particle, weight, rest, upper, intact, offset, give, lam)
        return
    for r in range(a, b):
        lam[r] += step[r]
    for k in range(node, node + b - a + 1):
        p = particle[first[a]] if k == node else particle[first[a + k - node] - 1]
        if weight[p] > 0.0:
            position[p, 0] += move[k, 0]
            position[p, 1] += move[k, 1]


@parallel_kernel
def sweep(
    back, skip, colour, run, position, period_x, period_y, first, particle, weight, rest, upper, intact, value, gradient, along,
    turn, bend, bow, give, offset, active, right, inverse, carried, move, step, lam,
):  # fmt: skip
    """Solve all runs, colour by colour or `back` from the last one, without the first colour on the way if `skip`.

    Run k is rows run[k] to run[k + 1], colour c runs colour[c] to colour[c + 1]; those of a colour share no particle, but for the
    last one's. active to step: room for the solver, of a row or of a node; the nodes of run k begin at run[k] + k.
    """
    colours = colour.shape[0] - 1
    for n in range(1 if skip else 0, colours):
        c = colours - 1 - n if back else n
        if c < LINK_COLOURS - 1:
            for k in prange(colour[c], colour[c + 1]):
                _solve_run(
                    run[k], run[k + 1], run[k] + k, position, period_x, period_y, first, particle, weight, rest, upper, intact,
                    value, gradient, along, turn, bend, bow, give, offset, active, right, inverse, carried, move, step, lam,
                )  # fmt: skip
        else:
            for k in range(colour[c], colour[c + 1]):
                _solve_run(
                    run[k], run[k + 1], run[k] + k, position, period_x, period_y, first, particle, weight, rest, upper, intact,
                    value, gradient, along, turn, bend, bow, give, offset, active, right, inverse, carried, move, step, lam,
                )  # fmt: skip
