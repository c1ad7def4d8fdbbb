//! Copies the poses of nodes from one world to another one.

use mirror_generated::interfaces::simulation::{GetPoseError, TeleportError};
use mirror_generated::{Context, Worker, WorkerError};

/// The world that the sensors of an instance see.
const WORLD: &str = "";
/// Poses are those in the root, because a parent may be elsewhere in the other world.
const ROOT: &str = "root";

/// A detector, and what follows its detections. It keeps nothing: each detection is a whole pose.
pub struct SpecificWorker;

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let mut failed = Vec::new();
        for id in &ctx.params.nodes {
            // Without a detection, the node stays where it was seen last. A call without a reply ends
            // the period: the calls for the other nodes would take as long to fail.
            let refused = match ctx.seen.get_pose(WORLD, id, ROOT) {
                Ok(pose) => match ctx.imagined.teleport(WORLD, id, ROOT, &pose) {
                    Ok(()) => continue,
                    Err(TeleportError::SimulationError(refused)) => refused,
                    Err(TeleportError::Call(error)) => return Err(error.into()),
                },
                Err(GetPoseError::SimulationError(refused)) => refused,
                Err(GetPoseError::Call(error)) => return Err(error.into()),
            };
            failed.push(format!("`{id}`: {refused}"));
        }
        if failed.is_empty() {
            Ok(())
        } else {
            Err(WorkerError::Failed(failed.join("; ")))
        }
    }
}
