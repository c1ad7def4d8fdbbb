"""Classes for types that are known at run time only, from their description."""

import keyword
import re
from collections import namedtuple
from collections.abc import Iterable, Mapping
from dataclasses import make_dataclass
from enum import IntEnum
from typing import Any

from robocomp._errors import RemoteError


def attribute(name: str) -> str:
    """The name of a member as an attribute."""
    return f"{name}_" if keyword.iskeyword(name) else name


def _distinct(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Attributes for these names. One that Python refuses or has for itself gets a `_`, a private one
    a letter before it, so that no description keeps a client from a network."""
    used = set(taken)
    found = []
    for name in names:
        free = attribute(f"n{name}" if name.startswith("_") else name)
        while free in used:
            free += "_"
        used.add(free)
        found.append(free)
    return found


def snake_case(name: str) -> str:
    """`getLaserData` as `get_laser_data`."""
    text = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name)
    text = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1_\2", text)
    return attribute(text.lower())


_OF_EXCEPTIONS = ("add_note", "args", "with_traceback")


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


def _class(name: str, described: Mapping[str, Any]) -> type | None:
    if "enum" in described:
        keys = _distinct((key for key, _ in described["enum"]), ["mro"])
        numbers = (number for _, number in described["enum"])
        return IntEnum(name, list(zip(keys, numbers, strict=True)))  # type: ignore[return-value]
    if "exception" in described:
        members = [member["name"] for member in described["exception"]]
        return _exception(name, _distinct(members, _OF_EXCEPTIONS))
    if "struct" in described:
        members = _distinct(member["name"] for member in described["struct"])
        return make_dataclass(name, [(member, Any) for member in members], slots=True)
    return None


def classes(modules: Iterable[Mapping[str, Any]]) -> dict[str, type]:
    """A class for each type of these modules, by its name `Module::Name`, and for the replies of
    operations that have several parts."""
    found: dict[str, type] = {}
    for module in modules:
        prefix = module["module"]
        for described in module.get("types", []):
            made = _class(described["name"], described)
            if made is not None:
                found[f"{prefix}::{described['name']}"] = made
        for interface in module.get("interfaces", []):
            for operation in interface.get("operations", []):
                has_result = bool(operation.get("result"))
                outputs = (part["name"] for part in operation.get("outputs", []))
                parts = _distinct(outputs, ["result"] if has_result else [])
                if has_result:
                    parts.append("result")
                if len(parts) > 1:
                    name = f"{prefix}::{interface['name']}.{operation['name']}"
                    title = operation["name"][:1].upper() + operation["name"][1:]
                    found[name] = namedtuple(f"{title}Answer", parts)  # noqa: PYI024
    return found
