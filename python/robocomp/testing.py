"""Workers under test: fake peers, virtual time, no process and no middleware.

Generated packages make their `TestContext` of this. A worker has its real context, clients and
publishers; calls and samples pass the codec of the middleware, so that a value that a network
would refuse is refused here, too.
"""

import collections.abc
import sys
from datetime import timedelta
from typing import Any, Generic, TypeVar

from robocomp import _native
from robocomp._component import Component, check_worker
from robocomp._context import Context
from robocomp._errors import Emergency, Error, StartError
from robocomp._fake_link import FakeLink, Fault, Record

__all__ = ["FakeArray", "FakeLink", "FakeServer", "FakeSubscriber", "Fault", "Record", "TestContext", "in_place"]

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
        raise TypeError(f"{type(value).__name__} is no type of the package of a component")
    return _native.Codec(component.description, dict(component.types)).view(value)


class FakeServer:
    """A server of a slot: it replies as configured, keeps the calls, and fails on demand."""

    def __init__(self, link: FakeLink, slot: int, member: str | None = None) -> None:
        self._server = link.server(slot, member)

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

    def __init__(self, link: FakeLink, slot: int, member: str | None = None) -> None:
        self._topic = link.topic(slot, member)

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


class FakeArray(Generic[F]):
    """The fake peers of the members of a slot array."""

    def __init__(
        self, link: FakeLink, slot: int, make: collections.abc.Callable[[FakeLink, int, str], F]
    ) -> None:
        self._link = link
        self._slot = slot
        self._make = make
        self._fakes: dict[str, F] = {}
        self._prepare: list[collections.abc.Callable[[F], None]] = []
        link.prepare_members(slot, self.member)

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

        Raises `StartError` if it lacks a function, has one that does not fit, or opens other
        members of slot arrays than `list_members` lists.
        """
        findings = check_worker(self._component, worker)
        if findings:
            raise StartError("; ".join(findings))
        made = worker()
        made.initialize(self.ctx)  # type: ignore[attr-defined]
        self.link.complete_members()
        if "machine" in self.link._description:
            self.link.machine = _native.MachineRunner(
                self._component.description, made, self.ctx
            )
            if self.link.present_lifecycle is None:
                self.link.machine.start()
        return made

    def run(self, worker: Any, time: timedelta) -> None:
        """Runs the worker for this time, as its process does: `compute` now and after each period,
        the steps of its machine, and in the state Emergency `emergency` in place of `compute`. The
        worker of a source of time moves time itself.
        Ends when the worker stops the component, or with the exception of a function."""
        left = _nanoseconds(time)
        while left > 0 and not self.link.is_stopping():
            if self.link.present_lifecycle in (None, "active"):
                self._turn(worker)
            step = min(self.link.period_ns(), left)
            if not self.link.simulates_time:
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

    def list_members(self, array: str, members: collections.abc.Sequence[str]) -> None:
        """Lists the members of a slot array, as `slots` in a .ddsl does, before the worker opens
        them."""
        self.link.list_members(array, members)

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
