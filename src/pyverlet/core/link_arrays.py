# mypy: ignore-errors
"""The `Links` struct: linked particles, pins, and rows in blocks. SI units, all in float64."""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t

DISTANCE = cython.declare(cython.int, 0)
ANGLE = cython.declare(cython.int, 1)
AREA = cython.declare(cython.int, 2)
MOTOR = cython.declare(cython.int, 3)

Links = cython.struct(
    # ---- linked particles
    count=cython.Py_ssize_t,
    sorted_index=cython.pointer(uint32_t),
    x=cython.pointer(cython.double),  # (count, 2) at the start of the substep, m
    u=cython.pointer(cython.double),  # (count, 2) velocity, m/s
    own=cython.pointer(cython.double),  # (count,) inverse mass, 1/kg
    weight=cython.pointer(cython.double),  # (count,) inverse mass that rows use: less if the particle is pinned by a spring
    warmed=cython.pointer(cython.double),  # (count, 2) m/s by links during contact solving, removed afterwards
    driven=cython.pointer(cython.double),  # (count, 2) m/s^2 by forces alone
    react=cython.pointer(cython.double),  # (count, 2) N s by rows since then
    surfaces=cython.bint,  # whether there are surfaces
    contact=cython.pointer(cython.double),  # of `Step`
    rough=cython.bint,
    stiff=cython.pointer(int32_t),  # (count,) whether a rigid link or pin acts on it
    struck=cython.pointer(cython.double),  # (count,) s into the substep, time of its impact; 0: none
    lively=cython.bint,  # whether rigid links bounce and nothing rests: then impulses are repeated whole
    warm=cython.bint,  # whether `u` includes `warmed`
    loose=cython.bint,  # whether all chains are alone
    drifted=cython.bint,  # whether particles have moved in this substep
    has_friction=cython.pointer(int32_t),  # (count,) whether surfaces that hold it have friction
    rim=cython.pointer(cython.double),  # (count,) spin times radius, m/s
    spun=cython.pointer(cython.double),  # (count,) rad/s that motors have given in this substep
    powered=cython.pointer(int32_t),  # (count,) number of motors that turn it
    motors=cython.bint,  # whether there are any
    gives=cython.bint,  # whether links can add kinetic energy: springs or motors
    ease=cython.pointer(cython.double),  # (count,) as in `Step`
    begun=cython.pointer(cython.double),  # (count, 3) `u` and `rim` before its chain was solved
    had=cython.pointer(cython.double),  # (rows, 2) `given` at that time
    held=cython.pointer(int32_t),  # (count,) contact with the surface that holds it; -1: none
    # ---- pins
    pins=cython.Py_ssize_t,
    pin_node=cython.pointer(int64_t),
    pin_point=cython.pointer(cython.double),  # (pins, 2) m
    pin_stiffness=cython.pointer(cython.double),
    pin_damping=cython.pointer(cython.double),
    pin_strength=cython.pointer(cython.double),
    pin_intact=cython.pointer(int32_t),
    pin_soft=cython.pointer(cython.double),
    pin_impulse=cython.pointer(cython.double),  # (pins, 2), and the others, too
    pin_load=cython.pointer(cython.double),
    pin_pull=cython.pointer(cython.double),
    pin_value=cython.pointer(cython.double),
    pin_next=cython.pointer(cython.double),
    pin_target=cython.pointer(cython.double),
    # ---- rows: what each measures is C
    rows=cython.Py_ssize_t,
    first=cython.pointer(int64_t),  # (rows + 1,) of its entries
    node=cython.pointer(int64_t),  # (entries,) linked particles
    gradient=cython.pointer(cython.double),  # (entries, 2) of C at the start of the substep; for distances see `way`
    slope=cython.pointer(cython.double),  # (entries, 2) of C at the current state
    kind=cython.pointer(int32_t),
    rest=cython.pointer(cython.double),
    stiffness=cython.pointer(cython.double),
    damping=cython.pointer(cython.double),
    upper=cython.pointer(cython.double),  # largest impulse, 0 for ropes and limits of angles; for motors their torque, N m
    slack=cython.pointer(cython.double),  # rad by which an angle may exceed `rest`
    strength=cython.pointer(cython.double),
    intact=cython.pointer(int32_t),
    impulse=cython.pointer(cython.double),  # J: accumulated along the gradient, N s; negative: it pulls
    load=cython.pointer(cython.double),  # J at the start of the substep
    impact=cython.pointer(cython.double),  # impulse by impacts in this substep, N s, not part of J
    saved=cython.pointer(cython.double),  # J, while impacts are distributed
    ahead=cython.pointer(cython.double),  # (rows, 3) J and `given` that have acted before it is solved
    pull=cython.pointer(cython.double),  # mean of -J as a force, N
    value=cython.pointer(cython.double),  # C at the start of the substep
    next=cython.pointer(cython.double),  # C expected after the drift
    soft=cython.pointer(cython.double),  # in C_next + soft J = target
    target=cython.pointer(cython.double),
    keeps=cython.pointer(cython.double),  # (rows,) share of `load` that stays when it is solved
    acts=cython.pointer(int32_t),  # for angles: 1 nearer to the end of their range, -1 to its start
    # ---- distances
    way=cython.pointer(cython.double),  # (rows, 2) from the first end to the second at the start of the substep, m
    end_way=cython.pointer(cython.double),  # (rows, 2) unit vector along the way after the drift
    chord_speed=cython.pointer(cython.double),  # m/s along it of a link that only turns in the drift
    given=cython.pointer(cython.double),  # (rows, 2) N s to the second end in this substep; of others `impulse` before the drift
    along=cython.pointer(cython.double),  # (rows, 2) direction of an impulse
    wanted=cython.pointer(cython.double),  # (rows, 2) m along it; N s that turn earlier impulses into it
    turning=cython.pointer(cython.double),  # (rows,) rad by which it would turn in this substep, extrapolated
    turned=cython.pointer(cython.double),  # (rows,) N s/m by which a taut link resists turning
    answer=cython.pointer(cython.double),  # (rows, 2) solution, N s
    inverse=cython.pointer(cython.double),  # (rows, 3) inverse of the block of the matrix, symmetric
    # ---- blocks: chains of distances, and single rows; chunks of blocks of a colour, which share no particle that can move
    block=cython.pointer(int64_t),  # (blocks + 1,) of its rows
    alone=cython.pointer(int32_t),  # (blocks,) whether no other block joins its movable particles
    chunk=cython.pointer(int64_t),  # (chunks + 1,) of its blocks
    colour=cython.pointer(int64_t),  # (colours + 1,) of its chunks
    colours=cython.int,
    passes=cython.int,
    substeps=cython.int,  # per frame
    now=cython.int,  # colour in work
    # ---- numbers of the substep
    h=cython.double,  # s
    left=cython.int,  # remaining substeps of the frame, this one included
    kick=cython.double,  # s of acceleration that impulses correspond to
    scale=cython.double,  # ratio to those of the last substep
    least=cython.double,  # m/s: smaller impulses may be repeated whole
    deepest=cython.double,  # m: surfaces push out deeper particles, and links ignore these surfaces
    spring_h=cython.double,  # s, as in `Step`, at least h
    pushed_out=cython.double,  # m, most that overlaps are separated by in a substep
    period_x=cython.double,  # m, 0: none
    period_y=cython.double,
)
