"""A hash of all sources that determine bits: whether a saved world continues exactly as it would have."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Final

_KINDS: Final = (".py", ".pxd", ".h")


@cache
def sources_hash() -> str:
    """The hash as 16 hex digits."""
    root = Path(__file__).resolve().parents[1]
    digest = hashlib.blake2b(digest_size=8)
    for path in (root / "common" / "constants.py", *sorted((root / "core").glob("*.*"))):
        if path.suffix in _KINDS:
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()
