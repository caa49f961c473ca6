# mypy: ignore-errors
"""The struct that stages of links share: linked particles, pins, and rows in blocks. SI units, all in float64."""

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
    weight=cython.pointer(cython.double),  # (count,) the same as rows feel it: less if it is pinned
    warmed=cython.pointer(cython.double),  # (count, 2) m/s that links give before contacts are solved, undone afterwards
    driven=cython.pointer(cython.double),  # (count, 2) m/s^2 that forces give it alone
    react=cython.pointer(cython.double),  # (count, 2) N s that rows have given it since, whatever its mass
    surfaces=cython.bint,  # whether there are any
    contact=cython.pointer(cython.double),  # of `Step`
    rough=cython.bint,
    stiff=cython.pointer(int32_t),  # (count,) whether what links or pins it is rigid
    struck=cython.pointer(cython.double),  # (count,) s into the substep, of the impact that it is part of; 0: of none
    lively=cython.bint,  # whether what is stiff bounces, and nothing rests: it gives again whatever it gave
    warm=cython.bint,  # whether `u` is with `warmed`
    loose=cython.bint,  # whether all chains are alone
    drifted=cython.bint,  # whether particles have moved in this substep
    has_friction=cython.pointer(int32_t),  # (count,) whether friction acts on it where it is held
    rim=cython.pointer(cython.double),  # (count,) spin times radius, m/s
    spun=cython.pointer(cython.double),  # (count,) rad/s that motors have given it in this substep
    powered=cython.pointer(int32_t),  # (count,) how many motors turn it
    motors=cython.bint,  # whether there are any
    gives=cython.bint,  # whether links can raise the energy of motion: there are springs, or motors
    ease=cython.pointer(cython.double),  # (count,) as in `Step`
    begun=cython.pointer(cython.double),  # (count, 3) `u` and `rim` before its chain, or what else changes them, was solved
    had=cython.pointer(cython.double),  # (rows, 2) `given` then
    held=cython.pointer(int32_t),  # (count,) contact with the surface that holds it, -1: none
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
    gradient=cython.pointer(cython.double),  # (entries, 2) of C at the start of the substep; of distances: see `way`
    slope=cython.pointer(cython.double),  # (entries, 2) of C at the velocities of now
    kind=cython.pointer(int32_t),
    rest=cython.pointer(cython.double),
    stiffness=cython.pointer(cython.double),
    damping=cython.pointer(cython.double),
    upper=cython.pointer(cython.double),  # most impulse, 0 for ropes and limits of angles; of motors their largest torque, N m
    slack=cython.pointer(cython.double),  # rad that an angle may be more than `rest`
    strength=cython.pointer(cython.double),
    intact=cython.pointer(int32_t),
    impulse=cython.pointer(cython.double),  # J: accumulated along the gradient, N s; negative: it pulls
    load=cython.pointer(cython.double),  # J that the substep began with
    impact=cython.pointer(cython.double),  # what it gives of impacts in this substep, N s: no part of J
    saved=cython.pointer(cython.double),  # J, while impacts are shared
    ahead=cython.pointer(cython.double),  # (rows, 3) J and `given` of before it is solved: it has acted on what impacts struck
    pull=cython.pointer(cython.double),  # mean of -J as a force, N
    value=cython.pointer(cython.double),  # C at the start of the substep
    next=cython.pointer(cython.double),  # where the drift takes it
    soft=cython.pointer(cython.double),  # of C_next + soft J = target
    target=cython.pointer(cython.double),
    keeps=cython.pointer(cython.double),  # (rows,) share of `load` that is not
    acts=cython.pointer(int32_t),  # of angles: 1 nearer to the end of their range, -1 to its beginning
    # ---- distances
    way=cython.pointer(cython.double),  # (rows, 2) from the first end to the second at the start of the substep, m
    end_way=cython.pointer(cython.double),  # (rows, 2) unit vector along the way after the drift
    chord_speed=cython.pointer(cython.double),  # m/s along it of a way that has only turned in the drift, by its velocity of then
    given=cython.pointer(cython.double),  # (rows, 2) N s to the second end in this substep; of others, `impulse` before the drift
    along=cython.pointer(cython.double),  # (rows, 2) the direction that an impulse has
    wanted=cython.pointer(cython.double),  # (rows, 2) m along it; N s that turn what has been given into it
    turning=cython.pointer(cython.double),  # (rows,) by how much it would turn in this substep if it turned as in the last
    turned=cython.pointer(cython.double),  # (rows,) N s/m by which a taut link resists being turned
    answer=cython.pointer(cython.double),  # (rows, 2) N s
    inverse=cython.pointer(cython.double),  # (rows, 3) of the block of the matrix, symmetric
    # ---- blocks: chains of distances, and single rows; chunks of blocks of a colour, which share no particle that can move
    block=cython.pointer(int64_t),  # (blocks + 1,) of its rows
    alone=cython.pointer(int32_t),  # (blocks,) whether nothing else joins its particles that can move
    chunk=cython.pointer(int64_t),  # (chunks + 1,) of its blocks
    colour=cython.pointer(int64_t),  # (colours + 1,) of its chunks
    colours=cython.int,
    passes=cython.int,
    substeps=cython.int,  # of a frame
    now=cython.int,  # colour of the stage that runs
    # ---- numbers of the substep
    h=cython.double,  # s
    left=cython.int,  # substeps of the frame, this one included
    kick=cython.double,  # s of acceleration that impulses stand for
    scale=cython.double,  # by which they are worth more than in the last substep
    least=cython.double,  # m/s: impulses that change speeds by less may be given again whole
    deepest=cython.double,  # m: who is farther beyond a surface is put out by it, and links do not see it
    spring_h=cython.double,  # s, that of `Step`, at least h
    pushed_out=cython.double,  # m by which overlaps are pushed out in a substep, at most
    period_x=cython.double,  # m, 0: none
    period_y=cython.double,
)
