//! The operations of `RoboComp`'s interface `InnerModelManager`, for all components that serve it.
//!
//! A component implements [`Tree`] for the tree that it serves, and lets [`Manager`], which has the
//! handlers of the interface, serve its slot; each error is an exception with the code of the
//! interface.

mod arguments;
mod refusal;

pub use refusal::Refusal;

use arguments::{
    direction, finite, frame, information, joint_kind, narrow, pose_in_base, pose3d_in, pose3d_out,
    scale, wrong_kind,
};
use innermodel::kinds::{Engine, Kind, Mesh, Plane, Render, Transform};
use innermodel::language::Document;
use innermodel::{Edit, NewNode, Point, Pose, Snapshot};
use interfaces::rc_inner_model::ColouredPoint;
use interfaces::robo_comp_inner_model_manager::inner_model_manager::{
    self as calls, InnerModelManager,
};
use interfaces::robo_comp_inner_model_manager::{
    self as types, Coord3D, InnerModelManagerError, JointType, MeshType, NodeInformationSequence,
    Plane3D, PointCloudVector, Pose3D,
};
use rc_diagnostics::foreign::clean;
use std::path::Path;
use std::sync::Arc;

/// The tree of a component.
pub trait Tree {
    /// The present version.
    fn snapshot(&self) -> Arc<Snapshot>;

    /// Reads elements of a file, in the form of the contents of its outermost element. Meshes are
    /// searched from the file of the tree.
    fn read(&self, elements: &str) -> Result<Document, Refusal>;

    /// Makes a change that moves no body: all of it, or nothing.
    fn change(
        &mut self,
        make: impl Fn(&mut Edit) -> Result<(), innermodel::Error>,
    ) -> Result<(), Refusal>;

    /// Makes a change that moves bodies. A component may refuse those that let bodies collide.
    fn move_bodies(
        &mut self,
        make: impl Fn(&mut Edit) -> Result<(), innermodel::Error>,
    ) -> Result<(), Refusal>;

    /// Adds a node below another one.
    fn add(&mut self, parent: &str, node: NewNode) -> Result<(), Refusal>;

    /// Removes a node with all below it.
    fn remove(&mut self, id: &str) -> Result<(), Refusal>;

    /// Whether a body below one node touches one below another node.
    fn collide(&mut self, a: &str, b: &str) -> Result<bool, Refusal>;

    /// Replaces the points of a node.
    fn set_cloud(&mut self, id: &str, cloud: Vec<ColouredPoint>) -> Result<(), Refusal>;
}

/// Answers the operations of the interface for one tree.
#[derive(Debug)]
pub struct Manager<T>(pub T);

/// The reply or the exception of an operation.
fn reply<T, E: From<InnerModelManagerError>>(result: Result<T, Refusal>) -> Result<T, E> {
    result.map_err(|refusal| InnerModelManagerError::from(refusal).into())
}

/// The reply of an operation that changes something.
fn done<E: From<InnerModelManagerError>>(result: Result<(), Refusal>) -> Result<bool, E> {
    reply(result.map(|()| true))
}

/// Whether the file of a mesh can be read. `written` is its name in a text.
///
/// # Errors
/// The file is missing, or is not a mesh.
pub fn readable_mesh(path: Option<&Path>, written: &str) -> Result<(), Refusal> {
    let Some(path) = path else {
        return Err(Refusal::Path(format!(
            "cannot find the mesh `{}`",
            clean(written)
        )));
    };
    innermodel_mesh::read(path)
        .map(drop)
        .map_err(|error| Refusal::Path(format!("{}: {error}", clean(&path.to_string_lossy()))))
}

impl<T: Tree> Manager<T> {
    fn new_mesh(&self, item: &str, mesh: &MeshType) -> Result<NewNode, Refusal> {
        let scale = scale([mesh.scale_x, mesh.scale_y, mesh.scale_z])?;
        // Only a file knows where its meshes are: the node is read as one.
        let element = innermodel::language::element(&innermodel::language::Node::new(
            item,
            Kind::Mesh(Mesh {
                file: mesh.mesh_path.clone(),
                path: None,
                scale,
                render: if mesh.render == 1 {
                    Render::Wireframe
                } else {
                    Render::Normal
                },
                collide: false,
            }),
        ));
        let unreadable = |refusal: Refusal| Refusal::Path(refusal.text());
        let mut document = self.0.read(&element).map_err(unreadable)?;
        let kind = document.nodes.pop().map(|node| node.kind);
        let Some(Kind::Mesh(read)) = kind else {
            return Err(Refusal::Path(format!(
                "cannot find the mesh `{}`",
                mesh.mesh_path
            )));
        };
        readable_mesh(read.path.as_deref(), &read.file)?;
        Ok(NewNode::new(item, Kind::Mesh(read), pose3d_in(&mesh.pose)))
    }

    /// Changes the kind of a node that has to be of one kind.
    fn change_kind(
        &mut self,
        item: &str,
        expected: &str,
        change: impl Fn(&mut Kind) -> bool,
    ) -> Result<(), Refusal> {
        let tree = self.0.snapshot();
        let node = tree.node(item)?;
        let mut kind = node.kind().clone();
        if !change(&mut kind) {
            return Err(wrong_kind(&node, expected));
        }
        self.0.move_bodies(|edit| edit.set_kind(item, kind.clone()))
    }
}

impl<T: Tree, C> InnerModelManager<C> for Manager<T> {
    fn add_transform(
        &mut self,
        _: &mut C,
        item: String,
        engine: String,
        base: String,
        pose: Pose3D,
    ) -> Result<bool, calls::AddTransformError> {
        let engine = match engine.as_str() {
            "static" | "" => Engine::Static,
            "bullet" => Engine::Bullet,
            _ => {
                let text = "expected the engine static or bullet".to_owned();
                return done(Err(Refusal::Engine(text)));
            }
        };
        let kind = Kind::Transform(Transform {
            engine,
            ..Transform::default()
        });
        let node = NewNode::new(item, kind, pose3d_in(&pose));
        done(self.0.add(&base, node))
    }

    fn add_joint(
        &mut self,
        _: &mut C,
        item: String,
        base: String,
        j: JointType,
    ) -> Result<bool, calls::AddJointError> {
        let kind = joint_kind(&j);
        let node = kind.map(|kind| NewNode::new(item, kind, pose3d_in(&j.pose)));
        done(node.and_then(|node| self.0.add(&base, node)))
    }

    fn add_mesh(
        &mut self,
        _: &mut C,
        item: String,
        base: String,
        m: MeshType,
    ) -> Result<bool, calls::AddMeshError> {
        let node = self.new_mesh(&item, &m);
        done(node.and_then(|node| self.0.add(&base, node)))
    }

    fn add_plane(
        &mut self,
        _: &mut C,
        item: String,
        base: String,
        plane: Plane3D,
    ) -> Result<bool, calls::AddPlaneError> {
        let (size, normal, point) = (
            [plane.width, plane.height, plane.thickness],
            [plane.nx, plane.ny, plane.nz],
            [plane.px, plane.py, plane.pz],
        );
        if let Err(refusal) = finite([size, normal, point].as_flattened()) {
            return done(Err(refusal));
        }
        let kind = Kind::Plane(Plane {
            texture: plane.texture,
            picture: None,
            size: size.map(f64::from),
            repeat: 1,
            normal: direction(normal),
            point: point.map(f64::from),
            collide: false,
        });
        let node = NewNode::new(item, kind, Pose::default());
        done(self.0.add(&base, node))
    }

    fn get_all_node_information(
        &mut self,
        _: &mut C,
    ) -> Result<NodeInformationSequence, calls::GetAllNodeInformationError> {
        let tree = self.0.snapshot();
        Ok(tree.nodes().map(|node| information(&node)).collect())
    }

    fn set_pose(
        &mut self,
        _: &mut C,
        base: String,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseError> {
        let tree = self.0.snapshot();
        let frames = frame(&tree, &base).and(frame(&tree, &item));
        done(frames.and_then(|_| {
            self.0
                .move_bodies(|edit| edit.set_pose_in(&item, &base, pose3d_in(&pose)))
        }))
    }

    fn set_pose_from_parent(
        &mut self,
        _: &mut C,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseFromParentError> {
        done(
            self.0
                .move_bodies(|edit| edit.set_pose(&item, pose3d_in(&pose))),
        )
    }

    fn get_pose(
        &mut self,
        _: &mut C,
        base: String,
        item: String,
    ) -> Result<calls::GetPoseAnswer, calls::GetPoseError> {
        let there = pose_in_base(&self.0.snapshot(), &base, &item);
        let pose = there.and_then(|there| pose3d_out(&there.pose()));
        reply(pose.map(|pose| (true, pose)))
    }

    fn get_pose_from_parent(
        &mut self,
        _: &mut C,
        item: String,
    ) -> Result<calls::GetPoseFromParentAnswer, calls::GetPoseFromParentError> {
        let tree = self.0.snapshot();
        let pose = frame(&tree, &item).and_then(|node| pose3d_out(&node.pose()));
        reply(pose.map(|pose| (true, pose)))
    }

    fn set_plane(
        &mut self,
        _: &mut C,
        item: String,
        plane: Plane3D,
    ) -> Result<bool, calls::SetPlaneError> {
        let normal = [plane.nx, plane.ny, plane.nz];
        let point = [plane.px, plane.py, plane.pz];
        if let Err(refusal) = finite([normal, point].as_flattened()) {
            return done(Err(refusal));
        }
        done(self.change_kind(&item, "a plane", |kind| {
            let plane = match kind {
                Kind::Plane(plane) => plane,
                Kind::Display(display) => &mut display.plane,
                _ => return false,
            };
            plane.normal = direction(normal);
            plane.point = point.map(f64::from);
            true
        }))
    }

    fn transform(
        &mut self,
        _: &mut C,
        base: String,
        item: String,
        coord_in_item: Coord3D,
    ) -> Result<calls::TransformAnswer, calls::TransformError> {
        let there = pose_in_base(&self.0.snapshot(), &base, &item);
        reply(there.and_then(|there| {
            let Coord3D { x, y, z } = coord_in_item;
            finite(&[x, y, z])?;
            let point = there.point(&Point::new(x.into(), y.into(), z.into()));
            let [x, y, z] = narrow(point.coords.into())?;
            Ok((true, Coord3D { x, y, z }))
        }))
    }

    fn get_transformation_matrix(
        &mut self,
        _: &mut C,
        base: String,
        item: String,
    ) -> Result<types::Matrix, calls::GetTransformationMatrixError> {
        let there = pose_in_base(&self.0.snapshot(), &base, &item);
        reply(there.and_then(|there| {
            // Its columns are the rows of the transposed one.
            let rows: [[f64; 4]; 4] = there.matrix().transpose().into();
            let rows: [f64; 16] = std::array::from_fn(|at| rows[at / 4][at % 4]);
            Ok(types::Matrix {
                cols: 4,
                rows: 4,
                data: narrow(rows)?.to_vec(),
            })
        }))
    }

    fn set_scale(
        &mut self,
        _: &mut C,
        item: String,
        scale_x: f32,
        scale_y: f32,
        scale_z: f32,
    ) -> Result<bool, calls::SetScaleError> {
        let scale = scale([scale_x, scale_y, scale_z]);
        done(scale.and_then(|scale| {
            self.change_kind(&item, "a mesh", |kind| {
                let Kind::Mesh(mesh) = kind else {
                    return false;
                };
                mesh.scale = scale;
                true
            })
        }))
    }

    fn add_attribute(
        &mut self,
        _: &mut C,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::AddAttributeError> {
        done(
            self.0
                .change(|edit| edit.add_attribute(&id_node, &name, &type_, &value)),
        )
    }

    fn remove_attribute(
        &mut self,
        _: &mut C,
        id_node: String,
        name: String,
    ) -> Result<bool, calls::RemoveAttributeError> {
        done(self.0.change(|edit| edit.remove_attribute(&id_node, &name)))
    }

    fn set_attribute(
        &mut self,
        _: &mut C,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::SetAttributeError> {
        done(
            self.0
                .change(|edit| edit.set_attribute(&id_node, &name, &type_, &value)),
        )
    }

    fn get_attribute(
        &mut self,
        _: &mut C,
        id_node: String,
        name: String,
    ) -> Result<calls::GetAttributeAnswer, calls::GetAttributeError> {
        let tree = self.0.snapshot();
        let found = tree.node(&id_node).and_then(|node| node.attribute(&name));
        let found = found.map(|(form, value)| (true, form.to_owned(), value.to_owned()));
        reply(found.map_err(Refusal::Tree))
    }

    fn remove_node(&mut self, _: &mut C, item: String) -> Result<bool, calls::RemoveNodeError> {
        done(self.0.remove(&item))
    }

    fn move_node(
        &mut self,
        _: &mut C,
        src: String,
        dst: String,
    ) -> Result<bool, calls::MoveNodeError> {
        done(self.0.move_bodies(|edit| edit.move_to(&src, &dst)))
    }

    fn collide(&mut self, _: &mut C, a: String, b: String) -> bool {
        self.0.collide(&a, &b).unwrap_or_else(|refusal| {
            tracing::warn!("collide: {}", refusal.text());
            false
        })
    }

    fn set_point_cloud_data(&mut self, _: &mut C, id: String, cloud: PointCloudVector) {
        let points = cloud.into_iter().map(|point| ColouredPoint {
            x: point.x,
            y: point.y,
            z: point.z,
            red: point.r,
            green: point.g,
            blue: point.b,
        });
        if let Err(refusal) = self.0.set_cloud(&id, points.collect()) {
            tracing::warn!("setPointCloudData: {}", refusal.text());
        }
    }
}
