"""The base of generated structures."""

from typing import Any

import numpy


class Struct:
    """A structure of an interface: a dataclass that compares by its members, arrays by their
    elements."""

    __slots__ = ()
    __match_args__: tuple[str, ...] = ()

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            equal(getattr(self, name), getattr(other, name)) for name in self.__match_args__
        )

    # A structure can be changed, so it is not a key.
    __hash__ = None  # type: ignore[assignment]


def equal(one: Any, other: Any) -> bool:
    """Whether two values are equal, with arrays of NumPy anywhere in them."""
    if isinstance(one, numpy.ndarray) or isinstance(other, numpy.ndarray):
        return bool(numpy.array_equal(one, other))
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(equal, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(equal(one[key], other[key]) for key in one)
    return bool(one == other)
