# mypy: ignore-errors
"""The struct that all stages of a frame share: arrays of particles and pairs, and the numbers of a substep. SI units."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint16_t, uint32_t
from cython.cimports.team import thread_team

from pyverlet.core.cells import Cells
from pyverlet.core.link_arrays import Links
from pyverlet.core.pair_lists import Lists

OPEN = cython.declare(cython.int, 0)
CAGE = cython.declare(cython.int, 1)
BOX = cython.declare(cython.int, 2)

NEAR = cython.declare(real, 0.05)
"""Of a radius, the smaller of a pair's: with larger gaps contacts carry no load."""

TOUCHED = cython.declare(real, 1e-30)
"""Least load of pairs that overlapped or carried load a substep ago, m/s."""

ELASTIC = cython.declare(real, 0.9)
"""With more restitution than this every bounce matters: of others several that follow closely may be taken for one, and contacts
that carry load for soft."""

FADING = cython.declare(real, 0.7)
"""What is left of the load of a contact after a substep without it."""

MOST_JOINT = cython.declare(cython.int, 16)
"""Impacts that are solved together."""

Step = cython.struct(
    # ---- particles, in cell order
    count=cython.Py_ssize_t,
    position=cython.pointer(real),  # (count, 2) m
    velocity=cython.pointer(real),  # (count, 2) m/s, of the middle of the substep
    spin=cython.pointer(real),  # (count,) rad/s, before and after the substeps of a call; `motion` has it meanwhile
    acceleration=cython.pointer(real),  # (count, 2) m/s^2 by gravity and forces
    inverse_mass=cython.pointer(real),  # (count,) 1/kg, 0: pinned
    radius=cython.pointer(real),  # (count,) m
    motion=cython.pointer(real),  # (count, 4) velocity, spin and a spare, side by side; with friction
    free=cython.pointer(real),  # (count, 2) velocity before any contact, m/s
    free_spin=cython.pointer(real),  # (count,)
    given=cython.pointer(real),  # (count, 2) what contacts gave in the last substep, m/s
    given_spin=cython.pointer(real),  # (count,)
    listed=cython.pointer(real),  # (count, 2) positions when the list of pairs was made
    moved=cython.pointer(real),  # (count, 2) since then, m
    checked=cython.pointer(real),  # (count, 2) positions when the list was last found to be good
    still=cython.pointer(uint8_t),  # (blocks,) whether nothing can move or push any of its particles, while `still_known`
    still_known=cython.bint,
    still_made=int64_t,  # how often that was found out
    awake=cython.pointer(int32_t),  # (blocks,) those that substeps go through
    awake_count=cython.int,
    collides=cython.bint,  # whether particles meet each other; else there are no pairs
    # ---- who sleeps, and who wakes: see `core.waking`
    watches=cython.bint,  # whether substeps end before an awake particle meets a sleeper
    island=cython.pointer[cython.const[int64_t]],  # (count,) -1 of those that are awake
    nearer=cython.double,  # m, by which accelerations may bring circles nearer in a substep
    speed=cython.p_double,  # (count,) m/s, of those that are awake, or what may hit them
    met_asleep=cython.pointer(uint8_t),  # (count,) 1 of sleepers that are met
    # ---- candidate pairs, in batches of eight that share no particle, by groups of cell rows
    groups=cython.Py_ssize_t,
    begin=cython.pointer(int64_t),  # (groups + 1,) of its lanes
    lanes=cython.pointer(int64_t),  # (groups,) how many there are
    swept=cython.pointer(int64_t),  # (groups,) how many of these are in the sweeps; the others are of pairs with a pinned circle
    busy=cython.pointer(int64_t),  # groups that have any: those of even numbers, of odd ones, and the last, of circles in no cell
    evens=cython.int,  # how many of these there are
    odds=cython.int,
    alone=cython.int,
    busy_from=cython.int,  # where in `busy` those stand that are gone through now: see `each_busy`
    pins=cython.bint,  # whether there are such: surfaces, each for the free one of its pair
    i=cython.pointer(uint32_t),
    j=cython.pointer(uint32_t),
    gap_x=cython.pointer(real),  # from i to j when the list was made, m
    gap_y=cython.pointer(real),
    normal_x=cython.pointer(real),
    normal_y=cython.pointer(real),
    depth=cython.pointer(real),  # overlap, m; negative: a gap
    load=cython.pointer(
        real
    ),  # impulse that the substep began with, m/s; 0 or negative: apart a substep ago, and what is left of it
    impulse=cython.pointer(real),  # accumulated, along the normal and the tangent, over the reduced mass, m/s
    tangent_impulse=cython.pointer(real),
    roll_impulse=cython.pointer(real),  # angular impulse on j against rolling, over the reduced mass, m^2/s
    tangents=cython.bint,  # whether there is `tangent_impulse`, and `roll_impulse`: since any contact had one for the first time
    rollings=cython.bint,
    hit=cython.pointer(
        int64_t
    ),  # pairs of a group that meet fast, in the scratch memory of a thread: see `Lists.scratch_capacity`
    hit_time=cython.pointer(cython.double),  # s into the substep
    summed_x=cython.pointer(real),  # what they gave in this frame, over the reduced mass, m/s; kept while `records_contacts`
    summed_y=cython.pointer(real),
    summed_virial=cython.pointer(real),  # and what of it was along the normal, times the distance, m^2/s
    crowded=cython.pointer(int32_t),  # (groups,) whether a pair of the group overlaps much
    bounced=cython.pointer(int32_t),  # (groups,) stage of this substep in which a pair of the group bounced last, 0: none
    searched=cython.pointer(int32_t),  # (groups,) stage in which it was last searched for pairs that do
    records_events=cython.bint,  # whether it is asked for who touches and bounces
    collected=cython.bint,  # whether all that has been heard, or noted, of the lists of now has been taken
    waiting=cython.bint,  # for that, before lists are made anew
    touched=cython.pointer(int32_t),  # whether they did, while `records_events`
    bounces=cython.pointer(int32_t),
    met=cython.pointer(real),  # largest speed at which they met, m/s
    pressed=cython.pointer(real),  # what they gave along the normal, over the reduced mass, m/s
    turn=cython.int,  # over the groups, for pairs that bounces in others have thrown at each other
    # ---- what pairs are made of; one for all, or one a lane
    reach=cython.pointer(real),  # r_i + r_j, m
    share=cython.pointer(real),  # of i in the inverse mass of the pair
    restitution=cython.pointer(real),
    friction=cython.pointer(real),
    rolling=cython.pointer(real),  # coefficient of rolling resistance times r_i r_j / (r_i + r_j), m
    radius_i=cython.pointer(real),
    radius_j=cython.pointer(real),
    grip=cython.pointer(real),  # 1 over the inverse mass of the point of contact along the tangent: 1/3 of two discs
    turn_i=cython.pointer(real),  # 2 / r of discs, 0 of a fixed rotation: how much an impulse along the tangent turns it
    turn_j=cython.pointer(real),
    sized=cython.Py_ssize_t,  # 1: one a lane, 0: one for all
    varied=cython.Py_ssize_t,
    mixed=cython.Py_ssize_t,
    rough=cython.bint,  # whether any contact has friction or resists rolling
    rolls=cython.bint,  # whether any resists rolling
    # ---- the room
    boundary=cython.int,
    x0=cython.double,  # of a box, and centre of a cage, m
    y0=cython.double,
    x1=cython.double,  # the other corner of a box; radius of a cage
    y1=cython.double,
    wall_restitution=cython.double,
    wall_friction=cython.double,
    wall_rolling=cython.double,
    wall_speed=cython.double,  # of the surface, counter-clockwise around a cage, m/s
    records_contacts=cython.bint,  # whether what contacts give is asked for: see `core.contact_recording`
    recorded_frame=int64_t,  # how many frames have been noted
    by_surface=cython.pointer(cython.double),  # (contact_capacity, GIVEN) by contacts with surfaces in this frame, m/s
    wall_given=cython.pointer(real),  # (count, 2) by walls in this frame to what links pull out, m/s
    records_work=cython.bint,  # whether it is asked for what contacts change of the energy: see `core.work`
    gained=cython.pointer(cython.double),  # (blocks,) J by contacts in this frame, but for moving particles; while `records_work`
    work=cython.pointer(cython.double),  # (count, WORK) J
    rest_scale=real,  # what an impulse of a contact at rest is worth there: h over the seconds of acceleration that it bears
    own_restitution=cython.pointer[cython.const[real]],  # of particle i at mixed * i; negative: the wall's
    own_friction=cython.pointer[cython.const[real]],
    own_rolling=cython.pointer[cython.const[real]],
    ease=cython.pointer[cython.const[real]],  # m r^2 over the moment of inertia: 2 of discs, 0 of those whose rotation is fixed
    own_material=cython.pointer[cython.const[uint32_t]],  # while there are `materials`
    materials=cython.Py_ssize_t,  # how many there are; 0: none has any
    together=cython.pointer(cython.double),  # (materials, materials, 3) e, mu and c of two; negative: as each has its own
    combine=cython.int,  # how two values become one: see `combined`
    wall_material=cython.Py_ssize_t,
    # ---- obstacles, and the list of surfaces that particles may touch: walls and segments; see `core.surface_lists`
    surfaces_good=cython.bint,  # whether the list is about the particles, the room and the obstacles of now
    wall_category=uint32_t,  # of the room
    wall_mask=uint32_t,
    one_way=cython.bint,  # whether an obstacle is
    solids=cython.Py_ssize_t,  # segments of obstacles that are no sensors
    sensors=cython.Py_ssize_t,  # how many there are, while `records_events`; see `core.sensors`
    sensed=cython.pointer(uint32_t),  # (count, words) a bit for each sensor that a particle has touched in this frame
    inside=cython.pointer(uint32_t),  # and that it touches at the end of it
    surfaces_kept=cython.bint,  # whether what it remembers has been put where the next one looks for it
    side=cython.int,  # which of two lists is that of now; the other is the one before
    since=cython.pointer(cython.double),  # (count,) s into the substep, of the last impact, or 0
    thrown=cython.pointer(uint16_t),  # (count,) how often impacts of pairs have struck it in this substep
    begun=cython.pointer(real),  # (count, 2) where it was when the substep began, of those that were struck since; see `Cells`
    at_surface=cython.pointer(int32_t),  # (count,) particles that may touch one, from the first of each block on
    at_surface_count=cython.pointer(int32_t),  # (blocks,)
    contact_count=cython.pointer(int64_t),  # (blocks,) how many places of the list a block takes
    contact_capacity=cython.Py_ssize_t,  # places there are
    contact_begin=cython.pointer(int32_t),  # (count,) of each particle its first place, and the one after its last
    contact_end=cython.pointer(int32_t),
    surface=cython.pointer(int32_t),  # (contact_capacity,) which: a side of the room, or SIDES + segment
    contact=cython.pointer(cython.double),  # (contact_capacity, CONTACT) see `core.surface_shapes`
    clear=cython.pointer(
        cython.double
    ),  # (contact_capacity, 3) at the first: where it was, how far what does not carry it then; 0: unknown
    old_surface=cython.pointer(int32_t),  # of the list before
    old_contact=cython.pointer(cython.double),
    segments=cython.Py_ssize_t,
    segment=cython.pointer(cython.double),  # (segments, SEGMENT) see `core.obstacles`
    body=cython.pointer(cython.double),  # (bodies, 6) pivot, m, angle, rad, and velocities when the frame began
    moving=cython.pointer(int32_t),  # segments that move
    moving_count=cython.Py_ssize_t,
    cell=cython.double,  # of the grid of segments, m
    cell_heads=cython.Py_ssize_t,  # a power of two
    head=cython.pointer(int32_t),  # of each cell its first link, or -1
    link=cython.pointer(int32_t),  # (links, 2) segment, and the next link
    links=cython.Py_ssize_t,  # in use
    links_capacity=cython.Py_ssize_t,
    margin=real,  # m, how much farther than it touches a particle sees surfaces when the list is made
    # ---- impacts of linked particles, see `core.rebounds` and `core.shared_impacts`; while `linked`
    stamp=cython.double,  # number of those impacts that are noted now
    node=cython.pointer(int32_t),  # (count,) which linked particle it is, if that is in this place; else anything
    impact=cython.pointer(cython.double),  # (count, IMPACT) of linked particles
    surface_rebound=cython.pointer(cython.double),  # (contact_capacity, REBOUND) of contacts with surfaces
    pair_rebound=cython.pointer(cython.double),  # (lanes, REBOUND)
    rebound_pair=cython.pointer(int64_t),  # lanes of a group that have bounced, from its begin on
    rebounding=cython.pointer(int32_t),  # (groups,) how many have
    rebounded=cython.pointer(int32_t),  # (groups,) whether pairs of a group, or surfaces struck with them, have
    rebound_sum=cython.pointer(cython.double),  # (groups + blocks, 2) of rows of a part
    rebound_task=cython.int,
    rebound_step=cython.double,  # how much of what was tried is right
    rebound_turn=cython.double,  # how much of that goes into what is tried next; negative: nothing is
    rebounds=cython.pointer(int32_t),  # (blocks,) whether particles of a block have bounced from surfaces
    # ---- what a frame begins and ends with
    falls_free=cython.bint,  # gravity is all there is beside contacts: a call is a frame
    gravity_x=real,  # m/s^2
    gravity_y=real,
    half=real,  # s from the middle of a substep to its end
    by_contacts=real,  # 1/s: times what contacts gave in the last substep that is an acceleration
    # ---- numbers of a substep
    h=real,  # s
    opening=real,  # s of acceleration that come first in the first substep of a call, instead of h
    already_given=real,  # share of `given` that the velocity at the start of a frame already holds, else 0
    scale=real,  # by which impulses are worth more in the first substep of a call than in the last one
    turned=cython.bint,  # whether `moved` is that after the drift
    turning=real,  # m/s: pairs that move against each other faster turn their normals in the drift
    sweep=cython.int,  # number of this sweep without springs, in this substep
    rest_speed=real,  # contacts that meet more slowly rest, m/s; where forces act, of a mean particle
    least_bounce=real,  # what speeds are rounded by: slower ones do not bounce; without forces `rest_speed`, if that is more
    resting=real,  # s: times `strength` it is the speed below which contacts of a particle rest
    strength=cython.pointer(real),  # (count,) m/s^2, what gravity and forces but drag give to each; unless falls_free
    restless=cython.bint,  # nothing accelerates: nothing rests
    spring_h=real,  # s, length of the substeps that springs of contacts are made for
    rate=real,  # of the springs, 1/s
    stiff=real,  # share of a violation that a sweep corrects
    leak=real,  # share of the accumulated impulse that it lets go
    push=real,  # fastest pushing out, m/s
    near=real,  # m: gaps beyond it, and beyond `NEAR` radii, are no contacts
    far=real,  # pairs with larger gaps cannot meet in this substep, m
    allowed=real,  # square of how far particles may move before the list needs a look, m^2
    fastest=cython.pointer(real),  # (blocks,) square of the largest speed
    stale=cython.pointer(int32_t),  # (blocks,) whether one has moved too far
    energy=cython.p_double,  # (blocks,) J of motion
    first=cython.int,  # substep of this call
    substep=cython.int,
    substeps=cython.int,
    relaxes=cython.int,
    team=cython.pointer(thread_team),
    parity=cython.Py_ssize_t,  # of the groups that are gone through now: see `each_group`
    cells=cython.pointer(Cells),
    lists=cython.pointer(Lists),
    link_table=cython.pointer(Links),
    linked=cython.bint,  # whether there are any
)
