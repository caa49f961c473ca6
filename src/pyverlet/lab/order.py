"""Measures the order of an integrator: error = C h^p, so p is the slope of log(error) against log(h), in float64."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.lab import figures
from pyverlet.lab.problems import PROBLEMS, Equation, Problem
from pyverlet.laws.integrators import Integrator, PositionVerlet, TimeCorrectedVerlet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAMES = (80, 160, 320, 640)
"""Numbers of steps per second of simulated time."""

JITTER = 0.3
"""Largest relative deviation of a varying step from the mean."""

WITHIN = 0.1
"""Largest allowed difference between measured and declared order."""


@dataclass(frozen=True)
class Convergence:
    """Errors of one method on one problem.

    Attributes:
        h: (k,) mean length of a step, s.
        error: (k,) largest distance from the solution in phase space over the whole time.
        order: fitted; None if fewer than two errors exceed rounding.
    """

    h: Floats
    error: Floats
    order: float | None


@dataclass(frozen=True)
class Method:
    """A row of the table.

    Attributes:
        label: name and conditions.
        integrator: the method.
        expected: its order; None if it has none.
        jitter: relative variation of its steps.
    """

    label: str
    integrator: Integrator
    expected: int | None
    jitter: float = 0.0


@dataclass(frozen=True)
class Orders:
    """A method, and its convergence by name of problem."""

    method: Method
    convergence: dict[str, Convergence] = field(default_factory=dict)

    @property
    def as_expected(self) -> bool:
        """Whether every problem shows the expected order; a method without one must show less than 1 on all."""
        orders = [each.order for each in self.convergence.values()]
        if self.method.expected is None:
            return all(order is not None and order < 1.0 - WITHIN for order in orders)
        return all(order is None or abs(order - self.method.expected) <= WITHIN for order in orders)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return {
            "method": self.method.label,
            "declared": self.method.integrator.order,
            "expected": self.method.expected,
            "jitter": self.method.jitter,
            "as_expected": self.as_expected,
            "problems": {
                name: {"order": each.order, "h": each.h.tolist(), "error": each.error.tolist()}
                for name, each in self.convergence.items()
            },
        }


def steps(frames: int, seconds: float = 1.0, jitter: float = 0.0) -> Floats:
    """(frames,) step lengths that sum to `seconds`, varied by up to `jitter` of each; always the same ones."""
    dts = 1 + jitter * np.random.default_rng(frames).uniform(-1, 1, frames)
    return np.asarray(dts * (seconds / dts.sum()))


def largest_error(integrator: Integrator, problem: Problem | Equation, dts: Floats) -> float:
    """Largest distance from the solution, in position and velocity, over all steps."""
    found = problem.motion(integrator, dts)
    exact = problem.solution(found.times)
    squares = [((a - b) ** 2).reshape(len(a), -1).sum(axis=1) for a, b in zip(found[1:], exact, strict=True)]
    return float(np.sqrt(sum(squares)).max())


def measure(
    integrator: Integrator, problem: Problem | Equation, *, jitter: float = 0.0, frames: Sequence[int] = FRAMES
) -> Convergence:
    """Run the same time with more and more steps, and fit the order."""
    errors = np.array([largest_error(integrator, problem, steps(n, problem.seconds, jitter)) for n in frames])
    h = problem.seconds / np.array(frames, dtype=np.float64)
    known = errors > problem.rounding
    order = float(np.polyfit(np.log(h[known]), np.log(errors[known]), 1)[0]) if np.count_nonzero(known) > 1 else None
    return Convergence(h, errors, order)


def methods(integrators: Sequence[Integrator]) -> list[Method]:
    """The rows for these integrators: each, the naive start of Verlet, and a varying step for methods that depend on it."""
    rows = [Method(each.label, each, each.order) for each in integrators]
    for each in integrators:
        if type(each) is PositionVerlet and not each.naive_start:
            naive = PositionVerlet(naive_start=True)
            rows.append(Method(naive.label, naive, 1))
    # A formula for constant steps has no order under varying ones; the corrected formula keeps its own.
    for each in integrators:
        if isinstance(each, PositionVerlet | TimeCorrectedVerlet):
            expected = each.order if isinstance(each, TimeCorrectedVerlet) else None
            rows.append(Method(f"{each.label}, jittering step", each, expected, JITTER))
    return rows


def table(rows: Sequence[Method], problems: Sequence[Problem | Equation] = tuple(PROBLEMS.values())) -> list[Orders]:
    """Measure every method on every problem."""
    return [
        Orders(row, {problem.name: measure(row.integrator, problem, jitter=row.jitter) for problem in problems}) for row in rows
    ]


def figure(orders: Sequence[Orders], problems: Sequence[Problem | Equation] = tuple(PROBLEMS.values())) -> Figure:
    """One log-log panel per problem: error against step, with slopes of order 1, 2 and 4. Needs the extra `plot`."""
    from matplotlib.figure import Figure

    rows = 1 if len(problems) == 1 else 2
    picture = Figure(figsize=(11.0, 4.0 * rows), dpi=150, layout="constrained")
    panels = np.ravel(picture.subplots(rows, -(-len(problems) // rows), sharex=True))
    for axes, problem in zip(panels, problems, strict=True):
        name = problem.name
        for number, each in enumerate(orders):
            found = each.convergence[name]
            dashes = ":" if each.method.jitter else "--" if "," in each.method.label else "-"
            axes.loglog(found.h, found.error, ls=dashes, lw=1.4, ms=5, label=each.method.label, **figures.style(number))
        axes.set(title=f"{name}:  {problem.law}", ylabel="largest error (SI units)")
        axes.set_xticks(found.h, [f"1/{1 / h:.4g}" for h in found.h])
        axes.set_xticks([], minor=True)
        axes.margins(x=0.14)
        figures.tidy(axes)
        _write_slopes(axes, [each.convergence[name] for each in orders])
    for axes in panels[-len(panels) // rows :]:
        axes.set_xlabel("length of a step h (s)")
    figures.legend(picture, panels[0])
    picture.suptitle("Error against step; the number beside a curve is its slope, the measured order")
    return picture


def _write_slopes(axes: Axes, found: Sequence[Convergence]) -> None:
    """Write measured orders at the right end of the curves, spread where curves are close."""
    low, high = np.log(axes.get_ylim())
    least, last = 0.036 * (high - low), -np.inf
    for number in np.argsort([each.error[0] for each in found]):
        each = found[number]
        last = max(float(np.log(each.error[0])), last + least)
        text = "rounding" if each.order is None else f"{each.order:.2f}"
        axes.annotate(
            text, (float(each.h[0]), float(np.exp(last))), (8, 0), textcoords="offset points", fontsize=8,
            color=figures.style(int(number))["color"], va="center",
        )  # fmt: skip
