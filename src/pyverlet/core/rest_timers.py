# mypy: ignore-errors
"""How long a particle has been at rest, of which sleep depends."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real

from pyverlet.core.kernels import inlined


@inlined
def longer_at_rest(
    velocity: cython.pointer[cython.const[real]], spin: cython.pointer[cython.const[real]],
    radius: cython.pointer[cython.const[real]], i: cython.Py_ssize_t, limit: real, dt: cython.float, timer: cython.float,
) -> cython.float:  # fmt: skip
    """Seconds at rest after a frame of dt s; 0 if the speed, with the rim's, exceeds sqrt(limit radius)."""
    rim: real = spin[i] * radius[i]
    speed2: real = velocity[2 * i] * velocity[2 * i] + velocity[2 * i + 1] * velocity[2 * i + 1] + rim * rim
    longer: cython.float = timer + dt
    zero: cython.float = 0
    return longer if speed2 <= limit * radius[i] else zero
