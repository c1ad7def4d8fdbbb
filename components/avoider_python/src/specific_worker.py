"""The behaviour of the robot in the states of `avoider.scxml`.

One scan and one motion in every period of `driving`.
"""

from __future__ import annotations

from datetime import timedelta

import numpy as np

from avoider_python import Context, Event, Worker
from policy import Motion, Scan, Settings, Side, cruise, is_clear, is_clear_again

# Below this percentage, the robot stops and charges; from the other one on, it drives again.
LOW = 20.0
FULL = 80.0
# How often the battery is read.
BATTERY_PERIOD = timedelta(seconds=1)

NOTHING = np.zeros(0, np.float32)


class SpecificWorker(Worker):
    """The robot's knowledge in its states."""

    def initialize(self, ctx: Context) -> None:
        # The scan of this period.
        self.scan = Scan(NOTHING, NOTHING)
        # The side to which it turns.
        self.side: Side | None = None
        # When it looked at the battery.
        self.looked: timedelta | None = None

    def entry_motion(self, ctx: Context) -> None:
        # The robot drives from the start on.
        ctx.machine.fire(Event.GO)

    def during_idle(self, ctx: Context) -> None:
        stand(ctx)

    def during_charging(self, ctx: Context) -> None:
        stand(ctx)

    def during_driving(self, ctx: Context) -> None:
        # Runs before the function of the state inside.
        if ctx.params.lockstep:
            # Two interfaces are two queues: a server that is late may serve the scan before the
            # motion that was sent earlier. One answers in the order in which it was asked, so that
            # an answer of the base says it is done.
            ctx.differential_robot.get_base_state()
        data = ctx.laser.get_laser_data()
        angles = np.array([measure.angle for measure in data], np.float32)
        distances = np.array([measure.dist for measure in data], np.float32)
        self.scan = Scan(angles, distances)

    def exit_driving(self, ctx: Context) -> None:
        ctx.differential_robot.stop_base()

    def during_cruising(self, ctx: Context) -> None:
        if is_clear(self.scan, settings(ctx)):
            drive(ctx, cruise(self.scan, settings(ctx)))
            return
        ctx.machine.fire(Event.OBSTACLE)
        self.turn(ctx)

    def during_turning(self, ctx: Context) -> None:
        if not is_clear_again(self.scan, settings(ctx)):
            self.turn(ctx)
            return
        ctx.machine.fire(Event.CLEAR)
        drive(ctx, cruise(self.scan, settings(ctx)))

    def exit_turning(self, ctx: Context) -> None:
        self.side = None

    def during_blocked(self, ctx: Context) -> None:
        if is_clear_again(self.scan, settings(ctx)):
            ctx.machine.fire(Event.CLEAR)
        drive(ctx, Motion())

    def during_battery(self, ctx: Context) -> None:
        now = ctx.now()
        is_early = (
            self.looked is not None
            and timedelta() <= now - self.looked < BATTERY_PERIOD
        )
        if is_early or not ctx.battery_status.is_connected:
            return
        self.looked = now
        battery = ctx.battery_status.get_battery_state()
        if battery.percentage < LOW:
            ctx.machine.fire(Event.BATTERY_LOW)
        elif battery.percentage >= FULL:
            ctx.machine.fire(Event.BATTERY_FULL)

    def turn(self, ctx: Context) -> None:
        """Turns on the spot, always to the same side."""
        if len(self.scan) == 0:
            drive(ctx, Motion())
            return
        if self.side is None:
            self.side = Side.freer(self.scan)
        drive(ctx, self.side.turn(settings(ctx)))


def stand(ctx: Context) -> None:
    """In lockstep, the time of the simulator passes with each motion."""
    if ctx.params.lockstep:
        drive(ctx, Motion())


def drive(ctx: Context, motion: Motion) -> None:
    """Sends a motion to the base."""
    ctx.differential_robot.set_speed_base(motion.advance, motion.turn)


def settings(ctx: Context) -> Settings:
    """The present parameters."""
    params = ctx.params
    return Settings(
        np.float32(params.safe_distance),
        np.float32(params.speed),
        np.float32(params.turn_speed),
    )
