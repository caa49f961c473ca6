"""Named constants, each with its unit and the reason for its value."""

from typing import Final

STANDARD_GRAVITY: Final = (0.0, -9.81)
"""m/s^2, y up. Rounded as in the teaching literature (CODATA's 9.80665 is a convention too)."""

SKIN: Final = 0.4
"""Initial skin of the neighbour list, in mean diameters: the list is valid until neighbours have moved relative to each other by
as much. It adapts as docs/design/pair-lists.md describes."""

KNOWN_FROM: Final = 4096
"""From so many rows on, arrays whose checksums are unchanged (`unchanged`) are not copied at the start of a frame, nor back where
nothing moves; smaller ones are copied as fast."""

ONE_THREAD_BELOW: Final = 2048
"""Worlds with fewer particles use one thread: at 2,000 a second one gained a tenth, and only on an idle machine."""

ALL_THREADS_FROM: Final = 10_000
"""Default number of particles from which on worlds use all threads. Threads synchronise several times per substep; on a busy
machine (with a browser drawing the world, for example) each may wait for a time slice. At 5,000 two threads gained 0.3 ms of 1.7
ms per frame on an idle machine, and were a hundred times slower beside three other processes."""

MOST_SUBSTEPS: Final = 100_000
"""Most substeps in a frame: more would not end in acceptable time, and cannot be interrupted. Use a smaller dt instead."""

REST_ACCELERATIONS: Final = 4.0
"""Approach speeds below this many |a| h are resting contact, not impact: 0.08 m/s under gravity at 480 substeps per second. One
substep of gravity is 1. Four times as much did not settle the scene `box` better."""

STANDS_OUT: Final = 1e-3
"""Fraction of the radius: new circles that stick out of the room by more are moved to the wall. If the first frame lifted them,
they would gain energy. Less is rounding of coordinates."""

SLEEP_SPEED: Final = 0.02
"""Over sqrt(g r): slower circles are at rest; 0.04 m/s at a radius of 0.5 m. Box2D has 0.05 m/s for all."""

SLEEP_AFTER_S: Final = 0.5
"""s at rest before an island falls asleep, as in Box2D."""

SLEEP_NEAR: Final = 1.01
"""Circles closer than this times their contact distance belong to one island."""

SURPLUS: Final = 8e-5
"""Fraction of a world's energy scale, that of a fall through its room, that contacts may add per frame. The guarantee is 1e-4."""

FRAME_BUDGET_MS: Final = 5.0
"""Milliseconds of physics per frame of 16.7 ms at 60 Hz: the rest is for drawing and the user's code."""

LEAST_DRAWN_RADIUS: Final = 0.35
"""Pixels: smaller circles are drawn with this radius, or they could not be seen on a large picture."""

FIRST_OBSTACLE: Final = 16
"""Number of the first obstacle as a surface; walls of the room have lower ones."""

OBSTACLE_LINKS: Final = 65_536
"""Most links in the obstacles' grid for a few large obstacles, 0.8 MB with its cells; each obstacle adds 64."""
