"""The nearest known name, for a name that is unknown."""

from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str], *, alike: float = 0.6) -> str:
    """` (did you mean 'cage'?)`, to be put behind a name; empty if none of those that are known is near."""
    import difflib  # only for a mistake

    near = difflib.get_close_matches(name, known, n=1, cutoff=alike)
    return f" (did you mean {near[0]!r}?)" if near else ""
