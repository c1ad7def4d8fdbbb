//! Requests of tools to a component, on `NAME.sock` in the run directory of its network.

use crate::component_state::ComponentState;
use crate::hops;
use crate::observation;
use crate::rpc::{Call, Error};
use rc_lifecycle::{LifecycleState, Transition};
use rc_vocabulary::foreign;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

pub use rc_vocabulary::{ParameterChange, ParameterStatus, Role, overlap};

/// A request to a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Answered with [`Status`].
    Status,
    /// Answered with [`Parameters`].
    Parameters {
        /// The parameters to list; all if there is no path.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        paths: Option<Vec<String>>,
    },
    /// Changes parameters, all or none. Answered with [`Changed`] when the worker has decided.
    ParametersSet {
        /// The new values by path; at least one.
        changes: Map<String, Value>,
    },
    /// Writes changed parameters into the configuration file. Answered with [`Saved`].
    ParametersSave,
    /// Sets the period of `compute()`. Answered with [`Done`].
    Period {
        /// Milliseconds, from 0.1 to 3,600,000.
        ms: f64,
    },
    /// Enters or leaves the state [`State::Emergency`]. Answered with [`Done`].
    Emergency {
        /// Whether to enter it.
        active: bool,
    },
    /// Fires an event of the state machine that may be fired from outside. Answered with [`Fired`]
    /// when a transition has taken it.
    Fire {
        /// The name of the event.
        event: String,
    },
    /// Takes a managed component through a transition of its life cycle. Answered with
    /// [`Lifecycle`] when its hook has ended.
    Lifecycle {
        /// The transition.
        transition: Transition,
    },
    /// Ends the component. Answered with [`Done`].
    Stop,
    /// Answered with [`Described`](crate::observation::Described).
    Describe,
    /// Answered at once with [`Clocks`](crate::observation::Clocks).
    Clocks,
    /// Notes the messages of chains for this client from now on, in place of its earlier pairs;
    /// without pairs, none. A few seconds after the end of the connection, it ends; until then
    /// another client gets the notes if it names the same pairs. Answered with
    /// [`Following`](crate::hops::Following).
    Follow {
        /// The pairs of messages on chains.
        pairs: Vec<hops::Pair>,
    },
    /// Takes the notes since the last request. Answered at once with
    /// [`HopReport`](crate::hops::HopReport).
    Hops,
    /// Copies the messages of a slot to this client from now on, or no more: notifications
    /// [`Tapped`](crate::observation::Tapped) and `Dropped`. The end of the connection ends it.
    /// Answered with [`Done`].
    Tap {
        /// The name of the slot.
        slot: String,
        /// Whether to copy.
        on: bool,
    },
    /// Handles a request to an implemented slot as if a client had sent it. Answered with
    /// [`Called`](crate::observation::Called) when the worker has replied.
    Call {
        /// The name of the slot.
        slot: String,
        /// The request with its envelope, in CDR.
        #[serde(
            serialize_with = "observation::encode",
            deserialize_with = "observation::decode"
        )]
        body: Vec<u8>,
        /// How long the reply may take, in milliseconds.
        timeout_ms: u64,
    },
    /// Handles a sample of a subscribed topic as if a publisher had sent it. Answered with [`Done`]
    /// when the worker has handled it.
    Sample {
        /// The name of the slot.
        slot: String,
        /// The operation of the topic.
        operation: String,
        /// The sample, in CDR.
        #[serde(
            serialize_with = "observation::encode",
            deserialize_with = "observation::decode"
        )]
        body: Vec<u8>,
    },
}

impl Request {
    /// Each method with its parameters, for error messages.
    const METHODS: [(&'static str, &'static str); 16] = [
        ("status", "{}"),
        ("parameters", r#"{} or {"paths": ["motors[0].max", …]}"#),
        (
            "parameters_set",
            r#"{"changes": {"motors[0].max": 1.5, …}}"#,
        ),
        ("parameters_save", "{}"),
        ("period", r#"{"ms": 0.1 … 3600000}"#),
        ("emergency", r#"{"active": true|false}"#),
        ("fire", r#"{"event": "go"}"#),
        (
            "lifecycle",
            r#"{"transition": "configure"|"cleanup"|"activate"|"deactivate"|"shutdown"}"#,
        ),
        ("stop", "{}"),
        ("describe", "{}"),
        ("clocks", "{}"),
        (
            "follow",
            r#"{"pairs": [{"input": {"slot", "operation"}, "output": {"slot", "operation"}, "way": "handler"|"compute"|"any"}, …]}"#,
        ),
        ("hops", "{}"),
        ("tap", r#"{"slot": "Laser", "on": true|false}"#),
        (
            "call",
            r#"{"slot": "Laser", "body": BASE64, "timeout_ms": 1 … 600000}"#,
        ),
        (
            "sample",
            r#"{"slot": "LaserPub", "operation": "scan", "body": BASE64}"#,
        ),
    ];

    /// Decodes a received request. The error is the answer to it.
    pub fn decode(call: Call) -> Result<Self, Error> {
        call.decode(&Self::METHODS, |request| match request {
            Self::ParametersSet { changes } => !changes.is_empty(),
            Self::Period { ms } => (0.1..=3.6e6).contains(ms),
            Self::Follow { pairs } => pairs.len() <= hops::MOST_PAIRS,
            Self::Call { timeout_ms, .. } => (1..=600_000).contains(timeout_ms),
            Self::Status
            | Self::Parameters { .. }
            | Self::ParametersSave
            | Self::Emergency { .. }
            | Self::Fire { .. }
            | Self::Lifecycle { .. }
            | Self::Stop
            | Self::Describe
            | Self::Clocks
            | Self::Hops
            | Self::Tap { .. }
            | Self::Sample { .. } => true,
        })
    }
}

/// The answer to a request that only succeeds: `{}`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Done {}

/// Effect of a fired event.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fired {
    /// The active states without substates afterwards, each with its ancestors.
    #[serde(deserialize_with = "foreign::texts")]
    pub states: Vec<String>,
}

/// The answer to [`Request::Lifecycle`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lifecycle {
    /// The state after the transition.
    pub state: LifecycleState,
}

/// The state of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// It opens its connections and initialises its worker.
    Starting,
    /// It runs `compute()` on its period.
    Running,
    /// It runs `emergency()` on its period, in place of `compute()`.
    Emergency,
    /// It ends.
    Stopping,
}

impl State {
    /// The word for it in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Emergency => "emergency",
            Self::Stopping => "stopping",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// The status of a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The component's type: the name after `Component` in its `.cdsl`.
    #[serde(deserialize_with = "foreign::text")]
    pub component: String,
    /// The component's name in its network.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// The network.
    #[serde(deserialize_with = "foreign::text")]
    pub network: String,
    /// The process.
    pub pid: u32,
    /// The state.
    pub state: State,
    /// The state of its life cycle, if it is managed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lifecycle: Option<LifecycleState>,
    /// Seconds since the start.
    pub uptime_s: f64,
    /// Milliseconds since the last turn of the worker's loop.
    pub age_ms: u64,
    /// Hash of the description files, 16 hexadecimal digits.
    #[serde(deserialize_with = "foreign::text")]
    pub model: String,
    /// The middleware of all connections that do not choose one.
    #[serde(deserialize_with = "foreign::text")]
    pub middleware: String,
    /// The period of `compute()`, in milliseconds.
    pub period_ms: f64,
    /// How often `compute()` took longer than its period, or was skipped.
    pub overruns: u64,
    /// The runs of `compute()`.
    pub compute: Timing,
    /// The last error of `compute()` or a handler.
    #[serde(deserialize_with = "foreign::optional")]
    pub last_error: Option<String>,
    /// The source of its time.
    #[serde(default)]
    pub clock: ClockStatus,
    /// State machine, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<MachineStatus>,
    /// Its replica of the shared world, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldStatus>,
    /// The connections, in the order of the `.cdsl`.
    pub slots: Vec<SlotStatus>,
    /// The components of the same process that have ended without an error, by their names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub done_beside: Vec<String>,
    /// For the proxy of a group that a supervisor runs: the group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<GroupStatus>,
}

/// The components of a group with a proxy, as the supervisor sees them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GroupStatus {
    /// The state of the worst component, the proxy among them.
    pub state: ComponentState,
    /// Whether all are ready.
    pub ready: bool,
    /// The states of the components behind the proxy, by their names.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::keys")]
    pub components: BTreeMap<String, ComponentState>,
}

/// The replica of a shared world in a component.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorldStatus {
    /// How many changes of others it has not seen.
    pub behind: u64,
    /// For how many milliseconds it has lacked some.
    pub behind_ms: u64,
    /// How many elements are not shown, because they are in conflict with others.
    pub conflicts: u64,
    /// The first of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub first_conflicts: Vec<String>,
    /// Why the newest changes are not shown: together they break a rule of the schema.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub fault: Option<String>,
    /// How many messages it has refused.
    pub refused: u64,
    /// Why it refused the last one; empty if it refused none.
    #[serde(default, deserialize_with = "foreign::text")]
    pub last_refusal: String,
    /// The instances whose replicas have been silent for five seconds and have not said goodbye, at most 32.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub silent: Vec<String>,
    /// How many more there are than those named.
    #[serde(default)]
    pub more_silent: u64,
}

/// The state machine of a component.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MachineStatus {
    /// The active states without substates, each with its ancestors: `driving.forward`.
    #[serde(deserialize_with = "foreign::texts")]
    pub states: Vec<String>,
    /// The events that may be fired from outside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub external: Vec<String>,
    /// The last transitions that changed states, the newest last.
    pub transitions: Vec<TransitionStatus>,
}

/// A transition that was taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransitionStatus {
    /// The state that it left.
    #[serde(deserialize_with = "foreign::text")]
    pub from: String,
    /// The states that it entered.
    #[serde(deserialize_with = "foreign::texts")]
    pub to: Vec<String>,
    /// The event; none for a transition without one.
    #[serde(default, deserialize_with = "foreign::optional")]
    pub event: Option<String>,
    /// How long exits, actions and entries took, in microseconds.
    pub took_us: u64,
    /// Seconds from the start of the component to the transition.
    pub at_s: f64,
}

/// The clock of a component: of `ctx.now()`, its period and the deadlines of its topics.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClockStatus {
    /// Which clock it is.
    pub kind: ClockKind,
    /// The time, in seconds since its zero.
    pub time_s: f64,
    /// The number of the present tick; 0 if the clock has none.
    #[serde(default)]
    pub tick: u64,
    /// For how many milliseconds the source has been silent, if that is too long. Then time stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost_ms: Option<u64>,
    /// For a source: the components that follow it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub followers: Vec<String>,
    /// For a source: the components that it has waited for beyond its limit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(deserialize_with = "foreign::texts")]
    pub waiting_for: Vec<String>,
}

/// A clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClockKind {
    /// The clock of the system.
    #[default]
    System,
    /// A component of the network publishes the time.
    Simulated,
    /// This component publishes the time of its network.
    Source,
    /// The nodes of its middleware share it, as by `/clock` of ROS 2.
    #[serde(rename = "ros")]
    Nodes,
}

impl ClockKind {
    /// The word for it in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::System => "system",
            Self::Simulated => "simulated",
            Self::Source => "source",
            Self::Nodes => "ros",
        }
    }
}

/// The status of one connection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlotStatus {
    /// The slot's name.
    #[serde(deserialize_with = "foreign::text")]
    pub name: String,
    /// Which end of the connection it is.
    pub role: Role,
    /// The type of the connection, `RoboCompLaser::Laser`.
    #[serde(deserialize_with = "foreign::text")]
    pub interface: String,
    /// The middlewares of its connections: `iceoryx2`, or several as in `iceoryx2, local`.
    #[serde(deserialize_with = "foreign::text")]
    pub middleware: String,
    /// How many messages went over each, if there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transports: Vec<TransportStatus>,
    /// Where the ends of the connection meet; none until it is open.
    #[serde(deserialize_with = "foreign::optional")]
    pub address: Option<String>,
    /// The number of connected peers.
    pub peers: usize,
    /// The handlers that ran for received samples or calls.
    pub handlers: Timing,
    /// Requests that the state of the component refused, so that no handler ran.
    #[serde(default)]
    pub refused: u64,
    /// Samples that were published, or calls that were made.
    #[serde(default)]
    pub sent: u64,
    /// Samples that were not published because the component was not active.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub withheld: u64,
    /// Counts of its conversions, if the other end has other units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub converted: Option<ConvertedStatus>,
    /// How old its values are, if the slot has `fresh` or `cache`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub freshness: Option<FreshnessStatus>,
    /// Counts of forwarded messages, if the component forwards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forwarded: Option<ForwardedStatus>,
    /// Samples that never arrived because newer ones took their place.
    pub lost: u64,
    /// Level of its receive queues; `None` if the middleware reserves their memory at the
    /// start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub queue: Option<QueueStatus>,
}

/// A middleware of a slot that has several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TransportStatus {
    /// Its name.
    #[serde(deserialize_with = "foreign::text")]
    pub middleware: String,
    /// The samples that were published over it, or the requests that came over it.
    pub messages: u64,
}

/// How old the values of a slot are: currency, obsolescence and freshness rate of Bouzeghoub and
/// Peralta, timeliness of Ballou et al.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreshnessStatus {
    /// The age up to which a value counts as fresh, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fresh_ms: Option<f64>,
    /// Currency: the age of the newest value, in milliseconds. None before the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub currency_ms: Option<f64>,
    /// How many values have come since the one that was used last.
    pub obsolescence: u64,
    /// Freshness rate: the part of all uses whose value was fresh. None before the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Timeliness: 1 for a newest value that was just made, 0 for one that is not fresh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeliness: Option<f64>,
    /// How often a value was used.
    pub uses: u64,
    /// How often one was used that was used before, or that was kept.
    pub cached: u64,
    /// Values that were not used because they were too old.
    pub refused: u64,
    /// Samples that were to be collected, and left without a match.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unmatched: u64,
}

/// Counts of the conversions of a slot.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConvertedStatus {
    /// The messages that were converted.
    pub messages: u64,
    /// The messages that were refused: a value does not fit its type in the other unit.
    pub bad_values: u64,
    /// The messages that were refused: no transform between their frames was known.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unplaced: u64,
    /// Converted messages in which three turns are at a gimbal lock.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub locked: u64,
    /// The last value of `bad_values`: whose it is, and what is wrong with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional")]
    pub bad_value: Option<String>,
}

/// Counts of forwarded messages of a slot, and the time from receiving to sending them; for a call,
/// there and back, without the wait for the reply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForwardedStatus {
    /// The messages.
    pub messages: u64,
    /// The mean time of a message, in microseconds.
    pub mean_us: f64,
    /// The longest time of a message, in microseconds.
    pub most_us: f64,
}

/// Whether a count is left out.
#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes a reference"
)]
fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// The use of the receive queues of a slot, of all its topics together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueueStatus {
    /// The bytes that wait.
    pub bytes: u64,
    /// The most bytes that wait.
    pub limit: u64,
    /// Samples that were dropped instead of queued: there was no room, or no request for the reply.
    pub dropped: u64,
}

/// How often something ran, how often it failed and how long it took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timing {
    /// The number of runs.
    pub count: u64,
    /// The number of runs that failed.
    pub errors: u64,
    /// The median time, in microseconds.
    pub p50_us: u64,
    /// The 99th percentile of the times, in microseconds.
    pub p99_us: u64,
    /// The longest time, in microseconds.
    #[serde(default)]
    pub max_us: u64,
}

/// The parameters of a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// The configuration file; none if the component read none.
    pub file: Option<PathBuf>,
    /// The listed parameters.
    pub parameters: Vec<ParameterStatus>,
}

/// The effect of a change of parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Changed {
    /// The values that changed at once.
    #[serde(default)]
    pub changed: Vec<ParameterChange>,
    /// The values that will change at the next start.
    #[serde(default)]
    pub pending: Vec<ParameterChange>,
}

/// The effect of saving parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// The configuration file.
    pub file: PathBuf,
    /// The values that were written.
    pub saved: Vec<ParameterChange>,
}
