//! Knows the rooms of a home, and logs which doors others have found there.

use room_keeper_generated::tracing::info;
use room_keeper_generated::world::DoorChange;
use room_keeper_generated::{Context, Worker, WorkerError, WorldHandlers};

pub struct SpecificWorker {}

impl Worker<Context> for SpecificWorker {
    fn initialize(_ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {})
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        // After a restart, the others still have the room.
        let (room, length) = (&ctx.params.room, ctx.params.length);
        if ctx.g.has_joined() && ctx.g.snapshot().room(room).is_err() {
            ctx.g
                .change(|edit| edit.add_room(room)?.set_length(length))?;
        }
        Ok(())
    }
}

impl WorldHandlers for SpecificWorker {
    fn door_changed(&mut self, ctx: &mut Context, change: &DoorChange) {
        for door in change.added() {
            let at = change.after.pose(ctx.params.room.as_str(), door);
            let [x, y, _] = at.map(|pose| pose.translation).unwrap_or_default();
            let width = door.width().unwrap_or_default();
            info!(
                "door {} of {width} m at {x} {y}",
                door.name().unwrap_or_default()
            );
        }
        for door in change.changed() {
            let opened = door.opened().unwrap_or_default();
            info!(
                "door {} is open by {opened:.2}",
                door.name().unwrap_or_default()
            );
        }
    }
}
