//! Finds a door in the kitchen, and says how far it is open.

use door_finder_generated::tracing::{info, warn};
use door_finder_generated::world::RoomChange;
use door_finder_generated::{Context, Worker, WorkerError, WorldHandlers};

pub struct SpecificWorker {
    /// How far the door is open.
    opened: f64,
}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self { opened: 0.0 })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        if ctx.g.snapshot().door("front").is_err() {
            return Ok(());
        }
        self.opened = (self.opened + 0.01) % 1.0;
        let opened = self.opened;
        ctx.g
            .change(|edit| edit.door("front")?.set_opened(opened))?;
        Ok(())
    }
}

impl WorldHandlers for SpecificWorker {
    fn room_changed(&mut self, ctx: &mut Context, change: &RoomChange) {
        for room in change.added() {
            // After a restart, the others still have the door.
            if ctx.g.snapshot().door("front").is_ok() {
                continue;
            }
            let room = room.node_id();
            let found = ctx.g.change(|edit| {
                let mut door = edit.add_door("front")?;
                door.set_width(0.8)?;
                let door = door.id();
                let pose = [1.2, 0.0, 0.0, 0.0, 0.0, 0.0];
                edit.rt(room, door)?.set_pose(pose)
            });
            match found {
                Ok(token) => info!("a door is found: change {token}"),
                Err(error) => warn!("{error}"),
            }
        }
    }
}
