"""Functions that add many particles and their links in one call, such as `pv.rope(world, (0, 5), (4, 5))`."""

from __future__ import annotations

from pyverlet.world.builders._built import Built, Sheet
from pyverlet.world.builders.fill import Filling, fill
from pyverlet.world.builders.outline import box, disc
from pyverlet.world.builders.soft_body import soft_body
from pyverlet.world.builders.threads import bridge, chain, cloth, net, rope

__all__ = ["Built", "Filling", "Sheet", "box", "bridge", "chain", "cloth", "disc", "fill", "net", "rope", "soft_body"]
