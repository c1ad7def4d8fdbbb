"""Prints the messages of a release of ROS 2 as `standard.txt` has them: NAME: TYPE FIELD, TYPE FIELD …

The definitions are those of the package `rosbags`. The packages are named on the command line.
"""

import sys

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore


def word(kind, what):
    if kind == Nodetype.NAME:
        package, _, name = what.split("/")
        return f"{package}/{name}"
    if kind == Nodetype.BASE:
        name, bound = what
        name = {"octet": "byte"}.get(name, name)
        return f"{name}<={bound}" if bound else name
    element, count = what
    if kind == Nodetype.ARRAY:
        return f"{word(*element)}[{count}]"
    return f"{word(*element)}[<={count}]" if count else f"{word(*element)}[]"


store = get_typestore(Stores.ROS2_JAZZY)
for name, (_, fields) in sorted(store.fielddefs.items()):
    if name.split("/")[0] not in sys.argv[1:]:
        continue
    fields = [f"{word(*what)} {field}" for field, what in fields]
    if fields == ["uint8 structure_needs_at_least_one_member"]:
        fields = []
    print(f"{name}: {', '.join(fields)}".rstrip())
