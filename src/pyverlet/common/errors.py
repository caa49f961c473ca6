"""The errors pyverlet raises on purpose. Each message is one sentence naming the argument, its value and what is allowed."""


class PyverletError(Exception):
    """Base of every error pyverlet raises on purpose."""


class InputError(PyverletError, ValueError):
    """An argument is outside what is allowed; nothing was changed."""


class IndexInputError(InputError, IndexError):
    """There is no such particle in a group."""


class KeyInputError(InputError, KeyError):
    """There is no such array in `world.data`."""

    __str__ = PyverletError.__str__


class Interrupted(PyverletError):  # noqa: N818  (like KeyboardInterrupt, it is no error)
    """A person ended long work early (Ctrl-C); the message says what is kept of it."""


class CoarseCoordinatesWarning(UserWarning):
    """Coordinates of float32 are too coarse so far from the origin; the message says up to where they are not."""


class CoarseStepsWarning(UserWarning):
    """Substeps are too long for an integrator to follow a force that depends on velocities; the message says how long may be."""


class NonFiniteError(PyverletError, ArithmeticError):
    """The state turned NaN or infinite; the world keeps the last good frame readable.

    Attributes:
        particle: index of the first particle concerned, in the order particles were added.
        stage: name of the stage after which it first showed.
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
        # An exception with a computed message does not pickle by itself; sweeps send errors between processes.
        return (PyverletError, (str(self),))


class CoreError(PyverletError, ImportError):
    """The compiled core cannot be loaded: damaged, missing, or made for another Python or processor."""
