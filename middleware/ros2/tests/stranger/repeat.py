"""Publishes reports, and checks that the component publishes them again, whole and in order: repeat.py NETWORK DOMAIN COUNT [BYTES …].

With BYTES each report holds so many, in text and data, and one is under way at a time."""

import sys

from node import Node, met, qos

from interop import DOOR, PERSON, WALL, Mark, Point, Report, ScoresEntry

# The most reports under way: no endpoint keeps more than its depth.
WINDOW = 500


def report(number, size=None):
    marks = [Mark(f"mark {i}", Point(i * 0.5, -i * 0.1)) for i in range(number % 4)]
    scores = [ScoresEntry(f"score {i}", i / 3) for i in range(number % 3)]
    ranges = [number + i * 0.001 for i in range(number % 7)]
    text, data = "größer als 5 €"[: number % 15], bytes(number % 5)
    if size is not None:
        text, data = "ä" * (size // 4), bytes(i * number % 251 for i in range(size - size // 4 * 2))
    # The package reads a sequence of octets as a list.
    return Report(number, text, list(data), ranges, [WALL, DOOR, PERSON][number % 3], Point(0.25, -number), marks, scores)


network, domain, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
sizes = [int(size) for size in sys.argv[4:]]
window = 1 if sizes else WINDOW
here = Node(network, domain)
echoes = here.reader("Echoes/echo", Report, qos(depth=1000))
reports = here.writer("Reports/report", Report, qos(depth=1000))
met(echoes, reports)
# A node of ROS 2 does not report when it has found an endpoint.
print("met", flush=True)
sys.stdin.readline()


def numbered(number):
    return report(number, sizes[number % len(sizes)] if sizes else None)


told = 0
while told < min(window, count):
    reports.write(numbered(told))
    told += 1
heard = 0
for echo in here.values(echoes):
    assert echo == numbered(heard), f"{heard}: {str(echo)[:1000]}"
    heard += 1
    if told < count:
        reports.write(numbered(told))
        told += 1
    if heard == count:
        break
print("told", told, "heard", heard)
