"""How old a value is, and what it is made of."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from enum import Enum
from typing import Generic, TypeVar

T = TypeVar("T")
U = TypeVar("U")


class Made(Enum):
    """What a value is made of."""

    COMPUTED = "computed"
    """All of it is new: no part was used before, and no reply was kept."""
    PARTLY_CACHED = "partly cached"
    """Some parts are new, others were used before or kept."""
    CACHED = "cached"
    """No part is new."""


@dataclass(frozen=True, slots=True)
class Freshness:
    """The age of a value, and what it is made of."""

    age: timedelta
    """The time since it was sent; of a reply, since its call began."""
    made: Made
    """What it is made of."""
    is_fresh: bool
    """Whether it is no older than its slot allows."""


@dataclass(frozen=True, slots=True)
class Fresh(Generic[T]):
    """A value that knows its age."""

    value: T
    """The value."""
    freshness: Freshness
    """Its age, and what it is made of."""

    @property
    def age(self) -> timedelta:
        """Its age."""
        return self.freshness.age

    @property
    def made(self) -> Made:
        """What it is made of."""
        return self.freshness.made

    @property
    def is_fresh(self) -> bool:
        """Whether it is no older than its slot allows."""
        return self.freshness.is_fresh

    def map(self, make: Callable[[T], U]) -> "Fresh[U]":
        """Another value that is made of this one."""
        return Fresh(make(self.value), self.freshness)

    def with_(self, other: "Fresh[U]") -> "Fresh[tuple[T, U]]":
        """Both values: as old as the older one, and made of both."""
        freshness = Freshness(
            max(self.age, other.age),
            self.made if self.made is other.made else Made.PARTLY_CACHED,
            self.is_fresh and other.is_fresh,
        )
        return Fresh((self.value, other.value), freshness)


def _freshness(age: timedelta, made: str, is_fresh: bool) -> Freshness:
    return Freshness(age, Made(made), is_fresh)
