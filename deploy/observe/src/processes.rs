//! The processes of a network, which change when components are restarted.

use crate::network::Network;
use std::collections::BTreeSet;

/// The processes of the components of a network.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Processes(BTreeSet<(String, u32)>);

impl Processes {
    /// The processes of the components that describe themselves now.
    pub fn of(network: &Network) -> Self {
        let all = network.components.iter();
        let all = all.map(|component| (component.name.clone(), component.described.pid));
        Self(all.collect())
    }

    /// Whether all components were restarted: then their shared memory is another one, too, and
    /// needs another [`Observer`](crate::Observer).
    pub fn were_replaced_by(&self, now: &Self) -> bool {
        !now.0.is_empty() && self.0.is_disjoint(&now.0)
    }

    /// Whether some of the processes are there now.
    pub fn are_among(&self, now: &Self) -> bool {
        !self.0.is_disjoint(&now.0)
    }

    /// Keeps the processes of now. If no component replies, those before are kept: what replies
    /// later is compared with them.
    pub fn update(&mut self, now: Self) {
        if !now.0.is_empty() {
            *self = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn processes(all: &[(&str, u32)]) -> Processes {
        let all = all.iter().map(|(name, pid)| ((*name).to_owned(), *pid));
        Processes(all.collect())
    }

    #[test]
    fn components_that_restart_after_a_silence_of_all_were_replaced() {
        let mut known = processes(&[("a", 1), ("b", 2)]);
        let one_is_new = processes(&[("a", 3), ("b", 2)]);
        assert!(!known.were_replaced_by(&one_is_new));
        known.update(one_is_new);
        let none = Processes::default();
        assert!(!known.were_replaced_by(&none));
        known.update(none);
        assert!(known.were_replaced_by(&processes(&[("a", 4)])));
        assert!(!known.were_replaced_by(&processes(&[("b", 2)])));
    }
}
