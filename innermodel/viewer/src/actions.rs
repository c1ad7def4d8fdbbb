//! Queue of the changes that the user of a component's window requests.

use innermodel::{Point, Vector};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A change that the user of a window wants.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A node gets another place. It keeps its rotation.
    Move {
        /// The id of the node.
        id: String,
        /// Its origin in the root, in millimetres.
        place: Point,
    },
    /// A body is pushed.
    Push {
        /// The id of the node.
        id: String,
        /// In N·s, in the root.
        impulse: Vector,
    },
}

/// The changes that wait for the worker, on whose thread the world is changed. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Actions {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug, Default)]
struct Shared {
    waiting: VecDeque<Action>,
    /// Why the last change that was refused cannot be made.
    refusal: Option<String>,
}

impl Actions {
    /// The most changes that wait. If the worker takes none, the first ones are dropped.
    pub const MOST: usize = 64;

    /// No change waits.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a change. Of several moves of a node in a row, the last one counts.
    pub fn push(&self, action: Action) {
        let waiting = &mut self.shared().waiting;
        if let (Some(Action::Move { id: last, place }), Action::Move { id, place: new }) =
            (waiting.back_mut(), &action)
            && last == id
        {
            *place = *new;
            return;
        }
        if waiting.len() == Self::MOST {
            waiting.pop_front();
        }
        waiting.push_back(action);
    }

    /// Takes the changes that wait, in their order.
    pub fn take(&self) -> Vec<Action> {
        self.shared().waiting.drain(..).collect()
    }

    /// Shows the user why a change cannot be made.
    pub fn refuse(&self, reason: &str) {
        self.shared().refusal = Some(reason.to_owned());
    }

    /// Takes the last reason.
    pub(crate) fn refusal(&self) -> Option<String> {
        self.shared().refusal.take()
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        // No change of it can be half made.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(id: &str, x: f64) -> Action {
        let id = id.to_owned();
        let place = Point::new(x, 0.0, 0.0);
        Action::Move { id, place }
    }

    #[test]
    fn moves_in_a_row_are_one_and_the_queue_has_a_bound() {
        let actions = Actions::new();
        let impulse = Vector::x();
        let id = "a".to_owned();
        let push = Action::Push { id, impulse };
        for action in [
            moved("a", 1.0),
            moved("a", 2.0),
            push.clone(),
            moved("a", 3.0),
            moved("b", 4.0),
        ] {
            actions.clone().push(action);
        }
        let taken = actions.take();
        let expected = [
            moved("a", 2.0),
            push.clone(),
            moved("a", 3.0),
            moved("b", 4.0),
        ];
        assert_eq!(taken, expected);
        assert_eq!(actions.take(), []);
        for _ in 0..Actions::MOST {
            actions.push(push.clone());
        }
        actions.push(moved("a", 1.0));
        let taken = actions.take();
        assert_eq!(taken.len(), Actions::MOST);
        assert_eq!(taken.last(), Some(&moved("a", 1.0)));
    }
}
