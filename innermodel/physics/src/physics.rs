//! The forces of one world.

use crate::bodies::{add_moving, add_obstacle, mass, obstacles, pose, transform};
use crate::joints::{Joint, above};
use innermodel::{Change, NodeId, Snapshot, Transform};
use innermodel_collision::Space;
use innermodel_collision::parry::math::{Pose, Vector};
use innermodel_simulation::{Dynamics, GRAVITY, MotorState, Moved};
use rapier3d_f64::prelude::{PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Duration;

/// The longest step of the solver in seconds.
const LONGEST: f64 = 0.001;
/// How stiff contacts are, in Hz: stiffer than rapier's default, whose steps are longer.
const CONTACTS: f64 = 120.0;
/// A place that differs by more, in mm or in parts of a rotation, was set by others.
const MOVED: f64 = 1e-6;

/// A body that forces move.
#[derive(Clone, Debug)]
struct Body {
    handle: RigidBodyHandle,
    /// Where the tree has it since the last step.
    place: Transform,
    /// Whether a joint says where it is.
    is_jointed: bool,
}

/// Forces by the library rapier.
#[derive(Default)]
pub struct Physics {
    world: PhysicsWorld,
    tree: Option<Snapshot>,
    bodies: BTreeMap<NodeId, Body>,
    obstacles: BTreeMap<NodeId, RigidBodyHandle>,
    /// Obstacles that move in this step: from where to where.
    moving: Vec<(RigidBodyHandle, Pose, Pose)>,
    joints: Vec<Joint>,
    jointed: BTreeSet<NodeId>,
    /// Speeds that bodies have when they are made: along and about.
    speeds: BTreeMap<NodeId, (Vector, Vector)>,
}

impl fmt::Debug for Physics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Physics")
            .field("bodies", &self.bodies)
            .field("joints", &self.joints.len())
            .finish_non_exhaustive()
    }
}

impl Physics {
    /// Forces that act from the next step on.
    pub fn new() -> Self {
        Self::default()
    }

    /// The speeds of all bodies.
    fn speeds(&self) -> BTreeMap<NodeId, (Vector, Vector)> {
        let bodies = self.bodies.iter();
        let speeds = bodies.filter_map(|(node, body)| {
            let body = self.world.bodies.get(body.handle)?;
            Some((*node, (body.linvel(), body.angvel())))
        });
        let mut all = self.speeds.clone();
        all.extend(speeds);
        all
    }

    /// Makes all bodies of a tree.
    fn build(&mut self, space: &Space) {
        let speeds = self.speeds();
        let tree = space.tree();
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, -GRAVITY, 0.0);
        world
            .integration_parameters
            .contact_softness
            .natural_frequency = CONTACTS;
        let ground = world.insert_body(RigidBodyBuilder::fixed());
        self.bodies.clear();
        self.joints.clear();
        self.jointed.clear();
        for node in tree.nodes() {
            let Some(mass) = mass(&node) else {
                continue;
            };
            let handle = add_moving(&mut world, space, &node, mass);
            if let (Some((along, about)), Some(body)) =
                (speeds.get(&node.node_id()), world.bodies.get_mut(handle))
            {
                body.set_linvel(*along, true);
                body.set_angvel(*about, true);
            }
            let joint = above(&node).and_then(|joint| {
                let known = |node| self.bodies.get(&node).map(|body: &Body| body.handle);
                Joint::add(&mut world, &joint, &node, handle, ground, known)
            });
            let body = Body {
                handle,
                place: node.to_root(),
                is_jointed: joint.is_some(),
            };
            if let Some(joint) = joint {
                self.jointed.insert(joint.node);
                self.joints.push(joint);
            }
            self.bodies.insert(node.node_id(), body);
        }
        let obstacles = obstacles(tree).filter_map(|node| {
            let handle = add_obstacle(&mut world, space, node.node_id())?;
            Some((node.node_id(), handle))
        });
        self.obstacles = obstacles.collect();
        self.world = world;
        self.speeds.clear();
    }

    /// Takes over what others have changed in the tree.
    fn follow(&mut self, space: &Space) {
        let tree = space.tree();
        let changes = self.tree.as_ref().map(|known| tree.since(known));
        let is_new = changes.as_ref().is_none_or(|changes| {
            let mut changes = changes.iter();
            changes.any(|change| !matches!(change, Change::Moved(_)))
        });
        if is_new {
            self.build(space);
        } else {
            for (node, body) in &mut self.bodies {
                let Ok(node) = tree.node(*node) else {
                    continue;
                };
                let there = node.to_root();
                let moved = (there.translation - body.place.translation).norm() > MOVED
                    || (there.rotation - body.place.rotation).norm() > MOVED;
                if moved && let Some(body) = self.world.bodies.get_mut(body.handle) {
                    // What is put somewhere does not keep its speed.
                    body.set_position(pose(&there), true);
                    body.set_linvel(Vector::ZERO, true);
                    body.set_angvel(Vector::ZERO, true);
                }
            }
            for (node, handle) in &self.obstacles {
                if let (Some((_, place)), Some(body)) =
                    (space.shape_of(*node), self.world.bodies.get(*handle))
                    && body.position() != place
                {
                    self.moving.push((*handle, *body.position(), *place));
                }
            }
        }
        self.tree = Some(tree.clone());
    }
}

/// The pose between two ones, at a part of the way from 0 to 1.
fn between(from: &Pose, to: &Pose, part: f64) -> Pose {
    Pose::from_parts(
        from.translation.lerp(to.translation, part),
        from.rotation.slerp(to.rotation, part),
    )
}

impl Dynamics for Physics {
    fn step(
        &mut self,
        space: &Space,
        motors: &BTreeMap<NodeId, MotorState>,
        step: Duration,
    ) -> Moved {
        self.moving.clear();
        self.follow(space);
        for joint in &mut self.joints {
            joint.drive(&mut self.world, motors.get(&joint.node));
        }
        let seconds = step.as_secs_f64();
        let count = (seconds / LONGEST).ceil().max(1.0);
        self.world.integration_parameters.dt = seconds / count;
        for part in 1..=count as u32 {
            let part = f64::from(part) / count;
            for (handle, from, to) in &self.moving {
                if let Some(body) = self.world.bodies.get_mut(*handle) {
                    body.set_next_kinematic_position(between(from, to, part));
                }
            }
            self.world.step();
        }
        let mut moved = Moved::default();
        for (node, body) in &mut self.bodies {
            let Some(here) = self.world.bodies.get(body.handle) else {
                continue;
            };
            body.place = transform(here.position());
            if !body.is_jointed {
                moved.places.push((*node, body.place));
            }
        }
        let joints = self.joints.iter();
        let positions = joints.filter_map(|joint| Some((joint.node, joint.position(&self.world)?)));
        moved.joints = positions.collect();
        moved
    }

    fn moves_joint(&self, joint: NodeId) -> bool {
        self.jointed.contains(&joint)
    }

    fn push(&mut self, node: NodeId, impulse: innermodel::Vector) -> bool {
        let Some(body) = self.bodies.get(&node) else {
            return false;
        };
        let Some(body) = self.world.bodies.get_mut(body.handle) else {
            return false;
        };
        body.apply_impulse(Vector::new(impulse.x, impulse.y, impulse.z), true);
        true
    }

    fn duplicate(&self) -> Box<dyn Dynamics> {
        Box::new(Self {
            speeds: self.speeds(),
            ..Self::default()
        })
    }
}
