"""What events are told under the contact law in Python."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground.constants import FIRST_OBSTACLE, SURFACES
from pyverlet.kernels import events as kernels
from pyverlet.laws.contacts.wide import Wide
from pyverlet.laws.events import Events, Told, key_of_surface
from pyverlet.state.slots import Slots


def collect(events: Events, state: Slots, pairs: Wide) -> None:
    """The list of pairs is about to change, or the frame ends: keep what was told."""
    room = len(pairs.closing)
    told = Told(np.empty(room, np.int64), np.empty(room), np.empty(room, np.int64))
    found = kernels.heard(*pairs.listed(), pairs.closing, pairs.bounced, pairs.touched, state.particle, *told)
    events.hear([Told(*(column[:found] for column in told))])


def close(world: Any) -> None:
    """The frame ends: tell what was noted of pairs, walls and obstacles."""
    slots, contacts, events = world._slots, world._contacts, world._events
    if contacts and len(world) > 1 and (pairs := contacts.packed(slots)):
        collect(events, slots, pairs)
    at = np.flatnonzero(slots.hits >= 0)
    rows, hits = slots.impacts[at].astype(float), slots.hits[at].astype(float)
    noted = rows[:, 1:].reshape(len(at), SURFACES, 3)
    is_noted = np.arange(SURFACES) < rows[:, :1]
    who, which = np.nonzero(is_noted)
    surface, bounces, speeds = noted[who, which].T
    number = surface.astype(np.int64)
    obstacle = number >= FIRST_OBSTACLE  # with images in a periodic room
    number[obstacle] = (number[obstacle] - FIRST_OBSTACLE) % max(len(world._course.seen()), 1)
    keys = key_of_surface(slots.particle[at[who]].astype(np.int64), number, obstacle)
    events.hear([Told(keys, speeds, bounces.astype(np.int64))])
    # A room of the user's own notes in `hits` alone.
    slots.hits[at[hits <= np.where(is_noted, noted[:, :, 2], -1.0).max(axis=1, initial=-1.0)]] = -1
