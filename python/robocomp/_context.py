"""The bases of the generated clients, publishers, machines and contexts."""

import os
import random
from collections.abc import Callable, ItemsView, Iterator, Mapping, Sequence
from datetime import timedelta
from enum import Enum, IntEnum
from typing import Any, Generic, TypeVar

from robocomp._freshness import Fresh, Freshness
from robocomp._link import Link
from robocomp._native import Member

End = TypeVar("End")
S = TypeVar("S", bound=IntEnum)
E = TypeVar("E", bound=IntEnum)


class _Window:
    """The wait of a window, which the worker ends when it changes what the component does next."""

    # The window that is there sets it.
    end_of_wait: Callable[[], Callable[[], None] | None] = staticmethod(lambda: None)

    @classmethod
    def look_again(cls) -> None:
        end = cls.end_of_wait()
        if end is not None:
            end()


def _timedelta(nanoseconds: int) -> timedelta:
    return timedelta(microseconds=nanoseconds / 1000)


def _nanoseconds(time: timedelta) -> int:
    nanoseconds = (time // timedelta(microseconds=1)) * 1000
    if nanoseconds < 0:
        raise ValueError(f"{time} is negative; a time from zero on is expected")
    return nanoseconds


class Client:
    """Calls the operations of a required slot."""

    __slots__ = ("_link", "_slot")

    def __init__(self, link: Link, slot: int) -> None:
        self._link = link
        self._slot = slot

    def _query(self, operation: int, /, *arguments: Any) -> Any:
        return self._link.query(self._slot, operation, arguments)

    def _query_in_place(self, operation: int, /, *arguments: Any) -> Any:
        return self._link.query_in_place(self._slot, operation, arguments)

    def _command(self, operation: int, /, *arguments: Any) -> None:
        self._link.command(self._slot, operation, arguments)

    @property
    def is_connected(self) -> bool:
        """Whether there is a server."""
        return self._link.peers(self._slot) > 0

    @property
    def freshness(self) -> Freshness | None:
        """The age of the last reply, and whether it was kept. `None` before the first one, and for
        a slot without `fresh` or `cache`."""
        return self._link.freshness(self._slot)

    @property
    def timeout(self) -> timedelta:
        """The longest time of a call."""
        return _timedelta(self._link.timeout_ns(self._slot))

    @timeout.setter
    def timeout(self, timeout: timedelta) -> None:
        self._link.set_timeout_ns(self._slot, _nanoseconds(timeout))


class Publisher:
    """Publishes the topics of a slot."""

    __slots__ = ("_link", "_slot")

    def __init__(self, link: Link, slot: int) -> None:
        self._link = link
        self._slot = slot

    def _publish(self, operation: int, /, *arguments: Any) -> None:
        self._link.publish(self._slot, operation, arguments)

    def _loan(self, operation: int, /) -> Any:
        return self._link.loan(self._slot, operation)

    @property
    def subscribers(self) -> int:
        """The number of subscribers; where topics differ, the largest one."""
        return self._link.peers(self._slot)


class Samples:
    """The newest samples of a subscribed slot with `fresh`."""

    __slots__ = ("_link", "_slot")

    def __init__(self, link: Link, slot: int) -> None:
        self._link = link
        self._slot = slot

    def _newest(self, operation: int, /) -> Fresh[Any]:
        return self._link.newest(self._slot, operation)


class Results:
    """The results of an implemented slot with `serve latest`, which answer queries without a
    handler."""

    __slots__ = ("_link", "_slot")

    def __init__(self, link: Link, slot: int) -> None:
        self._link = link
        self._slot = slot

    def _set(self, operation: int, result: Any, /) -> None:
        self._link.set_latest(self._slot, operation, result)


class SlotArray(Generic[End]):
    """A slot array of the context. The worker opens its members in `initialize`; afterwards they
    stay as they are. `End` is the client or the publisher of a member, `None` where members
    receive."""

    __slots__ = ("_ends", "_link", "_make", "_slot")

    def __init__(self, link: Link, slot: int, make: Callable[[Link, int], End]) -> None:
        self._link = link
        self._slot = slot
        self._make = make
        self._ends: dict[Member, End] = {}

    def open(self, name: str) -> Member:
        """Opens a member. Its address is `NETWORK/INSTANCE/ARRAY/MEMBER`.

        Raises `MemberError` if the name is no name of a member or is taken, if `initialize` has
        ended, or if the middleware refuses.
        """
        member, slot = self._link.open_member(self._slot, name)
        self._ends[member] = self._make(self._link, slot)
        return member

    def open_listed(self) -> None:
        """Opens the members that the network lists."""
        for name in self.listed() or []:
            self.open(name)

    def listed(self) -> list[str] | None:
        """The members that the network lists in `slots { … }`, or the command line after
        `--members`. `None` if neither does: the component was started by hand. The runtime ends a
        component that does not open exactly these."""
        return self._link.listed(self._slot)

    def members(self) -> list[Member]:
        """The open members, in their order."""
        return list(self._ends)

    def get(self, name: str) -> Member | None:
        """A member by its name."""
        return next((member for member in self._ends if member.name == name), None)

    def items(self) -> ItemsView[Member, End]:
        """The members with their clients or publishers."""
        return self._ends.items()

    def __getitem__(self, member: Member) -> End:
        try:
            return self._ends[member]
        except KeyError:
            name = getattr(member, "name", member)
            message = f"{name!r} is not a member of this slot array; `get` finds one by its name"
            raise LookupError(message) from None

    def __iter__(self) -> Iterator[Member]:
        return iter(self._ends)

    def __len__(self) -> int:
        return len(self._ends)


class Machine(Generic[S, E]):
    """The state machine of a component. `S` and `E` are its states and events."""

    __slots__ = ("_link",)

    def __init__(self, link: Link) -> None:
        self._link = link

    def fire(self, event: E) -> None:
        """Puts an event into the queue of the machine, which handles it after the present function
        of the worker."""
        self._link.fire(int(event))
        _Window.look_again()

    def is_in(self, state: S) -> bool:
        """Whether a state is active. Then its ancestors are, too."""
        return self._link.is_in(int(state))

    @property
    def has_started(self) -> bool:
        """Whether the machine has entered its initial states."""
        return self._link.machine_has_started()

    @property
    def has_ended(self) -> bool:
        """Whether the machine has reached an end state of its own."""
        return self._link.machine_has_ended()

    def active(self) -> list[str]:
        """The names of the active states without substates, as `driving.forward`."""
        return self._link.active_states()


class Order(Enum):
    """The order in which followers do a tick that the source of time waits for."""

    IN_TURN = "in turn"
    """One after the other, as the network lists them, then by name. A run repeats exactly."""
    AT_ONCE = "at once"
    """All at the same time. Messages between them may arrive in this tick or in the next one."""


class TimeSource:
    """Advances the time of the network: `ctx.time` of a component whose `.cdsl` has
    `simulates time;`. Time advances when the present function of the worker returns."""

    __slots__ = ("_link",)

    def __init__(self, link: Link) -> None:
        self._link = link

    @property
    def is_active(self) -> bool:
        """Whether the network takes its time from this component. Otherwise `advance` and `set`
        raise `TimeError`, and nothing else here has an effect."""
        return self._link.is_time_source()

    def advance(self, step: timedelta) -> int:
        """Moves time forward. Returns the number of the tick, from 1. Raises `TimeError` while the
        source waits for the tick before and `missing()` is empty."""
        tick = self._link.advance_time(_nanoseconds(step))
        _Window.look_again()
        return tick

    def set(self, time: timedelta) -> int:
        """Sets time, possibly to an earlier one: followers begin their periods again and report the
        jump. Otherwise as `advance`."""
        tick = self._link.set_time(_nanoseconds(time))
        _Window.look_again()
        return tick

    def wait_for_all(self, limit: timedelta) -> None:
        """From the next tick on, `compute` runs when every follower has done what was due in it, or
        when none has for `limit`, to within 50 ms; then `missing()` names who is missing. A
        `compute` that does not advance goes on waiting."""
        self._link.wait_for_followers(_nanoseconds(limit))

    def wait_for_nobody(self) -> None:
        """From the next tick on, `compute` runs with its period and waits for no follower."""
        self._link.wait_for_followers(None)

    def set_order(self, order: Order) -> None:
        """Sets the order in which followers do a tick that this component waits for."""
        self._link.set_time_order(order is Order.IN_TURN)

    def set_paced(self, paced: bool) -> None:
        """Whether `compute` comes with its period, in real time (the default), or as soon as all
        have done the tick. Without `wait_for_all` it always comes with its period."""
        self._link.set_time_paced(paced)

    @property
    def tick(self) -> int:
        """The number of the last tick."""
        return self._link.tick()

    def missing(self) -> list[str]:
        """Followers that have not done the last tick within its limit. If followers run in turn,
        the one whose turn it is."""
        return self._link.missing_followers()

    def followers(self) -> list[str]:
        """The components that follow."""
        return self._link.followers()

    def release(self, name: str) -> bool:
        """Waits no more for a follower, until it acknowledges again. Returns whether there was one
        of this name."""
        is_known = self._link.release_follower(name)
        _Window.look_again()
        return is_known


class Context:
    """The running component, as its worker sees it. It works on the thread of the worker only,
    while one of its functions runs."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._random: random.Random | None = None

    # The subscribed slots of a world, and whether each is that of streams.
    _world_slots: Sequence[tuple[int, bool]] = ()

    def _set_parameters(self, values: Mapping[str, Any]) -> None:
        """Takes the values of a configuration that was checked."""

    def _refusal(self) -> str | None:
        """Why a change of the parameters, which were taken, cannot be. It is said once."""
        return None

    @property
    def name(self) -> str:
        """The name of this component in its network."""
        return self._link.name()

    @property
    def network(self) -> str:
        """The name of the network."""
        return self._link.network()

    def now(self) -> timedelta:
        """The time of the network's clock since its zero, in whole microseconds: for the clock of
        the system that is 1970-01-01. Simulated time stands while a function of the worker runs."""
        return timedelta(microseconds=self._link.now_ns() // 1000)

    def now_ns(self) -> int:
        """The same time in nanoseconds."""
        return self._link.now_ns()

    @property
    def period(self) -> timedelta:
        """The period of `compute`. A new one holds from its next run on; at least 100 µs."""
        return _timedelta(self._link.period_ns())

    @period.setter
    def period(self, period: timedelta) -> None:
        self._link.set_period_ns(_nanoseconds(period))
        _Window.look_again()

    @property
    def state(self) -> str:
        """The state of this component: `starting`, `running`, `emergency` or `stopping`."""
        return self._link.state()

    def set_parameter(self, path: str, value: Any) -> None:
        """Requests a change of a parameter of this component, by its path: `range`,
        `motors[2].max`. The rest is that of `rcdeploy params set`: the value is checked,
        `params_changed` accepts or refuses it, and then `ctx.params` and all tools have the new
        value. This is done before the next `compute`, in lockstep in the same tick; a change of
        several components that is under way delays it. The log and the last error of the component
        have a refusal. At most 64 changes wait."""
        plain = os.fspath(value) if isinstance(value, os.PathLike) else value
        self._link.set_parameter(path, plain)
        _Window.look_again()

    @property
    def lifecycle(self) -> str | None:
        """The state of the life cycle; `None` for a component that is not managed."""
        return self._link.lifecycle()

    @property
    def is_stopping(self) -> bool:
        """Whether the component is to end. Long work should look at it."""
        return self._link.is_stopping()

    def stop(self, reason: str) -> None:
        """Ends this component in order: the present function returns, then `finalize` runs."""
        self._link.stop(reason)

    @property
    def random(self) -> random.Random:
        """Random numbers for the worker. An exact recording keeps their seed; in simulated time
        every run of the network has the same ones."""
        if self._random is None:
            self._random = random.Random(self._link.seed())
        return self._random
