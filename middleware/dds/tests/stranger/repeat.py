"""Publishes reports, and checks that the component publishes them again, whole and in order: repeat.py NETWORK DOMAIN COUNT."""

import sys

from interop import Echoes_echo, Kind, Mark, Point, Report, Reports_report, Scores_entry
from network import Network, met, qos

# The most reports under way: no endpoint keeps more than its depth.
WINDOW = 500


def report(number):
    marks = [Mark(f"mark {i}", Point(i * 0.5, -i * 0.1)) for i in range(number % 4)]
    ranges = [number + i * 0.001 for i in range(number % 7)]
    scores = [Scores_entry(f"score {i}", i / 3) for i in range(number % 3)]
    # The package reads a sequence of octets as a list.
    text, data = "größer als 5 €"[: number % 15], list(bytes(number % 5))
    return Report(number, text, data, ranges, list(Kind)[number % 3], Point(0.25, -number), marks, scores)


network, domain, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
here = Network(network, domain)
echoes = here.reader("Echoes/echo", Echoes_echo, qos(depth=1000))
reports = here.writer("Reports/report", Reports_report, qos(depth=1000))
met(echoes, reports)
told = 0
while told < min(WINDOW, count):
    reports.write(Reports_report(report(told)))
    told += 1
heard = 0
for echo in here.values(echoes):
    assert echo.report == report(heard), f"{heard}: {echo}"
    heard += 1
    if told < count:
        reports.write(Reports_report(report(told)))
        told += 1
    if heard == count:
        break
print("told", told, "heard", heard)
