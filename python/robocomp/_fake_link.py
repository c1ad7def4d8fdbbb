"""The joint of a worker under test with its test, in place of the runtime."""

import enum
import json
from collections.abc import Callable, Sequence
from typing import Any

from robocomp import _native
from robocomp._component import Component
from robocomp._errors import (
    Deadline,
    Error,
    NoServer,
    NotSent,
    QueueFull,
    Refused,
    RemoteError,
    ServerDied,
    Stopping,
)
from robocomp._native import Member
from robocomp._struct import equal


class Fault(enum.Enum):
    """What is wrong with a fake server."""

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


class _Server:
    """What a fake server knows."""

    def __init__(self) -> None:
        self.answers: dict[int, Any] = {}
        self.calls: list[Record] = []
        self.fault: Fault | None = None
        self.next_fault: Fault | None = None


class _Topic:
    """What a fake subscriber knows."""

    def __init__(self) -> None:
        self.samples: list[Record] = []
        self.reason: str | None = None
        self.subscribers = 1


class FakeLink:
    """The joint of a component with a test in place of its runtime."""

    def __init__(self, component: Component) -> None:
        self._description = json.loads(component.description)
        self._types = component.types
        self._slots: list[dict[str, Any]] = self._description["slots"]
        self._codec = _native.Codec(component.description, dict(component.types))
        # By the number of the slot in the description, and the name of a member of an array.
        self._servers: dict[tuple[int, str | None], _Server] = {}
        self._topics: dict[tuple[int, str | None], _Topic] = {}
        # The array and the name of each open member, by the number of its slot.
        self._members: dict[int, tuple[int, str]] = {}
        self._prepared: dict[int, Callable[[str], object]] = {}
        self._timeouts: dict[int, int] = {}
        self._period = int(self._description["period_ns"])
        self.now = 0
        self._tick = 0
        self.present_state = "running"
        self.present_lifecycle = "unconfigured" if self._description["managed"] else None
        self.gate_is_open = not self._description["managed"]
        self.stop_reason: str | None = None
        self.machine: Any = None

    def server(self, slot: int, member: str | None = None) -> _Server:
        """The fake server of a slot, or of a member of this array."""
        return self._servers.setdefault((slot, member), _Server())

    def topic(self, slot: int, member: str | None = None) -> _Topic:
        """The fake subscriber of a slot, or of a member of this array."""
        return self._topics.setdefault((slot, member), _Topic())

    def prepare_members(self, array: int, make: Callable[[str], object]) -> None:
        """Calls `make` with the name of each member of the array that the worker opens."""
        self._prepared[array] = make

    def list_members(self, array: str, members: Sequence[str]) -> None:
        """Lists the members of an array, as a network does."""
        if not self._codec.list_members(array, members):
            raise Error(f"{self.name()} has no slot array `{array}`")

    def complete_members(self) -> None:
        """Ends the opening of members."""
        self._codec.complete_members()

    def _place(self, slot: int) -> tuple[int, str | None]:
        """The number of a slot in the description, and the name of a member of an array."""
        return self._members.get(slot, (slot, None))

    def operation(self, slot: int, operation: int) -> dict[str, Any]:
        """The description of an operation."""
        slot, _ = self._place(slot)
        module, _, name = self._slots[slot]["type_name"].partition("::")
        modules = self._description["types"]
        interfaces = next(m["interfaces"] for m in modules if m["module"] == module)
        found = next(i for i in interfaces if i["name"] == name)
        described: dict[str, Any] = found["operations"][operation]
        return described

    def address(self, slot: int) -> str:
        """The address that messages name."""
        described, member = self._place(slot)
        name = self._slots[described]["name"]
        return f"`test/{name}`" if member is None else f"`test/{self.name()}/{name}/{member}`"

    # The functions of `robocomp.Link`.

    def query(self, slot: int, operation: int, arguments: tuple[Any, ...], /) -> Any:
        server = self.server(*self._place(slot))
        address = self.address(slot)
        if self.stop_reason is not None and self.present_state == "stopping":
            raise Stopping("the component is stopping")
        arguments = self._request(slot, operation, arguments)
        fault = self._fault(server)
        if fault is Fault.NO_SERVER:
            raise NoServer(f"no server at {address}")
        if fault is Fault.QUEUE_FULL:
            raise QueueFull(f"the queue of the server at {address} is full")
        server.calls.append(self._record(slot, operation, arguments))
        if fault is Fault.TIMEOUT:
            raise Deadline(f"no reply from {address} within {self.timeout_ns(slot) / 1e9} s")
        if fault is Fault.SERVER_DIED:
            raise ServerDied(f"the server at {address} died while it held the call")
        described = self.operation(slot, operation)
        has_result = bool(described.get("outputs")) or "result" in described
        if operation not in server.answers:
            if has_result:
                name = self._snake(described["name"])
                raise Refused(f"the test has no answer; set one with `on_{name}`")
            return None
        answer = server.answers[operation]
        try:
            value = answer(*arguments) if callable(answer) else answer
        except RemoteError as error:
            # An exception of another operation is a fault of the test.
            module_and_name = [path for path, _ in described.get("throws", [])]
            if not any(type(error) is self._types.get(path) for path in module_and_name):
                raise TypeError(f"`{described['name']}` does not throw {type(error).__name__}") from error
            raise
        reply = self._codec.reply(slot, operation, value)
        return self._codec.decode_reply(slot, operation, reply) if has_result else None

    def query_in_place(self, slot: int, operation: int, arguments: tuple[Any, ...], /) -> Any:
        return self._codec.view(self.query(slot, operation, arguments))

    def command(self, slot: int, operation: int, arguments: tuple[Any, ...], /) -> None:
        server = self.server(*self._place(slot))
        address = self.address(slot)
        arguments = self._request(slot, operation, arguments)
        fault = self._fault(server)
        if fault in (Fault.NO_SERVER, Fault.SERVER_DIED):
            raise NoServer(f"no server at {address}")
        if fault is Fault.QUEUE_FULL:
            raise QueueFull(f"the queue of the server at {address} is full")
        server.calls.append(self._record(slot, operation, arguments))
        answer = server.answers.get(operation)
        if answer is not None:
            answer(*arguments)

    def publish(self, slot: int, operation: int, arguments: tuple[Any, ...], /) -> None:
        topic = self.topic(*self._place(slot))
        arguments = self._request(slot, operation, arguments)
        if topic.reason is not None:
            raise NotSent(topic.reason)
        if self.gate_is_open:
            topic.samples.append(self._record(slot, operation, arguments))

    def loan(self, slot: int, operation: int, /) -> Any:
        def send(arguments: tuple[Any, ...]) -> None:
            self.publish(slot, operation, arguments)

        return self._codec.loan(slot, operation, send)

    def open_member(self, array: int, name: str, /) -> tuple[Member, int]:
        member, slot = self._codec.open_member(array, name)
        self._members[slot] = (array, name)
        if array in self._prepared:
            self._prepared[array](name)
        return member, slot

    def listed(self, array: int, /) -> list[str] | None:
        return self._codec.listed(array)

    def peers(self, slot: int, /) -> int:
        described, member = self._place(slot)
        if self._slots[described]["role"] == "publishes":
            return self.topic(described, member).subscribers
        return int(self.server(described, member).fault is not Fault.NO_SERVER)

    def timeout_ns(self, slot: int, /) -> int:
        described, _ = self._place(slot)
        given = self._slots[described]["qos"].get("timeout_ns", 1_000_000_000)
        return self._timeouts.get(slot, int(given))

    def set_timeout_ns(self, slot: int, timeout: int, /) -> None:
        self._timeouts[slot] = timeout

    def name(self) -> str:
        return str(self._description["name"])

    def network(self) -> str:
        return "test"

    def now_ns(self) -> int:
        return self.now

    def period_ns(self) -> int:
        return self._period

    def set_period_ns(self, period: int, /) -> None:
        self._period = max(period, 100_000)

    def state(self) -> str:
        return self.present_state

    def lifecycle(self) -> str | None:
        return self.present_lifecycle

    def is_stopping(self) -> bool:
        return self.stop_reason is not None

    def stop(self, reason: str, /) -> None:
        self.stop_reason = reason

    def seed(self) -> int:
        return 0

    # A source of time under test has no followers.

    @property
    def simulates_time(self) -> bool:
        """Whether the worker advances time itself."""
        return bool(self._description.get("simulates_time"))

    def is_time_source(self) -> bool:
        return self.simulates_time

    def advance_time(self, step: int, /) -> int:
        return self.set_time(self.now + step)

    def set_time(self, time: int, /) -> int:
        self.now = time
        self._tick += 1
        return self._tick

    def wait_for_followers(self, limit: int | None, /) -> None:
        pass

    def set_time_order(self, in_turn: bool, /) -> None:
        pass

    def set_time_paced(self, paced: bool, /) -> None:
        pass

    def tick(self) -> int:
        return self._tick

    def missing_followers(self) -> list[str]:
        return []

    def followers(self) -> list[str]:
        return []

    def release_follower(self, name: str, /) -> bool:
        return False

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

    def _request(self, slot: int, operation: int, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
        """The arguments as they arrive."""
        request = self._codec.request(slot, operation, arguments)
        return tuple(self._codec.decode_request(slot, operation, request))

    def _record(self, slot: int, operation: int, arguments: tuple[Any, ...]) -> Record:
        return Record((self._snake(self.operation(slot, operation)["name"]), *arguments))

    @staticmethod
    def _fault(server: _Server) -> Fault | None:
        fault = server.next_fault or server.fault
        server.next_fault = None
        return fault

    @staticmethod
    def _snake(name: str) -> str:
        """`getLaserData` as `get_laser_data`, `GetURL` as `get_url`."""
        words: list[str] = []
        for at, char in enumerate(name):
            before = name[at - 1] if at else "_"
            after = name[at + 1] if at + 1 < len(name) else "_"
            starts = char.isupper() and (
                before.islower() or before.isdigit() or (before.isupper() and after.islower())
            )
            words.append(f"_{char}" if starts and at and before != "_" else char)
        return "".join(words).lower().strip("_")
