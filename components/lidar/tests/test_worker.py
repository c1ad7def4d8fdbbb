"""The room that the lidar sees."""

from __future__ import annotations

import pytest

from lidar.testing import TestContext
from specific_worker import BEAMS, RINGS, SpecificWorker


def test_points_are_on_the_walls_in_millimetres() -> None:
    test = TestContext()
    worker = test.start(SpecificWorker)
    for number in range(2):
        worker.compute(test.ctx)
        [(name, scan)] = test.lidar_pub.take_samples()
        assert (name, scan.number, len(scan.points)) == ("new_scan", number, BEAMS * RINGS)
        for point in scan.points:
            walls = (point.x + 1500, point.x - 2500, point.y + 2000, point.y - 3000)
            assert min(map(abs, walls)) == pytest.approx(0.0, abs=0.01)
