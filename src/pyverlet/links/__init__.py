"""Links between particles: `world.links.append(pv.Stick(group, 0, 1))`. A new type is one file here, like `angle.py`."""

from __future__ import annotations

from pyverlet.links._link import Link
from pyverlet.links._set import Links
from pyverlet.links.angle import Angle
from pyverlet.links.area import Area
from pyverlet.links.pin import Pin
from pyverlet.links.rope import Rope
from pyverlet.links.spring import Spring
from pyverlet.links.stick import Stick

__all__ = ["Angle", "Area", "Link", "Links", "Pin", "Rope", "Spring", "Stick"]
