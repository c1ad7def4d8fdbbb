//! RoboComp's interface `InnerModelManager`.

use crate::SpecificWorker;
use crate::refusal::Refusal;
use crate::specific_worker::now;
use crate::wire::{pose3d_in, pose3d_out};
use crate::world::{readable_mesh, wrong_kind};
use inner_model_generated::interfaces::inner_model_manager as calls;
use inner_model_generated::tracing::warn;
use inner_model_generated::{
    AttributeType, ColouredPoint, Context, Coord3D, InnerModelManager, InnerModelManagerError,
    JointType, MeshType, NodeInformation, NodeInformationSequence, NodeType, Plane3D,
    PointCloudVector, Pose3D, robo_comp_inner_model_manager,
};
use innermodel::kinds::{Axis, Engine, Joint, Kind, Mesh, Plane, Render, Transform};
use innermodel::{NewNode, NodeRef, Point, Pose, Snapshot};

/// The reply or the exception of an operation.
fn reply<T, E: From<InnerModelManagerError>>(result: Result<T, Refusal>) -> Result<T, E> {
    result.map_err(|refusal| InnerModelManagerError::from(refusal).into())
}

/// The reply of an operation that changes something.
fn done<E: From<InnerModelManagerError>>(result: Result<(), Refusal>) -> Result<bool, E> {
    reply(result.map(|()| true))
}

fn finite(numbers: &[f32]) -> Result<(), Refusal> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Refusal::Value("a number is not finite".to_owned()))
}

/// A node that transforms: RoboComp asks for nothing else in poses.
fn frame<'t>(tree: &'t Snapshot, id: &str) -> Result<NodeRef<'t>, Refusal> {
    let node = tree.node(id)?;
    if node.kind().may_have_children() {
        return Ok(node);
    }
    Err(wrong_kind(&node, "a transform"))
}

/// The pose of `item` in `base`.
fn pose_in_base(tree: &Snapshot, base: &str, item: &str) -> Result<innermodel::Transform, Refusal> {
    let (base, item) = (frame(tree, base)?, frame(tree, item)?);
    Ok(tree.between(base.node_id(), item.node_id())?)
}

fn joint_kind(joint: &JointType) -> Result<Kind, Refusal> {
    finite(&[
        joint.lx, joint.ly, joint.lz, joint.hx, joint.hy, joint.hz, joint.mass,
    ])?;
    let axis = match joint.axis.as_str() {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" | "" => Axis::Z,
        _ => return Err(Refusal::Value("expected the axis x, y or z".to_owned())),
    };
    let (min, max) = (f64::from(joint.min), f64::from(joint.max));
    // Infinity is no limit.
    let is_range = min <= max && min < f64::INFINITY && max > f64::NEG_INFINITY;
    if !is_range {
        let text = format!("there is no angle from {min} to {max}");
        return Err(Refusal::Value(text));
    }
    Ok(Kind::Joint(Joint {
        axis,
        min,
        max,
        home: 0.0,
        max_speed: 0.0,
        port: port(joint.port)?,
        low: [joint.lx, joint.ly, joint.lz].map(f64::from),
        high: [joint.hx, joint.hy, joint.hz].map(f64::from),
    }))
}

fn port(port: i32) -> Result<u32, Refusal> {
    u32::try_from(port).map_err(|_| Refusal::Value(format!("{port} is no port")))
}

fn scale(numbers: [f32; 3]) -> Result<[f64; 3], Refusal> {
    finite(&numbers)?;
    if numbers.iter().any(|number| *number < 0.0) {
        let [x, y, z] = numbers;
        let text = format!("the scale ({x}, {y}, {z}) has a negative number");
        return Err(Refusal::Value(text));
    }
    Ok(numbers.map(f64::from))
}

fn node_type(kind: &Kind) -> NodeType {
    use innermodel::kinds::Drive;
    match kind {
        Kind::Transform(_) | Kind::Axes(_) | Kind::Battery(_) | Kind::Human(_) => {
            NodeType::Transform
        }
        Kind::Joint(_) | Kind::Prismatic(_) => NodeType::Joint,
        Kind::TouchSensor(_) => NodeType::TouchSensor,
        Kind::Robot(robot) => match robot.drive {
            Drive::Differential => NodeType::DifferentialRobot,
            Drive::Omni => NodeType::OmniRobot,
        },
        Kind::Camera(_) => NodeType::Camera,
        Kind::Rgbd(_) => NodeType::Rgbd,
        Kind::Laser(_) | Kind::Lidar(_) | Kind::Ultrasound(_) => NodeType::Laser,
        Kind::Imu(_) => NodeType::Imu,
        Kind::Plane(_) => NodeType::Plane,
        Kind::Display(_) => NodeType::DisplayII,
        Kind::Mesh(_) | Kind::Solid(_) => NodeType::Mesh,
        Kind::PointCloud => NodeType::PointCloud,
    }
}

fn information(node: &NodeRef<'_>) -> NodeInformation {
    let attributes = node.attributes();
    NodeInformation {
        id: node.id().to_owned(),
        parent_id: node
            .parent()
            .map_or_else(String::new, |parent| parent.id().to_owned()),
        n_type: node_type(node.kind()),
        attributes: attributes
            .map(|(name, form, value)| {
                let attribute = AttributeType {
                    type_: form.to_owned(),
                    value: value.to_owned(),
                };
                (name.to_owned(), attribute)
            })
            .collect(),
    }
}

impl SpecificWorker {
    fn add_node(&mut self, ctx: &Context, base: &str, node: NewNode) -> Result<(), Refusal> {
        self.world.change(now(ctx), |edit| {
            edit.add(base, node)?;
            Ok(())
        })
    }

    fn new_mesh(&self, item: &str, mesh: MeshType) -> Result<NewNode, Refusal> {
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
        let mut document = self.world.read(&element).map_err(unreadable)?;
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
        ctx: &Context,
        item: &str,
        expected: &str,
        change: impl Fn(&mut Kind) -> bool,
    ) -> Result<(), Refusal> {
        self.world.move_bodies(now(ctx), |edit| {
            let node = edit.snapshot().node(item)?;
            let mut kind = node.kind().clone();
            if !change(&mut kind) {
                return Err(wrong_kind(&node, expected));
            }
            Ok(edit.set_kind(item, kind)?)
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
        done(self.add_node(ctx, &base, node))
    }

    fn add_joint(
        &mut self,
        ctx: &mut Context,
        item: String,
        base: String,
        j: JointType,
    ) -> Result<bool, calls::AddJointError> {
        let kind = joint_kind(&j);
        let node = kind.map(|kind| NewNode::new(item, kind, pose3d_in(&j.pose)));
        done(node.and_then(|node| self.add_node(ctx, &base, node)))
    }

    fn add_mesh(
        &mut self,
        ctx: &mut Context,
        item: String,
        base: String,
        m: MeshType,
    ) -> Result<bool, calls::AddMeshError> {
        let node = self.new_mesh(&item, m);
        done(node.and_then(|node| self.add_node(ctx, &base, node)))
    }

    fn add_plane(
        &mut self,
        ctx: &mut Context,
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
            size: size.map(f64::from),
            repeat: 1,
            normal: direction(normal),
            point: point.map(f64::from),
            collide: false,
        });
        let node = NewNode::new(item, kind, Pose::default());
        done(self.add_node(ctx, &base, node))
    }

    fn get_all_node_information(
        &mut self,
        _ctx: &mut Context,
    ) -> Result<NodeInformationSequence, calls::GetAllNodeInformationError> {
        let tree = self.world.tree();
        Ok(tree.nodes().map(|node| information(&node)).collect())
    }

    fn set_pose(
        &mut self,
        ctx: &mut Context,
        base: String,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseError> {
        let tree = self.world.tree();
        let frames = frame(&tree, &base).and(frame(&tree, &item));
        done(frames.and_then(|_| {
            self.world
                .set_pose_in(now(ctx), &item, &base, pose3d_in(&pose))
        }))
    }

    fn set_pose_from_parent(
        &mut self,
        ctx: &mut Context,
        item: String,
        pose: Pose3D,
    ) -> Result<bool, calls::SetPoseFromParentError> {
        done(self.world.set_pose(now(ctx), &item, pose3d_in(&pose)))
    }

    fn get_pose(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<calls::GetPoseAnswer, calls::GetPoseError> {
        let there = pose_in_base(&self.world.tree(), &base, &item);
        reply(there.map(|there| (true, pose3d_out(&there.pose()))))
    }

    fn get_pose_from_parent(
        &mut self,
        _ctx: &mut Context,
        item: String,
    ) -> Result<calls::GetPoseFromParentAnswer, calls::GetPoseFromParentError> {
        let tree = self.world.tree();
        reply(frame(&tree, &item).map(|node| (true, pose3d_out(&node.pose()))))
    }

    fn set_plane(
        &mut self,
        ctx: &mut Context,
        item: String,
        plane: Plane3D,
    ) -> Result<bool, calls::SetPlaneError> {
        let normal = [plane.nx, plane.ny, plane.nz];
        let point = [plane.px, plane.py, plane.pz];
        if let Err(refusal) = finite([normal, point].as_flattened()) {
            return done(Err(refusal));
        }
        done(self.change_kind(ctx, &item, "a plane", |kind| {
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
        _ctx: &mut Context,
        base: String,
        item: String,
        coord_in_item: Coord3D,
    ) -> Result<calls::TransformAnswer, calls::TransformError> {
        let there = pose_in_base(&self.world.tree(), &base, &item);
        reply(there.map(|there| {
            let Coord3D { x, y, z } = coord_in_item;
            let point = there.point(&Point::new(x.into(), y.into(), z.into()));
            let [x, y, z] = point.coords.map(|number| number as f32).into();
            (true, Coord3D { x, y, z })
        }))
    }

    fn get_transformation_matrix(
        &mut self,
        _ctx: &mut Context,
        base: String,
        item: String,
    ) -> Result<robo_comp_inner_model_manager::Matrix, calls::GetTransformationMatrixError> {
        let there = pose_in_base(&self.world.tree(), &base, &item);
        reply(there.map(|there| {
            robo_comp_inner_model_manager::Matrix {
                cols: 4,
                rows: 4,
                // Its columns are the rows of the transposed one.
                data: there
                    .matrix()
                    .transpose()
                    .iter()
                    .map(|n| *n as f32)
                    .collect(),
            }
        }))
    }

    fn set_scale(
        &mut self,
        ctx: &mut Context,
        item: String,
        scale_x: f32,
        scale_y: f32,
        scale_z: f32,
    ) -> Result<bool, calls::SetScaleError> {
        let scale = scale([scale_x, scale_y, scale_z]);
        done(scale.and_then(|scale| {
            self.change_kind(ctx, &item, "a mesh", |kind| {
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
        ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::AddAttributeError> {
        done(self.world.change(now(ctx), |edit| {
            Ok(edit.add_attribute(&id_node, &name, &type_, &value)?)
        }))
    }

    fn remove_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<bool, calls::RemoveAttributeError> {
        done(
            self.world
                .change(now(ctx), |edit| Ok(edit.remove_attribute(&id_node, &name)?)),
        )
    }

    fn set_attribute(
        &mut self,
        ctx: &mut Context,
        id_node: String,
        name: String,
        type_: String,
        value: String,
    ) -> Result<bool, calls::SetAttributeError> {
        done(self.world.change(now(ctx), |edit| {
            Ok(edit.set_attribute(&id_node, &name, &type_, &value)?)
        }))
    }

    fn get_attribute(
        &mut self,
        _ctx: &mut Context,
        id_node: String,
        name: String,
    ) -> Result<calls::GetAttributeAnswer, calls::GetAttributeError> {
        let tree = self.world.tree();
        let found = tree.node(&id_node).and_then(|node| node.attribute(&name));
        let found = found.map(|(form, value)| (true, form.to_owned(), value.to_owned()));
        reply(found.map_err(Refusal::Tree))
    }

    fn remove_node(
        &mut self,
        ctx: &mut Context,
        item: String,
    ) -> Result<bool, calls::RemoveNodeError> {
        done(self.world.remove(now(ctx), &item))
    }

    fn move_node(
        &mut self,
        ctx: &mut Context,
        src: String,
        dst: String,
    ) -> Result<bool, calls::MoveNodeError> {
        done(
            self.world
                .move_bodies(now(ctx), |edit| Ok(edit.move_to(&src, &dst)?)),
        )
    }

    fn collide(&mut self, _ctx: &mut Context, a: String, b: String) -> bool {
        let found = self.world.space().collide(&a, &b);
        found.unwrap_or_else(|error| {
            warn!("collide: {error}");
            false
        })
    }

    fn set_point_cloud_data(&mut self, _ctx: &mut Context, id: String, cloud: PointCloudVector) {
        let points = cloud.into_iter().map(|point| ColouredPoint {
            x: point.x,
            y: point.y,
            z: point.z,
            red: point.r,
            green: point.g,
            blue: point.b,
        });
        let set = self.world.set_cloud(&id, points.collect());
        if let Err(refusal) = set {
            warn!(
                "setPointCloudData: {}",
                InnerModelManagerError::from(refusal).text
            );
        }
    }
}

/// A normal of 0 is that of a plane without one.
fn direction(normal: [f32; 3]) -> [f64; 3] {
    if normal == [0.0; 3] {
        return [0.0, 0.0, -1.0];
    }
    normal.map(f64::from)
}
