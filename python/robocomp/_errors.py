"""The exceptions of calls, of publishing and of workers."""

from datetime import timedelta


class Error(Exception):
    """The base of all exceptions of this package."""


class CallError(Error):
    """A call failed, or a command was not queued at a server."""


class NoServer(CallError):
    """No server of the address is alive."""


class Deadline(CallError):
    """The reply did not arrive in time."""


class ServerDied(CallError):
    """The server ended before it replied."""


class QueueFull(CallError):
    """The server has not taken enough of the earlier requests."""


class Refused(CallError):
    """The server refused the request."""


class Unavailable(CallError):
    """The server does not serve the operation in its present state."""

    state: str = ""
    """The active states of the server, or the state of its life cycle."""


class NoValue(CallError):
    """No sample of the topic has come yet."""


class Stale(CallError):
    """The value is older than its slot allows, which has `stale refuse`."""

    age: timedelta = timedelta(0)
    """Its age."""


class Stopping(CallError):
    """This component is stopping: it makes no more calls, and can still send commands."""


class InvalidArgument(CallError, TypeError, ValueError):
    """An argument does not fit its type or its range. The message names the field."""


class MalformedReply(CallError):
    """The reply cannot be decoded."""


class MiddlewareError(CallError):
    """The middleware failed."""


class SendError(Error):
    """A sample was not published."""


class InvalidSample(SendError, TypeError, ValueError):
    """The sample does not fit its type or its range. The message names the field."""


class NotSent(SendError):
    """The middleware failed."""


class MemberError(Error):
    """A member of a slot array was not opened."""


class TimeError(Error):
    """The time of the network did not advance."""

    tick: int = 0
    """The tick that is not done yet; 0 if the network has another clock."""

    waiting_for: tuple[str, ...] = ()
    """The followers that have not done it."""


class ConversionError(Error, ValueError):
    """A value does not become one of another data prototype."""

    code: str = "no-conversion"
    """The finding, as `rcgen convert` reports it; `bad-value` for a value that is refused."""

    index: int | None = None
    """Which of several values is refused."""


class RemoteError(Error):
    """The base of the exceptions that interfaces declare."""

    def __str__(self) -> str:
        members: tuple[str, ...] = getattr(self, "__match_args__", ())
        return ", ".join(f"{name}={getattr(self, name)!r}" for name in members)


class WorkerError(Error):
    """The runtime logs and counts the failure of a worker's function; the component runs on.

    Its subclasses do more. A handler that raises one refuses its request.
    """


class Emergency(WorkerError):
    """The component enters the state Emergency, in which `emergency` runs in place of `compute`.
    Raised by a handler, or in `emergency`, `restore` or `finalize`, it is a `WorkerError`."""


class Fatal(WorkerError):
    """The component ends with exit code 3, whichever function of the worker raises it."""


class StartError(Error):
    """The component does not start."""


class WrongThread(Error, RuntimeError):
    """The context was used on another thread, or outside of the worker's functions."""
