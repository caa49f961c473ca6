"""Pictures of a world, made by the library itself: without screen or driver, and byte for byte reproducible.

Loads only NumPy and the engine.
"""

from pyverlet.common.submodules import lazily
from pyverlet.picture.colour import DARK, LIGHT, ByEnergy, ByMass, ByOrigin, BySpeed, Colouring, Fixed, Groups, Theme
from pyverlet.picture.pen import Pen
from pyverlet.picture.raster import Raster
from pyverlet.picture.view import View, nearest

__all__ = [
    "DARK", "LIGHT", "ByEnergy", "ByMass", "ByOrigin", "BySpeed", "Colouring", "Fixed", "Groups", "Pen", "Raster", "Theme",
    "View", "nearest",
]  # fmt: skip

__getattr__, __dir__ = lazily(__name__)
