"""Suggests the nearest known name for an unknown one."""

from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str], *, alike: float = 0.6) -> str:
    """` (did you mean 'cage'?)`, to append to a name; empty if no known name is similar."""
    import difflib  # only needed after a mistake

    near = difflib.get_close_matches(name, known, n=1, cutoff=alike)
    return f" (did you mean {near[0]!r}?)" if near else ""
