//! Which nodes are bodies, and their shapes.

use innermodel::kinds::Engine;
use innermodel::{Kind, NodeId, NodeRef, Snapshot, Transform};
use innermodel_collision::Space;
use innermodel_collision::parry::math::{Mat3, Pose, Rotation, Vector};
use rapier3d_f64::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};

/// Millimetres in a metre.
pub(crate) const METRE: f64 = 1000.0;

/// The mass in kg of a node that forces move.
pub(crate) fn mass(node: &NodeRef<'_>) -> Option<f64> {
    match node.kind() {
        Kind::Transform(transform) if transform.engine == Engine::Bullet => {
            Some(if transform.mass > 0.0 {
                transform.mass
            } else {
                1.0
            })
        }
        _ => None,
    }
}

/// The nearest node above, or the node itself, that forces move.
pub(crate) fn mover(node: NodeRef<'_>) -> Option<NodeRef<'_>> {
    std::iter::successors(Some(node), NodeRef::parent).find(|node| mass(node).is_some())
}

/// The pose in metres.
pub(crate) fn pose(transform: &Transform) -> Pose {
    let r = &transform.rotation;
    let column = |at: usize| Vector::new(r[(0, at)], r[(1, at)], r[(2, at)]);
    let rotation = Mat3::from_cols(column(0), column(1), column(2));
    let t = transform.translation / METRE;
    Pose::from_parts(
        Vector::new(t.x, t.y, t.z),
        Rotation::from_mat3(&rotation).normalize(),
    )
}

/// The transform in millimetres.
pub(crate) fn transform(pose: &Pose) -> Transform {
    let rotation = Mat3::from_quat(pose.rotation);
    let column = |v: Vector| innermodel::Vector::new(v.x, v.y, v.z);
    Transform {
        rotation: innermodel::Matrix::from_columns(&[
            column(rotation.x_axis),
            column(rotation.y_axis),
            column(rotation.z_axis),
        ]),
        translation: column(pose.translation) * METRE,
    }
}

/// Adds a body that forces move.
pub(crate) fn add_moving(
    world: &mut PhysicsWorld,
    space: &Space,
    node: &NodeRef<'_>,
    mass: f64,
) -> RigidBodyHandle {
    let here = pose(&node.to_root());
    let shapes: Vec<_> = node
        .subtree()
        .filter(|part| part.kind().collides())
        .filter(|part| mover(*part).map(|m| m.node_id()) == Some(node.node_id()))
        .filter_map(|part| space.shape_of(part.node_id()))
        .collect();
    // A body at rest stays awake: what others move under it moves it again.
    let mut body = RigidBodyBuilder::dynamic().pose(here).can_sleep(false);
    if shapes.is_empty() {
        body = body.additional_mass(mass);
    }
    let handle = world.insert_body(body);
    let part = mass / shapes.len().max(1) as f64;
    for (shape, place) in shapes {
        let inner = here.inverse() * *place;
        let collider = ColliderBuilder::new(shape.clone())
            .position(inner)
            .mass(part);
        world.insert_collider(collider, Some(handle));
    }
    handle
}

/// Adds the body of an obstacle.
pub(crate) fn add_obstacle(
    world: &mut PhysicsWorld,
    space: &Space,
    node: NodeId,
) -> Option<RigidBodyHandle> {
    let (shape, place) = space.shape_of(node)?;
    let body = RigidBodyBuilder::kinematic_position_based().pose(*place);
    let handle = world.insert_body(body);
    world.insert_collider(ColliderBuilder::new(shape.clone()), Some(handle));
    Some(handle)
}

/// The obstacles of a tree: bodies with `collide` that forces do not move.
pub(crate) fn obstacles(tree: &Snapshot) -> impl Iterator<Item = NodeRef<'_>> {
    let colliding = tree.nodes().filter(|node| node.kind().collides());
    colliding.filter(|node| mover(*node).is_none())
}
