"""Classes for types that are known at run time only, from their description."""

import json
from collections import namedtuple
from collections.abc import Iterable, Mapping, MutableMapping
from dataclasses import make_dataclass
from enum import IntEnum
from typing import Any, Literal

from robocomp import _native
from robocomp._errors import RemoteError


NameKind = Literal["enumerator", "exception member", "member", "parameter", "part"]


def distinct(kind: NameKind, names: Iterable[str]) -> list[str]:
    """These names as generated code has them. Descriptions of other processes may have names that
    no IDSL allows, or that become one: no name keeps a client from a network, nor occupies it for
    long."""
    found: dict[str, None] = {}
    # The next number to try after a name that is used: each is tried once.
    numbers: dict[str, int] = {}
    for at, name in enumerate(names):
        free = _native.name_of(kind, name)
        if not (free.isascii() and free.isidentifier()):
            free = f"n{at}"
        wanted = free
        if free in found or (kind == "enumerator" and free == "mro"):
            free += "_"
        while free in found:
            number = numbers.get(wanted, 2)
            numbers[wanted] = number + 1
            free = f"{wanted}_{number}"
        found[free] = None
    return list(found)


def snake_case(name: str) -> str:
    """`getLaserData` as `get_laser_data`."""
    return _native.name_of("function", name)


def _title(name: str) -> str:
    title = name[:1].upper() + name[1:]
    return title if title.isascii() and title.isidentifier() else "Unnamed"


def _exception(name: str, members: list[str]) -> type:
    def __init__(self: Any, *values: Any) -> None:
        RemoteError.__init__(self, *values)
        for member, value in zip(members, values, strict=True):
            setattr(self, member, value)

    def __str__(self: Any) -> str:
        parts = (f"{member}={getattr(self, member)!r}" for member in members)
        return f"{name}({', '.join(parts)})"

    body = {"__init__": __init__, "__str__": __str__, "__match_args__": tuple(members)}
    return type(name, (RemoteError,), body)


def _class(module: str, name: str, described: Mapping[str, Any]) -> type | None:
    if "enum" in described:
        keys = distinct("enumerator", (key for key, _ in described["enum"]))
        numbers = (number for _, number in described["enum"])
        members = list(zip(keys, numbers, strict=True))
        return IntEnum(name, members, module=module)  # type: ignore[return-value]
    if "exception" in described:
        names = (member["name"] for member in described["exception"])
        made: type = _exception(name, distinct("exception member", names))
    elif "struct" in described:
        names = (member["name"] for member in described["struct"])
        fields = [(member, Any) for member in distinct("member", names)]
        made = make_dataclass(name, fields, slots=True)
    else:
        return None
    made.__module__ = module
    return made


def _answer(operation: Mapping[str, Any]) -> list[str]:
    """The parts of a reply: the result, then the `out` parameters."""
    parts = distinct("part", (part["name"] for part in operation.get("outputs", [])))
    if operation.get("result"):
        result = "result"
        taken = set(parts)
        while result in taken:
            result += "_"
        parts.insert(0, result)
    return parts


Known = MutableMapping[tuple[str, str], type]
"""Classes by the names of their types and by what those are."""


def classes(modules: Iterable[Mapping[str, Any]], known: Known | None = None) -> dict[str, type]:
    """A class for each type of these modules, by its name `Module::Name`, and for the replies of
    operations that have several parts. Types that are the same get the class in `known`."""
    known = {} if known is None else known
    found: dict[str, type] = {}
    for module in modules:
        prefix = module["module"]
        for described in module.get("types", []):
            name = f"{prefix}::{described['name']}"
            key = (name, json.dumps(described, sort_keys=True))
            made = known.get(key) or _class(
                prefix, _title(described["name"]), described
            )
            if made is not None:
                found[name] = known[key] = made
        for interface in module.get("interfaces", []):
            for operation in interface.get("operations", []):
                parts = _answer(operation)
                if len(parts) > 1:
                    name = f"{prefix}::{interface['name']}.{operation['name']}"
                    key = (name, json.dumps(parts))
                    title = f"{_title(operation['name'])}Answer"
                    found[name] = known.get(key) or namedtuple(  # noqa: PYI024
                        title, parts, module=prefix
                    )
                    known[key] = found[name]
    return found
