"""Reads a sample with the messages of exported packages, by the package rosbags, which knows ROS 2 and nothing of this
project; prints the values, and checks that they are the same bytes when written again.

values.py PACKAGES TYPE: the bytes of the body in hexadecimal digits on standard input.
"""

import pathlib
import sys

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# The header of a body, which gives its encoding: little endian.
HEAD = bytes([0, 1, 0, 0])


def text(value):
    if hasattr(value, "__msgtype__"):
        fields = vars(value).items()
        return "{" + ", ".join(f"{name}: {text(field)}" for name, field in fields if name != "__msgtype__") + "}"
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list):
        return "[" + ", ".join(map(text, value)) + "]"
    return repr(value)


store = get_typestore(Stores.EMPTY)
types = {}
for file in pathlib.Path(sys.argv[1]).glob("*/msg/*.msg"):
    types.update(get_types_from_msg(file.read_text(), f"{file.parts[-3]}/msg/{file.stem}"))
store.register(types)
body = bytes.fromhex(sys.stdin.read())
value = store.deserialize_cdr(HEAD + body, sys.argv[2])
assert bytes(store.serialize_cdr(value, sys.argv[2])) == HEAD + body
print("\n".join(f"{name}: {text(field)}" for name, field in vars(value).items() if name != "__msgtype__"))
