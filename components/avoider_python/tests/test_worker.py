"""The worker without scanner, base, battery or process."""

from datetime import timedelta

import pytest

from avoider_python import Event, NoServer, Params, State, TBattery, TData
from avoider_python.testing import Fault, TestContext
from specific_worker import SpecificWorker

PERIOD = timedelta(milliseconds=50)
DRIVE = ("set_speed_base", 300.0, 0.0)
TURN = ("set_speed_base", 0.0, pytest.approx(0.9))
STAND = ("set_speed_base", 0.0, 0.0)


def context() -> TestContext:
    test = TestContext(
        Params(safe_distance=500.0, speed=300.0, turn_speed=0.9, lockstep=False)
    )
    test.battery_status.fail(Fault.NO_SERVER)
    return test


def wall(distance: float) -> list[TData]:
    """A wall all around, in mm."""
    return [TData(angle=step * 0.087, dist=distance) for step in range(-18, 19)]


def test_a_clear_way_is_driven_and_an_obstacle_is_not() -> None:
    test = context()
    worker = test.start(SpecificWorker)
    assert test.ctx.machine.active() == ["on.motion.idle", "on.battery.charged"]
    test.laser.on_get_laser_data(wall(4000.0))
    test.run(worker, PERIOD)
    assert test.ctx.machine.is_in(State.CRUISING)
    assert test.differential_robot.take_calls() == [DRIVE]
    test.laser.on_get_laser_data(wall(400.0))
    test.run(worker, PERIOD)
    assert test.ctx.machine.is_in(State.TURNING)
    assert test.differential_robot.take_calls() == [TURN]
    test.ctx.machine.fire(Event.STOP)
    test.run(worker, PERIOD)
    assert test.ctx.machine.is_in(State.IDLE)
    assert test.differential_robot.calls() == [("stop_base",)]


def test_a_robot_that_finds_no_way_stands_and_tries_again() -> None:
    test = context()
    worker = test.start(SpecificWorker)
    test.laser.on_get_laser_data(wall(400.0))
    test.run(worker, timedelta(seconds=11))
    assert test.ctx.machine.is_in(State.BLOCKED)
    assert test.differential_robot.take_calls()[-1] == STAND
    test.run(worker, timedelta(seconds=5))
    assert test.ctx.machine.is_in(State.TURNING)


def test_with_a_low_battery_it_stands_until_it_has_charged() -> None:
    test = context()
    test.battery_status.recover()
    test.laser.on_get_laser_data(wall(4000.0))
    worker = test.start(SpecificWorker)
    for percentage, state in [
        (50.0, State.CRUISING),
        (19.0, State.CHARGING),
        (80.0, State.CRUISING),
    ]:
        test.battery_status.on_get_battery_state(TBattery(percentage=percentage))
        test.run(worker, timedelta(seconds=2))
        assert test.ctx.machine.is_in(state), percentage


def test_without_a_scan_the_base_gets_no_command() -> None:
    test = context()
    worker = test.start(SpecificWorker)
    test.laser.fail(Fault.NO_SERVER)
    with pytest.raises(NoServer, match="no server at"):
        test.run(worker, PERIOD)
    assert test.differential_robot.calls() == []


def test_it_decides_once_a_period() -> None:
    test = TestContext()
    test.battery_status.fail(Fault.NO_SERVER)
    test.laser.on_get_laser_data(wall(4000.0))
    worker = test.start(SpecificWorker)
    test.run(worker, timedelta(seconds=1))
    assert len(test.differential_robot.calls()) == 20
    assert test.now == timedelta(seconds=1)
