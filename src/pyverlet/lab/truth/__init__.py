"""Experiments on nine claims of the two articles that pyverlet began from. To add one: a function with `@experiment`."""

import textwrap
from collections.abc import Sequence

from pyverlet.lab.truth import _claim, claims
from pyverlet.lab.truth._claim import Experiment, Finding, Number

__all__ = ["EXPERIMENTS", "Experiment", "Finding", "Number", "claims", "markdown", "text"]

EXPERIMENTS: dict[str, Experiment] = dict(sorted(_claim.EXPERIMENTS.items()))

WIDTH = 100  # columns on a terminal

PREFACE = """\
# Nine claims, tried

pyverlet began from two articles that teach Euler, semi-implicit Euler and Verlet with bouncing balls. They are a fine start, and
nine things that they, or sketches like theirs, say are not quite so. Each is tried here; `pyverlet truth` repeats it on your
machine.

This page is written by `pyverlet truth --markdown`, and a test holds it to that.
"""


def text(finding: Finding) -> str:
    """A finding as text for a terminal."""
    about = finding.experiment
    numbers = "\n".join(f"                 {number.what}: {number.text}" for number in finding.numbers)
    parts = [("Claim", about.claim), ("Mathematics", about.mathematics), ("Experiment", about.setting)]
    lines = [_wrapped(f"{about.code}  {name}", content) for name, content in parts]
    return "\n".join([*lines, numbers, _wrapped(f"{about.code}  Verdict", finding.verdict)])


def _wrapped(name: str, content: str) -> str:
    return textwrap.fill(content, width=WIDTH, initial_indent=f"{name:<17}", subsequent_indent=" " * 17, break_on_hyphens=False)


def markdown(findings: Sequence[Finding]) -> str:
    """The page docs/truth.md."""
    parts = [PREFACE]
    for finding in findings:
        about = finding.experiment
        rows = "\n".join(f"| {number.what} | {number.text} |" for number in finding.numbers)
        parts.append(
            f"## {about.code}. “{about.claim}”\n\n{about.mathematics}\n\n*Experiment.* {about.setting}\n\n"
            f"| measured | |\n| --- | --- |\n{rows}\n\n*Verdict.* **{finding.verdict}**\n"
        )
    return "\n".join(parts)
