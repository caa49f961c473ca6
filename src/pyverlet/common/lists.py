"""Lists with checked entries, and attributes that hold one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Generic, Self, SupportsIndex, TypeVar

from pyverlet.common.errors import InputError

Thing = TypeVar("Thing")
Held = TypeVar("Held")


class CheckedList(list[Thing]):
    """A list whose entries are checked, and that may shrink during a loop over it."""

    def check_one(self, thing: Any) -> None:
        """Raise InputError if this object is not allowed in the list."""

    def append(self, thing: Any) -> Any:
        """Append an object; returns it. InputError if it is not allowed."""
        self.extend((thing,))
        return thing

    def extend(self, things: Iterable[Thing]) -> None:
        """Append several; InputError as for `append`."""
        super().extend(self._checked(things))

    def insert(self, index: SupportsIndex, thing: Thing) -> None:
        """Insert an object before this index; InputError as for `append`."""
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
    """Convert to a list; InputError if that is impossible."""
    try:
        return list(things)
    except TypeError:
        raise InputError(f"what is to be in the list is {things!r}; allowed are several in a list") from None


class Contents(Generic[Held]):
    """An attribute that always holds the same list: assignment replaces its contents, as `[:] =` does."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    if TYPE_CHECKING:  # for type checkers it is an ordinary attribute

        def __get__(self, owner: Any, kind: type | None = None) -> Held: ...

    def __set__(self, owner: Any, value: Held) -> None:
        held: Any = vars(owner).setdefault(self._name, value)
        if held is not value:  # the same after `+=`
            held[:] = value
