//! Options and outcome of `up`.

use crate::guard::guard_process::GuardCommand;
use rc_deploy_client::{Error, Format};
use rc_deploy_network::NetworkRules;
use rc_deploy_network::services::Service;
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Starts a view of a network, and ends it when it is dropped. The flag is set while the view
/// covers the streams.
pub type StartView = fn(network: &str, covers: Arc<AtomicBool>) -> Box<dyn Any>;

/// Options of `up`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The form of the events.
    pub format: Format,
    /// Show the log lines of components.
    pub relay: bool,
    /// Starts a view that covers the terminal. Events that are not as usual are reported after it.
    pub view: Option<StartView>,
    /// This is the background process of [`detach`](fn@crate::supervisor::detach::detach): it
    /// leaves the session of the terminal, and reports on standard output when the network is up.
    pub supervisor: bool,
    /// The limit of a log in bytes before rotation. Default: 16 MiB.
    pub log_limit: Option<u64>,
    /// How often the memory of components is read. Default: twice a minute.
    pub memory_pause: Option<Duration>,
    /// The command of the guard. Default: this program with the argument `guard`.
    pub guard: Option<GuardCommand>,
    /// The rules between parameters of the network.
    pub rules: NetworkRules,
    /// The shared-memory services of this machine, which the guard holds.
    pub hold: Vec<Service>,
    /// For each other machine by name, the shared-memory services that its guard holds, as JSON.
    pub services: BTreeMap<String, String>,
}

/// How an `up` ended.
#[derive(Debug)]
pub enum Outcome {
    /// All components ended successfully. For [`detach`](fn@crate::supervisor::detach::detach): the
    /// network is up.
    Done,
    /// The network was stopped on request.
    Stopped,
    /// A component failed. This was reported.
    Failed(String),
    /// The network could not be started. This was reported.
    Refused(Error),
}

impl Outcome {
    /// The exit code of the command.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Done | Self::Stopped => 0,
            Self::Failed(_) => 3,
            Self::Refused(error) => error.exit_code(),
        }
    }

    /// The message of a failure.
    pub fn message(&self) -> Option<String> {
        match self {
            Self::Done | Self::Stopped => None,
            Self::Failed(message) => Some(message.clone()),
            Self::Refused(error) => Some(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_has_a_message_and_a_code() {
        for outcome in [Outcome::Done, Outcome::Stopped] {
            assert_eq!((outcome.exit_code(), outcome.message()), (0, None));
        }
        let failed = Outcome::Failed("a: ended".to_owned());
        let message = failed.message();
        assert_eq!(
            (failed.exit_code(), message.as_deref()),
            (3, Some("a: ended"))
        );
        let refused = Outcome::Refused(Error::Plan("no plan".to_owned()));
        let message = refused.message().expect("a message");
        assert_eq!(refused.exit_code(), 1);
        assert!(message.contains("no plan"), "{message}");
    }
}
