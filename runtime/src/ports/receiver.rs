//! Receiving ends.

use rc_middleware::{Counter, Server, Subscriber};
use std::time::Duration;

/// A receiving end, which the event loop serves.
pub(crate) enum Receiver {
    Server {
        port: Box<dyn Server>,
        /// Counts requests.
        counter: Counter,
    },
    Subscriber {
        port: Box<dyn Subscriber>,
        operation: usize,
        /// The longest time between two samples.
        deadline: Option<Duration>,
    },
}

impl Receiver {
    /// Clears readiness. `woken` says whether the descriptor was readable.
    pub(crate) fn acknowledge(&mut self, woken: bool) {
        match self {
            Self::Server { port, .. } => port.acknowledge(woken),
            Self::Subscriber { port, .. } => port.acknowledge(woken),
        }
    }
}
