//! The interface `InnerModel`.

use crate::SpecificWorker;
use crate::specific_worker::now;
use crate::wire::{direction_in, direction_out, node_out, point_in, point_out, pose_in, pose_out};
use inner_model_generated::interfaces::inner_model as calls;
use inner_model_generated::{
    Attribute, Cloud, Contact, Contacts, Context, Direction, Hit, InnerModel, InnerModelError,
    JointPosition, JointPositions, Near, Node, Nodes, Point, Pose, rc_inner_model,
};
use inner_model_manager::Refusal;
use innermodel::{NodeId, NodeRef, Snapshot};
use innermodel_collision::Space;
use std::collections::HashSet;
use std::time::Duration;

/// The reply or the exception of an operation.
fn reply<T, E: From<InnerModelError>>(result: Result<T, Refusal>) -> Result<T, E> {
    result.map_err(|refusal| InnerModelError::from(refusal).into())
}

/// The reply for a result of the tree.
fn of_tree<T, E: From<InnerModelError>>(result: Result<T, innermodel::Error>) -> Result<T, E> {
    reply(result.map_err(Refusal::Tree))
}

/// The id of a node that is there.
fn id(tree: &Snapshot, node: NodeId) -> String {
    tree.node(node)
        .map_or_else(|_| String::new(), |node| node.id().to_owned())
}

fn joint(node: &NodeRef<'_>) -> Option<JointPosition> {
    Some(JointPosition {
        id: node.id().to_owned(),
        position: node.position()?,
    })
}

impl InnerModel<Context> for SpecificWorker {
    fn transform(
        &mut self,
        _ctx: &mut Context,
        to: String,
        point: Point,
        source: String,
    ) -> Result<Point, calls::TransformError> {
        let tree = self.world.tree();
        reply(finite([point.x, point.y, point.z]).and_then(|()| {
            let there = tree.transform(&to, point_in(&point), &source)?;
            Ok(point_out(&there))
        }))
    }

    fn transform_direction(
        &mut self,
        _ctx: &mut Context,
        to: String,
        direction: Direction,
        source: String,
    ) -> Result<Direction, calls::TransformDirectionError> {
        let tree = self.world.tree();
        reply(
            finite([direction.x, direction.y, direction.z]).and_then(|()| {
                let there = tree.transform_vector(&to, direction_in(&direction), &source)?;
                Ok(direction_out(&there))
            }),
        )
    }

    fn get_pose(
        &mut self,
        _ctx: &mut Context,
        to: String,
        id: String,
    ) -> Result<Pose, calls::GetPoseError> {
        of_tree(self.world.tree().pose(&to, &id).map(|pose| pose_out(&pose)))
    }

    fn get_pose_at(
        &mut self,
        _ctx: &mut Context,
        to: String,
        id: String,
        time: i64,
    ) -> Result<Pose, calls::GetPoseAtError> {
        let time = Duration::from_nanos(u64::try_from(time).unwrap_or(0));
        let then = self.world.model.at(time);
        let there = then.and_then(|then| then.between(&to, &id));
        of_tree(there.map(|there| pose_out(&there.pose())))
    }

    fn get_matrix(
        &mut self,
        _ctx: &mut Context,
        to: String,
        source: String,
    ) -> Result<rc_inner_model::Matrix, calls::GetMatrixError> {
        let matrix = self.world.tree().matrix(&to, &source);
        of_tree(matrix.map(|matrix| rc_inner_model::Matrix {
            rows: std::array::from_fn(|at| matrix[(at / 4, at % 4)]),
        }))
    }

    fn get_node(&mut self, _ctx: &mut Context, id: String) -> Result<Node, calls::GetNodeError> {
        of_tree(self.world.tree().node(&id).map(|node| node_out(&node)))
    }

    fn get_subtree(
        &mut self,
        _ctx: &mut Context,
        id: String,
    ) -> Result<Nodes, calls::GetSubtreeError> {
        let tree = self.world.tree();
        let top = tree.node(&id);
        of_tree(top.map(|top| top.subtree().map(|node| node_out(&node)).collect()))
    }

    fn get_joints(&mut self, _ctx: &mut Context) -> JointPositions {
        let tree = self.world.tree();
        tree.nodes().filter_map(|node| joint(&node)).collect()
    }

    fn print(&mut self, _ctx: &mut Context) -> String {
        self.world.tree().print()
    }

    fn get_cloud(&mut self, _ctx: &mut Context, id: String) -> Result<Cloud, calls::GetCloudError> {
        reply(self.world.cloud(&id))
    }

    fn set_pose(
        &mut self,
        ctx: &mut Context,
        id: String,
        pose: Pose,
    ) -> Result<(), calls::SetPoseError> {
        reply(self.world.set_pose(now(ctx), &id, pose_in(&pose)))
    }

    fn set_pose_in(
        &mut self,
        ctx: &mut Context,
        id: String,
        base: String,
        pose: Pose,
    ) -> Result<(), calls::SetPoseInError> {
        let pose = pose_in(&pose);
        reply(self.world.set_pose_in(now(ctx), &id, &base, pose))
    }

    fn set_joint(
        &mut self,
        ctx: &mut Context,
        id: String,
        position: f64,
    ) -> Result<f64, calls::SetJointError> {
        reply(self.world.move_bodies(now(ctx), |edit| {
            edit.set_joint(&id, position)?;
            let reached = edit.snapshot().node(&id)?.position();
            Ok(reached.unwrap_or_default())
        }))
    }

    fn set_joints(
        &mut self,
        ctx: &mut Context,
        joints: JointPositions,
    ) -> Result<JointPositions, calls::SetJointsError> {
        reply(self.world.move_bodies(now(ctx), |edit| {
            for joint in &joints {
                edit.set_joint(&joint.id, joint.position)?;
            }
            let reached = joints.iter().map(|moved| {
                let node = edit.snapshot().node(&moved.id)?;
                Ok(joint(&node).unwrap_or_default())
            });
            reached.collect()
        }))
    }

    fn add(
        &mut self,
        ctx: &mut Context,
        parent: String,
        elements: String,
    ) -> Result<(), calls::AddError> {
        reply(self.world.add(now(ctx), &parent, &elements))
    }

    fn set(&mut self, ctx: &mut Context, element: String) -> Result<(), calls::SetError> {
        reply(self.world.replace(now(ctx), &element))
    }

    fn remove(&mut self, ctx: &mut Context, id: String) -> Result<(), calls::RemoveError> {
        reply(self.world.remove(now(ctx), &id))
    }

    fn move_(
        &mut self,
        ctx: &mut Context,
        id: String,
        parent: String,
        keep_place: bool,
    ) -> Result<(), calls::MoveError> {
        reply(self.world.move_bodies(now(ctx), |edit| {
            if keep_place {
                edit.re_parent(&id, &parent)?;
            } else {
                edit.move_to(&id, &parent)?;
            }
            Ok(())
        }))
    }

    fn set_attribute(
        &mut self,
        ctx: &mut Context,
        id: String,
        attribute: Attribute,
    ) -> Result<(), calls::SetAttributeError> {
        let Attribute { name, type_, value } = attribute;
        reply(self.world.change(now(ctx), |edit| {
            let is_there = edit.snapshot().node(&id)?.attribute(&name).is_ok();
            if is_there {
                edit.set_attribute(&id, &name, &type_, &value)?;
            } else {
                edit.add_attribute(&id, &name, &type_, &value)?;
            }
            Ok(())
        }))
    }

    fn remove_attribute(
        &mut self,
        ctx: &mut Context,
        id: String,
        name: String,
    ) -> Result<(), calls::RemoveAttributeError> {
        reply(
            self.world
                .change(now(ctx), |edit| Ok(edit.remove_attribute(&id, &name)?)),
        )
    }

    fn collide(
        &mut self,
        _ctx: &mut Context,
        a: String,
        b: String,
    ) -> Result<bool, calls::CollideError> {
        of_tree(self.world.space().collide(&a, &b))
    }

    fn get_collisions(&mut self, _ctx: &mut Context) -> Contacts {
        let space = self.world.space();
        let contacts = space.collisions().into_iter();
        let contacts = contacts.map(|contact| Contact {
            a: id(space.tree(), contact.a),
            b: id(space.tree(), contact.b),
            depth: contact.depth,
            point: contact.point.map(|point| point_out(&point)),
            normal: contact.normal.map(|normal| direction_out(&normal)),
        });
        contacts.collect()
    }

    fn get_distance(
        &mut self,
        _ctx: &mut Context,
        a: String,
        b: String,
    ) -> Result<Near, calls::GetDistanceError> {
        let space = self.world.space();
        let near = space.distance(&a, &b);
        of_tree(near.map(|near| {
            near.map_or_else(Near::default, |near| Near {
                a: id(space.tree(), near.a),
                b: id(space.tree(), near.b),
                distance: near.distance,
            })
        }))
    }

    fn cast_ray(
        &mut self,
        _ctx: &mut Context,
        source: String,
        start: Point,
        direction: Direction,
        range: f64,
        ignored: String,
    ) -> Result<Vec<Hit>, calls::CastRayError> {
        let numbers = [
            start.x,
            start.y,
            start.z,
            direction.x,
            direction.y,
            direction.z,
        ];
        let (start, direction) = (point_in(&start), direction_in(&direction));
        let is_ray = direction.norm() > 0.0 && direction.norm().is_finite() && range >= 0.0;
        let numbers = finite(numbers).and_then(|()| {
            let why = "a ray needs a direction with a length, and a range of at least 0";
            is_ray
                .then_some(())
                .ok_or_else(|| Refusal::Value(why.to_owned()))
        });
        let space = self.world.space();
        reply(numbers.and_then(|()| Ok(cast(space, &source, &ignored, start, direction, range)?)))
    }
}

fn finite<const N: usize>(numbers: [f64; N]) -> Result<(), Refusal> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Refusal::Value("a number is not finite".to_owned()))
}

/// Casts a ray that looks through the bodies of a node.
fn cast(
    space: &Space,
    source: &str,
    ignored: &str,
    start: innermodel::Point,
    direction: innermodel::Vector,
    range: f64,
) -> Result<Vec<Hit>, innermodel::Error> {
    let mut through = HashSet::new();
    if !ignored.is_empty() {
        let top = space.tree().node(ignored)?;
        through.extend(top.subtree().map(|node| node.node_id()));
    }
    let counts = |node: NodeId| !through.contains(&node);
    let hit = space.ray(source, start, direction, range, &counts)?;
    let hit = hit.map(|hit| Hit {
        id: id(space.tree(), hit.node),
        distance: hit.distance,
        point: point_out(&hit.point),
        normal: direction_out(&hit.normal),
    });
    Ok(hit.into_iter().collect())
}
