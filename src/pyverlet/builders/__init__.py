"""Many particles and their links in one call: `pv.rope(world, (0, 5), (4, 5))`. Each returns its group and its links."""

from __future__ import annotations

from pyverlet.builders._built import Built, Sheet
from pyverlet.builders.bridge import bridge
from pyverlet.builders.chain import chain
from pyverlet.builders.cloth import cloth
from pyverlet.builders.net import net
from pyverlet.builders.outline import box, disc
from pyverlet.builders.rope import rope
from pyverlet.builders.soft_body import soft_body

__all__ = ["Built", "Sheet", "box", "bridge", "chain", "cloth", "disc", "net", "rope", "soft_body"]
