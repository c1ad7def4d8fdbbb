//! Requests of tools to the supervisor of a network, on `rcdeploy.sock` in its run directory.

use crate::component::{
    Changed, ClockStatus, ConvertedStatus, ForwardedStatus, MachineStatus, State, TransportStatus,
};
pub use crate::component_state::ComponentState;
pub use crate::event::{Event, Severity};
use crate::rpc::{self, Call, Error};
use rc_lifecycle::{LifecycleState, Transition};
use rc_vocabulary::foreign;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The name of the supervisor's socket in the run directory, without its extension.
pub const SOCKET: &str = "rcdeploy";

/// The name of the supervisor's abstract socket: one for a user and a network, in a namespace of the
/// network.
pub fn abstract_name(network: &str) -> Vec<u8> {
    let uid = rustix::process::getuid().as_raw();
    format!("robocomp/{uid}/{network}").into_bytes()
}

/// The user and the network of the name of a supervisor's abstract socket. `None` for other names.
pub fn of_abstract_name(name: &str) -> Option<(u32, String)> {
    let (user, network) = name.strip_prefix("robocomp/")?.split_once('/')?;
    Some((user.parse().ok()?, network.to_owned()))
}

/// A request to a supervisor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Answered with [`NetworkStatus`].
    Status,
    /// Answered with [`KeptEvents`]; then follow [`Notification`]s of these and of all new events.
    Events,
    /// Stops the network. Answered with [`Stopping`]; the connection closes when the network is
    /// down.
    Down,
    /// Writes the ring of `record { ring 60s; }`. Answered with an empty [`CommandResult`] when
    /// the request is on the way to its recorder.
    Ring,
    /// Answered with [`Chains`](crate::chains::Chains).
    Chains {
        /// Asks for the messages that came to the end, too. For each chain, how many of them are
        /// known already (`complete` of an earlier answer); none for a chain that is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        known: Option<Vec<u64>>,
    },
    /// Changes parameters of several components, those of all or none. Answered with
    /// [`ParametersChanged`].
    ParametersSet {
        /// The values by path, for each component by its full name.
        changes: BTreeMap<String, Map<String, Value>>,
    },
    /// Starts components. Answered with [`CommandResult`] when they are ready, or cannot be.
    Start {
        /// Components, or groups with all that is in them; at least one.
        names: Vec<String>,
    },
    /// Stops components. Answered with [`CommandResult`] when they have ended.
    Stop {
        /// Components, or groups with all that is in them; at least one.
        names: Vec<String>,
    },
    /// Stops components, then starts them. Answered with [`CommandResult`].
    Restart {
        /// Components, or groups with all that is in them; at least one.
        names: Vec<String>,
    },
    /// Takes managed components through their life cycle, as far as [`Transition::meant`] says:
    /// providers first towards active, else dependents first. Answered with [`CommandResult`].
    Lifecycle {
        /// The transition; not `shutdown`.
        transition: Transition,
        /// Components, or groups with all that is in them; none for all managed components.
        #[serde(default)]
        names: Vec<String>,
    },
}

/// A command to components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verb {
    /// Start those that do not run.
    Start,
    /// Stop them. They stay stopped until a command starts them.
    Stop,
    /// Stop all, then start all.
    Restart,
    /// Take managed components through their life cycle.
    Lifecycle(Transition),
}

impl Verb {
    /// The word for it in messages and on command lines.
    pub fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Restart => "restart",
            Self::Lifecycle(transition) => transition.word(),
        }
    }

    /// The request for these components or groups.
    pub fn request(self, names: Vec<String>) -> Request {
        match self {
            Self::Start => Request::Start { names },
            Self::Stop => Request::Stop { names },
            Self::Restart => Request::Restart { names },
            Self::Lifecycle(transition) => Request::Lifecycle { transition, names },
        }
    }
}

impl Request {
    /// Each method with its parameters, for error messages.
    const METHODS: [(&'static str, &'static str); 10] = [
        ("status", "{}"),
        ("events", "{}"),
        ("down", "{}"),
        ("ring", "{}"),
        ("chains", r#"{} or {"known": [120, …]}"#),
        (
            "parameters_set",
            r#"{"changes": {"lidar": {"speed": 300, …}, …}}"#,
        ),
        ("start", r#"{"names": ["lidar", …]}"#),
        ("stop", r#"{"names": ["lidar", …]}"#),
        ("restart", r#"{"names": ["lidar", …]}"#),
        (
            "lifecycle",
            r#"{"transition": "configure"|"activate"|"deactivate"|"cleanup", "names": ["lidar", …]}"#,
        ),
    ];

    /// Decodes a received request. The error is the answer to it.
    pub fn decode(call: Call) -> Result<Self, Error> {
        call.decode(&Self::METHODS, |request| match request {
            Self::Start { names } | Self::Stop { names } | Self::Restart { names } => {
                !names.is_empty()
            }
            Self::Lifecycle { transition, .. } => *transition != Transition::Shutdown,
            Self::ParametersSet { changes } => !changes.is_empty(),
            Self::Status | Self::Events | Self::Down | Self::Ring | Self::Chains { .. } => true,
        })
    }
}

/// Message of a supervisor to a client that follows events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Notification {
    /// An event.
    Event(Event),
    /// The client reads too slowly: the supervisor has dropped events that it did not get.
    Missed {
        /// How many.
        events: u64,
    },
}

impl Notification {
    /// Decodes a received notification.
    pub fn decode(method: &str, params: Value) -> Option<Self> {
        rpc::message(method, params).ok()
    }
}

/// The answer to [`Request::Events`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptEvents {
    /// How many past events follow.
    pub kept: usize,
}

/// The answer to [`Request::Down`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stopping {
    /// Always true.
    pub stopping: bool,
}

/// Changes, by the names of the components.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParametersChanged {
    /// The values before and after, and what will change at the next start.
    #[serde(deserialize_with = "foreign::keys")]
    pub components: BTreeMap<String, Changed>,
}

/// The result of a command to components.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandResult {
    /// The components that are ready, or have ended, in the order of the network.
    #[serde(deserialize_with = "foreign::texts")]
    pub done: Vec<String>,
    /// The other components of the command.
    pub failed: Vec<FailedCommand>,
}

/// A component for which a command failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedCommand {
    /// The component.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// The reason, possibly with the last lines of the component's log.
    #[serde(deserialize_with = "foreign::lines")]
    pub reason: String,
}

impl From<State> for ComponentState {
    fn from(state: State) -> Self {
        match state {
            State::Starting => Self::Starting,
            State::Running => Self::Running,
            State::Emergency => Self::Emergency,
            State::Stopping => Self::Stopping,
        }
    }
}

/// The status of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkStatus {
    /// The network's name.
    #[serde(deserialize_with = "foreign::text")]
    pub network: String,
    /// The process of the supervisor.
    pub pid: i32,
    /// The process of the guard, which cleans up after the supervisor.
    pub guard: Option<i32>,
    /// The run directory, with the sockets of the components.
    #[serde(default)]
    pub directory: PathBuf,
    /// The conditions of the network as a whole that have started and not ended.
    #[serde(default)]
    pub troubles: Vec<Trouble>,
    /// The file that the network was started from.
    pub ddsl: PathBuf,
    /// A hash of the file's content at the start; none if the file could not be read.
    #[serde(default)]
    pub digest: Option<String>,
    /// Whether the file has changed since. The client determines it, not the supervisor.
    #[serde(default)]
    pub changed: bool,
    /// The components, in the order of their start.
    pub components: Vec<ComponentStatus>,
}

/// The status of one component, as its supervisor sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentStatus {
    /// The component's name.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// Whether it was started by hand: the supervisor does not know it, a client found it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_hand: bool,
    /// The machine that it runs on; none for that of the supervisor.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::optional")]
    pub host: Option<String>,
    /// The state.
    pub state: ComponentState,
    /// The state of its life cycle, while it runs, if it is managed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lifecycle: Option<LifecycleState>,
    /// The name of the process whose thread it is; none for one of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub process: Option<String>,
    /// For the proxy of a group, the components behind it. Its state is the worst of theirs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub behind: Vec<String>,
    /// The process, while it runs.
    pub pid: Option<i32>,
    /// Seconds since the start, while it runs.
    pub uptime_s: Option<f64>,
    /// Whether it has reported readiness.
    pub ready: bool,
    /// The middlewares of its connections.
    #[serde(deserialize_with = "foreign::text")]
    pub middleware: String,
    /// Where connections choose their middlewares, those of each slot: `iceoryx2, local`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub transports: BTreeMap<String, String>,
    /// The processors that it may run on; empty for all.
    #[serde(default)]
    pub cpu: Vec<u16>,
    /// The real-time priority (`SCHED_FIFO`), if any.
    #[serde(default)]
    pub priority: Option<u8>,
    /// The executable.
    pub executable: PathBuf,
    /// The log.
    pub log: PathBuf,
    /// How often the supervisor restarted it without a command.
    pub restarts: u32,
    /// The limit from its start until it is ready, in milliseconds.
    pub ready_ms: u64,
    /// The limit from the request to stop until it has ended, in milliseconds.
    pub stop_ms: u64,
    /// Samples that its slots have lost in this run; slots without loss are left out.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::keys")]
    pub lost: BTreeMap<String, u64>,
    /// How many messages went over each middleware, by slot. Only a report of `rc-deploy-client` has it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub messages: BTreeMap<String, Vec<TransportStatus>>,
    /// The counts of forwarded messages of each slot, and its added delay.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub forwarded: BTreeMap<String, ForwardedStatus>,
    /// The conversions of its slots in this run; slots that convert nothing are left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub converted: BTreeMap<String, ConvertedStatus>,
    /// The conditions that have started and not ended.
    #[serde(default)]
    pub troubles: Vec<Trouble>,
    /// Clock, from its last heartbeat, unless it is that of the system.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<ClockStatus>,
    /// State machine, from its last heartbeat, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<MachineStatus>,
    /// How it ended.
    #[serde(deserialize_with = "foreign::optional")]
    pub exit: Option<String>,
}

/// A condition that has started and not ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trouble {
    /// The code of the event with which it started.
    #[serde(deserialize_with = "foreign::text")]
    pub code: String,
    /// The latest message, for people.
    #[serde(deserialize_with = "foreign::text")]
    pub message: String,
    /// When it started, RFC 3339 in UTC.
    #[serde(deserialize_with = "foreign::text")]
    pub since: String,
}
