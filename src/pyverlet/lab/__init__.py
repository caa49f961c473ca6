"""The laboratory: equations of motion solved, and worlds and integrators measured against what is known on paper."""

from pyverlet.common.submodules import lazily
from pyverlet.lab.problems import Equation
from pyverlet.lab.solver import Solution, solve

__all__ = ["Equation", "Solution", "solve"]

__getattr__, __dir__ = lazily(__name__)
