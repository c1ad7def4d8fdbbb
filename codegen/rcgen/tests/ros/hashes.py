"""Prints the type hashes of interface packages, by the functions of ROS 2's own generator.

hashes.py SHARE FOLDER: FOLDER holds the packages, SHARE the descriptions of the packages that ROS 2 installs. A line is
`NAME HASH`. The files are read by `rosidl_adapter`; its conversion to .idl, which needs a template engine, is left out.
"""

import json
import pathlib
import sys

import rosidl_generator_type_description as generator
from rosidl_adapter.parser import parse_message_file, parse_service_file
from rosidl_parser.definition import (
    Array, BasicType, BoundedSequence, BoundedString, Member, Message, NamespacedType, Service, Structure,
    UnboundedSequence, UnboundedString,
)

WORDS = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float", "float64": "double"}
EMPTY = "structure_needs_at_least_one_member"


def element(kind):
    if kind.pkg_name:
        return NamespacedType((kind.pkg_name, "msg"), kind.type)
    if kind.type == "string":
        return BoundedString(kind.string_upper_bound) if kind.string_upper_bound else UnboundedString()
    return BasicType(WORDS.get(kind.type, kind.type))


def whole(kind):
    if not kind.is_array:
        return element(kind)
    if kind.is_upper_bound:
        return BoundedSequence(element(kind), kind.array_size)
    return Array(element(kind), kind.array_size) if kind.array_size else UnboundedSequence(element(kind))


def message(package, kind, name, fields):
    members = [Member(whole(field.type), field.name) for field in fields]
    members = members or [Member(BasicType("uint8"), EMPTY)]
    return Message(Structure(NamespacedType((package, kind), name), members))


share, root = map(pathlib.Path, sys.argv[1:])
known = {}
for path in share.glob("*/*/*.json"):
    described = json.loads(path.read_text())["type_description_msg"]
    for one in [described["type_description"], *described["referenced_type_descriptions"]]:
        known[one["type_name"]] = one
own = {}
for folder in root.iterdir():
    for file in folder.glob("msg/*.msg"):
        parsed = parse_message_file(folder.name, file)
        generator.add_msg(message(folder.name, "msg", file.stem, parsed.fields), own)
    for file in folder.glob("srv/*.srv"):
        parsed = parse_service_file(folder.name, file)
        request = message(folder.name, "srv", f"{file.stem}_Request", parsed.request.fields)
        response = message(folder.name, "srv", f"{file.stem}_Response", parsed.response.fields)
        name = NamespacedType((folder.name, "srv"), file.stem)
        generator.add_srv(Service(name, request, response), own)
for name, one in own.items():
    known[name] = generator.serialize_individual_type_description(one.namespaced_type, one.members)
for name in own:
    print(name, generator.calculate_type_hash(generator.extract_full_type_description(name, known)))
