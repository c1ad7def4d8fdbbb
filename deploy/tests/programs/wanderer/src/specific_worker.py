"""Walks at random."""

from wanderer import Context, FullPoseEuler, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.x = 0.0

    def compute(self, ctx: Context) -> None:
        self.x += ctx.random.uniform(-ctx.params.step, ctx.params.step)
        # Seconds of a minute: a `float` holds no more digits of the time.
        second = ctx.now().total_seconds() % 60.0
        pose = FullPoseEuler(x=self.x, y=second, z=ctx.params.step)
        ctx.full_pose_estimation_pub.new_full_pose(pose)
