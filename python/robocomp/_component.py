"""The start of a component: its worker is imported, checked and run."""

import atexit
import importlib
import inspect
import json
import logging
import os
import signal
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robocomp import _native
from robocomp._context import Context
from robocomp._errors import StartError

# The exit codes of components.
_NOT_STARTED = 3

# The arguments that ask for something else than a run or a check of the worker.
_WITHOUT_WORKER = {"--help", "-h", "--version", "-V", "--probe"}


@dataclass(frozen=True, slots=True)
class Component:
    """A component, as its generated package describes it."""

    description: str
    """The description as JSON."""
    types: Mapping[str, type]
    """The classes of the types by their names, `Module::Name`."""
    context: type[Context]
    """The class of the context."""
    worker: type
    """The base class of the worker."""
    folder: str
    """The folder of the component. Its `etc/config.toml` is the default configuration."""


def main(component: Component, worker: str | type, args: Sequence[str] | None = None) -> int:
    """Runs a component with the command line of this process until it ends, and returns the exit
    code. `worker` is its class, or where to import it from: `module:Class`."""
    arguments = list(sys.argv[1:] if args is None else args)
    class_: type = component.worker
    if not _WITHOUT_WORKER.intersection(arguments):
        try:
            class_ = _imported(worker)
        except StartError as error:
            print(f"{_name(component)}: error: {error}", file=sys.stderr)
            return _NOT_STARTED
        findings = check_worker(component, class_)
        if findings:
            for finding in findings:
                print(f"{_name(component)}: error: {finding}", file=sys.stderr)
            return _NOT_STARTED
    _log_through_runtime()
    # A program that the worker starts has another launcher, or none.
    launcher = os.environ.pop("ROBOCOMP_LAUNCHER", "")
    # The runtime takes the signal: a KeyboardInterrupt would end the worker in the middle.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    code = _native.run(
        component.description,
        dict(component.types),
        component.context,
        class_,
        component.folder,
        arguments,
        os.path.abspath(launcher) if launcher else "",
    )
    # Python waits for threads of the worker. The runtime has ended, so signals end the process
    # again.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    return code


# The components on threads of this process.
_running: list[_native.Embedded] = []


def _end_all() -> None:
    """Ends the components before the interpreter: no thread may run Python code then."""
    for running in _running:
        running.stop()
    if not _native.await_end():
        print("robocomp: a component has not ended with its process", file=sys.stderr)
    # Variables, and threads that end with the process, may still have views.
    _native.leave_networks()


atexit.register(_end_all)


def embed(component: Component, worker: type, args: Sequence[str] = ()) -> _native.Embedded:
    """Runs a component on a thread of this process, with a command line as for its program: for
    tests. It runs until `stop`, at the latest until the interpreter ends."""
    findings = check_worker(component, worker)
    if findings:
        raise StartError("; ".join(findings))
    running = _native.embed(
        component.description,
        dict(component.types),
        component.context,
        worker,
        component.folder,
        list(args),
    )
    _running[:] = [other for other in _running if not other.has_ended()]
    _running.append(running)
    return running


_NEVER_RUN = (
    inspect.iscoroutinefunction,
    inspect.isasyncgenfunction,
    inspect.isgeneratorfunction,
)


def check_worker(component: Component, worker: type) -> list[str]:
    """What the worker lacks, and functions that cannot take the arguments of their calls."""
    if not (inspect.isclass(worker) and issubclass(worker, component.worker)):
        return [f"{worker!r} is not a subclass of the generated class `Worker`"]
    findings = []
    for name, function in _functions(component.worker):
        own = inspect.getattr_static(worker, name)
        place = f"{worker.__name__}.{name}()"
        if own is function:
            if getattr(function, "_robocomp_required", False):
                findings.append(f"{place} is missing; add def {name}{_parameters(function)}")
            continue
        call = getattr(worker, name)
        if not callable(call):
            findings.append(f"{place} is not a function; the generated class has one of this name")
            continue
        if any(is_of(call) for is_of in _NEVER_RUN):
            findings.append(
                f"{_location(call)}{place} is async or a generator, which a call does not run; "
                f"write def {name}{_parameters(function)}"
            )
            continue
        try:
            own_signature = inspect.signature(call)
        except ValueError:
            continue
        count = len(inspect.signature(function).parameters)
        # Attributes of the class are bound, except for a plain function, whose first parameter is
        # `self`.
        count -= 0 if inspect.isfunction(own) else 1
        try:
            own_signature.bind(*[None] * count)
        except TypeError:
            findings.append(
                f"{_location(call)}{place} takes {own_signature}; "
                f"it is called with {_parameters(function)}"
            )
    return findings


def _functions(class_: type) -> Iterator[tuple[str, Any]]:
    """The functions of the generated class, which its user may write."""
    for name in dir(class_):
        function = inspect.getattr_static(class_, name)
        if not name.startswith("_") and inspect.isfunction(function):
            yield name, function


def _parameters(function: Any) -> str:
    # The bases of workers name the type of the context `C`.
    return str(inspect.signature(function)).replace("'C'", "'Context'")


def _location(function: Any) -> str:
    try:
        file = inspect.getsourcefile(function)
        line = inspect.getsourcelines(function)[1]
    except (OSError, TypeError):
        return ""
    if not file:
        return ""
    short = os.path.relpath(file)
    return f"{file if short.startswith('..') else short}:{line}: "


def _name(component: Component) -> str:
    return str(json.loads(component.description).get("name", "component"))


def _imported(worker: str | type) -> type:
    if not isinstance(worker, str):
        return worker
    module_name, _, class_name = worker.partition(":")
    try:
        module = importlib.import_module(module_name)
    except SyntaxError as error:
        place = f"{error.filename}:{error.lineno}:{error.offset or 1}"
        raise StartError(f"{place}: {error.msg}: {(error.text or '').strip()}") from error
    except Exception as error:
        text = "".join(traceback.format_exception(error)).rstrip()
        if isinstance(error, ModuleNotFoundError):
            text += (
                f"\n{sys.executable} runs the component; `rcgen venv FILE.cdsl` makes it an "
                "environment with the packages of its pyproject.toml"
            )
        raise StartError(f"the worker `{module_name}` cannot be imported\n{text}") from error
    try:
        found = getattr(module, class_name)
    except AttributeError:
        raise StartError(f"{module.__file__} has no class `{class_name}`") from None
    if not inspect.isclass(found):
        raise StartError(f"`{class_name}` in {module.__file__} is not a class")
    return found


class _Handler(logging.Handler):
    """Passes lines of `logging` to the log of the component."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            _native.log(record.levelno, self.format(record))
        except Exception:
            self.handleError(record)


def _log_through_runtime() -> None:
    """The option `--log` of the component sets the shown level."""
    root = logging.getLogger()
    if not any(isinstance(handler, _Handler) for handler in root.handlers):
        root.addHandler(_Handler())
    root.setLevel(logging.NOTSET)
