"""Lists whose entries are checked, and attributes that hold one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Generic, Self, SupportsIndex, TypeVar

from pyverlet.common.errors import InputError

Thing = TypeVar("Thing")
Held = TypeVar("Held")


class CheckedList(list[Thing]):
    """What a world has several of: all that is put in is checked, and a loop over it may remove some."""

    def check_one(self, thing: Any) -> None:
        """Raise InputError if this is not allowed in the list."""

    def append(self, thing: Any) -> Any:
        """Add one; returns it. InputError if it is not allowed."""
        self.extend((thing,))
        return thing

    def extend(self, things: Iterable[Thing]) -> None:
        """Add several; InputError as `append`."""
        super().extend(self._checked(things))

    def insert(self, index: SupportsIndex, thing: Thing) -> None:
        """Add one before the one of this index; InputError as `append`."""
        super().insert(index, *self._checked((thing,)))

    def __iadd__(self, things: Iterable[Thing]) -> Self:  # type: ignore[override,misc]
        self.extend(things)
        return self

    def __setitem__(self, where: Any, value: Any) -> None:
        if isinstance(where, slice):
            super().__setitem__(where, self._checked(value))
        else:
            super().__setitem__(where, *self._checked((value,)))

    def __iter__(self) -> Iterator[Thing]:
        return iter(self[:])

    def _checked(self, things: Iterable[Any]) -> list[Any]:
        given = several(things)
        for thing in given:
            self.check_one(thing)
        return given


def several(things: Any) -> list[Any]:
    """These as a list; InputError if they cannot be one."""
    try:
        return list(things)
    except TypeError:
        raise InputError(f"what is to be in the list is {things!r}; allowed are several in a list") from None


class Contents(Generic[Held]):
    """An attribute that holds the same list for ever: assigning to it changes what is in the list, as `[:] =` does."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # it is read as any other attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Held: ...

    def __set__(self, owner: Any, value: Held) -> None:
        held: Any = vars(owner).setdefault(self._name, value)
        if held is not value:  # as it is after `+=`
            held[:] = value
