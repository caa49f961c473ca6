"""Named constants, each with its unit and the reason for its value."""

from __future__ import annotations

from typing import Final

STANDARD_GRAVITY: Final = (0.0, -9.81)
"""m/s^2, y up. Rounded as in the teaching literature (CODATA's 9.80665 is a convention too)."""

SKIN: Final = 0.4
"""Skin of the neighbour list to begin with, in mean diameters: the list stays valid until neighbours have moved against each
other by as much. It adapts; docs/design/pair-lists.md says what to."""

CELLS_PER_PARTICLE: Final = 4
"""The grid never has more cells than this many per particle; beyond it the cells grow. Memory stays linear in n."""

SKIN_LEAST: Final = 0.02
SKIN_MOST: Final = 2.0
"""Mean diameters between which the skin adapts: below, rounding would rebuild; above, cells would hold a crowd."""

SKIN_STEP: Final = 1.25
"""Factor by which the skin adapts at a rebuild."""

SKIN_HOLD: Final = 16
"""Rebuilds before a skin that was too large is tried again: second neighbours in a crystal come all at once."""

WORTH_LOOKING: Final = 0.3
"""With less than this part of half the skin left the list is rebuilt: looking again and again would cost as much."""

REBUILD_PAIRS: Final = 20.0
"""Candidate pairs that contacts solve in a substep in the time in which the list is built anew; all for each particle."""

REBUILD_CALL: Final = 60_000.0
"""Likewise, in all, in the time that it takes to build a list however few they are: without it worlds of 400 made a new one in
every other frame."""

WORTH_THINNING: Final = 0.3
"""Pairs for each particle that a step of the skin must spare for a list that is still good to be made anew: heaps at rest notice
the other order of their pairs, by 1e-6 m g R of 20,000, and would stir for ever for the sake of fewer."""

SAMPLE: Final = 64
"""Every so many pairs of a new list are looked at to tell how many the skin has brought."""

UNSORTED: Final = 0.2
"""Slots are put in order again when so many of them, as a part of all, are followed by one that belongs before."""

COLUMNS: Final = 3
"""Columns of a grid in the width of a row's height: narrow ones cut out neighbours more closely, and are more cells to count."""

LEVELS: Final = 12
"""Grids at most, each with cells half as large as the one before."""

SPARSE: Final = 1.0
"""A grid that would hold fewer circles than this part of the next coarser one is left out, and its circles stand in that."""

ROUNDING: Final = 1.001
"""Cells are larger than the longest distance of a listed pair by this factor, so that rounding cannot skip a row."""

BLOCK_ROWS: Final = 2
"""Rows and columns, of the largest cells, of the blocks in which displacements are compared."""

GRID_SPREAD: Final = 4.0
"""Standard deviations about the mean that the grid covers when a few outliers would stretch it; those share its rim cells."""

STRIPS: Final = 4096
"""Strips of grid rows a large world is cut into at most: thin ones stay in the cache while their colours are gone through.
Fixed, never derived from the number of threads, so that any number gives the same bits."""

STRIP_PARTICLES: Final = 256
"""A strip has at least this many particles: below it, starting a thread costs more than it saves."""

COLOURS: Final = 12
"""Colours of pairs in a strip. Up to ten listed neighbours of a circle have pairs of different colours with nearly any order of
choosing; only speed depends on it, never correctness."""

CLOSE: Final = 1.05
"""Of the contact distance: listed pairs nearer than this are solved last, apart from the others: hardly any of these touches
while the list lasts. Among falling circles these others are most, in a settled pile a tenth."""

KNOWN_FROM: Final = 32768
"""Arrays of so many rows are not copied when a frame begins if a digest says that nobody has changed them (`unchanged`): fewer
are copied as fast."""

FUSED_FROM: Final = 150_000
"""Circles from which on a substep is done strip by strip rather than stage by stage (`kernels.fused`): fewer fit into the caches
of a processor, and there it gains nothing."""

ONE_THREAD_BELOW: Final = 2048
"""Worlds with fewer particles run on one thread altogether: at 2,000 a second one gained a tenth, and only on a quiet machine."""

ALL_THREADS_FROM: Final = 10_000
"""Unless the user says how many, worlds use all threads from this many particles on. Threads wait for each other several times a
substep; on a busy machine (a browser drawing the world, say) each wait may last a time slice. At 5,000 two threads gain 0.3 ms of
1.7 ms a frame when nothing else runs, and lost a hundredfold when three other processes did."""

MOST_SUBSTEPS: Final = 100_000
"""In a frame: one of many more would not end while anybody waits, and nothing could stop it but the process's end. Who wants
finer steps takes a smaller dt."""

REST_ACCELERATIONS: Final = 4.0
"""An approach slower than this many |a| h is contact at rest, not an impact: 0.08 m/s under gravity at 480 substeps a second. One
substep of gravity is 1. Four times as much settled the scene `box` no better."""

STANDS_OUT: Final = 1e-3
"""Of its radius: who is added with more of it beyond a wall is put at the wall. To be lifted there by the first frame would give
energy that nothing has lost. Less is what coordinates are rounded by."""

SLEEP_SPEED: Final = 0.02
"""Of sqrt(g r): circles slower than this are calm, 0.04 m/s at a radius of 0.5 m. Box2D has 0.05 m/s for all."""

SLEEP_AFTER_S: Final = 0.5
"""s an island must have been calm before it falls asleep; the time Box2D takes too."""

SLEEP_NEAR: Final = 1.01
"""Circles nearer than this times their contact distance belong to one island."""

PUSHED: Final = 0.6
FED: Final = 1.6
"""Parts of an overlap that a substep takes from the positions, and feeds, divided by h, into the velocities. Less than all of
it keeps neighbours from undoing each other's push, more than all of it is stiffer: it holds the same weight with less overlap."""

CARRIED_WEIGHT: Final = 0.25
"""Of |a| h: a circle whose velocity a substep feeds by more than this carries weight. One that rests on others is fed 1 at least;
one that touches a neighbour by a rounding error, nothing to speak of."""

GRIP: Final = 0.8
"""Part of the slip of a contact that friction at rest feeds, divided by h, into the velocities: the tangential FED. Piles with
friction stood still from 0.8 on; at 0.5 single circles crept; at 1 a few in a box had a spin that turned nobody, at 1.6 many."""

UNEVEN: Final = 20.0
"""Ratio of masses from which on circles lend each other inertia: the overlap that a light circle needs
to carry a heavy one goes with it. Up to 20, piles do without; radii of 1:4 and equal density are 16."""

LENT: Final = 0.75
"""Part of its mass that a circle lends at most to those it rests against. At 0.5 small circles between large ones overlapped
twice as much; at 0.9 the frame of a crash gained twice as much energy."""

LOAN_S: Final = 0.1
"""s within which loans of inertia go back, and for which who has bounced has none. At 0.02 they come and go with contacts that
tremble; at 0.02 and at 0.2 unequal circles with e = 0.5 still trembled after 40 s."""

SUNK: Final = 1.6
"""Of |a| LOAN_S: who lends, or has just bounced and may not, meets others slower than this as at rest. So fast a heavy circle
falls into light ones while nobody lends; with restitution that made it bounce, and not lend, again: heaps of 1:100 with e = 0.3
boiled for ever."""

DEEP: Final = 0.025
DEEP_PART: Final = 0.25
DEEP_SWEEPS: Final = 8
"""Where chains of force meet, single contacts carry 20 times the mean. Of overlap beyond DEEP of the contact distance DEEP_PART
is treated again, so often: 10 contacts of 50,000. Half of it six times was as stiff, and piles moved more."""

DEEP_LENT: Final = 0.01
"""The same DEEP where circles lend each other inertia: light ones carry heavy ones there."""

LINK_GIVE: Final = 1e-7
"""What a rigid link gives way, as a part of what its particles do: a straight chain between two walls has no rigid solution."""

LINK_RESOLVED: Final = 0.2
"""(natural frequency * h)^2 of a spring that is treated half as motion to follow, half as stiffness to settle."""

LINK_BOWED: Final = 0.1
"""From this share of settling on, the tension of a link resists its being turned: below, substeps follow the swing."""

LINK_TAUT: Final = 0.01
"""Part of its length a rope may be short of taut and still be tried as taut, since others may stretch it in the same substep."""

LINK_MEMORY_S: Final = 1 / 120
"""s over which the pull of a link is averaged. In float32 a rigid link's own is noise: 1e-7 of a coordinate, times m / h^2."""

LINK_LEAST_N: Final = 1e-25
"""N: what pulls with less has stopped. The averages of links gone slack would for ever be numbers that processors are slow with,
too near 0 to have all their digits: 100 times as slow."""

LINK_TURN: Final = 0.25
"""rad: a chain whose solution turns a link by more is solved link by link instead; a straight step cannot be trusted so far."""

LINK_ROUNDS: Final = 8
"""Times the rows of a rope are asked anew who pulls. Three have been enough for chains of 100; what is left is clamped."""

LINK_SLIGHT: Final = 1e-5
"""Of its length a rope may have pushed, or been stretched, in a substep: the next pass lets it go, or takes it up. By so much
float32 rounds coordinates in a room of some 60 m, and for the sake of that large cloths were solved four times over."""

LINKS_ONE_THREAD_BELOW: Final = 4096
"""Worlds with fewer linked particles solve links on one thread: each colour is a meeting of the threads."""

LINK_COLOURS: Final = 64
"""Colours of links at most, bits of a number; the last one, for particles with more links than that, is solved on one thread."""

GROWTH: Final = 0.2
"""1/s: circles added on top of each other count as smaller at first, so that they just touch, and grow by this part of their
radius a second, at most. That bounds the speed they part with: pushed out in a frame they flew apart at hundreds of metres a
second."""

SURPLUS: Final = 8e-5
"""Part of the scale of a world's energy, that of a fall through its room, that contacts may add in a frame. Promised is 1e-4."""

SURPLUS_SOUGHT: Final = 2.0
PACE_FRAMES: Final = 10
"""Circles grow at such a pace that the energy would rise by so many times SURPLUS in a frame, averaged over PACE_FRAMES, if
nothing was taken back. With 1 growing takes a third longer; with 3 a pile stands still in half of the frames, since all its
motion is taken to pay for it, and without a pace in all of them."""

SMALLEST: Final = 1e-3
"""Part of its radius a circle starts with at least, however near another centre: coincident ones need something to part by."""

LARGEST_PUSH: Final = 0.3
"""Overlap seen by one substep, as a fraction of the contact distance. Settled piles stay far below it."""

GAS_STEP: Final = 0.1
"""Radii, root mean square, that circles of an elastic gas may move by in a substep without a word: at an area fraction of 0.6 it
then has 2 % less pressure, at twice that 10 % (`pyverlet check pressure` measures it)."""

GAS_FROM: Final = 100
"""Circles that make a gas: the pressure of fewer is a matter of each of them."""

GAS_LOOK_FRAMES: Final = 8
"""Frames after which that is looked at again: in each of them it took a fiftieth of the frame of 1,000 circles."""

FRAME_BUDGET_MS: Final = 5.0
"""Milliseconds of physics a frame may take, of the 16.7 ms at 60 Hz: the rest belongs to drawing and the user's own code."""

LEAST_DRAWN_RADIUS: Final = 0.35
"""Pixels: smaller circles are drawn as large, four tenths of a pixel, or a few of them on a large picture could not be seen."""

SURFACES: Final = 8
"""Surfaces noted of a circle in a frame at most."""

FIRST_OBSTACLE: Final = 16
"""Number of the first obstacle as a surface; walls of the room have lower ones."""

OBSTACLE_LINKS: Final = 65_536
"""Links the obstacles' grid has at most for a few large obstacles, 0.8 MB with its cells; each obstacle adds 64."""
