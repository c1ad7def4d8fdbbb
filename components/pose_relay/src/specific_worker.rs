//! Forwards poses from shared memory to ROS 2, as they are and as transforms.

use crate::transform::{rotation, stamp};
use pose_relay_generated::{
    Context, FullPoseEuler, Header, Robot, Transform, TransformStamped, Vector3, Worker,
    WorkerError, tracing::warn,
};

pub struct SpecificWorker {}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {})
    }

    fn compute(&mut self, _ctx: &mut Context) -> Result<(), WorkerError> {
        Ok(())
    }
}

impl Robot<Context> for SpecificWorker {
    fn new_full_pose(&mut self, ctx: &mut Context, pose: FullPoseEuler) {
        if let Err(why) = ctx.ros.new_full_pose(&pose) {
            warn!("a pose is not published: {why}");
        }
        let transform = TransformStamped {
            header: Header {
                stamp: stamp(ctx.now()),
                frame_id: ctx.params.parent_frame.clone(),
            },
            child_frame_id: ctx.params.child_frame.clone(),
            transform: Transform {
                translation: metres(pose.x, pose.y, pose.z),
                rotation: rotation(pose.rx.into(), pose.ry.into(), pose.rz.into()),
            },
        };
        if let Err(why) = ctx.tf.transforms(&[transform]) {
            warn!("a transform is not published: {why}");
        }
    }
}

/// Poses are in millimetres.
fn metres(x: f32, y: f32, z: f32) -> Vector3 {
    let [x, y, z] = [x, y, z].map(|value| f64::from(value) / 1000.0);
    Vector3 { x, y, z }
}
