"""Checks the guarantees of every world in each frame:

`finite`      nothing is NaN or infinite
`room`        no free particle leaves a closed room
`energy`      rises by at most 1e-4 of its scale in a frame of an undriven world
`links`       in a world with links, nor above its value in any of the last frames
`momentum`    is conserved without external forces
`ledger`      its accounts sum to the energy
`contacts`    the overlapping circles are those that plain NumPy finds, pair by pair
`bits`        a second run, on two threads if there are enough circles, ends with the same bits
`restore`     so does a run continued from `save` and `restore`
`file`        and one continued from a file
`error`       nothing but `InputError` is raised

Energies may differ by rounding and step errors, and by energy that links show but cannot release.
"""

import tempfile
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError, NonFiniteError
from pyverlet.common.threads import max_threads
from pyverlet.data import snapshot
from pyverlet.lab.fuzz.program import Build, Change
from pyverlet.lab.physics.energy import MOST, PARTING_S, scale
from pyverlet.laws.boundaries import Open
from pyverlet.laws.forces import ConstantForce, Drag, PointSpring, Wind
from pyverlet.laws.gains import pinned_move, undriven
from pyverlet.laws.integrators import Yoshida4
from pyverlet.laws.links import Pin
from pyverlet.world.world import World


def stored(world: World, h: float) -> tuple[float, float]:
    """Energy of links, J, and sum of their stiffness, N/m; stiffness is limited to what acts back within a substep of h.

    If its value C returns to 0 in a substep, its particles, of inverse masses w, have C^2 / (2 h^2 sum(w |grad C|^2)) J. A link
    much stiffer than substeps can follow shows more, if a wall or a pinned circle has stretched it after links were solved, and
    never releases that.
    """
    place, pool = world.position.astype(float), world.links.pool
    with np.errstate(divide="ignore"):
        weight = 1.0 / world.mass.astype(float)
    stiffness = np.where(np.isfinite(pool.rows["stiffness"]), pool.rows["stiffness"], 0.0)
    part = 1.0 / np.maximum(stiffness * pool.mobility(place, weight, world._state.periodic) * h * h, 1.0)
    return float((pool.energies(place, world._state.periodic) * part).sum()), float((stiffness * part).sum())


def rounded(world: World, held: float, stiff: float) -> float:
    """Energy that springs gain by rounding of positions, J: with stiffness k and stretch C, k C d and k d^2 / 2."""
    d = 4.0 * float(np.finfo(world.dtype).eps * np.abs(world.position).max(initial=0.0))
    return float(np.sqrt(2.0 * held * stiff)) * d + 0.5 * stiff * d * d


def rolled(world: World, h: float) -> float:
    """Energy error per frame of circles that roll along a wall, J: a step of order 2 moves them freely, friction only corrects
    velocity.

    A rolling disc accelerated by a moves a third of a h^2 / 2 too far; with friction it is 0.21 m (a h)^2 per substep, measured.
    """
    if world.integrator.velocity_lag:
        return 0.0
    gx, gy = world.gravity
    return 0.25 * _free_mass(world) * (gx * gx + gy * gy) * h * h * world.substeps


def of_rounding(world: World, dt: float) -> float:
    """Kinetic energy by rounding errors of positions, J; some methods round more often."""
    slowest = float(np.finfo(world.dtype).eps * np.abs(world.position).max(initial=0.0)) / dt  # m/s
    times = 6 if isinstance(world.integrator, Yoshida4) else 1  # independent errors, so that squares add up
    return 0.5 * times * _free_mass(world) * slowest**2


def _free_mass(world: World) -> float:
    """Mass that was free in the last frame, kg, without what was pinned since."""
    return float(np.where(np.isfinite(world.mass), world.mass, 0.0).sum(dtype=float)) + float(np.isinf(world.mass).sum())


CHECKS = ("finite", "room", "energy", "links", "momentum", "ledger", "contacts", "bits", "restore", "file", "error")

_CLOSED = 1e-6  # relative difference allowed between ledger accounts and energy; both are summed in float64
_FALL_S = 1.0  # without walls the energy scale is that of a fall of this duration, s
_MOMENTUM = 32.0  # rounding errors of each velocity in a substep: of six pairs, two sweeps, and a few more
_EASED = 60  # frames until deep overlaps left by longer steps have separated
_SWING = 8  # frames: for barely resolved vibrations, shown speeds and stretches are up to half a substep apart
_APART = 0.01  # deeper overlaps are being separated, which stretches links between such circles
_EDGE = 1e-5  # over the contact distance: pairs closer than this to touching may count or not, in float32


class Broken(Exception):  # noqa: N818  (a promise, not an error)
    """A guarantee, `check`, was broken before this frame."""

    def __init__(self, check: str, frame: int, what: str) -> None:
        super().__init__(f"{check}, frame {frame}: {what}")
        self.check, self.frame = check, frame


def check(build: Build, change: Change, *, frames: int, dt: float, only: str | None = None, without: Sequence[str] = ()) -> None:
    """Run a world made by `build` and changed by `change` before each frame; check all guarantees, one, or all but some.

    Raises:
        Broken: a guarantee does not hold.
        InputError: the program uses a value that is not allowed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # too coarse coordinates are intended
        with suppress(_Refused):
            _check(build, change, frames, dt, frozenset(CHECKS if only is None else [only]) - set(without))


def _check(build: Build, change: Change, frames: int, dt: float, made: frozenset[str]) -> None:
    world = build(1)
    half = frames // 2
    settling, seen = 0, _Seen()
    for frame in range(half):
        settling = _frame(world, change, frame, dt, made, seen, settling=settling)
    saved, file = world.save(), None
    if "file" in made and not world.actors and len(world) < 1000:
        with tempfile.TemporaryDirectory() as folder, _explained("file", world.frames):
            path = Path(folder) / "world.pvsnap"
            snapshot.save(world, path)
            file = snapshot.load(path, exact=True)
    for frame in range(half, frames):
        settling = _frame(world, change, frame, dt, made, seen, settling=settling)
    end = world.state_hash()
    if "contacts" in made:
        _compare_contacts(world, frames)
    if "bits" in made:
        other = build(min(2, max_threads()))
        _run(other, change, range(frames), dt)
        _same("bits", frames, end, other.state_hash())
    if not _silent(change, range(half, frames)):
        return
    if file:
        _run(file, change, range(half, frames), dt)
        _same("file", half, end, file.state_hash())
    if "restore" in made:
        with _explained("restore", half):
            world.restore(saved)
        _run(world, change, range(half, frames), dt)
        _same("restore", half, end, world.state_hash())


class _Seen:
    """History of a world: recent energies with their scale, and the largest sum of absolute accounts, J."""

    def __init__(self) -> None:
        self.recent, self.most = deque[tuple[float, float]](maxlen=_SWING), 0.0


class _Refused(Exception):  # noqa: N818  (the world has refused what was asked for)
    pass


def _beyond_following(world: World, h: float) -> bool:
    """Whether a spring to a point oscillates too fast for substeps of h: explicit integrators are then unstable.

    The leapfrog method is from w h = 2 on, w^2 = k / m, others of order 2 and more from between 1 and 3 on.
    """
    stiffness = sum(force.stiffness for force in world.forces if isinstance(force, PointSpring))
    return bool(stiffness * h * h >= float(world.mass.min(initial=np.inf)))


def _silent(change: Change, frames: range) -> bool:
    """Whether the world is not changed in these frames; `restore` does not undo changes of laws."""
    try:
        for frame in frames:
            change(None, frame)  # type: ignore[arg-type]
    except (AttributeError, TypeError):  # None has no attributes to change
        return False
    return True


def _run(world: World, change: Change, frames: range, dt: float) -> None:
    for frame in frames:
        change(world, frame)
        world.step(dt)


def _same(name: str, frame: int, one: str, other: str) -> None:
    if one != other:
        raise Broken(name, frame, f"{one} and {other}")


@contextmanager
def _explained(name: str, frame: int) -> Iterator[None]:
    """Context that attributes errors to this check; also `InputError`, as the program is not at fault there."""
    try:
        yield
    except NonFiniteError as error:
        raise Broken("finite", frame, str(error)) from error
    except Exception as error:
        raise Broken(name, frame, f"{type(error).__name__}: {error}") from error


def _frame(world: World, change: Change, frame: int, dt: float, made: frozenset[str], seen: _Seen, *, settling: int) -> int:
    """Run one frame; settling: number of coming frames in which a change may still raise the energy. Returns the new number.

    Velocities are half a step old, so a change also affects the next frame. Overlap left by a coarse step has more energy when
    steps become shorter, until it is gone. So have links that an obstacle has stretched by pushing out particles that started
    inside it, or that a change has stretched by moving their circles.
    """
    before_action, forces, places = (world.version, world.substeps), tuple(world.forces), world.position.copy()
    energy_then, linked = world.energy().total, bool(world.links)
    change(world, frame)
    looks: list[Callable[[], None]] = []
    moved = not np.array_equal(places, world.position)
    touched = moved or before_action != (world.version, world.substeps) or energy_then != world.energy().total
    touched |= bool(linked and not world.links)
    touched |= frame == 0 and len(world.obstacles) > 0  # obstacles push out particles that start inside them
    eases = (moved and linked) or before_action[1] != world.substeps
    eases |= bool(frame == 0 and world.links and _in_obstacles(world))
    h = dt / world.substeps
    about_energy = "links" if world.links else "energy"
    is_driven = world._frames.held.h not in (0.0, h) or not undriven(world)  # some methods need a constant step
    driven = world.actors or touched or settling or pinned_move(world._state) or is_driven
    # Integrators of order 2 are exact for uniform forces, and drag is solved for.
    uniform = all(isinstance(force, ConstantForce | Drag) and not isinstance(force, Wind) for force in world.forces)
    driven = driven or not uniform or bool(world.links and world.overlap().max > _APART)
    if driven:
        seen.recent.clear()
    elif about_energy in made:
        looks.append(_energy(about_energy, world, frame, dt, seen.recent))
    other_forces = forces != tuple(world.forces)  # a new force acts from half a substep before
    if "momentum" in made and not (other_forces or world.actors or (touched and linked)) and _alone(world):
        looks.append(_momentum(world, frame, dt))
    try:
        world.step(dt)
    except NonFiniteError as error:
        if _finite(world) and _beyond_following(world, h):
            raise _Refused from error
        raise Broken("finite", frame, str(error)) from error
    except InputError:
        raise
    except Exception as error:
        raise Broken("error", frame, f"{type(error).__name__}: {error}") from error
    for look in looks:
        look()
    if "finite" in made and not _finite(world):
        raise Broken("finite", frame, "a value is NaN or infinite")
    if "room" in made and not isinstance(world.boundary, Open):
        _stay(world, frame)
    if "ledger" in made and world.keeps_ledger:
        now = world.energy().total
        size = scale(world, _FALL_S) + abs(now)
        seen.most = max(seen.most, abs(now), sum(map(abs, world.ledger.as_dict().values())))
        if abs(world.ledger.total - now) > _CLOSED * size + of_rounding(world, dt) + 1e-14 * seen.most:
            raise Broken("ledger", frame, f"accounts add up to {world.ledger.total:.9g} J, energy is {now:.9g} J")
    return max(settling - 1, _EASED if eases else int(touched))


def _in_obstacles(world: World) -> bool:
    """Whether any particle overlaps an obstacle, even slightly."""
    near = world._obstacle_arrays.near(world.position, world.radius, world.category, world.mask)
    return bool((near.gap < world.radius[near.row]).any())


def _finite(world: World) -> bool:
    columns = (world.position, world.velocity, world.spin, world.angle)
    return all(bool(np.isfinite(column).all()) for column in columns)


def _stay(world: World, frame: int) -> None:
    held = world.boundary.holds(world.category, world.mask) & np.isfinite(world.mass)
    gone = np.flatnonzero(world.boundary.outside(world.position) & held)
    if len(gone):
        raise Broken(
            "room", frame, f"particle {gone[0]} of {len(world)} is at {world.position[gone[0]]}, {len(gone)} are outside"
        )


def _energy(name: str, world: World, frame: int, dt: float, recent: deque[tuple[float, float]]) -> Callable[[], None]:
    h = dt / world.substeps

    def total() -> tuple[float, float, float, float]:
        """Energy, J, as shown, and without what links show and cannot release in a substep: one of them must not have risen."""
        now, (held, stiff) = world.energy(), stored(world, h)
        return now.total, now.total - now.links + held, held, stiff

    shown, able, held, _ = total()
    size = scale(world, _FALL_S) + held
    recent.append((shown, able))
    shown, able = map(max, zip(*recent, strict=True)) if world.links else (shown, able)

    def look() -> None:
        now_shown, now_able, held, stiff = total()
        rise = min(now_shown - shown, now_able - able)
        # A link corrects the rounding of a position in a substep.
        allowed = MOST * size + of_rounding(world, h if world.links else dt) + rounded(world, held, stiff) + rolled(world, h)
        allowed += world._frames.held.parting * np.expm1(dt / PARTING_S)  # separation of overlaps from the start, in this frame
        if rise > allowed:
            share = f"{rise / size:.2e} of the scale, " if size else ""
            raise Broken(name, frame, f"up by {share}{rise:.4g} J")

    return look


def _alone(world: World) -> bool:
    """Whether no external force acts on the particles."""
    held = any(isinstance(link, Pin) for link in world.links) or not np.isfinite(world.mass).all()
    return not (held or any(world.gravity) or world.forces or world.obstacles) and isinstance(world.boundary, Open)


def _tension(world: World) -> float:
    """Total tension of links, N, averaged over a few substeps."""
    return sum(float(np.abs(link.force).sum(dtype=float)) for link in world.links)


def _momentum(world: World, frame: int, dt: float) -> Callable[[], None]:
    before, start, mass = world.momentum(), world.position.astype(float), world.mass.astype(float)
    eps, h = float(np.finfo(world.dtype).eps), dt / world.substeps

    def size(rows: NDArray[Any]) -> float:
        return float((mass * np.hypot(*rows.astype(float).T)).sum())

    moved, tension, asleep = size(world.velocity), _tension(world), world.asleep

    def look() -> None:
        if world.asleep.any() or asleep.any():  # sleeping particles stop slow ones without taking momentum
            return
        change = float(np.hypot(*(world.momentum() - before)))
        pulled = dt * max(tension, _tension(world))  # N s, which are rounded, too
        pushed = size(world.position - start) / dt  # separation without velocity
        allowed = _MOMENTUM * eps * world.substeps * max(moved + pulled, pushed, size(world.velocity))
        far = float(np.abs(start).max(initial=0.0))
        allowed += float(np.finfo(float).eps) * far * mass.sum() / h  # sums are in float64
        # Contacts and links depend on rounded positions; the heaviest one contributes m eps |x|.
        allowed += eps * far * float(mass.max(initial=0.0)) / h
        if world.links:
            # Half a substep of link impulses is not shown for particles in contact, but for linked ones it is.
            allowed += h / dt * pulled if world.collisions else 0.0
        if change > allowed:
            raise Broken("momentum", frame, f"changed by {change:.3g} N s, rounding explains {allowed:.3g}")

    return look


def _compare_contacts(world: World, frame: int) -> None:
    """Check that `overlap` finds the pairs that contacts should use."""
    if len(world) < 2 or world.links:
        return
    place, radius, free = world.position.astype(float), world.radius.astype(float), np.isfinite(world.mass)
    category, mask = world.category, world.mask
    surely = maybe = 0
    for k in range(len(world) - 1):
        reach = radius[k] + radius[k + 1 :]
        apart = np.hypot(*(place[k + 1 :] - place[k]).T)
        counts = free[k] | free[k + 1 :]
        counts &= ((category[k] & mask[k + 1 :]) != 0) & ((category[k + 1 :] & mask[k]) != 0)
        surely += int(((apart < (1 - _EDGE) * reach) & counts).sum())
        maybe += int(((apart < (1 + _EDGE) * reach) & counts).sum())
    found = world.overlap().contacts
    if not surely <= found <= maybe:
        raise Broken("contacts", frame, f"{found} pairs overlap by the cells, {surely} to {maybe} pair by pair")
