//! Snapshots and clones of the world.

use crate::refusal::{Refusal, reply};
use crate::requests::wrong;
use innermodel_simulation::{World, WorldSnapshot};
use rc_diagnostics::{foreign, nearest};
use rcis_generated::SimulationError;
use rcis_generated::types::rc_simulation::Reason;
use std::collections::BTreeMap;

/// The longest name of a snapshot or a clone.
const LONGEST: usize = 64;

/// The world of the scene, with snapshots and clones by their names.
#[derive(Debug)]
pub(crate) struct Worlds {
    /// The world that the slots serve.
    pub(crate) main: World,
    snapshots: BTreeMap<String, WorldSnapshot>,
    clones: BTreeMap<String, World>,
}

impl Worlds {
    pub(crate) fn new(main: World) -> Self {
        Self {
            main,
            snapshots: BTreeMap::new(),
            clones: BTreeMap::new(),
        }
    }

    /// The clone of a name; of no name, the world of the scene.
    pub(crate) fn named(&mut self, name: &str) -> Result<&mut World, Refusal> {
        if name.is_empty() {
            return Ok(&mut self.main);
        }
        if !self.clones.contains_key(name) {
            return Err(unknown(&self.clones, name, "clone"));
        }
        let found = self.clones.get_mut(name);
        found.ok_or_else(|| wrong("the clone was removed"))
    }

    /// Asks or changes the world of a name.
    pub(crate) fn with<T, E: From<SimulationError>>(
        &mut self,
        name: &str,
        make: impl FnOnce(&mut World) -> Result<T, Refusal>,
    ) -> Result<T, E> {
        reply(self.named(name).and_then(make))
    }

    /// Takes the problems of all worlds.
    pub(crate) fn problems(&mut self) -> Vec<String> {
        let worlds = self.clones.values_mut().chain([&mut self.main]);
        worlds.flat_map(World::problems).collect()
    }

    /// Keeps a world as it is under a new name, of at most `most`.
    pub(crate) fn keep(&mut self, world: &str, name: String, most: usize) -> Result<(), Refusal> {
        check_new(&self.snapshots, &name, "snapshot", most)?;
        let kept = self.named(world)?.snapshot();
        self.snapshots.insert(name, kept);
        Ok(())
    }

    /// Sets a world back to a snapshot.
    pub(crate) fn restore(&mut self, world: &str, name: &str) -> Result<(), Refusal> {
        let kept = self.snapshots.get(name).cloned();
        let kept = kept.ok_or_else(|| unknown(&self.snapshots, name, "snapshot"))?;
        self.named(world)?.restore(&kept);
        Ok(())
    }

    pub(crate) fn forget(&mut self, name: &str) -> Result<(), Refusal> {
        let known = self.snapshots.remove(name).map(drop);
        known.ok_or_else(|| unknown(&self.snapshots, name, "snapshot"))
    }

    pub(crate) fn snapshots(&self) -> Vec<String> {
        self.snapshots.keys().cloned().collect()
    }

    /// Clones a world under a new name, of at most `most`.
    pub(crate) fn add_clone(
        &mut self,
        world: &str,
        name: String,
        most: usize,
    ) -> Result<(), Refusal> {
        check_new(&self.clones, &name, "clone", most)?;
        let new = World::clone(self.named(world)?);
        self.clones.insert(name, new);
        Ok(())
    }

    pub(crate) fn remove_clone(&mut self, name: &str) -> Result<(), Refusal> {
        let known = self.clones.remove(name).map(drop);
        known.ok_or_else(|| unknown(&self.clones, name, "clone"))
    }

    pub(crate) fn clones(&self) -> Vec<String> {
        self.clones.keys().cloned().collect()
    }
}

/// Checks that a name is free, and that there is room.
fn check_new<T>(
    of: &BTreeMap<String, T>,
    name: &str,
    what: &str,
    most: usize,
) -> Result<(), Refusal> {
    let cleaned = foreign::clean(name);
    if name.is_empty() || name.len() > LONGEST {
        let text = format!("the name of a {what} has 1 to {LONGEST} bytes");
        Err(Refusal::Other(Reason::WrongValue, text))
    } else if of.contains_key(name) {
        let text = format!("a {what} has the name `{cleaned}` already");
        Err(Refusal::Other(Reason::DuplicateName, text))
    } else if of.len() >= most {
        let text = format!("there are {most} of them already; remove a {what} first");
        Err(Refusal::Other(Reason::TooMany, text))
    } else {
        Ok(())
    }
}

/// The refusal of a name that nothing has.
fn unknown<T>(of: &BTreeMap<String, T>, name: &str, what: &str) -> Refusal {
    let near = nearest(name, of.keys().map(String::as_str));
    let hint = near.map_or_else(String::new, |near| format!(", did you mean `{near}`?"));
    let text = format!("no {what} has the name `{}`{hint}", foreign::clean(name));
    Refusal::Other(Reason::UnknownName, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel_simulation::Speed;
    use std::time::Duration;

    fn worlds() -> Worlds {
        let scene = r#"<innerModel><differentialrobot id="base"/></innerModel>"#;
        let tree = innermodel::InnerModel::parse(scene).expect("a scene");
        Worlds::new(World::new(tree, Duration::from_millis(10), 1).expect("a world"))
    }

    fn reason(refused: Result<(), Refusal>) -> Reason {
        match refused.expect_err("a refusal") {
            Refusal::Other(reason, _) => reason,
            Refusal::World(error) => panic!("{error}"),
        }
    }

    #[test]
    fn names_of_clones_are_new_known_and_few() {
        let mut worlds = worlds();
        worlds.add_clone("", "one".to_owned(), 2).expect("a clone");
        let again = worlds.add_clone("", "one".to_owned(), 2);
        assert_eq!(reason(again), Reason::DuplicateName);
        worlds
            .add_clone("one", "two".to_owned(), 2)
            .expect("a clone");
        let third = worlds.add_clone("", "three".to_owned(), 2);
        assert_eq!(reason(third), Reason::TooMany);
        let empty = worlds.add_clone("", String::new(), 9);
        assert_eq!(reason(empty), Reason::WrongValue);
        assert_eq!(reason(worlds.named("on").map(drop)), Reason::UnknownName);
        assert_eq!(reason(worlds.remove_clone("on")), Reason::UnknownName);
        worlds.remove_clone("one").expect("a clone");
        assert_eq!(worlds.clones(), ["two"]);
    }

    #[test]
    fn a_clone_and_a_snapshot_do_not_follow_the_world() {
        let mut worlds = worlds();
        worlds.keep("", "start".to_owned(), 2).expect("a snapshot");
        worlds
            .add_clone("", "other".to_owned(), 2)
            .expect("a clone");
        let ahead = Speed {
            advance: 100.0,
            ..Speed::default()
        };
        worlds.main.drive("base", ahead).expect("a base");
        worlds.main.run(100).expect("steps");
        let z = |world: &World| world.place("base").expect("a base").z;
        assert!(z(&worlds.main) > 99.0);
        assert!(z(worlds.named("other").expect("a clone")).abs() < 1e-9);
        worlds.restore("", "start").expect("a snapshot");
        assert!(z(&worlds.main).abs() < 1e-9);
        worlds.forget("start").expect("a snapshot");
        assert_eq!(reason(worlds.restore("", "start")), Reason::UnknownName);
        assert!(worlds.snapshots().is_empty() && worlds.problems().is_empty());
    }
}
