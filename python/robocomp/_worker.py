"""The bases of the generated workers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from robocomp._context import Context
from robocomp._errors import WorkerError

_F = TypeVar("_F", bound=Callable[..., Any])
C = TypeVar("C", bound=Context)


@dataclass(frozen=True, slots=True)
class ParamChange:
    """A parameter that changed while the component runs."""

    path: str
    """The path, as `motors[2].max`."""
    old: Any
    """The value before."""
    new: Any
    """The value now."""
    secret: bool
    """Whether the values are never shown."""


def default(function: _F) -> _F:
    """Marks a function of the generated worker that the runtime need not call."""
    function._robocomp_default = True  # type: ignore[attr-defined]
    return function


def required(function: _F) -> _F:
    """Marks a function of the generated worker that the user has to write."""
    function._robocomp_required = True  # type: ignore[attr-defined]
    return function


class Worker(Generic[C]):
    """The worker of a component with the context `C`.

    The runtime makes it without arguments and calls all functions on one thread. An exception of
    `compute` is logged and counted, and the component continues with the next period;
    `robocomp.Emergency` and `robocomp.Fatal` do what they say.
    """

    @default
    def initialize(self, ctx: C) -> None:
        """Runs once, when the clients and publishers are open."""

    @required
    def compute(self, ctx: C) -> None:
        """Runs once a period."""
        raise NotImplementedError

    @default
    def params_changed(self, ctx: C, changes: Sequence[ParamChange]) -> None:
        """Runs after parameters of the running component changed.

        `ctx.params` holds the new values. An exception rejects the request: the requester receives
        its text, and `ctx.params` gets the old values back.
        """

    @default
    def emergency(self, ctx: C) -> None:
        """Runs once a period instead of `compute`, while the component is in the state Emergency."""

    @default
    def restore(self, ctx: C) -> None:
        """Runs once when the state Emergency ends."""

    @default
    def finalize(self, ctx: C) -> None:
        """Runs once before the component ends.

        It can still send commands and publish. A query raises `robocomp.Stopping`.
        """


class ManagedWorker(Worker[C]):
    """The worker of a component that the manager of its life cycle starts and stops."""

    @default
    def configure(self, ctx: C) -> None:
        """Prepares for work: opens devices, reserves memory. The component is inactive afterwards.

        After an exception it is unconfigured as before; after `robocomp.Emergency`, `error` follows.
        The same holds for the next functions, with the state that each begins in.
        """

    @default
    def activate(self, ctx: C) -> None:
        """Begins to work. Afterwards the component is active: `compute` and the handlers run."""

    @default
    def deactivate(self, ctx: C) -> None:
        """Ends its work. It can publish a last time. The component is inactive afterwards."""

    @default
    def cleanup(self, ctx: C) -> None:
        """Releases the resources of `configure`. The component is unconfigured afterwards."""

    @default
    def shutdown(self, ctx: C) -> None:
        """Runs once before the component is finalized, in which it only waits for its end."""

    @default
    def error(self, ctx: C, transition: str, reason: str) -> None:
        """Runs after the function of `transition` has raised `robocomp.Emergency`.

        The component is unconfigured afterwards; with an exception, which is the default, it is
        finalized.
        """
        raise WorkerError(reason)
