"""The joint of a worker under test with its test: that of a process, over the fakes of the runtime."""

import enum
import json
from collections.abc import Callable, Sequence
from typing import Any

from robocomp import _native
from robocomp._classes import snake_case
from robocomp._component import Component
from robocomp._errors import Error
from robocomp._struct import equal


class Fault(enum.Enum):
    """The fault of a fake server."""

    NO_SERVER = "no server"
    """There is none: calls raise `NoServer`, and `is_connected` is false."""
    TIMEOUT = "timeout"
    """It does not reply: queries raise `Deadline`, without waiting; commands are queued."""
    SERVER_DIED = "server died"
    """It ends during the call: queries raise `ServerDied`, commands `NoServer`."""
    QUEUE_FULL = "queue full"
    """It takes no request: calls raise `QueueFull`."""


class Record(tuple[Any, ...]):
    """A call or a sample: the name of the operation in `snake_case`, then the arguments. It equals
    a tuple of the same values, arrays by their elements."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, tuple) and equal(tuple(self), tuple(other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]


class TestLink:
    """The link of a component under test. Its functions are those of a process, but for a state
    machine, whose steps the test takes."""

    __test__ = False

    def __init__(self, component: Component) -> None:
        self.bench = _native.Bench(component.description, dict(component.types))
        self._link = self.bench.link()
        self._description = json.loads(component.description)
        self.machine: Any = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._link, name)

    @property
    def has_machine(self) -> bool:
        """Whether the component has a state machine."""
        return "machine" in self._description

    def names(self, slot: int) -> list[str]:
        """The names of the operations of a slot, as records have them."""
        operations = self._description["slots"][slot]["operations"]
        return [snake_case(operation["name"]).rstrip("_") for operation in operations]

    def prepare_members(self, array: int, make: Callable[[str], object]) -> None:
        """Calls `make` with the name of each member of the array that the worker opens."""
        self.bench.prepare_members(array, make)

    def list_members(self, array: str, members: Sequence[str]) -> None:
        """Lists the members of an array, as a network does."""
        if not self.bench.list_members(array, list(members)):
            raise Error(f"{self._description['name']} has no slot array `{array}`")

    def fire(self, event: int, /) -> None:
        self._running_machine().fire(event)

    def is_in(self, state: int, /) -> bool:
        return bool(self._running_machine().is_in(state))

    def machine_has_started(self) -> bool:
        return self.machine is not None and bool(self.machine.has_started)

    def machine_has_ended(self) -> bool:
        return self.machine is not None and bool(self.machine.has_ended)

    def active_states(self) -> list[str]:
        return list(self._running_machine().active())

    def _running_machine(self) -> Any:
        if self.machine is None:
            raise Error("the state machine has not started; begin with `test.start(SpecificWorker)`")
        return self.machine
