//! Changes of the scene, and snapshots of the world.

use crate::dynamics::Dynamics;
use crate::error::Error;
use crate::human;
use crate::state::State;
use crate::world::World;
use innermodel::{Edit, Snapshot};
use innermodel_collision::Space;
use rc_diagnostics::foreign::clean;
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// A world at one time, to which it can be set back.
#[derive(Debug)]
pub struct WorldSnapshot {
    tree: Arc<Snapshot>,
    state: State,
    dynamics: Option<Box<dyn Dynamics>>,
}

impl Clone for WorldSnapshot {
    fn clone(&self) -> Self {
        Self {
            tree: Arc::clone(&self.tree),
            state: self.state.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
        }
    }
}

impl World {
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
        let after = self.tree();
        self.sensors.jump(&before, &after);
        self.follow();
        Ok(result)
    }

    /// [`World::edit`], unless bodies touch afterwards that did not touch before.
    ///
    /// # Errors
    /// [`Error::Collision`] has the first two; then nothing is changed.
    pub fn edit_apart<T>(
        &mut self,
        make: impl Fn(&mut Edit) -> Result<T, innermodel::Error>,
    ) -> Result<T, Error> {
        let trial = self.model.fork();
        trial.change(self.state.time, &make)?;
        let after = trial.snapshot();
        self.follow();
        let before = self.bodies.space().collisions().into_iter();
        let before: BTreeSet<_> = before.map(|contact| (contact.a, contact.b)).collect();
        let mut space = Space::clone(self.bodies.space());
        space.update(&after);
        let new = space.collisions().into_iter().find(|contact| {
            let (a, b) = (contact.a, contact.b);
            !before.contains(&(a, b)) && !before.contains(&(b, a))
        });
        if let Some(contact) = new {
            return Err(Error::Collision {
                body: clean(after.node(contact.a)?.id()),
                other: clean(after.node(contact.b)?.id()),
            });
        }
        self.edit(make)
    }

    /// The world as it is, to set it back later.
    pub fn snapshot(&self) -> WorldSnapshot {
        WorldSnapshot {
            tree: self.tree(),
            state: self.state.clone(),
            dynamics: self.dynamics.as_ref().map(|dynamics| dynamics.duplicate()),
        }
    }

    /// Sets the scene with all bases, joints, batteries and speeds back. Time goes on.
    pub fn restore(&mut self, to: &WorldSnapshot) {
        let before = self.tree();
        self.model.restore(self.state.time, &to.tree);
        self.state = State {
            time: self.state.time,
            steps: self.state.steps,
            ..to.state.clone()
        };
        self.bodies.forget_place();
        self.follow();
        self.find_devices();
        let after = self.tree();
        self.sensors.jump(&before, &after);
        // Forces stay as they are switched; bodies get their speeds back.
        if let (Some(own), Some(kept)) = (&mut self.dynamics, &to.dynamics) {
            *own = kept.duplicate();
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
        self.sensors.hash_state(&mut hasher);
        let speeds = self.dynamics.as_ref().map(|dynamics| dynamics.digest());
        speeds.hash(&mut hasher);
        hasher.finish()
    }
}
