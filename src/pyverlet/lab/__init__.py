"""The laboratory: solves equations of motion, and measures worlds and integrators against exact solutions."""

from pyverlet.common.submodules import lazily
from pyverlet.lab.problems import Equation
from pyverlet.lab.solver import Solution, solve

__all__ = ["Equation", "Solution", "solve"]

__getattr__, __dir__ = lazily(__name__)
