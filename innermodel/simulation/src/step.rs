//! One step of the world: the order in which its parts move.

use crate::error::Error;
use crate::free_path::Surroundings;
use crate::random::Random;
use crate::world::World;
use innermodel::{Edit, Kind, NodeId};

impl World {
    /// The most steps of one call of [`World::run`].
    pub const MOST_STEPS: u64 = 10_000_000;

    /// Makes steps.
    ///
    /// # Errors
    /// More than [`World::MOST_STEPS`] are asked for.
    pub fn run(&mut self, steps: u64) -> Result<(), Error> {
        if steps > Self::MOST_STEPS {
            return Err(Error::TooManySteps(steps));
        }
        for _ in 0..steps {
            self.step()?;
        }
        Ok(())
    }

    /// Lets the time of one step pass: bases, joints and batteries change, then sensors measure.
    pub fn step(&mut self) -> Result<(), Error> {
        self.state.steps += 1;
        self.state.time += self.step;
        self.follow();
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.place(self.bodies.space());
        }
        self.move_bases()?;
        self.move_joints();
        self.move_people();
        self.apply_forces();
        let (tree, seconds) = (self.tree(), self.step.as_secs_f64());
        let state = &mut self.state;
        state.batteries.step(&tree, &state.bases, seconds);
        self.follow();
        let times = (self.state.time, self.step);
        self.sensors.step(&tree, times, self.seed);
        Ok(())
    }

    /// One after the other: each base meets those that have moved before it.
    fn move_bases(&mut self) -> Result<(), Error> {
        let bases: Vec<NodeId> = self.state.bases.nodes().collect();
        let without_power = self.state.batteries.robots_without_power(&self.tree());
        for node in bases {
            self.move_base(node, !without_power.contains(&node))?;
        }
        Ok(())
    }

    fn move_base(&mut self, node: NodeId, is_powered: bool) -> Result<(), Error> {
        let tree = self.tree();
        let here = tree.node(node)?;
        let (Kind::Robot(robot), Some(base)) = (here.kind(), self.state.bases.state(node)) else {
            return Ok(());
        };
        let around = Surroundings {
            space: self.bodies.space(),
            tree: &tree,
            forces: self.dynamics.as_deref(),
            step: self.step,
        };
        let place = here.to_root();
        let mut random = Random::new(self.seed, here.id(), self.state.steps);
        let seconds = self.step.as_secs_f64();
        let after = base.after_step(
            (here, robot),
            is_powered,
            seconds,
            &mut random,
            |from, speed| {
                let problems = &mut self.problems;
                let obstacles = &mut self.obstacles;
                obstacles.free_fraction(around, node, &place, from, speed, problems)
            },
        );
        let (base, pose) = after?;
        if pose != here.pose() {
            if let Err(error) = self.change(|edit| edit.set_pose(node, pose)) {
                // The base stays where it is, and the world goes on.
                self.problems
                    .add(format!("`{}` cannot move: {error}", here.id()));
                return Ok(());
            }
            self.follow();
        }
        self.state.bases.set(node, base);
        Ok(())
    }

    fn move_joints(&mut self) {
        let (tree, seconds) = (self.tree(), self.step.as_secs_f64());
        let forces = self.dynamics.as_deref();
        let is_forced = |joint| forces.is_some_and(|forces| forces.moves_joint(joint));
        let moves = self.state.motors.step(&tree, seconds, is_forced);
        self.change_each(&moves, |edit, (node, position)| {
            edit.set_joint(*node, *position).map(drop)
        });
    }

    fn move_people(&mut self) {
        let (tree, seconds) = (self.tree(), self.step.as_secs_f64());
        let state = &mut self.state;
        let moves = state.people.step(&tree, &state.bases, seconds);
        self.change_each(&moves, |edit, (node, pose)| edit.set_pose(*node, *pose));
    }

    fn apply_forces(&mut self) {
        if self.dynamics.is_none() {
            return;
        }
        self.follow();
        let Some(dynamics) = &mut self.dynamics else {
            return;
        };
        let motors = &mut self.state.motors;
        let moved = dynamics.step(self.bodies.space(), motors.states(), self.step);
        if moved.places.is_empty() && moved.joints.is_empty() {
            return;
        }
        let seconds = self.step.as_secs_f64();
        let before = self.model.snapshot();
        motors.forced(&before, &moved.joints, seconds);
        self.change_each(&moved.places, |edit, (node, place)| {
            edit.set_pose_in(*node, NodeId::ROOT, place.pose())
        });
        self.change_each(&moved.joints, |edit, (joint, position)| {
            edit.set_joint(*joint, *position).map(drop)
        });
        self.follow();
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.applied(self.bodies.space());
        }
    }

    /// Changes of many nodes by the world itself: one that is refused, such as a place that would
    /// be infinite, is reported, and the others are made.
    fn change_each<T>(
        &mut self,
        all: &[T],
        make: impl Fn(&mut Edit, &T) -> Result<(), innermodel::Error>,
    ) {
        if all.is_empty()
            || self
                .change(|edit| all.iter().try_for_each(|one| make(edit, one)))
                .is_ok()
        {
            return;
        }
        for one in all {
            if let Err(error) = self.change(|edit| make(edit, one)) {
                self.problems.add(format!("something cannot move: {error}"));
            }
        }
    }
}
