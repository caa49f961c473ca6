"""Links between particles: `world.links.append(pv.Stick(group, 0, 1))`. A new type is one file here, such as `angle.py`."""

from __future__ import annotations

from pyverlet.laws.links._link import Link
from pyverlet.laws.links._set import Links
from pyverlet.laws.links.angle import Angle, AngleLimit, Motor
from pyverlet.laws.links.area import Area
from pyverlet.laws.links.distance import Rope, Spring, Stick
from pyverlet.laws.links.pin import Pin

__all__ = ["Angle", "AngleLimit", "Area", "Link", "Links", "Motor", "Pin", "Rope", "Spring", "Stick"]
