"""A random world as a program: lines that build it, and changes while it runs. What is printed is what was run.

Programs use every room, integrator, link, obstacle, force and service, in any allowed mixture. A failing one is reduced by
leaving out everything without which the same check still fails.
"""

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME
from pyverlet.world.world import World

Build = Callable[[int | None], World]  # a world on at most so many threads
Change = Callable[[World, int], None]  # applies the changes due before a frame


@dataclass(frozen=True)
class Program:
    """A world and its later changes."""

    seed: int  # of all random numbers in the lines
    count: int  # circles, `n` in the lines
    settings: Mapping[str, str] = field(default_factory=dict)  # arguments of `pv.World`, as written
    lines: tuple[str, ...] = ()  # statements that fill `world`, using `n` and `rng`
    changes: tuple[tuple[int, str], ...] = ()  # (frame, statement): changes of `world` before this frame
    frames: int = 40  # number of frames
    dt: str = "1 / 60"  # s, as written

    @property
    def body(self) -> str:
        """The two functions `build(threads)` and `change(world, frame)`."""
        settings = ", ".join(f"{name}={value}" for name, value in {**self.settings, "threads": "threads"}.items())
        built = [f"rng, n = np.random.default_rng({self.seed}), {self.count}", f"world = pv.World({settings})", *self.lines]
        changes = [f"if frame == {frame}:\n        {statement}" for frame, statement in self.changes]
        build, change = ("\n    ".join(lines) for lines in ([*built, "return world"], changes or ["pass"]))
        return f"def build(threads):\n    {build}\n\n\ndef change(world, frame):\n    {change}"

    def source(self, only: str | None = None) -> str:
        """The whole program, for running by itself; `only`: the failing check."""
        chosen = f", only={only!r}" if only else ""
        return (
            "import numpy as np\n\nimport pyverlet as pv\nfrom pyverlet.lab import fuzz\n\n\n"
            f"{self.body}\n\n\nfuzz.check(build, change, frames={self.frames}, dt={self.dt}{chosen})\n"
        )

    def functions(self) -> tuple[Build, Change]:
        """`build` and `change`, compiled from the printed text."""
        names: dict[str, Any] = {"np": np, "pv": pv}
        exec(compile(self.body, "<fuzzed world>", "exec"), names)
        return names["build"], names["change"]

    @property
    def seconds(self) -> float:
        """Length of a frame, s."""
        top, _, bottom = self.dt.partition("/")
        return float(top) / float(bottom or 1)


Fails = Callable[[Program], int | None]  # the frame in which a program still fails in the same way; None if it does not


def shrink(program: Program, fails: Fails) -> Program:
    """A minimal program that still fails, by leaving out one part after another."""
    smaller, tries = True, 300
    while smaller and tries > 0:
        smaller = False
        for simpler in _simpler(program):
            tries -= 1
            frame = fails(simpler)
            if frame is not None:
                program, smaller = simpler, True
                break
            if tries <= 0:
                break
    return program


def _simpler(program: Program) -> Iterator[Program]:
    """Programs with one part less, largest parts first."""
    for fewer in (program.frames // 4, program.frames // 2, program.frames * 3 // 4, program.frames - 1):
        if 1 <= fewer < program.frames:
            yield replace(program, frames=fewer, changes=tuple(change for change in program.changes if change[0] < fewer))
    for fewer in (program.count // 10, program.count // 2, program.count * 3 // 4, program.count - 1):
        if 0 <= fewer < program.count:
            yield replace(program, count=fewer)
    for k in range(len(program.changes)):
        yield replace(program, changes=program.changes[:k] + program.changes[k + 1 :])
    for k in range(len(program.lines)):
        yield replace(program, lines=program.lines[:k] + program.lines[k + 1 :])
    for name in program.settings:
        yield replace(program, settings={key: value for key, value in program.settings.items() if key != name})
    for k, line in enumerate(program.lines):
        for shorter in _shorter(line):
            yield replace(program, lines=(*program.lines[:k], shorter, *program.lines[k + 1 :]))


def _shorter(line: str) -> Iterator[str]:
    """The line without one of the named arguments of a call."""
    tree = ast.parse(line)
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        for k in range(len(call.keywords)):
            argument = call.keywords.pop(k)
            yield ast.unparse(tree)
            call.keywords.insert(k, argument)


T = TypeVar("T")

SIZE = 10.0  # m, half width of every room; radii depend on the number of circles
_COUNTS = (0, 1, 2, 3, 7, 20, 60, 150, 400, 900, 2000, 2600)  # above 2,048 circles a world uses several threads


class _Chance:
    """Random choices, as text."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def one(self, things: Sequence[T]) -> T:
        return things[int(self.rng.integers(len(things)))]

    def happens(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def number(self, low: float, high: float) -> str:
        return f"{self.rng.uniform(low, high):.3g}"

    def log(self, low: float, high: float) -> str:
        return f"{np.exp(self.rng.uniform(np.log(low), np.log(high))):.3g}"

    def part(self) -> str:
        """A fraction: often 0, often 1."""
        return self.one(["0", "0", "1", self.number(0.1, 0.9), self.number(0.1, 0.9)])

    def point(self, reach: float) -> str:
        return f"({self.number(-reach, reach)}, {self.number(-reach, reach)})"

    def count(self, most: int) -> int:
        """A number up to `most`, usually small."""
        return min(int(self.rng.geometric(0.6)) - 1, most)


def _settings(c: _Chance, count: int) -> dict[str, str]:
    walls, s = f"restitution={c.part()}, friction={c.part()}", SIZE
    boundaries = [f"pv.Circle(radius={s:g}, {walls})", f"pv.Box(({-s:g}, {-s:g}), ({s:g}, {s:g}), {walls})", "pv.Open()"]
    settings = {"boundary": c.one(boundaries)}
    if c.happens(0.6):
        pull = c.one([0.0, 9.81, 9.81, float(c.log(0.1, 100))])
        turn = float(c.number(0, 2 * np.pi))
        settings["gravity"] = f"({pull * np.cos(turn):.3g}, {pull * np.sin(turn):.3g})"
    if c.happens(0.6):
        method = c.one(["", "", "", ", method=pv.BruteForce()"]) if count < 500 else ""
        settings["collisions"] = c.one(["None", *[f"pv.Collisions(restitution={c.part()}, friction={c.part()}{method})"] * 6])
    if c.happens(0.4):
        settings["integrator"] = f"pv.{c.one([cls.__name__ for cls in BY_NAME.values()])}()"
    settings["substeps"] = str(c.one([1, 2, 4, 8, 8, 8, 16, 32]))
    if c.happens(0.4):
        settings["dtype"] = '"float64"'
    settings |= {name: "True" for name in ("ledger", "events", "contacts", "sleep") if c.happens(0.25)}
    return settings


def _circles(c: _Chance, count: int) -> str:
    # Radii that cover from a hundredth to nine tenths of the room, at random places, so that many overlap at the start.
    largest = min(SIZE * np.sqrt(float(c.log(0.01, 0.9)) / max(count, 1)), SIZE / 3)
    ratio, reach = c.one([1.0, 1.0, 2.0, 5.0, 50.0]), 0.7 * (SIZE - largest)
    arguments = [f"position=rng.uniform({-reach:.3g}, {reach:.3g}, (n, 2))"]
    arguments.append(f"radius={largest:.3g}" if ratio == 1 else f"radius={largest:.3g} * {ratio:g} ** -rng.random(n)")
    if c.happens(0.6):
        arguments.append(f"velocity=rng.normal(0, {c.log(0.1, 20)}, (n, 2))")
    heavy = c.one([1, 1, 3, 30, 1000])
    if heavy > 1:
        arguments.append(f"mass={heavy} ** rng.random(n)")
    elif c.happens(0.3):
        arguments.append(f"density={c.log(0.1, 100)}")
    if c.happens(0.3):
        arguments.append("spin=rng.normal(0, 5, n)")
    if c.happens(0.2):
        arguments.append("restitution=rng.random(n), friction=rng.random(n)")
    if c.happens(0.1):
        arguments.append("category=1 << rng.integers(0, 3, n), mask=rng.integers(1, 8, n)")
    return f"circles = world.add({', '.join(arguments)}, on_overlap='push')"


def _link(c: _Chance) -> str:
    pair = "*rng.permutation(n)[:n // 2 * 2].reshape(2, -1)[:, :20]"
    row = "np.arange(min(n, 20) - 1), np.arange(1, min(n, 20))"
    breaks = c.one(["", "", f", breaking_force={c.log(1, 1000)}"])
    soft = f", damping={c.part()}{breaks}"
    kinds = [
        f"pv.Stick(circles, {c.one([pair, row])}{breaks})", f"pv.Rope(circles, {c.one([pair, row])}{breaks})",
        f"pv.Spring(circles, {c.one([pair, row])}, stiffness={c.log(1, 1e4)}{soft})",
        f"pv.Stick(circles, {row}, compliance={c.log(1e-6, 1e-2)})",
        f"pv.Pin(circles, rng.integers(n, size=1){breaks})",
        "pv.Angle(circles, np.arange(min(n, 12) - 2), np.arange(1, min(n, 12) - 1), "
        f"np.arange(2, min(n, 12)), compliance={c.log(1e-4, 1)})",
    ]  # fmt: skip
    return f"world.links.append({c.one(kinds)})"


def _built(c: _Chance) -> str:
    return c.one(
        [
            f"pv.chain(world, {c.point(5)}, {c.point(5)}, links={c.one([3, 10, 30])})",
            f"pv.rope(world, {c.point(5)}, {c.point(5)}, links={c.one([3, 10, 30])})",
            f"pv.cloth(world, {c.point(4)}, width=3, height=2, columns=6, rows=5)",
            f"pv.soft_body(world, [(-2, -1), (1, -1), (1, 2)], spacing=0.4, filled={c.happens(0.5)})",
        ]
    )


def _obstacle(c: _Chance) -> str:
    how = f"restitution={c.part()}, friction={c.part()}"
    if c.happens(0.25):
        how += c.one([f", velocity={c.point(1)}", f", angular_velocity={c.number(-2, 2)}", f", surface_speed={c.number(-3, 3)}"])
    kinds = [
        f"pv.Segment({c.point(9)}, {c.point(9)}, {how})", f"pv.Capsule({c.point(9)}, {c.point(9)}, radius=0.3, {how})",
        f"pv.Disc({c.point(9)}, {c.number(0.3, 2)}, {how})", f"pv.Polygon([(-3, -6), (4, -5), (0, -3)], {how})",
        f"pv.Chain([(-9, 1), (-4, -3), (0, -1), (6, -4)], {how})",
    ]  # fmt: skip
    return f"world.obstacles.append({c.one(kinds)})"


def _force(c: _Chance) -> str:
    kinds = [
        f"pv.Drag(linear={c.log(0.01, 2)})", f"pv.Drag(quadratic={c.log(0.01, 1)})",
        f"pv.PointSpring(stiffness={c.log(0.1, 10)})",
        f"pv.Attractor(strength={c.log(1, 100)}, softening=1.0)", f"pv.ConstantForce({c.point(5)})",
        f"pv.Wind({c.point(5)}, linear={c.log(0.01, 1)})", "pv.Gravitation(strength=0.5, softening=0.5)",
    ]  # fmt: skip
    return f"world.forces.append({c.one(kinds)})"


def _actor(c: _Chance) -> str:
    kinds = [
        f"pv.Emitter(pv.Box((-2, 3), (2, 6)), rate={c.number(5, 100)}, radius=0.2, most=30)", "pv.Sink(pv.Circle(radius=2))",
    ]  # fmt: skip
    return f"world.actors.append({c.one(kinds)})"


def _change(c: _Chance) -> str:
    kinds = [
        f"world.add(position={c.point(4)}, radius={c.number(0.1, 0.8)}, on_overlap='push')",
        "world.remove(np.arange(0, len(world), 3))", "world.remove(np.arange(len(world)) % 2 == 0)",
        f"world.velocity += {c.point(3)}", "world.velocity *= -1", "world.position[:1] = (0.1, 0.2)",
        "world.spin[:] = 3", "world.mass[:2] = np.inf", "world.mass[:] = 1", "world.radius *= 0.8",
        f"world.gravity = {c.point(20)}", f"world.substeps = {c.one([1, 3, 8, 20])}",
        "[world.links.remove(link) for link in list(world.links)]",
        "world.obstacles.clear()", "world.forces.clear()", "world.integrator = pv.VelocityVerlet()",
    ]  # fmt: skip
    return c.one(kinds)


def random_program(seed: int) -> Program:
    """The program of this seed."""
    c = _Chance(seed)
    count = int(c.one(_COUNTS) * c.rng.uniform(0.8, 1.0))
    settings, lines = _settings(c, count), [_circles(c, count)]
    if count and c.happens(0.25):
        lines.append("world.mass[rng.random(n) < 0.1] = np.inf")
    kinds: list[tuple[float, Callable[[_Chance], str], int]] = [
        (0.3, _link, 3), (0.15, _built, 2), (0.3, _obstacle, 4), (0.3, _force, 3), (0.15, _actor, 2),
    ]  # fmt: skip
    for probability, kind, most in kinds:
        if c.happens(probability) and (kind is not _link or count >= 4):
            lines += [kind(c) for _ in range(1 + c.count(most - 1))]
    frames = c.one([20, 40, 60]) if count < 500 else 20
    changes = sorted((int(c.rng.integers(1, frames)), _change(c)) for _ in range(c.count(4)))
    return Program(
        seed, count, settings, tuple(lines), tuple(changes), frames, c.one(["1 / 60", "1 / 60", "1 / 240", "1 / 30", "1 / 15"])
    )
