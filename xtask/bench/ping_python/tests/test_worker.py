"""The worker without processes."""

import io

import numpy as np
import pytest
from ping_python.testing import TestContext
from specific_worker import SpecificWorker


def test_a_block_calls_or_publishes_and_the_end_of_the_input_ends(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    test = TestContext()
    test.echo.on_echo(np.full(8, 7, np.uint8))
    monkeypatch.setattr("sys.stdin", io.StringIO("query 8 2\npublish 4 1\nplace 4 1\n"))
    worker = test.start(SpecificWorker)
    for _ in range(4):
        worker.compute(test.ctx)
    assert len(test.echo.calls()) == 2
    # Both blocks of values end with an empty one.
    assert [len(sample[2]) for sample in test.sample.samples()] == [4, 0, 0]
    assert [len(sample[1].data) for sample in test.pictures.samples()] == [4]
    assert test.ctx.is_stopping
    assert capsys.readouterr().out.startswith("ready\ntimes ")
