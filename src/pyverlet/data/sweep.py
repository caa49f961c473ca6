"""."""


def sweep():
    """."""
