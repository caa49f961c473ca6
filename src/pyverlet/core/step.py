# mypy: ignore-errors
"""The `Step` struct, shared by all stages of a frame: arrays of particles and pairs, and parameters. SI units."""

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
"""Largest gap at which contacts carry load, over the smaller radius of a pair."""

TOUCHED = cython.declare(real, 1e-30)
"""Least load of pairs that overlapped or carried load a substep ago, m/s."""

ELASTIC = cython.declare(real, 0.9)
"""Above this restitution every bounce is resolved; below, several bounces in quick succession may count as one, and loaded
contacts stay soft."""

FADING = cython.declare(real, 0.7)
"""Factor of a contact's load per substep without load."""

MOST_JOINT = cython.declare(cython.int, 16)
"""Most impacts that are solved together."""

Step = cython.struct(
    # ---- particles, in cell order
    count=cython.Py_ssize_t,
    position=cython.pointer(real),  # (count, 2) m
    velocity=cython.pointer(real),  # (count, 2) m/s, of the middle of the substep
    spin=cython.pointer(real),  # (count,) rad/s, before and after a call's substeps; in between it is in `motion`
    acceleration=cython.pointer(real),  # (count, 2) m/s^2 by gravity and forces
    inverse_mass=cython.pointer(real),  # (count,) 1/kg, 0: pinned
    radius=cython.pointer(real),  # (count,) m
    motion=cython.pointer(real),  # (count, 4) velocity, spin and padding; with friction
    free=cython.pointer(real),  # (count, 2) velocity before any contact, m/s
    free_spin=cython.pointer(real),  # (count,)
    given=cython.pointer(real),  # (count, 2) sum of contact impulses of the last substep, m/s
    given_spin=cython.pointer(real),  # (count,)
    listed=cython.pointer(real),  # (count, 2) positions for which the pair list was made
    moved=cython.pointer(real),  # (count, 2) displacement since, m
    checked=cython.pointer(real),  # (count, 2) positions at the last check of the list
    still=cython.pointer(uint8_t),  # (blocks,) whether nothing moves any of its particles, while `still_known`
    still_known=cython.bint,
    still_made=int64_t,  # how often that was determined
    awake=cython.pointer(int32_t),  # (blocks,) blocks that substeps visit
    awake_count=cython.int,
    collides=cython.bint,  # whether there are pairs
    # ---- who sleeps, and who wakes: see `core.waking`
    watches=cython.bint,  # whether calls end before an awake particle touches a sleeper
    island=cython.pointer[cython.const[int64_t]],  # (count,) -1 if awake
    nearer=cython.double,  # m, by which accelerations may bring circles closer in a substep
    speed=cython.p_double,  # (count,) m/s, own or that of a particle that may hit it
    met_asleep=cython.pointer(uint8_t),  # (count,) 1 for sleepers that are touched
    # ---- candidate pairs, in batches of eight that share no particle, by groups of cell rows
    groups=cython.Py_ssize_t,
    begin=cython.pointer(int64_t),  # (groups + 1,) first lane of each
    lanes=cython.pointer(int64_t),  # (groups,) how many there are
    swept=cython.pointer(int64_t),  # (groups,) lanes in sweeps; the others are pairs with a pinned circle
    busy=cython.pointer(int64_t),  # groups with lanes: even ones, odd ones, and the last, of circles without a cell
    evens=cython.int,  # number of even ones
    odds=cython.int,
    alone=cython.int,
    busy_from=cython.int,  # first of the groups in `busy` in work: see `each_busy`
    pins=cython.bint,  # whether there are pairs with a pinned circle, which are surface contacts
    i=cython.pointer(uint32_t),
    j=cython.pointer(uint32_t),
    gap_x=cython.pointer(real),  # from i to j when the list was made, m
    gap_y=cython.pointer(real),
    normal_x=cython.pointer(real),
    normal_y=cython.pointer(real),
    depth=cython.pointer(real),  # overlap, m; negative: a gap
    load=cython.pointer(
        real
    ),  # impulse at the start of the substep, m/s; 0 or negative: apart a substep ago, and its decayed value
    impulse=cython.pointer(real),  # accumulated, normal and tangential, over the reduced mass, m/s
    tangent_impulse=cython.pointer(real),
    roll_impulse=cython.pointer(real),  # angular, on j, against rolling, over the reduced mass, m^2/s
    tangents=cython.bint,  # whether `tangent_impulse` and `roll_impulse` exist: since any contact first had one
    rollings=cython.bint,
    hit=cython.pointer(int64_t),  # pairs of a group with impacts, in scratch memory: see `Lists.scratch_capacity`
    hit_time=cython.pointer(cython.double),  # s into the substep
    summed_x=cython.pointer(real),  # impulses in this frame, over the reduced mass, m/s; while `records_contacts`
    summed_y=cython.pointer(real),
    summed_virial=cython.pointer(real),  # normal impulse times distance, m^2/s
    crowded=cython.pointer(int32_t),  # (groups,) whether a pair of the group overlaps much
    bounced=cython.pointer(int32_t),  # (groups,) stage of this substep with the last impact in the group; 0: none
    searched=cython.pointer(int32_t),  # (groups,) stage of its last search for impacts
    records_events=cython.bint,  # whether events are recorded
    collected=cython.bint,  # whether the records of the current lists have been saved
    waiting=cython.bint,  # for that, before lists are made anew
    touched=cython.pointer(int32_t),  # whether the pair touched, while `records_events`
    bounces=cython.pointer(int32_t),
    met=cython.pointer(real),  # largest approach speed, m/s
    pressed=cython.pointer(real),  # normal impulse, over the reduced mass, m/s
    turn=cython.int,  # over the groups, for impacts caused by others
    # ---- what pairs are made of; one for all, or one a lane
    reach=cython.pointer(real),  # r_i + r_j, m
    per_reach=cython.pointer(real),  # 1 over it
    share=cython.pointer(real),  # of i in the inverse mass of the pair
    restitution=cython.pointer(real),
    friction=cython.pointer(real),
    rolling=cython.pointer(real),  # coefficient of rolling resistance times r_i r_j / (r_i + r_j), m
    radius_i=cython.pointer(real),
    radius_j=cython.pointer(real),
    grip=cython.pointer(real),  # inverse of the contact point's tangential inverse mass: 1/3 for two discs
    turn_i=cython.pointer(real),  # 2 / r for discs, 0 for fixed rotation: spin by a tangential impulse
    turn_j=cython.pointer(real),
    sized=cython.Py_ssize_t,  # 1: one per lane, 0: one for all
    varied=cython.Py_ssize_t,
    mixed=cython.Py_ssize_t,
    rough=cython.bint,  # whether any contact has friction or rolling resistance
    rolls=cython.bint,  # whether any has rolling resistance
    # ---- the room
    boundary=cython.int,
    x0=cython.double,  # of a box, and centre of a cage, m
    y0=cython.double,
    x1=cython.double,  # the other corner of a box; radius of a cage
    y1=cython.double,
    wall_restitution=cython.double,
    wall_friction=cython.double,
    wall_rolling=cython.double,
    wall_speed=cython.double,  # of the cage's surface, counter-clockwise, m/s
    records_contacts=cython.bint,  # whether contact impulses are recorded: see `core.contact_recording`
    recorded_frame=int64_t,  # number of recorded frames
    by_surface=cython.pointer(cython.double),  # (contact_capacity, GIVEN) impulses of surface contacts in this frame, m/s
    wall_given=cython.pointer(real),  # (count, 2) impulses of walls in this frame on what links pull out, m/s
    records_work=cython.bint,  # whether energy changes by contacts are booked: see `core.work`
    gained=cython.pointer(
        cython.double
    ),  # (blocks,) J by contacts in this frame, without moves of particles; while `records_work`
    work=cython.pointer(cython.double),  # (count, WORK) J
    rest_scale=real,  # weight of a resting contact's impulse there: h over its seconds of acceleration
    own_restitution=cython.pointer[cython.const[real]],  # of particle i at mixed * i; negative: the default
    own_friction=cython.pointer[cython.const[real]],
    own_rolling=cython.pointer[cython.const[real]],
    ease=cython.pointer[cython.const[real]],  # m r^2 over the moment of inertia: 2 for discs, 0 for fixed rotation
    own_material=cython.pointer[cython.const[uint32_t]],  # while there are `materials`
    materials=cython.Py_ssize_t,  # their number; 0: none
    together=cython.pointer(cython.double),  # (materials, materials, 3) e, mu and c of two; negative: from their own values
    combine=cython.int,  # rule for combining two values: see `combined`
    wall_material=cython.Py_ssize_t,
    # ---- obstacles, and the list of surfaces that particles may touch: walls and segments; see `core.surface_lists`
    surfaces_good=cython.bint,  # whether the list matches the current particles, room and obstacles
    wall_category=uint32_t,  # of the room
    wall_mask=uint32_t,
    one_way=cython.bint,  # whether any obstacle is one-way
    solids=cython.Py_ssize_t,  # segments of obstacles that are not sensors
    sensors=cython.Py_ssize_t,  # their number, while `records_events`; see `core.sensors`
    sensed=cython.pointer(uint32_t),  # (count, words) a bit for each sensor that a particle touched in this frame
    inside=cython.pointer(uint32_t),  # a bit for each sensor that it touches at the end of the frame
    surfaces_kept=cython.bint,  # whether its contact state has been made available to the next list
    side=cython.int,  # which of the two lists is current; the other is the previous one
    since=cython.pointer(cython.double),  # (count,) time of the last impact, s into the substep, or 0
    thrown=cython.pointer(uint16_t),  # (count,) number of pair impacts on it in this substep
    begun=cython.pointer(real),  # (count, 2) position at the start of the substep, if struck since; see `Cells`
    at_surface=cython.pointer(int32_t),  # (count,) particles that may touch a surface, block by block
    at_surface_count=cython.pointer(int32_t),  # (blocks,)
    contact_count=cython.pointer(int64_t),  # (blocks,) places of the list that a block takes
    contact_capacity=cython.Py_ssize_t,  # number of places
    contact_begin=cython.pointer(int32_t),  # (count,) first place of each particle, and the one after its last
    contact_end=cython.pointer(int32_t),
    contact_particle=cython.pointer(uint32_t),  # (contact_capacity,) whose contact it is
    surface=cython.pointer(int32_t),  # (room,) a side of the room, or SIDES + segment
    contact=cython.pointer(cython.double),  # (contact_capacity, CONTACT) see `core.surface_rows`
    clear=cython.pointer(
        cython.double
    ),  # (contact_capacity, 3) position, and distance of unloaded surfaces then, 0: unknown; by eights, too
    old_surface=cython.pointer(int32_t),  # of the previous list
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
    margin=real,  # m, extra distance at which surfaces are listed
    # ---- impacts of linked particles, see `core.rebounds` and `core.shared_impacts`; while `linked`
    stamp=cython.double,  # number of the current records of impacts
    node=cython.pointer(int32_t),  # (count,) number among linked particles, valid if that one is in this row
    impact=cython.pointer(cython.double),  # (count, IMPACT) of linked particles
    surface_rebound=cython.pointer(cython.double),  # (contact_capacity, REBOUND) of contacts with surfaces
    pair_rebound=cython.pointer(cython.double),  # (lanes, REBOUND)
    rebound_pair=cython.pointer(int64_t),  # lanes of a group with impacts, from its begin on
    rebounding=cython.pointer(int32_t),  # (groups,) their number
    rebounded=cython.pointer(int32_t),  # (groups,) whether pairs of a group, or surfaces hit by them, had impacts
    rebound_sum=cython.pointer(cython.double),  # (groups + blocks, 2) sums over rows
    rebound_task=cython.int,
    rebound_step=cython.double,  # correction factor of the last trial
    rebound_turn=cython.double,  # fraction of it in the next trial; negative: no next trial
    rebounds=cython.pointer(int32_t),  # (blocks,) whether particles of a block had impacts on surfaces
    # ---- what a frame begins and ends with
    falls_free=cython.bint,  # only gravity acts besides contacts: a call is a frame
    gravity_x=real,  # m/s^2
    gravity_y=real,
    half=real,  # s from the middle of a substep to its end
    by_contacts=real,  # 1/s: converts the last contact impulses to accelerations
    # ---- numbers of a substep
    h=real,  # s
    opening=real,  # s of acceleration in the first substep of a call, instead of h
    already_given=real,  # fraction of `given` already contained in velocities at the start of a frame, else 0
    scale=real,  # factor of warm-start impulses in the first substep of a call
    turned=cython.bint,  # whether `moved` includes the drift
    turning=real,  # m/s: pairs with a faster relative motion turn their normals in the drift
    sweep=cython.int,  # number of the current relaxation sweep in this substep
    rest_speed=real,  # approach speed below which contacts rest, m/s; with forces, of a mean particle
    least_bounce=real,  # rounding of speeds, below which there are no bounces; without forces at least `rest_speed`
    resting=real,  # s: times `strength` it is the speed below which contacts of a particle rest
    strength=cython.pointer(real),  # (count,) m/s^2, by gravity and forces without drag; unless falls_free
    restless=cython.bint,  # nothing accelerates, so nothing rests
    spring_h=real,  # s, length of the substeps for which contact springs are made
    rate=real,  # of the springs, 1/s
    stiff=real,  # fraction of a violation corrected by a sweep
    leak=real,  # fraction of the accumulated impulse released
    push=real,  # fastest separation, m/s
    near=real,  # m: with gaps beyond it, and beyond `NEAR` radii, there is no contact
    far=real,  # pairs with larger gaps cannot touch in this substep, m
    allowed=real,  # square of the displacement after which the list is checked, m^2
    fastest=cython.pointer(real),  # (blocks,) square of the largest speed
    stale=cython.pointer(int32_t),  # (blocks,) whether a particle has moved too far
    energy=cython.p_double,  # (blocks,) J, kinetic
    first=cython.int,  # first substep of this call
    substep=cython.int,
    substeps=cython.int,
    relaxes=cython.int,
    team=cython.pointer(thread_team),
    parity=cython.Py_ssize_t,  # of the groups in work: see `each_group`
    cells=cython.pointer(Cells),
    lists=cython.pointer(Lists),
    link_table=cython.pointer(Links),
    linked=cython.bint,  # whether there are links
)
