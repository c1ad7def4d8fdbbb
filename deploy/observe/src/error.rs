//! Errors of tools.

use rc_middleware::OpenError;
use rc_values::ValueError;

/// Error of a tool that looks, calls or sends.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No component of the network replies.
    #[error("no component of network {network} runs{help}")]
    NotRunning {
        /// The network.
        network: String,
        /// The nearest network that runs, or all of them.
        help: String,
    },
    /// There is nothing of this name.
    #[error("{network} has no {what} `{name}`{help}")]
    Unknown {
        /// The network.
        network: String,
        /// `topic`, `operation` …
        what: &'static str,
        /// Name on the command line.
        name: String,
        /// The nearest name, or all names.
        help: String,
    },
    /// There are several of this name.
    #[error("`{name}` can be {}; write more of the name", .found.join(", or "))]
    Ambiguous {
        /// Name on the command line.
        name: String,
        /// Candidates for the ambiguous name.
        found: Vec<String>,
    },
    /// A component describes its types in a form that cannot be used.
    #[error("{component}: {reason}")]
    Description {
        /// The component.
        component: String,
        /// Reason of the failure.
        reason: String,
    },
    /// JSON or bytes that do not fit a type.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// The types of a message are not those of the description.
    #[error(
        "{sender} has types {theirs:016x} of `{topic}`, and the description has {ours:016x}; generate the components again"
    )]
    OtherTypes {
        /// The topic.
        topic: String,
        /// Which messages.
        sender: &'static str,
        /// The hash in the message.
        theirs: u64,
        /// The hash of the description.
        ours: u64,
    },
    /// A middleware refuses.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A component does not reply, or refuses.
    #[error("{component}: {reason}")]
    Component {
        /// The component.
        component: String,
        /// Reply of the component.
        reason: String,
    },
    /// The component refuses the request, so the handler has not run.
    #[error("{operation} refuses: {reason}")]
    Refused {
        /// The operation.
        operation: String,
        /// Why.
        reason: String,
    },
    /// The component does not serve the operation in its present state.
    #[error("{operation} refuses: {}", rc_middleware::rpc::not_served_in(.state))]
    Unavailable {
        /// The operation.
        operation: String,
        /// The active states of the component, or the state of its life cycle.
        state: String,
    },
    /// The component does not run.
    #[error("{component}: {reason}")]
    NoServer {
        /// The component.
        component: String,
        /// Text of the system's error.
        reason: String,
    },
    /// The connection closed before the reply: the component has ended, or its host is lost.
    #[error("the connection to {component} closed before it replied")]
    ServerDied {
        /// The component.
        component: String,
    },
    /// The component did not reply in time.
    #[error("{operation}: {reason}")]
    Deadline {
        /// The operation.
        operation: String,
        /// Reply of the component.
        reason: String,
    },
    /// The system refuses.
    #[error("{action}: {reason}")]
    System {
        /// Failed action.
        action: String,
        /// Reason of the failure.
        reason: String,
    },
}

impl Error {
    /// Whether the input is wrong, not the system or the network.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Unknown { .. }
                | Self::Ambiguous { .. }
                | Self::Value(_)
                | Self::Refused { .. }
                | Self::Unavailable { .. }
        )
    }

    pub(crate) fn system(action: &str, reason: &dyn std::fmt::Display) -> Self {
        Self::System {
            action: action.to_owned(),
            reason: reason.to_string(),
        }
    }
}
