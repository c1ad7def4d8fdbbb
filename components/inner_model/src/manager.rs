//! RoboComp's interface `InnerModelManager`.

use crate::SpecificWorker;
use crate::specific_worker::now;
use crate::world::World;
use inner_model_generated::interfaces::inner_model_manager::ServeInnerModelManager;
use inner_model_generated::{ColouredPoint, Context, HandlerError, Request};
use inner_model_manager::Refusal;
use inner_model_manager::{Manager, Tree};
use innermodel::language::Document;
use innermodel::{Edit, Error, NewNode, Snapshot, Time};
use std::sync::Arc;

/// The tree, which changes now.
pub struct Now<'w> {
    world: &'w mut World,
    time: Time,
}

impl Tree for Now<'_> {
    fn snapshot(&self) -> Arc<Snapshot> {
        self.world.tree()
    }

    fn read(&self, elements: &str) -> Result<Document, Refusal> {
        self.world.read(elements)
    }

    fn change(&mut self, make: impl Fn(&mut Edit) -> Result<(), Error>) -> Result<(), Refusal> {
        self.world.change(self.time, |edit| Ok(make(edit)?))
    }

    fn move_bodies(
        &mut self,
        make: impl Fn(&mut Edit) -> Result<(), Error>,
    ) -> Result<(), Refusal> {
        self.world.move_bodies(self.time, |edit| Ok(make(edit)?))
    }

    fn add(&mut self, parent: &str, node: NewNode) -> Result<(), Refusal> {
        self.world
            .change(self.time, |edit| Ok(edit.add(parent, node).map(drop)?))
    }

    fn remove(&mut self, id: &str) -> Result<(), Refusal> {
        self.world.remove(self.time, id)
    }

    fn collide(&mut self, a: &str, b: &str) -> Result<bool, Refusal> {
        Ok(self.world.space().collide(a, b)?)
    }

    fn set_cloud(&mut self, id: &str, cloud: Vec<ColouredPoint>) -> Result<(), Refusal> {
        self.world.set_cloud(id, &cloud)
    }
}

impl SpecificWorker {
    /// The handlers of the interface.
    pub fn manager(&mut self, ctx: &Context) -> Manager<Now<'_>> {
        Manager(Now {
            time: now(ctx),
            world: &mut self.world,
        })
    }
}

impl ServeInnerModelManager<Context> for SpecificWorker {
    fn serve(&mut self, ctx: &mut Context, request: &mut Request<'_>) -> Result<(), HandlerError> {
        self.manager(ctx).serve(ctx, request)
    }
}
