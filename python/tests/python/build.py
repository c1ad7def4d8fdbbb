"""Components for tests, from descriptions."""

import json
from pathlib import Path
from typing import Any

import robocomp
from robocomp._classes import classes, snake_case

ROOT = Path(__file__).resolve().parents[3]

QOS = {
    "reliable": True,
    "transient_local": False,
    "depth": 100,
    "deadline_ns": None,
    "lifespan_ns": None,
    "liveliness_ns": None,
    "timeout_ns": 2_000_000_000,
    "spin_ns": 0,
}


def hash_of(text: str) -> str:
    """A hash for a type of the tests: both ends are made by this file."""
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = ((value ^ byte) * 0x100000001B3) % 2**64
    return f"{value:016x}"


def operation_id(name: str) -> int:
    return int.from_bytes(bytes.fromhex(hash_of(name))[:4], "little", signed=True)


class Fixture:
    """A component: its description, its classes, and the bases that a generator would write."""

    def __init__(self, name: str, modules: list[dict[str, Any]], middleware: str, **more: Any) -> None:
        self.types = classes(modules)
        self.modules = modules
        self.description: dict[str, Any] = {
            "name": name,
            "model": "0" * 16,
            "middleware": middleware,
            "period_ns": 10_000_000,
            "types": modules,
            "slots": [],
            **more,
        }
        self._attributes: list[tuple[str, Any, bool]] = []
        self._handlers: dict[str, Any] = {}

    def _interface(self, full: str) -> dict[str, Any]:
        module, name = full.split("::")
        for described in self.modules:
            if described["module"] == module:
                for interface in described["interfaces"]:
                    if interface["name"] == name:
                        return interface
        raise KeyError(full)

    def slot(self, name: str, role: str, full: str, in_place: bool = False, **more: Any) -> "Fixture":
        interface = self._interface(full)
        operations = [
            {"name": o["name"], "handler": snake_case(o["name"]), "in_place": in_place}
            for o in interface["operations"]
        ]
        if self.description["middleware"] == "ros2":
            # The names that `rcgen` gives types without an annotation.
            package = f"{full.split('::')[0].lower()}_msgs"
            kind = "msg" if role in ("publishes", "subscribesTo") else "srv"
            names = (o["name"][:1].upper() + o["name"][1:] for o in interface["operations"])
            more["external_types"] = [f"{package}/{kind}/{interface['name']}{n}" for n in names]
        qos = {**QOS, **more.pop("qos", {})}
        self.description["slots"].append(
            {
                "name": name,
                "role": role,
                "interface": interface["name"],
                "type_name": full,
                "type_hash": hash_of(full),
                "middleware": self.description["middleware"],
                "qos": qos,
                "operations": operations,
                **more,
            }
        )
        is_array = bool(more.get("is_array"))
        end: Any = None
        if role == "requires":
            end = _client(interface)
        elif role == "publishes":
            end = _publisher(interface)
        else:
            for operation in interface["operations"]:
                handler = _handler(operation, is_array)
                self._handlers[snake_case(operation["name"])] = handler
        self._attributes.append((snake_case(name), end, is_array))
        return self

    @property
    def worker(self) -> type:
        """The base of workers."""

        def compute(self: Any, ctx: Any) -> None: ...

        def nothing(self: Any, ctx: Any) -> None: ...

        def changed(self: Any, ctx: Any, changes: Any) -> None: ...

        hooks = {
            "initialize": robocomp.default(nothing),
            "compute": robocomp.default(compute),
            "params_changed": robocomp.default(changed),
            "finalize": robocomp.default(nothing),
            "emergency": robocomp.default(nothing),
            "restore": robocomp.default(nothing),
        }
        return type("Worker", (), {**hooks, **self._handlers})

    def component(self, worker: type, folder: str = "/nowhere") -> robocomp.Component:
        attributes = self._attributes
        simulates_time = self.description.get("simulates_time")

        class Context(robocomp.Context):
            def __init__(self, link: robocomp.Link) -> None:
                super().__init__(link)
                if simulates_time:
                    self.time = robocomp.TimeSource(link)
                for number, (name, end, is_array) in enumerate(attributes):
                    if is_array:
                        make = end or (lambda link, slot: None)
                        setattr(self, name, robocomp.SlotArray(link, number, make))
                    elif end:
                        setattr(self, name, end(link, number))

            def _set_parameters(self, values: Any) -> None:
                self.params = values

        base = worker.__mro__[1]
        return robocomp.Component(
            description=json.dumps(self.description),
            types=self.types,
            context=Context,
            worker=base,
            folder=folder,
        )


def _client(interface: dict[str, Any]) -> type:
    body: dict[str, Any] = {}
    for number, operation in enumerate(interface["operations"]):
        if operation["pattern"] == "query":
            def call(self: Any, *arguments: Any, number: int = number) -> Any:
                return self._query(number, *arguments)
        else:
            def call(self: Any, *arguments: Any, number: int = number) -> Any:
                return self._command(number, *arguments)
        body[snake_case(operation["name"])] = call
    return type(f"{interface['name']}Client", (robocomp.Client,), body)


def _publisher(interface: dict[str, Any]) -> type:
    body: dict[str, Any] = {}
    for number, operation in enumerate(interface["operations"]):
        def publish(self: Any, *arguments: Any, number: int = number) -> None:
            self._publish(number, *arguments)

        def loan(self: Any, number: int = number) -> Any:
            return self._loan(number)

        body[snake_case(operation["name"])] = publish
        body[f"loan_{snake_case(operation['name'])}"] = loan
    return type(f"{interface['name']}Publisher", (robocomp.Publisher,), body)


def _handler(operation: dict[str, Any], of_member: bool) -> Any:
    names = [f"a{number}" for number, _ in enumerate(operation.get("inputs", []))]
    names = ["member", *names] if of_member else names
    scope: dict[str, Any] = {}
    exec(f"def handler(self, ctx, {', '.join(names)}): raise NotImplementedError", scope)
    return robocomp.required(scope["handler"])
