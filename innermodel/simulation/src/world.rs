//! The world: a tree, what moves in it, and what measures.

use crate::dynamics::Dynamics;
use crate::error::Error;
use crate::free_path::Pressed;
use crate::human;
use crate::imu_integrator::ImuIntegrator;
use crate::pose2d::Pose2D;
use crate::schedule::Sensor;
use crate::state::{BaseState, BatteryState, MotorState, State};
use innermodel::{Edit, InnerModel, Keep, Kind, NodeId, Snapshot, Vector};
use innermodel_collision::Space;
use innermodel_render::Scene;
use rc_diagnostics::foreign::clean;
use std::collections::{BTreeMap, BTreeSet};
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

/// A world that moves by fixed steps of simulated time.
///
/// A clone is a world of its own, with the same future if it gets the same commands. It shares with
/// the first world what neither changes: pages of the tree, shapes and meshes. Its cost is that of
/// the states of devices, and at its first step that of the list of bodies.
#[derive(Debug)]
pub struct World {
    pub(crate) model: Arc<InnerModel>,
    pub(crate) space: Arc<Space>,
    /// Whether `space` has the bodies where they are at present.
    pub(crate) is_space_present: bool,
    pub(crate) scene: Scene,
    pub(crate) step: Duration,
    pub(crate) seed: u64,
    pub(crate) state: State,
    pub(crate) sensors: BTreeMap<NodeId, Sensor>,
    pub(crate) dynamics: Option<Box<dyn Dynamics>>,
    /// Motions that obstacles prevented in the last steps of bases. A change of the scene forgets
    /// them.
    pub(crate) pressed: BTreeMap<NodeId, Vec<Pressed>>,
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
            pressed: self.pressed.clone(),
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
            pressed: BTreeMap::new(),
            problems: Vec::new(),
        };
        world.report_bodies();
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
        std::mem::take(&mut self.problems)
    }

    /// Adds a problem, if it does not wait already.
    pub(crate) fn report(&mut self, problem: String) {
        if self.problems.len() < MOST_PROBLEMS && !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }

    /// Changes of many nodes by the world itself: one that is refused, such as a place that would
    /// be infinite, is reported, and the others are made.
    pub(crate) fn change_each<T>(
        &mut self,
        all: &[T],
        make: impl Fn(&mut Edit, &T) -> Result<(), innermodel::Error>,
    ) {
        if self
            .change(|edit| all.iter().try_for_each(|one| make(edit, one)))
            .is_ok()
        {
            return;
        }
        for one in all {
            if let Err(error) = self.change(|edit| make(edit, one)) {
                self.report(format!("something cannot move: {error}"));
            }
        }
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
        if !self.is_space_present || self.space.tree().version() != tree.version() {
            std::sync::Arc::make_mut(&mut self.space).update(&tree);
            self.is_space_present = true;
            self.report_bodies();
        }
    }

    /// Tells which meshes have given no body.
    pub(crate) fn report_bodies(&mut self) {
        let space = std::sync::Arc::make_mut(&mut self.space);
        for problem in space.problems() {
            let (id, error) = (clean(&problem.id), clean(&problem.error.to_string()));
            self.report(format!("`{id}` has no body: {error}"));
        }
    }

    /// The bodies at present.
    pub(crate) fn space(&self) -> &innermodel_collision::Space {
        &self.space
    }

    /// Makes the state of devices that are new, and drops that of devices that are gone.
    pub(crate) fn find_devices(&mut self) {
        self.pressed.clear();
        let tree = self.tree();
        let mut there: BTreeSet<NodeId> = BTreeSet::new();
        let mut problems: Vec<String> = Vec::new();
        for node in tree.nodes() {
            let id = node.node_id();
            let kind = node.kind();
            if let Some(signal) = kind.signal() {
                let (time, tree) = (self.state.time, Arc::clone(&tree));
                // At the start, all stands.
                let speed = (self.state.steps == 0).then(Vector::zeros);
                let track = || ImuIntegrator::new(node.to_root(), speed);
                let track = matches!(kind, Kind::Imu(_)).then(track);
                let sensor = self.sensors.entry(id);
                let sensor = sensor.or_insert_with(|| Sensor::new(signal, time, tree, track));
                let found = sensor.check(signal, self.step);
                problems.extend(
                    found
                        .into_iter()
                        .map(|text| format!("`{}`: {text}", node.id())),
                );
                there.insert(id);
            }
            match kind {
                Kind::Robot(_) => {
                    let place = Pose2D::of(&node.to_root());
                    self.state.bases.entry(id).or_insert_with(|| BaseState {
                        odometer: place,
                        corrected: place,
                        ..BaseState::default()
                    });
                }
                Kind::Joint(_) | Kind::Prismatic(_) => {
                    self.state.motors.entry(id).or_insert_with(|| MotorState {
                        position: node.position().unwrap_or_default(),
                        ..MotorState::default()
                    });
                }
                Kind::Battery(battery) => {
                    let full = BatteryState {
                        level: battery.level,
                        is_connected: true,
                    };
                    self.state.batteries.entry(id).or_insert(full);
                }
                Kind::Human(_) => {
                    self.state.people.entry(id).or_default();
                }
                _ => continue,
            }
            there.insert(id);
        }
        problems
            .into_iter()
            .for_each(|problem| self.report(problem));
        self.sensors.retain(|node, _| there.contains(node));
        self.state.bases.retain(|node, _| there.contains(node));
        self.state.motors.retain(|node, _| there.contains(node));
        self.state.batteries.retain(|node, _| there.contains(node));
        self.state.people.retain(|node, _| there.contains(node));
    }
}
