//! Copies the poses of nodes from one world to another one.

use mirror_generated::{Context, Worker, WorkerError};

/// The world that the sensors of an instance see.
const WORLD: &str = "";
/// Poses are those in the root, since a parent may be elsewhere in the other world.
const ROOT: &str = "root";

/// A detector, and what follows its detections. It keeps nothing: each detection is a whole pose.
pub struct SpecificWorker;

impl Worker for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let mut failed = Vec::new();
        for id in &ctx.params.nodes {
            // Without a detection, the node stays where it was seen last.
            let moved = match ctx.seen.get_pose(WORLD, id, ROOT) {
                Ok(pose) => ctx
                    .imagined
                    .teleport(WORLD, id, ROOT, &pose)
                    .map_err(|error| error.to_string()),
                Err(error) => Err(error.to_string()),
            };
            if let Err(error) = moved {
                failed.push(format!("`{id}`: {error}"));
            }
        }
        if failed.is_empty() {
            Ok(())
        } else {
            Err(WorkerError::Failed(failed.join("; ")))
        }
    }
}
