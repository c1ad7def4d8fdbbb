"""A lidar in a room of five by four metres."""

from __future__ import annotations

import math

from lidar import Context, Point, Scan, Worker

BEAMS = 360
RINGS = 4
# From the lidar, in millimetres: x to the right, y ahead.
LEFT, RIGHT, BACK, AHEAD = -1500.0, 2500.0, -2000.0, 3000.0


def distance(angle: float) -> float:
    """To the nearest wall, at an angle from straight ahead to the left."""
    right, ahead = -math.sin(angle), math.cos(angle)
    ways = [math.inf]
    if right:
        ways.append((RIGHT if right > 0 else LEFT) / right)
    if ahead:
        ways.append((AHEAD if ahead > 0 else BACK) / ahead)
    return min(ways)


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.number = 0

    def compute(self, ctx: Context) -> None:
        points: list[Point] = []
        for ring in range(RINGS):
            for beam in range(BEAMS):
                # Each turn begins a little further.
                angle = math.tau * (beam + 0.1 * self.number) / BEAMS
                away = distance(angle)
                point = Point(-away * math.sin(angle), away * math.cos(angle), 100.0 * ring, ring / RINGS)
                points.append(point)
        ctx.lidar_pub.new_scan(Scan(self.number, points))
        self.number += 1
