"""Workers under test: fake peers, virtual time, no process and no middleware.

Generated packages make their `TestContext` of this. A worker has its real context, clients and
publishers; calls and samples pass the codec of the middleware, so that a value that a network
would refuse is refused here, too.
"""

import collections.abc
import sys
import weakref
from datetime import timedelta
from typing import Any, Generic, TypeVar

from robocomp import _native
from robocomp._component import Component, check_worker
from robocomp._context import Context
from robocomp._errors import Emergency, Error, StartError
from robocomp._test_link import Fault, Record, TestLink

__all__ = ["FakeArray", "FakeServer", "FakeSubscriber", "Fault", "Record", "TestContext", "TestLink", "in_place"]

C = TypeVar("C", bound=Context)
F = TypeVar("F")
W = TypeVar("W")
V = TypeVar("V")


def in_place(value: Any) -> Any:
    """A value as a handler gets it that reads in place: a view of a copy. Its class is one of the
    component's package."""
    package = type(value).__module__.partition(".")[0]
    component = getattr(sys.modules.get(package), "COMPONENT", None)
    if not isinstance(component, Component):
        raise TypeError(f"{type(value).__name__} is not a type of the package of a component")
    return _native.view_of(component.description, dict(component.types), value)


class FakeServer:
    """A server of a slot: it replies as configured, keeps the calls, and fails on demand."""

    def __init__(self, link: TestLink, slot: int, member: str | None = None) -> None:
        self._server = link.bench.server(slot, member)
        self._names = link.names(slot)

    def calls(self) -> list[Record]:
        """The calls that have reached the server, in their order: `("set_speed_base", 0.0, 0.5)`."""
        return _records(self._names, self._server.calls())

    def take_calls(self) -> list[Record]:
        """The same; forgets them."""
        return _records(self._names, self._server.take_calls())

    def fail(self, fault: Fault) -> None:
        """Lets all calls fail from now on."""
        self._server.fail(fault.value, False)

    def fail_once(self, fault: Fault) -> None:
        """Lets the next call fail."""
        self._server.fail(fault.value, True)

    def recover(self) -> None:
        """Ends the faults."""
        self._server.recover()

    def _on(self, operation: int, answer: Any) -> None:
        self._server.on(operation, answer)

    def _or_default(self, operation: int, answer: collections.abc.Callable[[], Any]) -> None:
        self._server.or_default(operation, answer)


def _records(
    names: list[str], all_: collections.abc.Iterable[tuple[int, tuple[Any, ...]]]
) -> list[Record]:
    return [Record((names[operation], *arguments)) for operation, arguments in all_]


class FakeSubscriber:
    """The subscriber of a slot, which keeps the samples."""

    def __init__(self, link: TestLink, slot: int, member: str | None = None) -> None:
        self._topic = link.bench.topic(slot, member)
        self._names = link.names(slot)

    def samples(self) -> list[Record]:
        """What was published on all topics of the slot, in its order: `("new_image", image)`."""
        return _records(self._names, self._topic.samples())

    def take_samples(self) -> list[Record]:
        """The same; forgets them."""
        return _records(self._names, self._topic.take_samples())

    def fail(self, reason: str) -> None:
        """Lets publishing fail with `NotSent`."""
        self._topic.fail(reason)

    def recover(self) -> None:
        """Ends the fault."""
        self._topic.recover()

    def set_subscribers(self, count: int) -> None:
        """Sets `subscribers` of the publisher; the default is 1."""
        self._topic.set_subscribers(count)


class FakeArray(Generic[F]):
    """The fake peers of the members of a slot array."""

    def __init__(
        self, link: TestLink, slot: int, make: collections.abc.Callable[[TestLink, int, str], F]
    ) -> None:
        self._link = link
        self._slot = slot
        self._make = make
        self._fakes: dict[str, F] = {}
        self._prepare: list[collections.abc.Callable[[F], None]] = []
        # The link must not keep this object, which keeps the link.
        own = weakref.ref(self)

        def make_fake(member: str) -> None:
            array = own()
            if array is not None:
                array.member(member)

        link.prepare_members(slot, make_fake)

    def member(self, name: str) -> F:
        """The peer of a member. A test may prepare it before the worker opens the member."""
        if name not in self._fakes:
            self._fakes[name] = self._make(self._link, self._slot, name)
            for prepare in self._prepare:
                prepare(self._fakes[name])
        return self._fakes[name]

    def each(self, prepare: collections.abc.Callable[[F], None]) -> None:
        """Does this with the peer of each member, now and when the worker opens it."""
        self._prepare.append(prepare)
        for fake in self.all():
            prepare(fake)

    def all(self) -> list[F]:
        """The peers of all members that the worker has opened, or that the test has asked for."""
        return list(self._fakes.values())


class TestContext(Generic[C, W]):
    """The peers, the clock and the state of a worker under test. The generated class adds a fake
    for each slot that calls or publishes."""

    __test__ = False

    def __init__(self, component: Component, context: type[C], params: Any = None) -> None:
        self._component = component
        self.link = TestLink(component)
        self._bench = self.link.bench
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

        Raises `StartError` if it lacks a function, has one that does not fit, or opens other
        members of slot arrays than `list_members` lists.
        """
        findings = check_worker(self._component, worker)
        if findings:
            raise StartError("; ".join(findings))
        made = worker()
        made.initialize(self.ctx)  # type: ignore[attr-defined]
        self._bench.complete_members()
        if self.link.has_machine:
            self.link.machine = _native.MachineRunner(
                self._component.description, made, self.ctx
            )
            if self.ctx.lifecycle is None:
                self.link.machine.start()
        return made

    def requested_parameters(self) -> list[tuple[str, Any]]:
        """Takes the changes of parameters that the worker has requested by `ctx.set_parameter`:
        paths and values, in their order. Nothing checks them, and `ctx.params` stays."""
        requested: list[tuple[str, Any]] = self.link.take_requested_parameters()
        return requested

    def run(self, worker: Any, time: timedelta) -> None:
        """Runs the worker for this time, as its process does: `compute` now and after each period,
        the steps of its machine, and in the state Emergency `emergency` in place of `compute`. The
        worker of a source of time moves time itself.
        Ends when the worker stops the component, or with the exception of a function."""
        left = _nanoseconds(time)
        while left > 0 and not self.ctx.is_stopping:
            if self.ctx.lifecycle in (None, "active"):
                self._turn(worker)
            left = self._bench.end_period(left)

    def _turn(self, worker: Any) -> None:
        machine = self.link.machine
        try:
            if machine is not None:
                machine.react()
            if self.ctx.is_stopping:
                return
            if self.ctx.state == "emergency":
                worker.emergency(self.ctx)
            elif machine is None:
                worker.compute(self.ctx)
            else:
                if machine.during():
                    worker.compute(self.ctx)
                machine.rest()
        except Emergency:
            self.set_state("emergency")

    def transition(self, worker: Any, transition: str) -> str:
        """Takes the worker through a transition of its life cycle, as its process does, and returns
        the state afterwards. The worker is unconfigured at first."""
        if self.ctx.lifecycle is None:
            raise Error("the component is not managed")
        if transition == "shutdown":
            # A process goes through these on its way to the end.
            for state, earlier in (("active", "deactivate"), ("inactive", "cleanup")):
                if self.ctx.lifecycle == state:
                    self.transition(worker, earlier)
        return self._bench.transition(transition, worker, self.ctx, self._start_machine)

    def _start_machine(self) -> None:
        machine = self.link.machine
        if machine and not machine.has_started:
            machine.start()

    def list_members(self, array: str, members: collections.abc.Sequence[str]) -> None:
        """Lists the members of a slot array, as `slots` in a .ddsl does, before the worker opens
        them."""
        self.link.list_members(array, members)

    @property
    def now(self) -> timedelta:
        """The time of `ctx.now()`. It begins at zero."""
        return self.ctx.now()

    def advance(self, step: timedelta) -> None:
        """Moves the time of `ctx.now()` forward."""
        self._bench.advance(_nanoseconds(step))

    def set_time(self, time: timedelta) -> None:
        """Sets the time of `ctx.now()`, possibly to an earlier one."""
        self._bench.set_time(_nanoseconds(time))

    def set_state(self, state: str) -> None:
        """Sets `ctx.state`. The default is `running`."""
        self._bench.set_state(state)


def _nanoseconds(time: timedelta) -> int:
    return (time // timedelta(microseconds=1)) * 1000
