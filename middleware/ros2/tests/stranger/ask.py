"""Asks the envoy everything: ask.py NETWORK DOMAIN."""

import sys

from node import Client, Node

from envoy import (
    AddTwoInts_Request, AddTwoInts_Response, EnvoyNote_Request, EnvoyNote_Response, EnvoyNoted_Request, EnvoyNoted_Response,
    EnvoyShift_Request, EnvoyShift_Response, LOST, Mark, Point, Report, ScoresEntry,
)

network, domain = sys.argv[1:]
here = Node(network, domain)
marks = [Mark("a", Point(1.0, 2.0)), Mark("", Point(0.0, 0.0))]
report = Report(1 << 40, "ä", [1, 255], [1.5], LOST, Point(0.5, 0.25), marks, [ScoresEntry("b", -1.0)])
# The first call of each of these is sent as soon as the ends are found.
add = Client(here, "Envoy/add", AddTwoInts_Request, AddTwoInts_Response)
print(add.call(1 << 40, -2))
shift = Client(here, "Envoy/shift", EnvoyShift_Request, EnvoyShift_Response)
print(shift.call(report, 0.5))
print(shift.call(Report(text="bare"), 0.5))
note = Client(here, "Envoy/note", EnvoyNote_Request, EnvoyNote_Response)
print(note.call("from Python"))
noted = Client(here, "Envoy/noted", EnvoyNoted_Request, EnvoyNoted_Response)
print(noted.call())
# Large and odd.
for size in (2 << 10, (2 << 10) + 1, (200 << 10) + 3, 1 << 20):
    long = Report(1, "x" * size, [], [], LOST, Point(), marks, [])
    assert shift.call(long, 0.0).result == long, size
    print("shifted", size)
