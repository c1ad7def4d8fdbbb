//! RoboComp's interface `InnerModelManager`.

use crate::SpecificWorker;
use crate::specific_worker::now;
use crate::world::World;
use inner_model_generated::interfaces::inner_model_manager as calls;
use inner_model_generated::tracing::warn;
use inner_model_generated::{
    ColouredPoint, Context, Coord3D, InnerModelManager, JointType, MeshType,
    NodeInformationSequence, Plane3D, PointCloudVector, Pose3D, robo_comp_inner_model_manager,
};
use inner_model_manager::Refusal;
use inner_model_manager::{Manager, Tree};
use innermodel::language::Document;
use innermodel::{Edit, Error, NewNode, Snapshot, Time};
use std::sync::Arc;

/// The tree, which changes now.
struct Now<'w> {
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
    fn manager(&mut self, ctx: &Context) -> Manager<Now<'_>> {
        Manager(Now {
            time: now(ctx),
            world: &mut self.world,
        })
    }
}

impl InnerModelManager for SpecificWorker {
    fn add_transform(
        &mut self,
        ctx: &mut Context,
        item: String,
        engine: String,
        base: String,
        pose: Pose3D,
    ) -> Result<bool, calls::AddTransformError> {
        self.manager(ctx).add_transform(item, engine, base, pose)
    }

    fn add_joint(
        &mut self,
        ctx: &mut Context,
        item: String,
        base: String,
        j: JointType,
    ) -> Result<bool, calls::AddJointError> {
        self.manager(ctx).add_joint(item, base, j)
    }

    fn add_mesh(
        &mut self,
        ctx: &mut Context,
        item: String,
        base: String,
        m: MeshType,
    ) -> Result<bool, calls::AddMeshError> {
        self.manager(ctx).add_mesh(item, base, m)
    }

    fn add_plane(
        &mut self,
        ctx: &mut Context,
        item: String,
        base: String,
        plane: Plane3D,
    ) -> Result<bool, calls::AddPlaneError> {
        self.manager(ctx).add_plane(item, base, plane)
    }

    fn get_all_node_information(
        &mut self,
        ctx: &mut Context,
    ) -> Result<NodeInformationSequence, calls::GetAllNodeInformationError> {
        self.manager(ctx).get_all_node_information()
    }

    fn set_pose(
        &mut self,
        ctx: &mut Context,
        base: String,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseError> {
        self.manager(ctx).set_pose(base, item, pose)
    }

    fn set_pose_from_parent(
        &mut self,
        ctx: &mut Context,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseFromParentError> {
        self.manager(ctx).set_pose_from_parent(item, pose)
    }

    fn get_pose(
        &mut self,
        ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<calls::GetPoseAnswer, calls::GetPoseError> {
        self.manager(ctx).get_pose(base, item)
    }

    fn get_pose_from_parent(
        &mut self,
        ctx: &mut Context,
        item: String,
    ) -> Result<calls::GetPoseFromParentAnswer, calls::GetPoseFromParentError> {
        self.manager(ctx).get_pose_from_parent(item)
    }

    fn set_plane(
        &mut self,
        ctx: &mut Context,
        item: String,
        plane: Plane3D,
    ) -> Result<bool, calls::SetPlaneError> {
        self.manager(ctx).set_plane(item, plane)
    }

    fn transform(
        &mut self,
        ctx: &mut Context,
        base: String,
        item: String,
        coord_in_item: Coord3D,
    ) -> Result<calls::TransformAnswer, calls::TransformError> {
        self.manager(ctx).transform(base, item, coord_in_item)
    }

    fn get_transformation_matrix(
        &mut self,
        ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<robo_comp_inner_model_manager::Matrix, calls::GetTransformationMatrixError> {
        self.manager(ctx).get_transformation_matrix(base, item)
    }

    fn set_scale(
        &mut self,
        ctx: &mut Context,
        item: String,
        scale_x: f32,
        scale_y: f32,
        scale_z: f32,
    ) -> Result<bool, calls::SetScaleError> {
        self.manager(ctx).set_scale(item, scale_x, scale_y, scale_z)
    }

    fn add_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::AddAttributeError> {
        self.manager(ctx).add_attribute(id_node, name, type_, value)
    }

    fn remove_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<bool, calls::RemoveAttributeError> {
        self.manager(ctx).remove_attribute(id_node, name)
    }

    fn set_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::SetAttributeError> {
        self.manager(ctx).set_attribute(id_node, name, type_, value)
    }

    fn get_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<calls::GetAttributeAnswer, calls::GetAttributeError> {
        self.manager(ctx).get_attribute(id_node, name)
    }

    fn remove_node(
        &mut self,
        ctx: &mut Context,
        item: String,
    ) -> Result<bool, calls::RemoveNodeError> {
        self.manager(ctx).remove_node(item)
    }

    fn move_node(
        &mut self,
        ctx: &mut Context,
        src: String,
        dst: String,
    ) -> Result<bool, calls::MoveNodeError> {
        self.manager(ctx).move_node(src, dst)
    }

    fn collide(&mut self, ctx: &mut Context, a: String, b: String) -> bool {
        let found = self.manager(ctx).collide(&a, &b);
        found.unwrap_or_else(|refusal| {
            warn!("collide: {}", refusal.text());
            false
        })
    }

    fn set_point_cloud_data(&mut self, ctx: &mut Context, id: String, cloud: PointCloudVector) {
        if let Err(refusal) = self.manager(ctx).set_point_cloud_data(&id, cloud) {
            warn!("setPointCloudData: {}", refusal.text());
        }
    }
}
