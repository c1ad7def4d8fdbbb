"""Calls each operation of the component: ask.py NETWORK DOMAIN."""

import sys

from node import Client, Node

from interop import (
    PERSON, AddTwoInts_Request, AddTwoInts_Response, InteropNote_Request, InteropNote_Response, InteropNoted_Request,
    InteropNoted_Response, InteropShift_Request, InteropShift_Response, Mark, Point, Report, ScoresEntry,
)

network, domain = sys.argv[1:]
here = Node(network, domain)
marks = [Mark("a", Point(1.0, 2.0)), Mark("", Point(0.0, 0.0))]
report = Report(1 << 40, "ä", [1, 255], [1.5], PERSON, Point(0.5, 0.25), marks, [ScoresEntry("b", -1.0)])
# The first call of each is sent as soon as the endpoints have matched.
add = Client(here, "Interop/add", AddTwoInts_Request, AddTwoInts_Response)
print(add.call(1 << 40, -2))
shift = Client(here, "Interop/shift", InteropShift_Request, InteropShift_Response)
print(shift.call(report, 0.5))
print(shift.call(Report(text="bare"), 0.5))
note = Client(here, "Interop/note", InteropNote_Request, InteropNote_Response)
print(note.call("from Python"))
noted = Client(here, "Interop/noted", InteropNoted_Request, InteropNoted_Response)
print(noted.call())
# Large and odd.
for size in (2 << 10, (2 << 10) + 1, (200 << 10) + 3, 1 << 20):
    long = Report(1, "x" * size, [], [], PERSON, Point(), marks, [])
    assert shift.call(long, 0.0).result == long, size
    print("shifted", size)
