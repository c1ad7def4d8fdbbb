"""The worker without a lidar, and without the conversion of its connection."""

from __future__ import annotations

import numpy as np

from mapper import Point, Scan
from mapper.testing import TestContext
from specific_worker import SpecificWorker


def test_a_cloud_has_the_numbers_of_the_scan() -> None:
    test = TestContext()
    worker = test.start(SpecificWorker)
    worker.lidar_new_scan(test.ctx, Scan(3, [Point(1.0, 2.0, 3.0, 0.5), Point(-1.0, 0.0, 0.25, 1.0)]))
    [(name, cloud)] = test.cloud.samples()
    assert (name, cloud.header.frame_id, cloud.width, cloud.is_dense) == ("new_cloud", "lidar", 2, True)
    points = np.frombuffer(cloud.data.tobytes(), "<f4").reshape(-1, 4)
    assert points.tolist() == [[1.0, 2.0, 3.0, 0.5], [-1.0, 0.0, 0.25, 1.0]]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "intensity"]


def test_an_empty_scan_is_an_empty_cloud() -> None:
    test = TestContext()
    test.start(SpecificWorker).lidar_new_scan(test.ctx, Scan(4, []))
    [(_, cloud)] = test.cloud.samples()
    assert (cloud.width, len(cloud.data)) == (0, 0)
