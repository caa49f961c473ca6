"""Named constants, each with its unit and the reason for its value."""

from typing import Final

STANDARD_GRAVITY: Final = (0.0, -9.81)
"""m/s^2, y up. Rounded as in the teaching literature (CODATA's 9.80665 is a convention too)."""

SKIN: Final = 0.4
"""Skin of the neighbour list to begin with, in mean diameters: the list stays valid until neighbours have moved against each
other by as much. It adapts; docs/design/pair-lists.md says what to."""

KNOWN_FROM: Final = 4096
"""Arrays of so many rows are not copied when a frame begins if digests say that they have not changed (`unchanged`), nor back
where nothing moves: fewer are copied as fast."""

ONE_THREAD_BELOW: Final = 2048
"""Worlds with fewer particles run on one thread altogether: at 2,000 a second one gained a tenth, and only on a quiet machine."""

ALL_THREADS_FROM: Final = 10_000
"""Unless the user says how many, worlds use all threads from this many particles on. Threads wait for each other several times a
substep; on a busy machine (a browser drawing the world, say) each wait may last a time slice. At 5,000 two threads gain 0.3 ms of
1.7 ms a frame when nothing else runs, and lost a hundredfold when three other processes did."""

MOST_SUBSTEPS: Final = 100_000
"""In a frame: one of many more would not end in any acceptable time, and nothing could stop it but the process's end. Who wants
finer steps takes a smaller dt."""

REST_ACCELERATIONS: Final = 4.0
"""An approach slower than this many |a| h is contact at rest, not an impact: 0.08 m/s under gravity at 480 substeps a second. One
substep of gravity is 1. Four times as much settled the scene `box` no better."""

STANDS_OUT: Final = 1e-3
"""Of its radius: who is added with more of it beyond a wall is put at the wall. To be lifted there by the first frame would give
energy that nothing has lost. Less is what coordinates are rounded by."""

SLEEP_SPEED: Final = 0.02
"""Of sqrt(g r): circles slower than this are at rest, 0.04 m/s at a radius of 0.5 m. Box2D has 0.05 m/s for all."""

SLEEP_AFTER_S: Final = 0.5
"""s an island must have been at rest before it falls asleep; the time Box2D takes too."""

SLEEP_NEAR: Final = 1.01
"""Circles nearer than this times their contact distance belong to one island."""

SURPLUS: Final = 8e-5
"""Part of the scale of a world's energy, that of a fall through its room, that contacts may add in a frame. Promised is 1e-4."""

FRAME_BUDGET_MS: Final = 5.0
"""Milliseconds of physics a frame may take, of the 16.7 ms at 60 Hz: the rest belongs to drawing and the user's own code."""

LEAST_DRAWN_RADIUS: Final = 0.35
"""Pixels: smaller circles are drawn as large, four tenths of a pixel, or a few of them on a large picture could not be seen."""

FIRST_OBSTACLE: Final = 16
"""Number of the first obstacle as a surface; walls of the room have lower ones."""

OBSTACLE_LINKS: Final = 65_536
"""Links the obstacles' grid has at most for a few large obstacles, 0.8 MB with its cells; each obstacle adds 64."""
