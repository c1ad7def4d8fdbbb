//! The state of the renewal of a host's shared memory.

use super::agent_process::Start;

/// The state of the renewal of the services, and the starts that wait for it.
#[derive(Default)]
pub(super) struct Renewal {
    pub(super) step: Step,
    /// The processes that start when their services are created.
    pub(super) waiting: Vec<Start>,
}

#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Step {
    #[default]
    None,
    /// The components end.
    Ends,
    /// A new guard creates the services.
    Creates,
}

impl Renewal {
    /// Whether components end because of it: they leave nothing to clean up for.
    pub(super) fn ends(&self) -> bool {
        self.step == Step::Ends
    }
}
