//! The restart policy of a component.

use crate::word::words;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// When a component restarts. It does not apply to the first start of a network, which must
/// succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restart {
    /// The ends after which a component restarts.
    pub policy: RestartPolicy,
    /// How long it may hang before it is stopped, which counts as a failure. `None`: no limit.
    #[serde(default)]
    pub hung: Option<Duration>,
    /// How many restarts are allowed within which time. One more end stops the network.
    pub limit: Option<(u32, Duration)>,
    /// The pause before a restart. It doubles after each short run, up to
    /// [`Restart::LONGEST_PAUSE`].
    pub backoff: Duration,
}

/// The ends after which a component restarts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestartPolicy {
    /// Never.
    Never,
    /// After a failure.
    OnFailure,
    /// After every end.
    Always,
}

words!(RestartPolicy);

impl RestartPolicy {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Never, Self::OnFailure, Self::Always];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Never => "never",
            Self::OnFailure => "on_failure",
            Self::Always => "always",
        }
    }
}

impl Restart {
    /// The pause before a restart, where none is set.
    pub const BACKOFF: Duration = Duration::from_millis(500);
    /// The longest pause between restarts.
    pub const LONGEST_PAUSE: Duration = Duration::from_secs(30);
}

impl Default for Restart {
    fn default() -> Self {
        Self {
            policy: RestartPolicy::Never,
            hung: None,
            limit: None,
            backoff: Self::BACKOFF,
        }
    }
}
