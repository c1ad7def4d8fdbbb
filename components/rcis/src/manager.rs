//! RoboComp's interface `InnerModelManager`: the tree of the world that sensors see.

use crate::SpecificWorker;
use crate::elements::{self, MOST_NODES};
use inner_model_manager::{Manager, Refusal, Tree};
use innermodel::language::Document;
use innermodel::{Edit, Error, Kind, NewNode, Snapshot};
use innermodel_simulation::World;
use rcis_generated::interfaces::inner_model_manager as calls;
use rcis_generated::tracing::warn;
use rcis_generated::{
    ColouredPoint, Context, Coord3D, InnerModelManager, JointType, MeshType,
    NodeInformationSequence, Plane3D, PointCloudVector, Pose3D, robo_comp_inner_model_manager,
};
use std::path::Path;
use std::sync::Arc;

/// The world, and the file of its scene.
struct Scene<'w> {
    world: &'w mut World,
    file: &'w Path,
    refuses_collisions: bool,
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

impl SpecificWorker {
    fn manager(&mut self) -> Manager<Scene<'_>> {
        Manager(Scene {
            world: &mut self.world,
            file: &self.scene,
            refuses_collisions: self.refuses_collisions,
        })
    }
}

impl InnerModelManager for SpecificWorker {
    fn add_transform(
        &mut self,
        _ctx: &mut Context,
        item: String,
        engine: String,
        base: String,
        pose: Pose3D,
    ) -> Result<bool, calls::AddTransformError> {
        self.manager().add_transform(item, engine, base, pose)
    }

    fn add_joint(
        &mut self,
        _ctx: &mut Context,
        item: String,
        base: String,
        j: JointType,
    ) -> Result<bool, calls::AddJointError> {
        self.manager().add_joint(item, base, j)
    }

    fn add_mesh(
        &mut self,
        _ctx: &mut Context,
        item: String,
        base: String,
        m: MeshType,
    ) -> Result<bool, calls::AddMeshError> {
        self.manager().add_mesh(item, base, m)
    }

    fn add_plane(
        &mut self,
        _ctx: &mut Context,
        item: String,
        base: String,
        plane: Plane3D,
    ) -> Result<bool, calls::AddPlaneError> {
        self.manager().add_plane(item, base, plane)
    }

    fn get_all_node_information(
        &mut self,
        _ctx: &mut Context,
    ) -> Result<NodeInformationSequence, calls::GetAllNodeInformationError> {
        self.manager().get_all_node_information()
    }

    fn set_pose(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseError> {
        self.manager().set_pose(base, item, pose)
    }

    fn set_pose_from_parent(
        &mut self,
        _ctx: &mut Context,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseFromParentError> {
        self.manager().set_pose_from_parent(item, pose)
    }

    fn get_pose(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<calls::GetPoseAnswer, calls::GetPoseError> {
        self.manager().get_pose(base, item)
    }

    fn get_pose_from_parent(
        &mut self,
        _ctx: &mut Context,
        item: String,
    ) -> Result<calls::GetPoseFromParentAnswer, calls::GetPoseFromParentError> {
        self.manager().get_pose_from_parent(item)
    }

    fn set_plane(
        &mut self,
        _ctx: &mut Context,
        item: String,
        plane: Plane3D,
    ) -> Result<bool, calls::SetPlaneError> {
        self.manager().set_plane(item, plane)
    }

    fn transform(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
        coord_in_item: Coord3D,
    ) -> Result<calls::TransformAnswer, calls::TransformError> {
        self.manager().transform(base, item, coord_in_item)
    }

    fn get_transformation_matrix(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<robo_comp_inner_model_manager::Matrix, calls::GetTransformationMatrixError> {
        self.manager().get_transformation_matrix(base, item)
    }

    fn set_scale(
        &mut self,
        _ctx: &mut Context,
        item: String,
        scale_x: f32,
        scale_y: f32,
        scale_z: f32,
    ) -> Result<bool, calls::SetScaleError> {
        self.manager().set_scale(item, scale_x, scale_y, scale_z)
    }

    fn add_attribute(
        &mut self,
        _ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::AddAttributeError> {
        self.manager().add_attribute(id_node, name, type_, value)
    }

    fn remove_attribute(
        &mut self,
        _ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<bool, calls::RemoveAttributeError> {
        self.manager().remove_attribute(id_node, name)
    }

    fn set_attribute(
        &mut self,
        _ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::SetAttributeError> {
        self.manager().set_attribute(id_node, name, type_, value)
    }

    fn get_attribute(
        &mut self,
        _ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<calls::GetAttributeAnswer, calls::GetAttributeError> {
        self.manager().get_attribute(id_node, name)
    }

    fn remove_node(
        &mut self,
        _ctx: &mut Context,
        item: String,
    ) -> Result<bool, calls::RemoveNodeError> {
        self.manager().remove_node(item)
    }

    fn move_node(
        &mut self,
        _ctx: &mut Context,
        src: String,
        dst: String,
    ) -> Result<bool, calls::MoveNodeError> {
        self.manager().move_node(src, dst)
    }

    fn collide(&mut self, _ctx: &mut Context, a: String, b: String) -> bool {
        let found = self.manager().collide(&a, &b);
        found.unwrap_or_else(|refusal| {
            warn!("collide: {}", refusal.text());
            false
        })
    }

    fn set_point_cloud_data(&mut self, _ctx: &mut Context, id: String, cloud: PointCloudVector) {
        if let Err(refusal) = self.manager().set_point_cloud_data(&id, cloud) {
            warn!("setPointCloudData: {}", refusal.text());
        }
    }
}
