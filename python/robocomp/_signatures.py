"""Signatures and documentation of operations that are known at run time only."""

import inspect
from collections.abc import Mapping
from typing import Any

import numpy as np

from robocomp._classes import distinct, snake_case
from robocomp._native import primitives

_NUMBERS = primitives()


def annotation(text: str, types: Mapping[str, type]) -> Any:
    """The type of Python for a type of a description, as `sequence<Demo::Point,3>`."""
    if text in _NUMBERS:
        return _NUMBERS[text]
    if text.endswith("]"):
        element = text.rpartition("[")[0]
    elif text.startswith("sequence<"):
        inner = text[len("sequence<") : -1]
        whole, _, bound = inner.rpartition(",")
        element = whole if bound.isdecimal() and whole.count("<") == whole.count(">") else inner
    elif text.startswith("dictionary<"):
        key, _, value = text[len("dictionary<") : -1].partition(",")
        return dict[annotation(key, types), annotation(value, types)]  # type: ignore[misc]
    elif text == "string" or text.startswith("string<"):
        return str
    else:
        return types.get(text, Any)
    if element in _NUMBERS:
        return np.ndarray
    return list[annotation(element, types)]  # type: ignore[misc]


def _of_member(member: Mapping[str, Any], types: Mapping[str, type]) -> Any:
    found = annotation(member["type"], types)
    return found | None if member.get("optional") else found


def _line(name: str, member: Mapping[str, Any]) -> str:
    """A parameter with its type, unit and range."""
    text = f"    {name}: {member['type']}"
    if member.get("unit"):
        text += f", in {member['unit']}"
    least, most = member.get("range") or (None, None)
    if least is not None:
        text += f", from {least:g}"
    if most is not None:
        text += f", to {most:g}"
    return text + (", optional" if member.get("optional") else "")


def signature(
    operation: Mapping[str, Any], types: Mapping[str, type], answer: type | None
) -> inspect.Signature:
    """The signature of a function that calls an operation, or that publishes its samples. `answer`
    is the class of a reply with several parts."""
    inputs = operation.get("inputs", [])
    names = distinct("parameter", (member["name"] for member in inputs))
    outputs = [_of_member(member, types) for member in operation.get("outputs", [])]
    if operation.get("result"):
        outputs.insert(0, annotation(operation["result"], types))
    result = answer if len(outputs) > 1 else (outputs[0] if outputs else None)
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    return inspect.Signature(
        [
            inspect.Parameter(name, kind, annotation=_of_member(member, types))
            for name, member in zip(names, inputs, strict=True)
        ],
        return_annotation=result,
    )


def documentation(whole: str, operation: Mapping[str, Any]) -> str:
    """The description of an operation in the IDSL. `whole` is its name."""
    inputs = operation.get("inputs", [])
    names = distinct("parameter", (member["name"] for member in inputs))
    lines = [f"`{whole}`", *map(_line, names, inputs)]
    outputs = operation.get("outputs", [])
    replies = [_line(snake_case(member["name"]), member) for member in outputs]
    if operation.get("result"):
        replies.insert(0, f"    result: {operation['result']}")
    if replies:
        lines += ["Returns", *replies]
    throws = [name for name, _ in operation.get("throws", [])]
    if throws:
        lines += ["Raises", *(f"    {name}" for name in throws)]
    return "\n".join(lines)
