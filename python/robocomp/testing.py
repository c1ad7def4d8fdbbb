"""Workers under test: fake peers, virtual time, no process and no middleware.

Generated packages make their `TestContext` of this. A worker has its real context, clients and
publishers; calls and samples pass the codec of the middleware, so that a value that a network
would refuse is refused here, too.
"""

import collections.abc
import enum
import json
import sys
from datetime import timedelta
from typing import Any, Generic, TypeVar

from robocomp import _native
from robocomp._component import Component, check_worker
from robocomp._context import Context
from robocomp._errors import (
    Deadline,
    Emergency,
    Error,
    NoServer,
    NotSent,
    QueueFull,
    Refused,
    RemoteError,
    ServerDied,
    StartError,
    Stopping,
)
from robocomp._struct import equal

__all__ = ["FakeLink", "FakeServer", "FakeSubscriber", "Fault", "Record", "TestContext", "in_place"]

C = TypeVar("C", bound=Context)
W = TypeVar("W")
V = TypeVar("V")


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


def in_place(value: Any) -> Any:
    """A value as a handler gets it that reads in place: a view of a copy. Its class is one of the
    component's package."""
    package = type(value).__module__.partition(".")[0]
    component = getattr(sys.modules.get(package), "COMPONENT", None)
    if not isinstance(component, Component):
        raise TypeError(f"{type(value).__name__} is no type of the package of a component")
    return _native.Codec(component.description, dict(component.types)).view(value)


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
        self._servers: dict[int, _Server] = {}
        self._topics: dict[int, _Topic] = {}
        self._timeouts: dict[int, int] = {}
        self._period = int(self._description["period_ns"])
        self.now = 0
        self.present_state = "running"
        self.present_lifecycle = "unconfigured" if self._description["managed"] else None
        self.gate_is_open = not self._description["managed"]
        self.stop_reason: str | None = None
        self.machine: Any = None

    def server(self, slot: int) -> _Server:
        """The fake server of a slot."""
        return self._servers.setdefault(slot, _Server())

    def topic(self, slot: int) -> _Topic:
        """The fake subscriber of a slot."""
        return self._topics.setdefault(slot, _Topic())

    def operation(self, slot: int, operation: int) -> dict[str, Any]:
        """The description of an operation."""
        module, _, name = self._slots[slot]["type_name"].partition("::")
        modules = self._description["types"]
        interfaces = next(m["interfaces"] for m in modules if m["module"] == module)
        found = next(i for i in interfaces if i["name"] == name)
        described: dict[str, Any] = found["operations"][operation]
        return described

    def address(self, slot: int) -> str:
        """The address that messages name."""
        return f"`test/{self._slots[slot]['name']}`"

    # The functions of `robocomp.Link`.

    def query(self, slot: int, operation: int, arguments: tuple[Any, ...], /) -> Any:
        server = self.server(slot)
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
        server = self.server(slot)
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
        topic = self.topic(slot)
        arguments = self._request(slot, operation, arguments)
        if topic.reason is not None:
            raise NotSent(topic.reason)
        if self.gate_is_open:
            topic.samples.append(self._record(slot, operation, arguments))

    def loan(self, slot: int, operation: int, /) -> Any:
        def send(arguments: tuple[Any, ...]) -> None:
            self.publish(slot, operation, arguments)

        return self._codec.loan(slot, operation, send)

    def peers(self, slot: int, /) -> int:
        if self._slots[slot]["role"] == "publishes":
            return self.topic(slot).subscribers
        return int(self.server(slot).fault is not Fault.NO_SERVER)

    def timeout_ns(self, slot: int, /) -> int:
        given = self._slots[slot]["qos"].get("timeout_ns", 1_000_000_000)
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


class FakeServer:
    """A server of a slot: it replies as configured, keeps the calls, and fails on demand."""

    def __init__(self, link: FakeLink, slot: int) -> None:
        self._server = link.server(slot)

    def calls(self) -> list[Record]:
        """The calls that have reached the server, in their order: `("set_speed_base", 0.0, 0.5)`."""
        return list(self._server.calls)

    def take_calls(self) -> list[Record]:
        """The same; forgets them."""
        calls, self._server.calls = self._server.calls, []
        return calls

    def fail(self, fault: Fault) -> None:
        """Lets all calls fail from now on."""
        self._server.fault = fault

    def fail_once(self, fault: Fault) -> None:
        """Lets the next call fail."""
        self._server.next_fault = fault

    def recover(self) -> None:
        """Ends the faults."""
        self._server.fault = self._server.next_fault = None

    def _on(self, operation: int, answer: Any) -> None:
        self._server.answers[operation] = answer

    def _or_default(self, operation: int, answer: collections.abc.Callable[[], Any]) -> None:
        self._server.answers.setdefault(operation, lambda *_: answer())


class FakeSubscriber:
    """The subscriber of a slot, which keeps the samples."""

    def __init__(self, link: FakeLink, slot: int) -> None:
        self._topic = link.topic(slot)

    def samples(self) -> list[Record]:
        """What was published on all topics of the slot, in its order: `("new_image", image)`."""
        return list(self._topic.samples)

    def take_samples(self) -> list[Record]:
        """The same; forgets them."""
        samples, self._topic.samples = self._topic.samples, []
        return samples

    def fail(self, reason: str) -> None:
        """Lets publishing fail with `NotSent`."""
        self._topic.reason = reason

    def recover(self) -> None:
        """Ends the fault."""
        self._topic.reason = None

    def set_subscribers(self, count: int) -> None:
        """Sets what `subscribers` of the publisher is; otherwise 1."""
        self._topic.subscribers = count


# The transitions of a life cycle: from which state to which other one.
_TRANSITIONS = {
    "configure": ("unconfigured", "inactive"),
    "activate": ("inactive", "active"),
    "deactivate": ("active", "inactive"),
    "cleanup": ("inactive", "unconfigured"),
}


class TestContext(Generic[C, W]):
    """The peers, the clock and the state of a worker under test. The generated class adds a fake
    for each slot that calls or publishes."""

    __test__ = False

    def __init__(self, component: Component, context: type[C], params: Any = None) -> None:
        self._component = component
        self.link = FakeLink(component)
        self.ctx: C = context(self.link)
        if params is None:
            values, period = _native.configuration(component.description, component.folder, None)
            self.ctx._set_parameters(values)
            if period is not None:
                self.link.set_period_ns(period)
        else:
            self.ctx.params = params  # type: ignore[attr-defined]

    def start(self, worker: type[V]) -> V:
        """Makes the worker, runs `initialize`, and starts its state machine.

        Raises `StartError` if it lacks a function, or has one that does not fit.
        """
        findings = check_worker(self._component, worker)
        if findings:
            raise StartError("; ".join(findings))
        made = worker()
        made.initialize(self.ctx)  # type: ignore[attr-defined]
        if "machine" in self.link._description:
            self.link.machine = _native.MachineRunner(
                self._component.description, made, self.ctx
            )
            if self.link.present_lifecycle is None:
                self.link.machine.start()
        return made

    def run(self, worker: Any, time: timedelta) -> None:
        """Runs the worker for this time, as its process does: `compute` now and after each period,
        the steps of its machine, and in the state Emergency `emergency` in place of `compute`.
        Ends when the worker stops the component, or with the exception of a function."""
        left = _nanoseconds(time)
        while left > 0 and not self.link.is_stopping():
            if self.link.present_lifecycle in (None, "active"):
                self._turn(worker)
            step = min(self.link.period_ns(), left)
            self.link.now += step
            left -= step

    def _turn(self, worker: Any) -> None:
        machine = self.link.machine
        try:
            if machine is not None:
                machine.react()
            if self.link.is_stopping():
                return
            if self.link.present_state == "emergency":
                worker.emergency(self.ctx)
            elif machine is None:
                worker.compute(self.ctx)
            else:
                if machine.during():
                    worker.compute(self.ctx)
                machine.rest()
        except Emergency:
            self.link.present_state = "emergency"

    def transition(self, worker: Any, transition: str) -> str:
        """Takes the worker through a transition of its life cycle, as its process does, and returns
        the state afterwards. The worker is unconfigured at first."""
        link = self.link
        if link.present_lifecycle is None:
            raise Error("the component is not managed")
        if transition == "shutdown":
            for earlier in ("deactivate", "cleanup"):
                if _TRANSITIONS[earlier][0] == link.present_lifecycle:
                    self.transition(worker, earlier)
            before, after = link.present_lifecycle, "finalized"
        elif transition in _TRANSITIONS:
            before, after = _TRANSITIONS[transition]
        else:
            raise Error(f"there is no transition `{transition}`")
        if link.present_lifecycle != before or before == "finalized":
            raise Error(f"`{transition}` is not possible in the state `{link.present_lifecycle}`")
        link.gate_is_open = transition in ("activate", "deactivate")
        try:
            getattr(worker, transition)(self.ctx)
            if transition == "activate" and link.machine and not link.machine.has_started:
                link.machine.start()
        except Emergency as emergency:
            after = self._error(worker, transition, emergency)
        except Exception:
            link.gate_is_open = before == "active"
            raise
        link.present_lifecycle = after
        link.gate_is_open = after == "active"
        return after

    def _error(self, worker: Any, transition: str, emergency: Emergency) -> str:
        try:
            worker.error(self.ctx, transition, str(emergency))
        except Exception:  # noqa: BLE001, whatever it raises, the error stays
            return "finalized"
        return "unconfigured"

    @property
    def now(self) -> timedelta:
        """The time of `ctx.now()`. It begins at zero."""
        return timedelta(microseconds=self.link.now // 1000)

    def advance(self, step: timedelta) -> None:
        """Moves the time of `ctx.now()` forward."""
        self.link.now += _nanoseconds(step)

    def set_time(self, time: timedelta) -> None:
        """Sets the time of `ctx.now()`, possibly to an earlier one."""
        self.link.now = _nanoseconds(time)

    def set_state(self, state: str) -> None:
        """Sets what `ctx.state` is. It is `running` otherwise."""
        self.link.present_state = state


def _nanoseconds(time: timedelta) -> int:
    return (time // timedelta(microseconds=1)) * 1000
