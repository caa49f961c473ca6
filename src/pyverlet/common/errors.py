"""The exceptions of pyverlet. Each message is one sentence with the argument, its value and what is allowed."""


class PyverletError(Exception):
    """Base class of pyverlet's exceptions."""


class InputError(PyverletError, ValueError):
    """An argument is outside what is allowed; nothing was changed."""


class IndexInputError(InputError, IndexError):
    """A group has no such particle."""


class KeyInputError(InputError, KeyError):
    """`world.data` has no such array."""

    __str__ = PyverletError.__str__


class Interrupted(PyverletError):  # noqa: N818  (like KeyboardInterrupt, it is no error)
    """Long work was ended early (Ctrl-C); the message says what is kept of it."""


class CoarseCoordinatesWarning(UserWarning):
    """Coordinates of float32 are too coarse so far from the origin; the message has the limit."""


class CoarseStepsWarning(UserWarning):
    """Substeps are too long for an integrator with a force that depends on velocity; the message has the limit."""


class NonFiniteError(PyverletError, ArithmeticError):
    """The state turned NaN or infinite; the world keeps the last good frame.

    Attributes:
        particle: index of the first particle concerned, in the order particles were added.
        stage: stage after which it was first found.
    """

    def __init__(self, particle: int, stage: str, time: float, message: str | None = None) -> None:
        self.particle = particle
        self.stage = stage
        super().__init__(
            message
            or f"particle {particle} turned non-finite in stage '{stage}' at time {time:.6g} s; "
            "the world holds the last good frame (use more substeps, a smaller dt or weaker forces)"
        )

    def __reduce__(self) -> tuple[type[PyverletError], tuple[str]]:
        # Exceptions with a computed message need this to pickle; sweeps send errors between processes.
        return (PyverletError, (str(self),))


class CoreError(PyverletError, ImportError):
    """The compiled core cannot be loaded: damaged, missing, or made for another Python or processor."""
