"""A running network without a component, for notebooks and scripts."""

import atexit
import inspect
import json
import os
import weakref
from collections.abc import Iterator, Mapping, MutableMapping
from datetime import timedelta
from typing import Any

from robocomp import _native
from robocomp._classes import Known, classes, snake_case
from robocomp._signatures import documentation
from robocomp._signatures import signature as operation_signature


class Slot:
    """A slot that a component implements: its operations are functions."""

    def __init__(self, network: "Network", name: str, operations: dict[str, "_Described"]) -> None:
        self._network = network
        self._name = name
        self._operations = operations
        self._functions: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        # `copy` and `pickle` ask an instance that has no attributes yet.
        if name in ("_functions", "_operations"):
            raise AttributeError(name)
        if name in self._functions:
            return self._functions[name]
        for operation, described in self._operations.items():
            if name in (operation, _native.name_of("method", operation)):
                return self._functions.setdefault(name, self._function(operation, described))
        names = ", ".join(self.__dir__())
        raise AttributeError(f"{self._name} has no operation `{name}`; there are {names}")

    def __dir__(self) -> list[str]:
        return [_native.name_of("method", operation) for operation in self._operations]

    def __repr__(self) -> str:
        return f"<slot {self._name}: {', '.join(self.__dir__())}>"

    def _function(self, operation: str, described: "_Described") -> Any:
        whole = f"{self._name}.{operation}"
        signature = described.signature()

        def call(*arguments: Any, **named: Any) -> Any:
            values = _arguments(whole, signature, arguments, named)
            return self._network._call(whole, values)

        call.__name__ = _native.name_of("method", operation)
        call.__qualname__ = f"{self._name}.{call.__name__}"
        call.__module__ = f"network {self._network.name}"
        call.__doc__ = documentation(whole, described.operation)
        call.__signature__ = signature  # type: ignore[attr-defined]
        return call


class _Described:
    """An operation with the types of its component."""

    def __init__(self, operation: Mapping[str, Any], interface: str, types: dict[str, type]) -> None:
        self.operation = operation
        self._interface = interface
        self._types = types

    def signature(self) -> inspect.Signature:
        """Made where it is needed: a network may have thousands of operations."""
        answer = self._types.get(f"{self._interface}.{self.operation['name']}")
        return operation_signature(self.operation, self._types, answer)


def _arguments(
    whole: str, signature: inspect.Signature, arguments: tuple[Any, ...], named: Mapping[str, Any]
) -> tuple[Any, ...]:
    try:
        return signature.bind(*arguments, **named).args
    except TypeError as error:
        raise TypeError(f"{whole}{signature}: {error}") from None


class Parameters(MutableMapping[str, Any]):
    """The parameters of a running component by their paths, as `motors[2].max`. A value that is
    assigned is checked as one of the configuration; `update` changes several, all or none. Those
    that are not editable take effect at the next start of the component, if it allows that.
    A duration is a text, as `500ms`; a `timedelta` may be assigned. Secret values are `***`."""

    def __init__(self, network: "Network", component: str) -> None:
        self._network = network
        self._component = component

    def _all(self) -> dict[str, dict[str, Any]]:
        text = self._network._native.parameters(self._component)
        return {one["path"]: one for one in json.loads(text)["parameters"]}

    def __getitem__(self, path: str) -> Any:
        found = self._all()
        if path not in found:
            raise KeyError(f"{self._component} has no parameter `{path}`; there are {', '.join(found)}")
        return found[path]["value"]

    def __setitem__(self, path: str, value: Any) -> None:
        self.update({path: value})

    def __delitem__(self, path: str) -> None:
        raise TypeError(f"a component keeps its parameters; `{path}` cannot be deleted")

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def update(self, *values: Any, **named: Any) -> None:
        """Changes parameters, all or none. Raises `Error` with the reason of the component."""
        changes = {path: _plain(value) for path, value in dict(*values, **named).items()}
        self._network._native.set_parameters(self._component, json.dumps(changes))

    def save(self) -> None:
        """Writes the changed values into the configuration of the component."""
        self._network._native.save_parameters(self._component)

    def __repr__(self) -> str:
        values = ((path, one["value"], one) for path, one in self._all().items())
        lines = (f"  {path} = {value!r}  ({one['allowed']})" for path, value, one in values)
        return "\n".join([f"<parameters of {self._component}", *lines]) + ">"


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, timedelta):
        return f"{value // timedelta(microseconds=1)}us"
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value


class Component:
    """A running component: the slots that it implements are attributes, and items by their names."""

    def __init__(self, network: "Network", name: str, slots: dict[str, Slot]) -> None:
        self._network = network
        self._name = name
        self._slots = slots

    @property
    def params(self) -> Parameters:
        """The parameters."""
        return Parameters(self._network, self._name)

    def __getitem__(self, slot: str) -> Slot:
        try:
            return self.__getattr__(slot)
        except AttributeError as error:
            raise KeyError(str(error)) from None

    def __getattr__(self, name: str) -> Slot:
        if name == "_slots":
            raise AttributeError(name)
        for known, slot in self._slots.items():
            if name in (known, snake_case(known)):
                return slot
        names = ", ".join(map(snake_case, self._slots)) or "none"
        raise AttributeError(f"{self._name} implements no slot `{name}`; there are: {names}")

    def __dir__(self) -> list[str]:
        return [*(snake_case(slot) for slot in self._slots), "params"]

    def __repr__(self) -> str:
        slots = ", ".join(map(snake_case, self._slots)) or "none"
        return f"<component {self._name}: slots {slots}>"


class Publisher:
    """Publishes on a topic as long as it is open: `publish(…)` has the parameters of the operation.
    The end of a `with` block closes it, and so does the end of the program."""

    def __init__(self, publisher: _native.Publisher, name: str, described: _Described) -> None:
        self._publisher = publisher
        self._name = name
        self._signature = described.signature()
        self.__doc__ = documentation(name, described.operation)
        _open.add(self)

    def publish(self, *arguments: Any, **named: Any) -> None:
        """Publishes a sample: its values, by position or by name."""
        self._publisher.publish(_arguments(self._name, self._signature, arguments, named))

    @property
    def subscribers(self) -> int:
        """The number of subscribers."""
        return self._publisher.subscribers()

    def close(self) -> None:
        """Waits, for at most a second, until the last samples have arrived, and closes the topic."""
        self._publisher.close()

    def __enter__(self) -> "Publisher":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<publisher {self._name}{self._signature}>"


_open: weakref.WeakSet[Publisher] = weakref.WeakSet()


def _close_all() -> None:
    for publisher in list(_open):
        publisher.close()


atexit.register(_close_all)


class Samples(Iterator[Any]):
    """The samples of a topic, in their order. At most 64 MiB of messages wait for the loop: beyond
    that the oldest are dropped. Decoded, sequences of structures take several times as much memory.
    The middleware may drop some before."""

    def __init__(self, samples: _native.Samples, limit: float | None) -> None:
        self._samples = samples
        self._limit = limit

    @property
    def dropped(self) -> int:
        """The number of samples that were dropped so far because the loop was too slow."""
        return self._samples.dropped()

    def __next__(self) -> Any:
        parts = self._samples.next(self._limit)
        if parts is None:
            raise StopIteration
        return parts[0] if len(parts) == 1 else parts


class Network:
    """A running network: its components are attributes, those of groups items."""

    def __init__(self, name: str, timeout: timedelta) -> None:
        self.name = name
        """The name."""
        self.timeout = timeout
        """The longest time of a call."""
        _seconds(timeout)
        self._native = _native.Network(name)
        known: Known = {}
        modules = {
            component: [json.loads(module) for module in texts]
            for component, texts in self._native.modules()
        }
        self._types = {component: classes(of, known) for component, of in modules.items()}
        self.types: dict[str, type] = {}
        """The classes of all types by their names, `Module::Name`. Where components were built with
        different versions of a type, `types_of` has that of each."""
        for found in self._types.values():
            self.types = found | self.types
        self._native.set_types(self._types)
        self._operations = {
            component: {
                (f"{module['module']}::{interface['name']}", operation["name"]): operation
                for module in of
                for interface in module.get("interfaces", [])
                for operation in interface.get("operations", [])
            }
            for component, of in modules.items()
        }
        slots: dict[str, dict[str, dict[str, _Described]]] = {
            name: {} for name in self._native.components()
        }
        for component, slot, interface, operation in self._native.operations():
            described = self._described(component, interface, operation)
            slots.setdefault(component, {}).setdefault(slot, {})[operation] = described
        self._components = {
            component: Component(
                self,
                component,
                {slot: Slot(self, f"{component}.{slot}", of) for slot, of in served.items()},
            )
            for component, served in slots.items()
        }

    def _described(self, component: str, interface: str, operation: str) -> _Described:
        described = self._operations[component][interface, operation]
        return _Described(described, interface, self._types[component])

    def __repr__(self) -> str:
        components = ", ".join(self._components)
        return f"<network {self.name}: components {components}; topics {len(self.topics)}>"

    @property
    def components(self) -> list[str]:
        """The names of the components."""
        return list(self._components)

    @property
    def topics(self) -> list[str]:
        """The names of the topics."""
        return self._native.topics()

    def __getitem__(self, name: str) -> Component:
        try:
            return self._components[name]
        except KeyError:
            names = ", ".join(self._components)
            raise KeyError(f"there is no component `{name}`; there are {names}") from None

    def __getattr__(self, name: str) -> Component:
        components: dict[str, Component] = self.__dict__.get("_components", {})
        if name in components:
            return components[name]
        raise AttributeError(f"there is no component `{name}`; there are {', '.join(components)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._components]

    def types_of(self, component: str) -> dict[str, type]:
        """The classes of the types of a component by their names, `Module::Name`."""
        self[component]
        return dict(self._types.get(component, {}))

    def topic(self, name: str, timeout: timedelta | None = None) -> "Samples":
        """The samples of a topic from now on: `COMPONENT.SLOT.OPERATION`, or an end of it. With a
        `timeout`, it ends when no sample comes for this time."""
        limit = None if timeout is None else _seconds(timeout)
        return Samples(self._native.listen(name), limit)

    def publisher(self, topic: str) -> Publisher:
        """Opens a topic that a component subscribes to, for publishing: `COMPONENT.SLOT.OPERATION`,
        or an end of it. Waits for the first subscriber, for at most two seconds."""
        publisher, name, *of = self._native.publisher(topic)
        return Publisher(publisher, name, self._described(*of))

    def _call(self, operation: str, arguments: tuple[Any, ...]) -> Any:
        return self._native.call(operation, arguments, _seconds(self.timeout))


def _seconds(time: timedelta) -> float:
    if time < timedelta(0):
        raise ValueError(f"a timeout of {time} is negative")
    return time.total_seconds()


def connect(network: str = "default", timeout: timedelta = timedelta(seconds=2)) -> Network:
    """Asks the components of a running network for their descriptions. `timeout` is the longest
    time of a call."""
    return Network(network, timeout)
