//! The world: a tree, what moves in it, and what measures.

use crate::base::BaseState;
use crate::battery::BatteryState;
use crate::dynamics::Dynamics;
use crate::error::Error;
use crate::human::{self, Walk};
use crate::motor::MotorState;
use crate::schedule::Sensor;
use innermodel::{Edit, InnerModel, Keep, NodeId, Pose, Snapshot, Vector};
use innermodel_collision::Space;
use innermodel_render::Scene;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::time::Duration;

/// The shortest and the longest step.
const STEPS: std::ops::RangeInclusive<Duration> =
    Duration::from_micros(10)..=Duration::from_secs(1);
/// The direction to the light of all cameras, in the root: from above, to the left and behind.
const LIGHT: [f64; 3] = [-0.4, 1.0, -0.3];

/// Nothing asks for the past.
const NO_PAST: Keep = Keep {
    versions: 2,
    duration: Duration::from_secs(10),
    gap: Duration::from_secs(1),
};
/// The most problems that wait for [`World::problems`].
const MOST_PROBLEMS: usize = 100;

/// What changes with time, besides the tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) time: Duration,
    pub(crate) steps: u64,
    pub(crate) bases: BTreeMap<NodeId, BaseState>,
    pub(crate) motors: BTreeMap<NodeId, MotorState>,
    pub(crate) batteries: BTreeMap<NodeId, BatteryState>,
    pub(crate) people: BTreeMap<NodeId, Walk>,
}

/// A world at one time, to which it can be set back.
#[derive(Debug)]
pub struct Kept {
    tree: Arc<Snapshot>,
    state: State,
    dynamics: Option<Box<dyn Dynamics>>,
}

impl Clone for Kept {
    fn clone(&self) -> Self {
        Self {
            tree: Arc::clone(&self.tree),
            state: self.state.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
        }
    }
}

/// A world that moves by fixed steps of simulated time.
///
/// A clone is a world of its own, with the same future if it gets the same commands. It shares with
/// the first world what neither changes: pages of the tree, shapes and meshes. Its cost is that of
/// the states of devices, and at its first step that of the list of bodies.
#[derive(Debug)]
pub struct World {
    model: Arc<InnerModel>,
    pub(crate) space: Arc<Space>,
    /// Whether `space` has the bodies where they are at present.
    pub(crate) is_space_present: bool,
    pub(crate) scene: Scene,
    pub(crate) step: Duration,
    pub(crate) seed: u64,
    pub(crate) state: State,
    pub(crate) sensors: BTreeMap<NodeId, Sensor>,
    pub(crate) dynamics: Option<Box<dyn Dynamics>>,
    problems: Vec<String>,
}

impl Clone for World {
    fn clone(&self) -> Self {
        let model = self.model.fork();
        model.keep(NO_PAST);
        Self {
            model: Arc::new(model),
            space: Arc::clone(&self.space),
            is_space_present: false,
            scene: self.scene.clone(),
            step: self.step,
            seed: self.seed,
            state: self.state.clone(),
            sensors: self.sensors.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
            problems: Vec::new(),
        }
    }
}

impl World {
    /// The world of a tree. `step` is the time that passes in a step; `seed` decides about the
    /// errors of sensors and actuators.
    ///
    /// # Errors
    /// The step is shorter than 10 µs or longer than 1 s, or the tree has ids that the skeleton of
    /// a person needs.
    pub fn new(
        model: impl Into<Arc<InnerModel>>,
        step: Duration,
        seed: u64,
    ) -> Result<Self, Error> {
        let model = model.into();
        if !STEPS.contains(&step) {
            return Err(Error::Step(step));
        }
        model.change(Duration::ZERO, human::add_skeletons)?;
        model.keep(NO_PAST);
        let space = Space::new(&model.snapshot());
        let mut scene = Scene::new();
        scene.set_light(Some(Vector::from(LIGHT)));
        let mut world = Self {
            model,
            space: Arc::new(space),
            is_space_present: true,
            scene,
            step,
            seed,
            state: State::default(),
            sensors: BTreeMap::new(),
            dynamics: None,
            problems: Vec::new(),
        };
        world.tell_bodies();
        world.find_devices();
        Ok(world)
    }

    /// The tree, for a viewer. Changes go through [`World::edit`].
    pub fn model(&self) -> &Arc<InnerModel> {
        &self.model
    }

    /// The present version of the tree.
    pub fn tree(&self) -> Arc<Snapshot> {
        self.model.snapshot()
    }

    /// Simulated time since the start.
    pub fn time(&self) -> Duration {
        self.state.time
    }

    /// How many steps were made.
    pub fn steps(&self) -> u64 {
        self.state.steps
    }

    /// The time of one step.
    pub fn step_time(&self) -> Duration {
        self.step
    }

    /// What is missing since the last call, such as bodies whose meshes cannot be read, and what
    /// could not be done. At most 100 lines wait.
    pub fn problems(&mut self) -> Vec<String> {
        std::mem::take(&mut self.problems)
    }

    /// Adds a problem, if it does not wait already.
    pub(crate) fn tell(&mut self, problem: String) {
        if self.problems.len() < MOST_PROBLEMS && !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }

    /// Changes the scene: all of it, or nothing if one change is refused. Sensors show it in their
    /// next frame.
    pub fn edit<T>(
        &mut self,
        make: impl FnOnce(&mut Edit) -> Result<T, innermodel::Error>,
    ) -> Result<T, Error> {
        let before = self.tree();
        let result = self.change(|edit| {
            let result = make(edit)?;
            human::add_skeletons(edit)?;
            Ok(result)
        })?;
        self.find_devices();
        self.jump(&before);
        self.follow();
        Ok(result)
    }

    /// Puts a node to a place at once, whatever is in between. Odometry does not notice.
    pub fn teleport(&mut self, id: &str, base: &str, pose: Pose) -> Result<(), Error> {
        self.edit(|edit| edit.set_pose_in(id, base, pose))
    }

    /// A change by the world itself.
    pub(crate) fn change<T>(
        &mut self,
        make: impl FnOnce(&mut Edit) -> Result<T, innermodel::Error>,
    ) -> Result<T, Error> {
        Ok(self.model.change(self.state.time, make)?)
    }

    /// The world as it is, to set it back later.
    pub fn keep_state(&self) -> Kept {
        Kept {
            tree: self.tree(),
            state: self.state.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
        }
    }

    /// Sets the scene with all bases, joints, batteries and speeds back. Time goes on.
    pub fn set_back(&mut self, to: &Kept) {
        let before = self.tree();
        self.model.restore(self.state.time, &to.tree);
        self.state = State {
            time: self.state.time,
            steps: self.state.steps,
            ..to.state.clone()
        };
        self.is_space_present = false;
        self.follow();
        self.find_devices();
        self.jump(&before);
        // Forces stay as they are switched; bodies get their speeds back.
        if let (Some(own), Some(kept)) = (&mut self.dynamics, &to.dynamics) {
            *own = kept.duplicate();
        }
    }

    /// Tells inertial sensors that a change has put them elsewhere: a place that jumps is no
    /// acceleration.
    fn jump(&mut self, before: &Snapshot) {
        let tree = self.tree();
        for (node, sensor) in &mut self.sensors {
            let there = tree.node(*node).map(|node| node.to_root());
            let was = before.node(*node).map(|node| node.to_root());
            if let (Ok(there), Ok(was)) = (there, was)
                && there != was
            {
                sensor.jump_to(&there);
            }
        }
    }

    /// A number that differs, but for chance, where anything differs that later steps depend on.
    pub fn digest(&self) -> u64 {
        let tree = self.tree();
        let mut hasher = DefaultHasher::new();
        tree.print().hash(&mut hasher);
        for node in tree.nodes() {
            node.position().map(f64::to_bits).hash(&mut hasher);
        }
        // All digits of numbers are printed.
        format!("{:?}", self.state).hash(&mut hasher);
        (self.step, self.seed).hash(&mut hasher);
        for (node, sensor) in &self.sensors {
            (node, sensor.digest()).hash(&mut hasher);
        }
        let speeds = self.dynamics.as_ref().map(|dynamics| dynamics.digest());
        speeds.hash(&mut hasher);
        hasher.finish()
    }
}
