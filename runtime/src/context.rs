//! What a worker can ask of its runtime; generated contexts dereference to it.

use crate::State;
use crate::status::Shared;
use std::sync::Arc;
use std::time::Duration;

/// The running component, seen by its worker.
#[derive(Debug)]
pub struct Core {
    name: String,
    network: String,
    pub(crate) shared: Arc<Shared>,
    pub(crate) new_period: Option<Duration>,
}

impl Core {
    pub(crate) fn new(name: &str, network: &str, shared: Arc<Shared>) -> Self {
        Self {
            name: name.to_owned(),
            network: network.to_owned(),
            shared,
            new_period: None,
        }
    }

    /// The name of this component in its network.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The network that it belongs to.
    pub fn network(&self) -> &str {
        &self.network
    }

    /// Where it is in its life.
    pub fn state(&self) -> State {
        self.shared.status().state
    }

    /// How often `compute()` runs.
    pub fn period(&self) -> Duration {
        self.new_period
            .unwrap_or_else(|| self.shared.status().period)
    }

    /// Sets how often `compute()` runs, from its next run on.
    pub fn set_period(&mut self, period: Duration) {
        self.new_period = Some(period);
    }

    /// Asks this component to end in order: the present call returns, then `finalize` runs.
    pub fn stop(&mut self, reason: &str) {
        tracing::info!("stopping: {reason}");
        self.shared.wake_event.stop();
    }

    /// Whether a stop was asked for; long work in a handler may look at it.
    pub fn is_stopping(&self) -> bool {
        self.shared.wake_event.is_stopping()
    }
}
