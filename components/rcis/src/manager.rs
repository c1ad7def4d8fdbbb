//! RoboComp's interface `InnerModelManager`: the tree of the world that sensors see.

use crate::SpecificWorker;
use crate::elements::{self, MOST_NODES};
use inner_model_manager::{Refusal, Tree};
use innermodel::language::Document;
use innermodel::{Edit, Error, Kind, NewNode, Snapshot};
use innermodel_simulation::World;
use rcis_generated::interfaces::inner_model_manager::ServeInnerModelManager;
use rcis_generated::{ColouredPoint, Context, HandlerError, Request};
use std::path::Path;
use std::sync::Arc;

/// The world, and the file of its scene.
pub struct Scene<'w> {
    pub(crate) world: &'w mut World,
    pub(crate) file: &'w Path,
    pub(crate) refuses_collisions: bool,
}

fn refused(error: innermodel_simulation::Error) -> Refusal {
    match error {
        innermodel_simulation::Error::Tree(error) => Refusal::Tree(error),
        collision @ innermodel_simulation::Error::Collision { .. } => {
            Refusal::Collision(collision.to_string())
        }
        other => Refusal::Kind(other.to_string()),
    }
}

impl Tree for Scene<'_> {
    fn snapshot(&self) -> Arc<Snapshot> {
        self.world.tree()
    }

    fn read(&self, elements: &str) -> Result<Document, Refusal> {
        elements::read(self.file, elements)
    }

    fn change(&mut self, make: impl Fn(&mut Edit) -> Result<(), Error>) -> Result<(), Refusal> {
        self.world.edit(make).map_err(refused)
    }

    fn move_bodies(
        &mut self,
        make: impl Fn(&mut Edit) -> Result<(), Error>,
    ) -> Result<(), Refusal> {
        if self.refuses_collisions {
            return self.world.edit_apart(make).map_err(refused);
        }
        self.change(make)
    }

    fn add(&mut self, parent: &str, node: NewNode) -> Result<(), Refusal> {
        if self.world.tree().len() >= MOST_NODES {
            let text = format!("a world has at most {MOST_NODES} nodes");
            return Err(Refusal::Value(text));
        }
        let added = self.world.edit(|edit| edit.add(parent, node).map(drop));
        added.map_err(refused)
    }

    fn remove(&mut self, id: &str) -> Result<(), Refusal> {
        self.change(|edit| edit.remove(id).map(drop))
    }

    fn collide(&mut self, a: &str, b: &str) -> Result<bool, Refusal> {
        self.world.collide(a, b).map_err(refused)
    }

    /// No sensor measures the points of a node.
    fn set_cloud(&mut self, id: &str, _cloud: Vec<ColouredPoint>) -> Result<(), Refusal> {
        let tree = self.world.tree();
        let node = tree.node(id)?;
        let (id, tag) = (rc_diagnostics::foreign::clean(id), node.kind().tag());
        Err(Refusal::Kind(if *node.kind() == Kind::PointCloud {
            format!("no sensor sees the points of `{id}`; the simulator does not keep them")
        } else {
            format!("`{id}` is a {tag}, not a pointcloud")
        }))
    }
}

impl ServeInnerModelManager<Context> for SpecificWorker {
    fn serve(&mut self, ctx: &mut Context, request: &mut Request<'_>) -> Result<(), HandlerError> {
        self.manager().serve(ctx, request)
    }
}
