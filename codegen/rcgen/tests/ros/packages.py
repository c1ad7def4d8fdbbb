"""Reads interface packages with ROS 2's own tools, and prints what these find in them.

Each folder on the command line holds packages. Of every type there are two lines: `fields NAME: TYPE FIELD, …`, as
rosidl_adapter reads the file, and `bytes NAME: …`, the order of what is on the wire, by rosidl_parser from the .idl that
`rosidl translate` makes.
"""

import pathlib
import sys
import tempfile

from catkin_pkg.package import parse_package
from rosidl_adapter.parser import parse_message_file, parse_service_file
from rosidl_cli.command.translate.api import translate
from rosidl_parser.definition import (
    Array, BasicType, BoundedSequence, BoundedString, IdlLocator, Message, NamespacedType, Service,
    UnboundedSequence, UnboundedString,
)
from rosidl_parser.parser import parse_idl_file

WORDS = {"boolean": "bool", "octet": "uint8", "float": "float32", "double": "float64"}


def layout(kind, structures):
    if isinstance(kind, BasicType):
        return WORDS.get(kind.typename, kind.typename)
    if isinstance(kind, BoundedString):
        return f"string<={kind.maximum_size}"
    if isinstance(kind, UnboundedString):
        return "string"
    if isinstance(kind, NamespacedType):
        return content(structures["/".join(kind.namespaced_name())], structures)
    inner = layout(kind.value_type, structures)
    if isinstance(kind, Array):
        return f"{kind.size}({inner})"
    if isinstance(kind, BoundedSequence):
        return f"<={kind.maximum_size}({inner})"
    assert isinstance(kind, UnboundedSequence), kind
    return f"*({inner})"


def content(structure, structures):
    return " ".join(layout(member.type, structures) for member in structure.members)


def read(root, known, lines):
    structures = {}
    for folder in sorted(root.iterdir()):
        # Many import the same.
        texts = tuple((file, file.read_bytes()) for file in sorted(folder.glob("**/*.*")))
        texts = tuple((file.relative_to(root), text) for file, text in texts)
        if texts not in known:
            known[texts] = package(folder, lines)
        structures.update(known[texts])
    own = {folder.name for folder in root.iterdir()}
    for name, structure in structures.items():
        try:
            lines.add(f"bytes {name}: {content(structure, structures)}")
        except KeyError as missing:
            # A member has a type of ROS's own packages, whose files are not here.
            assert missing.args[0].split("/")[0] not in own, name


def package(folder, lines):
    warnings = []
    manifest = parse_package(str(folder / "package.xml"), warnings=warnings)
    assert manifest.name == folder.name and not warnings, (folder, warnings)
    files = sorted(folder.glob("msg/*.msg")) + sorted(folder.glob("srv/*.srv"))
    listed = (folder / "CMakeLists.txt").read_text()
    out = pathlib.Path(tempfile.mkdtemp(dir=sys.argv[1]))
    names = [str(file.relative_to(folder)) for file in files]
    for name in names:
        assert f'"{name}"' in listed, name
    translate(
        package_name=folder.name, interface_files=[f"{folder}:{name}" for name in names], output_format="idl",
        output_path=out,
    )
    needed, structures = set(), {}
    for file in files:
        kind = file.suffix[1:]
        name = f"{folder.name}/{kind}/{file.stem}"
        if kind == "msg":
            parts = {"": parse_message_file(folder.name, file)}
        else:
            service = parse_service_file(folder.name, file)
            parts = {"_Request": service.request, "_Response": service.response}
        for part, message in parts.items():
            fields = ", ".join(map(str, message.fields))
            constants = "".join(f"; {constant}" for constant in message.constants)
            lines.add(f"fields {name}{part}: {fields}{constants}")
            needed.update(field.type.pkg_name for field in message.fields)
        idl = parse_idl_file(IdlLocator(out, pathlib.PurePosixPath(kind) / f"{file.stem}.idl"))
        for message in idl.content.get_elements_of_type(Message):
            structures[name] = message.structure
        for service in idl.content.get_elements_of_type(Service):
            structures[f"{name}_Request"] = service.request_message.structure
            structures[f"{name}_Response"] = service.response_message.structure
    needed -= {None, folder.name}
    depends = {depend.name for depend in manifest.build_depends} - {"rosidl_default_runtime"}
    assert depends == needed, (folder, depends, needed)
    for other in needed:
        assert f"find_package({other} REQUIRED)" in listed, other
    return structures


def main():
    known, lines = {}, set()
    for root in sys.argv[2:]:
        read(pathlib.Path(root), known, lines)
    pathlib.Path(sys.argv[1], "found").write_text("".join(line + "\n" for line in sorted(lines)))


main()
