"""The worker without processes."""

import numpy as np
import pytest
from pong_python.testing import TestContext
from specific_worker import SpecificWorker


def test_times_are_reported_at_the_end_of_a_block(capsys: pytest.CaptureFixture[str]) -> None:
    test = TestContext()
    worker = test.start(SpecificWorker)
    data = np.full(4, 7, np.uint8)
    worker.sample_sample(test.ctx, 1, data)
    worker.sample_sample(test.ctx, 0, data[:0])
    said = capsys.readouterr().out.split()
    assert said[:2] == ["ready", "times"]
    assert len(said) == 3
    assert worker.echo_echo(test.ctx, data) is data
