//! The world: a tree, what moves in it, and what measures.

use crate::bodies::Bodies;
use crate::dynamics::Dynamics;
use crate::error::Error;
use crate::free_path::Obstacles;
use crate::human;
use crate::pictures::Pictures;
use crate::problems::Problems;
use crate::sensors::Sensors;
use crate::state::State;
use innermodel::{Edit, InnerModel, Keep, NodeId, Snapshot};
use std::sync::Arc;
use std::time::Duration;

/// The shortest and the longest step.
const STEPS: std::ops::RangeInclusive<Duration> =
    Duration::from_micros(10)..=Duration::from_secs(1);

/// The past is not needed.
const NO_PAST: Keep = Keep {
    versions: 2,
    duration: Duration::from_secs(10),
    gap: Duration::from_secs(1),
};

/// A world that moves by fixed steps of simulated time.
///
/// A clone is an independent world, with the same future if it gets the same commands. It shares
/// memory with the first world for what neither changes: pages of the tree, shapes and meshes. Its
/// cost is that of the states of devices, and at its first step that of the list of bodies.
#[derive(Debug)]
pub struct World {
    pub(crate) model: Arc<InnerModel>,
    pub(crate) bodies: Bodies,
    pub(crate) pictures: Pictures,
    pub(crate) step: Duration,
    pub(crate) seed: u64,
    pub(crate) state: State,
    pub(crate) sensors: Sensors,
    pub(crate) dynamics: Option<Box<dyn Dynamics>>,
    pub(crate) obstacles: Obstacles,
    pub(crate) problems: Problems,
}

impl Clone for World {
    fn clone(&self) -> Self {
        let model = self.model.fork();
        model.keep(NO_PAST);
        let mut bodies = self.bodies.clone();
        bodies.forget_place();
        Self {
            model: Arc::new(model),
            bodies,
            pictures: self.pictures.clone(),
            step: self.step,
            seed: self.seed,
            state: self.state.clone(),
            sensors: self.sensors.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
            obstacles: self.obstacles.clone(),
            problems: Problems::default(),
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
        let mut problems = Problems::default();
        let mut world = Self {
            bodies: Bodies::new(&model.snapshot(), &mut problems),
            model,
            pictures: Pictures::new(),
            step,
            seed,
            state: State::default(),
            sensors: Sensors::default(),
            dynamics: None,
            obstacles: Obstacles::default(),
            problems,
        };
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

    /// Takes the problems since the last call, such as bodies whose meshes cannot be read. At most
    /// 100 wait.
    pub fn problems(&mut self) -> Vec<String> {
        self.problems.take()
    }

    /// A change by the world itself.
    pub(crate) fn change<T>(
        &mut self,
        make: impl FnOnce(&mut Edit) -> Result<T, innermodel::Error>,
    ) -> Result<T, Error> {
        Ok(self.model.change(self.state.time, make)?)
    }

    /// Moves the bodies to where the present version has them.
    pub(crate) fn follow(&mut self) {
        let tree = self.tree();
        self.bodies.follow(&tree, &mut self.problems);
    }

    /// Makes the state of new devices, and drops that of removed ones.
    pub(crate) fn find_devices(&mut self) {
        self.obstacles.clear();
        let tree = self.tree();
        let times = (self.state.time, self.step);
        let is_start = self.state.steps == 0;
        let problems = &mut self.problems;
        self.sensors.find(&tree, times, is_start, problems);
        self.state.find_devices(&tree);
    }

    /// The id of a node that is there.
    pub fn id_of(&self, node: NodeId) -> Option<String> {
        Some(self.tree().node(node).ok()?.id().to_owned())
    }
}
