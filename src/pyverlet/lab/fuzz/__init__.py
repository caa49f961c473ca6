"""Random worlds of everything there is, each held to what is promised of all: `pyverlet check fuzz`.

A world is a program (`program`), drawn by chance (`draw`) and checked as it runs (`watch`). One that fails is made as small as
can be (`shrink`), and printed.
"""

from pyverlet.lab.fuzz.draw import random_program
from pyverlet.lab.fuzz.program import Program
from pyverlet.lab.fuzz.run import Finding, fuzz
from pyverlet.lab.fuzz.shrink import shrink
from pyverlet.lab.fuzz.watch import CHECKS, Broken, check

__all__ = ["CHECKS", "Broken", "Finding", "Program", "check", "fuzz", "random_program", "shrink"]
