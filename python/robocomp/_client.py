"""A running network without a component, for notebooks and scripts."""

import json
from collections.abc import Iterator
from datetime import timedelta
from typing import Any

from robocomp import _native
from robocomp._classes import Known, classes, distinct, snake_case


class Slot:
    """A slot that a component implements: its operations are functions."""

    def __init__(self, network: "Network", name: str, operations: dict[str, list[str]]) -> None:
        self._network = network
        self._name = name
        self._operations = operations

    def __getattr__(self, name: str) -> Any:
        # `copy` and `pickle` ask an instance that has no attributes yet.
        if name == "_operations":
            raise AttributeError(name)
        for operation, inputs in self._operations.items():
            if name in (operation, _native.name_of("method", operation)):
                return self._function(operation, distinct("parameter", inputs))
        names = ", ".join(self.__dir__())
        raise AttributeError(f"{self._name} has no operation `{name}`; there are {names}")

    def __dir__(self) -> list[str]:
        return [_native.name_of("method", operation) for operation in self._operations]

    def _function(self, operation: str, inputs: list[str]) -> Any:
        whole = f"{self._name}.{operation}"

        def call(*arguments: Any, **named: Any) -> Any:
            values = list(arguments)
            for one in inputs[len(values) :]:
                if one not in named:
                    raise TypeError(f"{whole}({', '.join(inputs)}) needs `{one}`")
                values.append(named.pop(one))
            if named or len(values) > len(inputs):
                raise TypeError(f"{whole} takes ({', '.join(inputs)})")
            return self._network._call(whole, tuple(values))

        call.__name__ = _native.name_of("method", operation)
        return call


class Component:
    """A running component: the slots that it implements are attributes."""

    def __init__(self, name: str, slots: dict[str, Slot]) -> None:
        self._name = name
        self._slots = slots

    def __getattr__(self, name: str) -> Slot:
        if name == "_slots":
            raise AttributeError(name)
        for known, slot in self._slots.items():
            if name in (known, snake_case(known)):
                return slot
        names = ", ".join(map(snake_case, self._slots)) or "none"
        raise AttributeError(f"{self._name} implements no slot `{name}`; there are: {names}")

    def __dir__(self) -> list[str]:
        return [snake_case(slot) for slot in self._slots]


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
        self.timeout = timeout
        """The longest time of a call."""
        _seconds(timeout)
        self._native = _native.Network(name)
        known: Known = {}
        self._types = {
            component: classes(map(json.loads, modules), known)
            for component, modules in self._native.modules()
        }
        self.types: dict[str, type] = {}
        """The classes of all types by their names, `Module::Name`. Where components were built with
        different versions of a type, `types_of` has that of each."""
        for found in self._types.values():
            self.types = found | self.types
        self._native.set_types(self._types)
        slots: dict[str, dict[str, dict[str, list[str]]]] = {
            name: {} for name in self._native.components()
        }
        for component, slot, operation, inputs in self._native.operations():
            slots.setdefault(component, {}).setdefault(slot, {})[operation] = inputs
        self._components = {
            component: Component(
                component,
                {slot: Slot(self, f"{component}.{slot}", of) for slot, of in served.items()},
            )
            for component, served in slots.items()
        }

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
        `timeout` it ends when no sample comes for as long."""
        limit = None if timeout is None else _seconds(timeout)
        return Samples(self._native.listen(name), limit)

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
