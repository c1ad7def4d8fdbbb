//! The answers of a component to changes of parameters of several components.

use rc_management::component::Changed;

/// The answers of a component to the last changes.
#[derive(Debug, Default)]
pub(crate) struct ProposalAnswers {
    decided: Option<(u64, Result<Changed, String>)>,
    settled: u64,
    /// Whether it runs with its configuration, since its changed values were not restored.
    configured: bool,
}

impl ProposalAnswers {
    /// A worker has decided.
    pub(super) fn decided(&mut self, number: u64, result: Result<Changed, String>) {
        self.decided = Some((number, result));
    }

    /// A part is kept, or taken back.
    pub(super) fn settled(&mut self, number: u64) {
        self.settled = number;
    }

    /// The component runs with its configuration.
    pub(super) fn configured(&mut self) {
        self.configured = true;
    }

    /// Whether it has begun to run with its configuration since the last look.
    pub(super) fn take_configured(&mut self) -> bool {
        std::mem::take(&mut self.configured)
    }

    pub(super) fn take_answer(&mut self, number: u64) -> Option<Result<Changed, String>> {
        let decided = self.decided.take_if(|(of, _)| *of == number);
        decided.map(|(_, result)| result)
    }

    pub(super) fn is_settled(&self, number: u64) -> bool {
        self.settled == number
    }
}
