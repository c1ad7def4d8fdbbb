"""The clock without a network: the worker moves the time of its test."""

from datetime import timedelta

import pytest
from robocomp import Order

from clock_python import Params
from clock_python.testing import TestContext
from specific_worker import SpecificWorker

STEP = timedelta(milliseconds=10)


def params(**changes: timedelta | bool) -> Params:
    all = Params(
        step=STEP,
        rate=1.0,
        paused=False,
        wait=True,
        limit=timedelta(seconds=5),
        at_once=False,
        end=timedelta(0),
    )
    for name, value in changes.items():
        setattr(all, name, value)
    return all


def test_time_passes_by_its_step_until_it_ends() -> None:
    test = TestContext(params(end=5 * STEP))
    worker = test.start(SpecificWorker)
    test.run(worker, 3 * STEP)
    assert (test.now, test.ctx.time.tick) == (3 * STEP, 3)
    test.run(worker, 10 * STEP)
    assert (test.now, test.ctx.now()) == (5 * STEP, 5 * STEP)


def test_time_that_is_paused_stands() -> None:
    test = TestContext(params(paused=True))
    test.run(test.start(SpecificWorker), 3 * STEP)
    assert test.now == timedelta(0)


def test_a_source_sets_time_and_has_no_followers_in_a_test() -> None:
    time = TestContext(params()).ctx.time
    assert time.is_active and time.missing() == time.followers() == []
    time.wait_for_all(STEP)
    time.wait_for_nobody()
    time.set_order(Order.AT_ONCE)
    time.set_paced(False)
    assert (time.advance(STEP), time.set(STEP)) == (1, 2)
    assert not time.release("nobody")
    with pytest.raises(ValueError, match="is negative"):
        time.advance(-STEP)
