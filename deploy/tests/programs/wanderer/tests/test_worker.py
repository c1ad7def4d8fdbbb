"""The walk without a network."""

from datetime import timedelta
from itertools import pairwise

from specific_worker import SpecificWorker
from wanderer import Params
from wanderer.testing import TestContext


def test_no_step_is_longer_than_the_parameter() -> None:
    test = TestContext(Params(step=2.0))
    test.run(test.start(SpecificWorker), timedelta(seconds=1))
    samples = test.full_pose_estimation_pub.samples()
    walk = [pose.x for _, pose in samples]
    assert len(walk) == 200
    assert all(abs(after - before) <= 2.0 for before, after in pairwise(walk))
    assert len(set(walk)) > 100
