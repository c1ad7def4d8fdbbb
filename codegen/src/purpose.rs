//! The purposes of the pieces of a worker.

use crate::view;

/// The purpose of a piece of the worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The `impl` of a slot's trait: the index of the slot in the component.
    Slot(usize),
    /// The handler of an operation: the indices of the slot, and of the operation in its interface.
    Operation(usize, usize),
    /// A function of a state: its name.
    State(String),
}

/// The functions of a state that a worker may have, with their documentation.
pub(crate) fn of_state(state: &view::machine::State) -> [(&'static str, String); 3] {
    let path = &state.path;
    [
        ("entry", format!("Runs when `{path}` is entered.")),
        ("exit", format!("Runs when `{path}` is left.")),
        (
            "during",
            format!("Runs once a period while `{path}` is active, in place of `compute`."),
        ),
    ]
}
