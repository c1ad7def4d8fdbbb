//! The forces of one world.

use crate::bodies::{
    Part, add_moving, add_obstacle, counts, mass, mover, obstacles, pose, transform,
};
use crate::joints::{Joint, above};
use crate::motors::Motor;
use innermodel::{Change, Kind, NodeId, Snapshot, Transform};
use innermodel_collision::Space;
use innermodel_collision::parry::math::{Pose, Vector};
use innermodel_simulation::{Dynamics, GRAVITY, MotorState, PushError, StepResult};
use rapier3d_f64::prelude::{PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
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
    /// The shapes of bodies.
    parts: Vec<Part>,
    obstacles: BTreeMap<NodeId, RigidBodyHandle>,
    /// Kinds of the nodes of which bodies, obstacles and joints were made.
    known: BTreeMap<NodeId, Arc<Kind>>,
    /// Nodes that carry joints and that forces do not move.
    carriers: BTreeMap<NodeId, RigidBodyHandle>,
    /// Obstacles and carriers that move in this step: from where to where.
    moving: Vec<(RigidBodyHandle, Pose, Pose)>,
    joints: Vec<Joint>,
    motors: BTreeMap<NodeId, Motor>,
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
        self.bodies.clear();
        self.parts.clear();
        self.carriers.clear();
        self.joints.clear();
        let counting = tree.nodes().filter(counts);
        self.known = counting
            .map(|node| (node.node_id(), Arc::clone(node.shared_kind())))
            .collect();
        for node in tree.nodes() {
            let Some(mass) = mass(&node) else {
                continue;
            };
            let handle = add_moving(&mut world, space, &node, mass, &mut self.parts);
            if let (Some((along, about)), Some(body)) =
                (speeds.get(&node.node_id()), world.bodies.get_mut(handle))
            {
                body.set_linvel(*along, true);
                body.set_angvel(*about, true);
            }
            let joint = above(&node).and_then(|joint| {
                let outer = joint.parent()?;
                let moved = mover(outer).and_then(|mover| {
                    let body = self.bodies.get(&mover.node_id())?;
                    Some((mover, body.handle))
                });
                let (carrier, handle_of_carrier) = moved.unwrap_or_else(|| {
                    let new = || {
                        let builder = RigidBodyBuilder::kinematic_position_based();
                        world.insert_body(builder.pose(pose(&outer.to_root())))
                    };
                    let carriers = self.carriers.entry(outer.node_id());
                    (outer, *carriers.or_insert_with(new))
                });
                let carrier = (&carrier, handle_of_carrier);
                let added = Joint::add(&mut world, &joint, (&node, handle), carrier)?;
                let motor = self.motors.entry(added.node);
                motor.or_insert_with(|| {
                    Motor::at(joint.position().unwrap_or_default() / added.scale())
                });
                Some(added)
            });
            let body = Body {
                handle,
                place: node.to_root(),
                is_jointed: joint.is_some(),
            };
            self.joints.extend(joint);
            self.bodies.insert(node.node_id(), body);
        }
        let obstacles = obstacles(tree).filter_map(|node| {
            let handle = add_obstacle(&mut world, space, node.node_id())?;
            Some((node.node_id(), handle))
        });
        self.obstacles = obstacles.collect();
        self.world = world;
        self.speeds.clear();
        let joints: BTreeSet<NodeId> = self.joints.iter().map(|joint| joint.node).collect();
        self.motors.retain(|joint, _| joints.contains(joint));
    }

    /// Makes all bodies again if their set has changed. Returns whether it did.
    fn rebuilt(&mut self, space: &Space) -> bool {
        let tree = space.tree();
        let changes = self.tree.as_ref().map(|known| tree.since(known));
        let counts_in = |node: &NodeId| tree.node(*node).is_ok_and(|node| counts(&node));
        let other = |change: &Change| match change {
            Change::Moved(_) => false,
            Change::Removed { node, .. } => self.known.contains_key(node),
            Change::Added(node) => counts_in(node),
            Change::Parent(node) => tree
                .node(*node)
                .is_ok_and(|node| node.subtree().any(|node| counts(&node))),
            // An attribute makes no other body.
            Change::Data(node) => match (self.known.get(node), tree.node(*node)) {
                (Some(known), Ok(node)) => !Arc::ptr_eq(known, node.shared_kind()),
                (None, Ok(node)) => counts(&node),
                _ => true,
            },
        };
        let is_new = changes.is_none_or(|changes| changes.iter().any(other));
        if is_new {
            self.build(space);
        }
        self.tree = Some(tree.clone());
        is_new
    }

    /// The obstacles and carriers that the tree has elsewhere, and where.
    fn elsewhere(&self, space: &Space) -> Vec<(RigidBodyHandle, Pose, Pose)> {
        let obstacles = self.obstacles.iter();
        let obstacles =
            obstacles.filter_map(|(node, handle)| Some((*handle, *space.shape_of(*node)?.1)));
        let carriers = self.carriers.iter().filter_map(|(node, handle)| {
            let node = space.tree().node(*node).ok()?;
            Some((*handle, pose(&node.to_root())))
        });
        let all = obstacles.chain(carriers);
        let all = all.filter_map(|(handle, there)| {
            let here = *self.world.bodies.get(handle)?.position();
            (here != there).then_some((handle, here, there))
        });
        all.collect()
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
    fn place(&mut self, space: &Space) {
        if self.rebuilt(space) {
            return;
        }
        for (handle, _, there) in self.elsewhere(space) {
            if let Some(body) = self.world.bodies.get_mut(handle) {
                body.set_position(there, true);
            }
        }
        for (node, body) in &mut self.bodies {
            let Ok(node) = space.tree().node(*node) else {
                continue;
            };
            let there = node.to_root();
            let moved = (there.translation - body.place.translation).norm() > MOVED
                || (there.rotation - body.place.rotation).norm() > MOVED;
            if moved && let Some(own) = self.world.bodies.get_mut(body.handle) {
                // A body that was put elsewhere does not keep its speed.
                own.set_position(pose(&there), true);
                own.set_linvel(Vector::ZERO, true);
                own.set_angvel(Vector::ZERO, true);
                body.place = there;
                if let Some(joint) = self.joints.iter().find(|joint| joint.own == node.node_id())
                    && let Ok(there) = space.tree().node(joint.node)
                    && let Some(motor) = self.motors.get_mut(&joint.node)
                {
                    motor.put(there.position().unwrap_or_default() / joint.scale());
                }
            }
        }
        for joint in &mut self.joints {
            joint.place(&mut self.world, space.tree());
        }
    }

    fn step(
        &mut self,
        space: &Space,
        motors: &BTreeMap<NodeId, MotorState>,
        step: Duration,
    ) -> StepResult {
        self.rebuilt(space);
        self.moving = self.elsewhere(space);
        for part in &self.parts {
            part.place(&mut self.world, space);
        }
        for joint in &self.joints {
            if let Some(motor) = self.motors.get_mut(&joint.node) {
                motor.set_goal(motors.get(&joint.node), joint.scale());
            }
        }
        let seconds = step.as_secs_f64();
        let count = (seconds / LONGEST).ceil().max(1.0);
        let dt = seconds / count;
        self.world.integration_parameters.dt = dt;
        for part in 1..=count as u32 {
            let part = f64::from(part) / count;
            for (handle, from, to) in &self.moving {
                if let Some(body) = self.world.bodies.get_mut(*handle) {
                    body.set_next_kinematic_position(between(from, to, part));
                }
            }
            for joint in &self.joints {
                if let Some(motor) = self.motors.get_mut(&joint.node) {
                    joint.drive(&mut self.world, motor, dt);
                }
            }
            self.world.step();
            for joint in &self.joints {
                if let Some(motor) = self.motors.get_mut(&joint.node) {
                    let there = joint.position(&self.world, motor.position);
                    motor.position = there.unwrap_or(motor.position);
                }
            }
        }
        let mut moved = StepResult::default();
        for (node, body) in &self.bodies {
            if let Some(here) = self.world.bodies.get(body.handle)
                && !body.is_jointed
            {
                moved.places.push((*node, transform(here.position())));
            }
        }
        let joints = self.joints.iter();
        let positions = joints.filter_map(|joint| {
            let motor = self.motors.get(&joint.node)?;
            Some((joint.node, motor.position * joint.scale()))
        });
        moved.joints = positions.collect();
        moved
    }

    fn moves_joint(&self, joint: NodeId) -> bool {
        self.motors.contains_key(&joint)
    }

    fn moves(&self, body: NodeId) -> bool {
        self.known.contains_key(&body) && !self.obstacles.contains_key(&body)
    }

    fn applied(&mut self, space: &Space) {
        let tree = space.tree();
        for (node, body) in &mut self.bodies {
            if let Ok(node) = tree.node(*node) {
                body.place = node.to_root();
            }
        }
        self.tree = Some(tree.clone());
    }

    fn push(
        &mut self,
        space: &Space,
        node: NodeId,
        impulse: innermodel::Vector,
        fastest: f64,
    ) -> Result<(), PushError> {
        self.place(space);
        let body = self.bodies.get(&node).ok_or(PushError::Unmoved)?;
        let body = self.world.bodies.get_mut(body.handle);
        let body = body.ok_or(PushError::Unmoved)?;
        let before = body.linvel();
        body.apply_impulse(Vector::new(impulse.x, impulse.y, impulse.z), true);
        // NaN is not within the bound either.
        if body.linvel().length() <= fastest {
            return Ok(());
        }
        body.set_linvel(before, true);
        Err(PushError::TooFast)
    }

    fn digest(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for (node, (along, about)) in self.speeds() {
            let numbers = [along.x, along.y, along.z, about.x, about.y, about.z];
            (node, numbers.map(f64::to_bits)).hash(&mut hasher);
        }
        // All digits of numbers are printed.
        format!("{:?}", self.motors).hash(&mut hasher);
        hasher.finish()
    }

    fn duplicate(&self) -> Box<dyn Dynamics> {
        Box::new(Self {
            speeds: self.speeds(),
            motors: self.motors.clone(),
            ..Self::default()
        })
    }
}
