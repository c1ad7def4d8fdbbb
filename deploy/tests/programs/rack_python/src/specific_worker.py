"""A rack of devices. Each member has a value of its own, by which a test tells them apart: 1 for
the first member, 2 for the second."""

from rack_python import (
    BatteryStatusClient,
    CallError,
    Context,
    FullPoseEstimationPubPublisher,
    FullPoseEuler,
    GetLaserAndBStateDataAnswer,
    LaserConfData,
    Member,
    SlotArray,
    TBaseState,
    TBattery,
    TData,
    Worker,
)


def own(member: Member) -> float:
    """The value of a member that has no source."""
    return member.index + 1.0


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        # The last pose that each member of an array has heard.
        self.heard: dict[Member, FullPoseEuler] = {}
        for name in ctx.params.members:
            ctx.lasers.open(name)
            ctx.poses.open(name)
        if not ctx.params.members:
            ctx.lasers.open_listed()
            ctx.poses.open_listed()
        for receives in (ctx.tracks, ctx.dds_tracks, ctx.ros_tracks):
            receives.open_listed()
        for serves in (ctx.dds_batteries, ctx.ros_batteries):
            serves.open_listed()
        ctx.sources.open_listed()
        ctx.dds_sources.open_listed()
        ctx.ros_sources.open_listed()
        ctx.dds_poses.open_listed()
        ctx.ros_poses.open_listed()

    def compute(self, ctx: Context) -> None:
        self.publish(ctx.poses, ctx.tracks)
        self.publish(ctx.dds_poses, ctx.dds_tracks)
        self.publish(ctx.ros_poses, ctx.ros_tracks)

    def publish(
        self,
        poses: SlotArray[FullPoseEstimationPubPublisher],
        tracks: SlotArray[None],
    ) -> None:
        """Publishes a pose for each member: the one that the track of its name heard, else its
        own."""
        for member, publisher in poses.items():
            track = tracks.get(member.name)
            heard = self.heard.get(track) if track else None
            publisher.new_full_pose(heard or FullPoseEuler(x=own(member)))

    def battery(
        self, sources: SlotArray[BatteryStatusClient], member: Member
    ) -> TBattery:
        """The battery of the source with the name of this member, else its own."""
        source = sources.get(member.name)
        if source is None:
            return TBattery(percentage=own(member))
        return sources[source].get_battery_state()

    def scan(self, ctx: Context, member: Member) -> list[TData]:
        """The scan of the source with the name of this member, else one measure."""
        source = ctx.sources.get(member.name)
        if source is None:
            return [TData(dist=1000.0 * own(member))]
        try:
            return ctx.sources[source].get_laser_data()
        except CallError:
            return []

    def lasers_get_laser_data(self, ctx: Context, member: Member) -> list[TData]:
        return self.scan(ctx, member)

    def lasers_get_laser_and_b_state_data(
        self, ctx: Context, member: Member
    ) -> GetLaserAndBStateDataAnswer:
        return GetLaserAndBStateDataAnswer(
            b_state=TBaseState(), result=self.scan(ctx, member)
        )

    def lasers_get_laser_conf_data(self, ctx: Context, member: Member) -> LaserConfData:
        return LaserConfData(driver=ctx.name, device=member.name)

    def dds_batteries_get_battery_state(self, ctx: Context, member: Member) -> TBattery:
        return self.battery(ctx.dds_sources, member)

    def ros_batteries_get_battery_state(self, ctx: Context, member: Member) -> TBattery:
        return self.battery(ctx.ros_sources, member)

    def tracks_new_full_pose(
        self, ctx: Context, member: Member, pose: FullPoseEuler
    ) -> None:
        self.heard[member] = pose

    def dds_tracks_new_full_pose(
        self, ctx: Context, member: Member, pose: FullPoseEuler
    ) -> None:
        self.heard[member] = pose

    def ros_tracks_new_full_pose(
        self, ctx: Context, member: Member, pose: FullPoseEuler
    ) -> None:
        self.heard[member] = pose
