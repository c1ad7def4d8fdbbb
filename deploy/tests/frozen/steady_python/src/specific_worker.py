"""Drives with a constant speed, repeats the poses that it hears, and serves a battery."""

import logging
from collections.abc import Sequence

from steady_python import Context, FullPoseEuler, ParamChange, TBattery, Worker

log = logging.getLogger(__name__)


class SpecificWorker(Worker):
    """Its worker."""

    def initialize(self, ctx: Context) -> None:
        self.poses = 0

    def compute(self, ctx: Context) -> None:
        speed = ctx.params.speed
        ctx.differential_robot.set_speed_base(speed, 0.0)
        state = ctx.differential_robot.get_base_state()
        log.info("speed=%g x=%g", speed, state.x)

    def params_changed(self, ctx: Context, changes: Sequence[ParamChange]) -> None:
        log.info("parameter=%g", ctx.params.speed)

    def battery_status_get_battery_state(self, ctx: Context) -> TBattery:
        return TBattery(percentage=77.0)

    def full_pose_estimation_pub_new_full_pose(self, ctx: Context, pose: FullPoseEuler) -> None:
        self.poses += 1
        log.info("poses=%d", self.poses)
        ctx.seen.new_full_pose(pose)
