//! A change of parameters on its way to the worker and back.

use crate::component::Component;
use crate::waker::Waker;
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_management::rpc::Error;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The limit for a decision of the worker.
pub(crate) const CHANGE_LIMIT: Duration = Duration::from_secs(3);

/// A checked change of parameters, which the worker accepts or refuses.
#[derive(Debug)]
pub(crate) struct Proposal {
    old: Arc<Values>,
    new: Arc<Values>,
    changes: Vec<ParamChange>,
    /// Whether it undoes a change that the worker has accepted before: a refusal then has no
    /// effect.
    is_way_back: bool,
    state: Mutex<ProposalState>,
    management: Waker,
}

#[derive(Debug)]
enum ProposalState {
    /// The worker has not seen it.
    Queued,
    /// The worker is in `params_changed()`.
    InWorker,
    /// The time is up.
    Withdrawn,
    Decided(Result<(), String>),
}

impl Proposal {
    pub(crate) fn new(
        old: Arc<Values>,
        new: Values,
        changes: Vec<ParamChange>,
        management: Waker,
    ) -> Self {
        Self {
            old,
            new: Arc::new(new),
            changes,
            is_way_back: false,
            state: Mutex::new(ProposalState::Queued),
            management,
        }
    }

    /// The way back from this proposal, which the worker has accepted.
    pub(crate) fn undo(&self) -> Self {
        Self {
            old: self.new.clone(),
            new: self.old.clone(),
            changes: self.changes.iter().map(ParamChange::reversed).collect(),
            is_way_back: true,
            state: Mutex::new(ProposalState::Queued),
            management: self.management.clone(),
        }
    }

    /// The accepted changes.
    pub(crate) fn changes(&self) -> &[ParamChange] {
        &self.changes
    }

    /// The values if the worker accepts.
    pub(crate) fn new_values(&self) -> Arc<Values> {
        self.new.clone()
    }

    fn state(&self) -> MutexGuard<'_, ProposalState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives the worker the new values, and the old ones again if it refuses. Runs on the worker's
    /// thread and returns the last result of the worker.
    pub(crate) fn put_to(&self, component: &mut dyn Component) -> Result<(), WorkerError> {
        {
            let mut state = self.state();
            if !matches!(*state, ProposalState::Queued) {
                return Ok(());
            }
            *state = ProposalState::InWorker;
        }
        component.set_parameters(&self.new);
        let result = component.parameters_changed(&self.changes);
        if let Err(error) = &result {
            if self.is_way_back {
                warn_of_refused_way_back(error);
            } else {
                component.set_parameters(&self.old);
            }
        }
        let decision = match &result {
            Ok(()) => Ok(()),
            Err(WorkerError::Failed(reason)) => Err(reason.clone()),
            Err(WorkerError::Emergency(reason)) => {
                Err(format!("{reason}; the component is in emergency now"))
            }
            Err(WorkerError::Fatal(reason)) => Err(format!("{reason}; the component ends")),
        };
        {
            let mut state = self.state();
            if matches!(*state, ProposalState::InWorker) {
                *state = ProposalState::Decided(decision);
                drop(state);
                self.management.wake();
                return result;
            }
        }
        // It was withdrawn meanwhile, and the answer was that nothing has changed.
        if result.is_ok() {
            component.set_parameters(&self.old);
            let back: Vec<_> = self.changes.iter().map(ParamChange::reversed).collect();
            tracing::warn!(
                "a change of parameters took longer than {CHANGE_LIMIT:?} and is taken back"
            );
            if let Err(error) = component.parameters_changed(&back) {
                warn_of_refused_way_back(&error);
                return Err(error);
            }
        }
        result
    }

    pub(crate) fn is_decided(&self) -> bool {
        matches!(*self.state(), ProposalState::Decided(_))
    }

    /// The decision of the worker. Without one, the proposal is withdrawn: `reason` says why, from
    /// whether the worker is in `params_changed()`.
    pub(crate) fn conclude(&self, reason: impl FnOnce(bool) -> String) -> Result<(), Error> {
        let mut state = self.state();
        match &*state {
            ProposalState::Decided(Ok(())) => Ok(()),
            ProposalState::Decided(Err(reason)) => Err(Error::new(Error::WORKER_REFUSES, reason)),
            ProposalState::Queued | ProposalState::InWorker | ProposalState::Withdrawn => {
                let message = reason(matches!(*state, ProposalState::InWorker));
                *state = ProposalState::Withdrawn;
                Err(Error::new(Error::WORKER_TIMEOUT, message))
            }
        }
    }
}

fn warn_of_refused_way_back(error: &WorkerError) {
    tracing::warn!("params_changed() refuses the way back: {error}");
}
