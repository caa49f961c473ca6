"""One text, and a kernel of it for each kind of world: what cannot happen in one is not compiled for it.

Registers are few: kept ready for friction, they are missing where nothing rubs, and a smooth heap took half as long again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pyverlet.compile.jit import Kernel, variant

BOUNCES = True
"""Whether some pair may bounce or rub, or the virial is asked for, or walls that bounce ask who carries weight."""

RUBS = True
"""Whether some pair may rub."""

LISTENS = True
"""Whether somebody may listen to who meets how fast."""

SMOOTH, HEARD, BOUNCING, ROUGH = "smooth", "heard", "bouncing", "rough"

KINDS = {
    SMOOTH: {"BOUNCES": False, "RUBS": False, "LISTENS": False},
    HEARD: {"BOUNCES": False, "RUBS": False, "LISTENS": True},
    BOUNCING: {"BOUNCES": True, "RUBS": False, "LISTENS": True},
    ROUGH: {"BOUNCES": True, "RUBS": True, "LISTENS": True},
}


def for_each_kind(make: Callable[..., Any], function: Callable[..., Any], **stages: dict[str, Kernel]) -> dict[str, Kernel]:
    """What `make` makes of a function for each kind; stages: what it calls, by name, of the same kind.

    To be called where a module ends: names that come after are not known to the function.
    """
    return {
        kind: make(variant(function, kind, **constants, **{name: of[kind] for name, of in stages.items()}))
        for kind, constants in KINDS.items()
    }
