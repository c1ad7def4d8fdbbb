//! A rack of devices. Each member has a value of its own, by which a test tells them apart: 1 for the first member, 2 for
//! the second.

use rack_generated::{
    BatteryStatusClient, CallError, Context, DdsBatteries, DdsTracks, DdsTracksSlot,
    FullPoseEstimationPubPublisher, FullPoseEuler, GetBatteryStateError, LaserConfData, Lasers,
    Member, RosBatteries, RosBatteriesSlot, RosTracks, RosTracksSlot, SendError, SlotArray,
    TBaseState, TBattery, TData, Tracks, Worker, WorkerError,
};

/// The last pose that each member of an array has heard.
type Heard = Vec<Option<FullPoseEuler>>;

pub struct SpecificWorker {
    heard: Heard,
    heard_over_dds: Heard,
    heard_over_ros: Heard,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        if ctx.params.members.is_empty() {
            ctx.lasers.open_listed()?;
            ctx.poses.open_listed()?;
        }
        for name in &ctx.params.members {
            ctx.lasers.open(name)?;
            ctx.poses.open(name)?;
        }
        ctx.sources.open_listed()?;
        ctx.tracks.open_listed()?;
        ctx.dds_batteries.open_listed()?;
        ctx.ros_batteries.open_listed()?;
        ctx.dds_sources.open_listed()?;
        ctx.ros_sources.open_listed()?;
        ctx.dds_poses.open_listed()?;
        ctx.ros_poses.open_listed()?;
        ctx.dds_tracks.open_listed()?;
        ctx.ros_tracks.open_listed()?;
        Ok(Self {
            heard: vec![None; ctx.tracks.len()],
            heard_over_dds: vec![None; ctx.dds_tracks.len()],
            heard_over_ros: vec![None; ctx.ros_tracks.len()],
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        publish(&mut ctx.poses, &ctx.tracks, &self.heard)?;
        publish(&mut ctx.dds_poses, &ctx.dds_tracks, &self.heard_over_dds)?;
        publish(&mut ctx.ros_poses, &ctx.ros_tracks, &self.heard_over_ros)?;
        Ok(())
    }
}

/// The value of a member that has no source.
fn own(member: &Member) -> f32 {
    (member.index() + 1) as f32
}

/// Publishes a pose for each member: the one that the track of its name heard, else its own.
fn publish(
    poses: &mut SlotArray<FullPoseEstimationPubPublisher>,
    tracks: &SlotArray<()>,
    heard: &Heard,
) -> Result<(), SendError> {
    for (member, publisher) in poses.iter_mut() {
        let track = tracks.get(member.name());
        let pose = match track.and_then(|track| heard[track.index()].clone()) {
            Some(heard) => heard,
            None => FullPoseEuler {
                x: own(member),
                ..FullPoseEuler::default()
            },
        };
        publisher.new_full_pose(&pose)?;
    }
    Ok(())
}

/// The battery of the source with the name of this member, else its own.
fn battery(
    sources: &mut SlotArray<BatteryStatusClient>,
    member: &Member,
) -> Result<TBattery, GetBatteryStateError> {
    let Some(source) = sources.get(member.name()).cloned() else {
        return Ok(TBattery {
            percentage: own(member),
            ..TBattery::default()
        });
    };
    sources[&source].get_battery_state()
}

/// The scan of the source with the name of this member, else one measure.
fn scan(ctx: &mut Context, member: &Member) -> Result<Vec<TData>, CallError> {
    let Some(source) = ctx.sources.get(member.name()).cloned() else {
        let dist = 1000.0 * own(member);
        return Ok(vec![TData { angle: 0.0, dist }]);
    };
    ctx.sources[&source].get_laser_data()
}

impl Lasers<Context> for SpecificWorker {
    fn get_laser_data(&mut self, ctx: &mut Context, member: &Member) -> Vec<TData> {
        scan(ctx, member).unwrap_or_default()
    }

    fn get_laser_and_b_state_data(
        &mut self,
        ctx: &mut Context,
        member: &Member,
    ) -> (Vec<TData>, TBaseState) {
        let scan = scan(ctx, member).unwrap_or_default();
        (scan, TBaseState::default())
    }

    fn get_laser_conf_data(&mut self, ctx: &mut Context, member: &Member) -> LaserConfData {
        LaserConfData {
            driver: ctx.name().to_owned(),
            device: member.name().to_owned(),
            ..LaserConfData::default()
        }
    }
}

impl DdsBatteries<Context> for SpecificWorker {
    fn get_battery_state(
        &mut self,
        ctx: &mut Context,
        member: &Member,
    ) -> Result<TBattery, GetBatteryStateError> {
        battery(&mut ctx.dds_sources, member)
    }
}

impl RosBatteries<Context, RosBatteriesSlot> for SpecificWorker {
    fn get_battery_state(
        &mut self,
        ctx: &mut Context,
        member: &Member,
    ) -> Result<TBattery, GetBatteryStateError> {
        battery(&mut ctx.ros_sources, member)
    }
}

impl Tracks<Context> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, member: &Member, pose: FullPoseEuler) {
        let _ = ctx;
        self.heard[member.index()] = Some(pose);
    }
}

impl DdsTracks<Context, DdsTracksSlot> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, member: &Member, pose: FullPoseEuler) {
        let _ = ctx;
        self.heard_over_dds[member.index()] = Some(pose);
    }
}

impl RosTracks<Context, RosTracksSlot> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, member: &Member, pose: FullPoseEuler) {
        let _ = ctx;
        self.heard_over_ros[member.index()] = Some(pose);
    }
}
