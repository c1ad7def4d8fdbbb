//! State that changes with time, besides the tree.

use crate::bases::Bases;
use crate::batteries::Batteries;
use crate::motors::Motors;
use crate::people::People;
use innermodel::Snapshot;
use std::time::Duration;

/// State that changes with time, besides the tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) time: Duration,
    pub(crate) steps: u64,
    pub(crate) bases: Bases,
    pub(crate) motors: Motors,
    pub(crate) batteries: Batteries,
    pub(crate) people: People,
}

impl State {
    /// Makes the state of new devices, and drops that of removed ones.
    pub(crate) fn find_devices(&mut self, tree: &Snapshot) {
        for node in tree.nodes() {
            self.bases.notice(node);
            self.motors.notice(node);
            self.batteries.notice(node);
            self.people.notice(node);
        }
        self.bases.drop_removed(tree);
        self.motors.drop_removed(tree);
        self.batteries.drop_removed(tree);
        self.people.drop_removed(tree);
    }
}
