//! Which nodes are bodies, and their shapes.

use innermodel::kinds::Engine;
use innermodel::{Kind, NodeId, NodeRef, Snapshot, Transform};
use innermodel_collision::Space;
use innermodel_collision::parry::math::{Mat3, Pose, Rotation, Vector};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};

/// Millimetres in a metre.
pub(crate) const METRE: f64 = 1000.0;

/// A frame that differs by more, in m or in parts of a rotation, was set by others.
const MOVED: f64 = 1e-9;

/// Whether two frames differ by rounding only.
pub(crate) fn near(a: &Pose, b: &Pose) -> bool {
    let (a_turn, b_turn) = (a.rotation.to_array(), b.rotation.to_array());
    let apart = a_turn.iter().zip(b_turn).map(|(a, b)| (a - b).abs());
    // A quaternion and its negative are the same rotation.
    let other = a_turn.iter().zip(b_turn).map(|(a, b)| (a + b).abs());
    (a.translation - b.translation).length() <= MOVED
        && apart.fold(0.0, f64::max).min(other.fold(0.0, f64::max)) <= MOVED
}

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

/// A shape of a body that forces move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    handle: ColliderHandle,
    node: NodeId,
    body: NodeId,
}

impl Part {
    /// Takes over a changed place of the part in its body.
    pub(crate) fn place(&self, world: &mut PhysicsWorld, space: &Space) {
        let (Ok(body), Some((_, there))) =
            (space.tree().node(self.body), space.shape_of(self.node))
        else {
            return;
        };
        let inner = pose(&body.to_root()).inverse() * *there;
        if let Some(collider) = world.colliders.get_mut(self.handle)
            && let Some(known) = collider.position_wrt_parent()
            && !near(known, &inner)
        {
            collider.set_position_wrt_parent(inner);
        }
    }
}

/// Whether a change of a node, or of another node that becomes it, makes other bodies or joints.
pub(crate) fn counts(node: &NodeRef<'_>) -> bool {
    let moves = |node: NodeRef<'_>| mass(&node).is_some();
    match node.kind() {
        Kind::Joint(_) | Kind::Prismatic(_) => node.children().any(moves),
        kind => kind.collides() || moves(*node),
    }
}

/// Adds a body that forces move, and its parts to `parts`.
pub(crate) fn add_moving(
    world: &mut PhysicsWorld,
    space: &Space,
    node: &NodeRef<'_>,
    mass: f64,
    parts: &mut Vec<Part>,
) -> RigidBodyHandle {
    let here = pose(&node.to_root());
    let shapes: Vec<_> = node
        .subtree()
        .filter(|part| part.kind().collides())
        .filter(|part| mover(*part).map(|m| m.node_id()) == Some(node.node_id()))
        .filter_map(|part| Some((part.node_id(), space.shape_of(part.node_id())?)))
        .collect();
    // A body at rest stays awake: what others move under it moves it again.
    let mut body = RigidBodyBuilder::dynamic().pose(here).can_sleep(false);
    if shapes.is_empty() {
        body = body.additional_mass(mass);
    }
    let handle = world.insert_body(body);
    let part = mass / shapes.len().max(1) as f64;
    for (id, (shape, place)) in shapes {
        let inner = here.inverse() * *place;
        let collider = ColliderBuilder::new(shape.clone())
            .position(inner)
            .mass(part);
        parts.push(Part {
            handle: world.insert_collider(collider, Some(handle)),
            node: id,
            body: node.node_id(),
        });
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
