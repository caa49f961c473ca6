"""The arrays that the compiled core holds of one world, and the state of its contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet import core
from pyverlet.common import memory
from pyverlet.common.arrays import Array
from pyverlet.common.constants import SKIN
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.state.sorted_state import SortedState
from pyverlet.world.contact_memory import STEP, Memory, columns_of
from pyverlet.world.materials import ease_of, materials_of, mixed, names_of, numbers_of, resist, skin_of, walls_of
from pyverlet.world.obstacle_rows import ObstacleRows
from pyverlet.world.sleepers import Remembered

SORTED_FROM = 1024
UNSORTED = 0.2
"""From SORTED_FROM rows on, rows are sorted by cells if this fraction of them is followed by one that belongs before it."""


_NONE = np.empty(0, np.uint8)


class CoreArrays:
    """The engine of one world and the arrays that it works on: rows, and contact state that persists between frames.

    Attributes:
        engine: steps particles; see `core.engine_object`.
        kick, h: seconds of acceleration of the last substep, and its length; 0 before the first. h is also 0 when the supports of
            particles may have been removed: their motion then starts from their velocities alone. steps: of the last frame.
        hertz, finer: spring frequency of contacts, and for how long, s, a higher one would have been possible.
        parting: J that particles which the user has placed inside each other may still gain, see `laws.limiter`.
        typical, strongest: m/s^2, of `ForceSum`, after the last frame; used for decisions before forces are evaluated.
        gave, gave_spin: (n, 2) m/s and (n,) rad/s that contacts gave in the last substep.
        parts: number of threads of a frame.
        free: whether any particle is not pinned.
        largest, mean_radius: m. unequal: whether masses differ, pinned particles aside.
        asleep: state of sleeping contacts, as rates.
        obstacles: as the engine sees them.
        rough, rolls: whether contacts have friction or rolling resistance, or a motor runs; whether they have rolling resistance.
    """

    kick: float
    h: float
    hertz: float
    finer: float
    steps: float
    parting: float
    typical: float
    strongest: float

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.engine: Any = core.unit("engine", dtype).Engine(1)
        self.parts = 1
        self._room: Any = None
        self.obstacles = ObstacleRows()
        self.forget()

    def forget(self) -> None:
        """Discard all contact state."""
        self.restore(Memory.empty(self._dtype))

    def save(self, obstacles: ObstacleArrays | None = None) -> Memory:
        """The state that `restore` needs to continue with the same bits; obstacles: those that number the surfaces."""
        particle, count = self._particle, int(self._particle.max(initial=-1)) + 1
        given = np.zeros((count, 3), self._dtype)
        given[particle, :2], given[particle, 2] = self.gave, self.gave_spin
        pairs, values = (array.copy() for array in self._impulses())
        surfaces, pushes = (array.copy() for array in self._at_surfaces())
        asleep = self.asleep
        if obstacles is not None:
            self._note_let_go(self.obstacles.others(obstacles))
        if obstacles is not None and (now := self.obstacles.renamed(obstacles)) is not None:
            surfaces[:, 1] = now[surfaces[:, 1]]
            surfaces, pushes = surfaces[surfaces[:, 1] >= 0], pushes[surfaces[:, 1] >= 0]
            asleep = asleep.at_surfaces(now)
        kept = self._kept_list or (self.engine.save_list() if self.kick else None)
        *rows, skin = kept or (particle[:0], particle[:0], ())
        listed, checked = (np.zeros((count if len(each) else 0, 2), self._dtype) for each in rows)
        if len(listed):
            listed[particle], checked[particle] = rows
        return Memory(pairs, values, surfaces, pushes, given, *self._numbers(), asleep, listed, checked, skin)

    def restore(self, memory: Memory, obstacles: ObstacleArrays | None = None) -> None:
        """Set the state that `save` returned; obstacles: the current ones, which number its surfaces. None: unchanged."""
        if obstacles is not None:
            self.obstacles.name_after(obstacles)
        self._kept_surfaces: tuple[Array, Array] | None = memory.surfaces, memory.pushes
        self._kept: tuple[Array, Array] | None = (memory.pairs, memory.values)  # not yet passed to the engine
        self._kept_list: Any = (memory.listed, memory.checked, memory.skin) if memory.skin else None
        self._particle = np.arange(len(memory.given), dtype=np.int32)
        self.gave, self.gave_spin = columns_of(memory.given)
        self.asleep = memory.asleep
        vars(self).update((name, getattr(memory, name)) for name in STEP)
        self._made = -1  # `SortedState.revision` of the engine's arrays; -1: none yet
        self._collisions: Any = None
        self._names: list[str] = []  # of materials
        self._most_friction = self._most_rolling = 0.0  # for two circles without values of their own
        self._skin: float | None = -1.0
        self._still: tuple[int, Array] | None = None

    def note(self, state: SortedState) -> Any:
        """State for `go_back` if this frame is refused: all but the impulses of contacts. Pinned particles have none."""
        if len(state.island) and self._particle is state.particle:
            known: Any = state.free
            return self._particle, known, self.gave[known], self.gave_spin[known], *self._numbers()
        return self._particle, slice(None), self.gave.copy(), self.gave_spin.copy(), *self._numbers()

    def _numbers(self) -> tuple[float, float, float, float, float, float, float, float]:
        return self.kick, self.h, self.hertz, self.finer, self.steps, self.parting, self.typical, self.strongest

    def go_back(self, note: Any) -> None:
        """Discard contacts and restore the rest from what `note` returned."""
        particle, known, gave, gave_spin, *numbers = note
        self.forget()
        given = np.zeros((int(particle.max(initial=-1)) + 1, 3), self._dtype)
        given[particle[known], :2], given[particle[known], 2] = gave, gave_spin
        self._particle = np.arange(len(given), dtype=np.int32)
        self.gave, self.gave_spin = columns_of(given)
        vars(self).update(zip(STEP, numbers, strict=True))

    def forget_list(self) -> None:
        """Discard the pair list, which describes other particles."""
        self.engine.forget_list()
        if self._kept_list is not None:
            listed, checked, skin = self._kept_list
            self._kept_list = listed[:0], checked[:0], skin

    def _impulses(self) -> tuple[Array, Array]:
        """`pairs` and `values` of `Memory`."""
        return self._kept if self._kept is not None else self.engine.take_impulses(self._particle)

    def _at_surfaces(self) -> tuple[Array, Array]:
        """`surfaces` and `pushes` of `Memory`."""
        if self._kept_surfaces is not None:
            return self._kept_surfaces
        sorted_index, surface, pushes = self.engine.take_surfaces()
        return np.column_stack((self._particle[sorted_index], surface)).astype(np.int32), pushes

    def renumber(self, now: Array, state: SortedState) -> None:
        """Renumber particles, now at `now` (n,) or removed (-1), in the stored contact state and then in the rows."""
        gone, self.h = np.flatnonzero(now < 0), 0.0
        left = memory.without(state.particle, gone)
        if self._kept is not None:
            self.restore(self.save().renumbered(now))
        else:
            index, particle = left if self._particle is state.particle else memory.without(self._particle, gone)
            self._move(memory.places(index, len(self._particle), np.int32), index, None, particle)
            self.asleep = self.asleep.renumbered(now)
        state.forget(gone, *left)

    def _move(self, place: Array, gone: Array, source: Array | None, particle: Array) -> None:
        """Move what is stored for row k to row place[k], or drop it (-1). particle: the user's index of each new row.

        gone, source: as `memory.moved` takes them.
        """
        moves = gone, source, len(particle)
        self.engine.move_particles(place, *moves, self.parts)
        self.gave, self.gave_spin = (memory.moved(given, *moves, blank=0) for given in (self.gave, self.gave_spin))
        self._particle = particle

    def leave(self, moved: Array, lone: Array) -> None:
        """Drop the contacts of the particles `moved` (k,), and the last impulses of those without links, `lone`.

        Impulses of links stay: they belong to the velocities of a body that is moved as a whole.
        """
        known = len(self._particle)
        now = np.arange(max(known, int(moved.max(initial=-1)) + 1))
        now[moved] = -1
        if self._kept is not None:
            saved = self.save()
            saved.given[lone[lone < known]] = 0
            for rows in (saved.listed, saved.checked) if len(saved.listed) else ():
                rows[moved[moved < known]] = np.nan
            self.restore(saved.renumbered(now)._replace(given=saved.given, listed=saved.listed, checked=saved.checked))
            return
        sorted_index = _places(self._particle)[lone[lone < known]]
        self.gave[sorted_index], self.gave_spin[sorted_index] = 0, 0
        place = np.where(now[self._particle] >= 0, np.arange(known, dtype=np.int32), np.int32(-1))
        self.engine.move_particles(place, np.flatnonzero(place < 0), place, known, self.parts)
        self.asleep = self.asleep.renumbered(now)

    def load(self, world: Any, dt: float) -> None:
        """Pass the particles and their materials to the engine for a frame of dt seconds."""
        state, engine, collisions, forces = world._sorted, self.engine, world.collisions, world._force_sum
        forces.typical, forces.strongest = self.typical, self.strongest
        parts = world._team.now
        if engine.threads < parts:
            engine.set_threads(parts)
        self.parts = parts
        if collisions is not self._collisions:
            self._names = names_of(collisions)
            self._most_friction = collisions.most("friction") if collisions else 0.0
            self._most_rolling = collisions.most("rolling_resistance") if collisions else 0.0
        self._wake(state)
        changed = state.revision != self._made or collisions is not self._collisions
        if self._particle is not state.particle or self._kept is not None:
            self._follow(state)
        elif changed:
            self._hold(state)
        if changed:
            self._set_materials(world)
        if (skin := skin_of(collisions)) != self._skin:
            self._skin = skin
            if self._kept_list is None:
                engine.set_skin(SKIN if self._skin is None else self._skin, self._skin is None)
        engine.set_boundary(*walls_of(world.boundary, self._names))
        if world.boundary is not self._room:
            engine.set_periodic(*state.periodic)
            self._room = world.boundary
        self.follow_obstacles(world, dt)
        if self._kept_list is not None:
            engine.set_skin(self._kept_list[2][0], self._skin is None)
            engine.restore_list(*self._kept_list)
            self._kept_list = None
        engine.patch_list(parts)
        if len(state) >= SORTED_FROM:
            self._sort(state)
        self._still = self.engine.take_still(not state.copied)
        if state.periodic:
            state.crossed = np.zeros(state.position.shape)
            engine.follow_images(state.crossed)

    def still(self) -> Array:
        """(blocks,) which rows neither the last frame nor the one before has changed; or empty."""
        now = self.engine.take_still(True) if self._still else None
        return now[1] if self._still and now and self._still[0] == now[0] else _NONE

    def set_aside(self, state: SortedState) -> None:
        """Store the contact state of islands that have just fallen asleep."""
        at_rest, asleep = _at_rest(state)
        asleep[self.asleep.particle] = False  # already stored
        left, rest = self._remembered().split(at_rest, asleep)
        self.asleep = self.asleep.joined(left.times(1.0 / self.kick))
        self._remember(rest)

    def wake(self, world: Any) -> None:
        """Restore contacts of islands that woke in the middle of a frame."""
        self._wake(world._sorted)
        self._follow(world._sorted)
        self._set_materials(world)

    def _wake(self, state: SortedState) -> None:
        """Restore the stored contact state of particles that are awake now."""
        if not len(self.asleep.particle) or len(self.asleep.particle) == len(state.asleep):
            return
        self.asleep, awake = self.asleep.split(*_at_rest(state))
        self._remember(self._remembered().joined(awake.times(self.kick)))
        if 2 * len(awake.particle) > np.count_nonzero(state.inverse_mass):  # with other springs most would jump or drop
            self.hertz = float(np.median(awake.hertz))

    def _remembered(self) -> Remembered:
        """The contact state of all particles that the engine moves."""
        given, hertz = np.column_stack((self.gave, self.gave_spin)), np.full(len(self.gave), self.hertz)
        return Remembered(*self._impulses(), *self._at_surfaces(), self._particle, given, hertz)

    def _remember(self, what: Remembered) -> None:
        """Replace the contact state; of a particle that occurs twice the last entry counts."""
        sorted_index = _places(self._particle)[what.particle]
        self.gave[:], self.gave_spin[:] = 0, 0
        self.gave[sorted_index], self.gave_spin[sorted_index] = what.given[:, :2], what.given[:, 2]
        self._kept, self._kept_surfaces = (what.pairs, what.values), (what.surfaces, what.pushes)
        self.engine.forget_list()

    def _sort(self, state: SortedState) -> None:
        """Sort rows by cells if many are out of order; the pair list stays the same."""
        falls, order = self.engine.order()
        if falls > UNSORTED * len(state):
            order = order.astype(np.int32)
            self.engine.renumber(order)
            self.gave, self.gave_spin = self.gave[order], self.gave_spin[order]
            surfaces = self._at_surfaces()
            state.reorder(order)
            self._particle = state.particle
            self._hold(state)
            self._give_surfaces(*surfaces)

    def _follow(self, state: SortedState) -> None:
        """Reorder the stored contact state to the current order of rows."""
        if self._kept is None:
            known, no_rows = len(self._particle), np.empty(0, np.int64)
            if not np.array_equal(self._particle, state.particle[:known]):
                place, source = _places(state.particle)[self._particle], np.full(len(state), -1)
                source[place] = np.arange(known)
                self._move(place, no_rows, source, state.particle)
            elif known < len(state):
                self._move(np.arange(known, dtype=np.int32), no_rows, None, state.particle)
            self._particle = state.particle
            self._hold(state)
            return
        place, (pairs, values), surfaces = _places(state.particle), self._kept, self._at_surfaces()
        given = np.zeros((max(len(state), int(self._particle.max(initial=-1)) + 1), 3), self._dtype)
        given[self._particle, :2], given[self._particle, 2] = self.gave, self.gave_spin
        if self._kept_list is not None:
            rows, skin = self._kept_list[:2], self._kept_list[2]
            if len(rows[0]):  # new particles are not in the list
                come = np.full((max(len(state) - len(rows[0]), 0), 2), np.nan, self._dtype)
                rows = [np.concatenate((row, come))[state.particle] for row in rows]
            self._kept_list = *rows, skin
        self._particle = state.particle
        self.gave, self.gave_spin = columns_of(given[state.particle])
        self._hold(state)
        self.engine.give_impulses(place[pairs], values)
        self._give_surfaces(*surfaces)
        self._kept = None

    def _give_surfaces(self, surfaces: Array, pushes: Array) -> None:
        """Pass contacts with surfaces to the engine, by current particle indices and surface numbers."""
        self._find_surfaces(_places(self._particle)[surfaces[:, 0]], surfaces[:, 1], pushes)
        self._kept_surfaces = None

    def _find_surfaces(self, sorted_index: Array, surface: Array, pushes: Array) -> None:
        """Have the engine match these contacts of rows, -1 for none, when it next lists surfaces."""
        order = np.argsort(sorted_index, kind="stable")[np.count_nonzero(sorted_index < 0) :]
        self.engine.give_surfaces(sorted_index[order].astype(np.int32), surface[order], pushes[order])

    def follow_obstacles(self, world: Any, dt: float) -> None:
        """Pass the current obstacles to the engine for a frame of dt seconds."""
        now = self.obstacles.begin(world._obstacle_arrays, self.engine, self.largest, dt, self._names)
        self._note_let_go(self.obstacles.refiltered if now is None else now < 0)
        if now is not None:
            surfaces, pushes = self._at_surfaces()
            surfaces[:, 1] = now[surfaces[:, 1]]
            held = surfaces[:, 1] >= 0
            self._give_surfaces(surfaces[held], pushes[held])
            self.asleep = self.asleep.at_surfaces(now)  # removed sensors wake no particle
        boundary, state, arrays = world.boundary, world._sorted, world._obstacle_arrays
        self.rolls = arrays.rolls or resist(boundary, "rolling_resistance", self._most_rolling, state.most_rolling)
        has_friction = arrays.rough or resist(boundary, "friction", self._most_friction, state.most_friction)
        self.rough = self.rolls or has_friction or world.links.pool.has_motor
        self.engine.set_rolls(self.rolls)

    def _note_let_go(self, others: Array | None) -> None:
        """Reset h if a surface that carries particles has changed: others (surfaces,) bool, or None."""
        if others is not None:
            for surfaces, pushes in (self._at_surfaces(), (self.asleep.surfaces, self.asleep.pushes)):
                if (others[surfaces[:, 1]] & (pushes[:, 0] > 0)).any():
                    self.h = 0.0

    def _hold(self, state: SortedState) -> None:
        """Pass the current arrays to the engine."""
        made = {
            "own_restitution": state.restitution, "own_friction": state.friction, "own_rolling": state.rolling_resistance,
            "own_material": numbers_of(state, self._names), "ease": ease_of(state),
        }  # fmt: skip
        one = slice(None) if mixed(state) else slice(1)
        self.engine.set_particles(
            position=state.position, velocity=state.velocity, acceleration=state.acceleration,
            inverse_mass=state.inverse_mass, radius=state.radius, spin=state.spin, given=self.gave, given_spin=self.gave_spin,
            particle=state.particle, category=state.category, mask=state.mask,
            **{name: np.ascontiguousarray(column[one]) for name, column in made.items()},
        )  # fmt: skip

    def _set_materials(self, world: Any) -> None:
        """Pass changed materials to the engine; pinned particles lose their last contact impulses."""
        held = world._sorted.inverse_mass == 0
        self.gave[held], self.gave_spin[held] = 0, 0
        state = world._sorted
        self._made, self._collisions = state.revision, world.collisions
        self.free = bool((state.inverse_mass > 0).any())
        materials = materials_of(state, world._state.shown["radius"], world.collisions)
        self.largest = materials["largest"] if len(state) else 0.0
        self.mean_radius, self.unequal = materials["mean_radius"], state.differ("mass") and _unequal(state.inverse_mass)
        self.engine.set_materials(**materials)


def _unequal(inverse_mass: Array) -> bool:
    """Whether masses differ, pinned particles aside."""
    free = inverse_mass[inverse_mass > 0]
    return bool(len(free) and (free != free[0]).any())


def _places(particle: Array) -> Array:
    """The row of each of the user's particles."""
    place = np.zeros(len(particle), np.int32)
    place[particle] = np.arange(len(particle), dtype=np.int32)
    return place


def _at_rest(state: SortedState) -> tuple[Array, Array]:
    """By the user's index: which particles cannot move, and which of these sleep."""
    rest, asleep = np.zeros((2, len(state)), bool)
    rest[state.particle], asleep[state.particle] = state.inverse_mass == 0, state.island >= 0
    return rest, asleep
