//! Components on other machines.
//!
//! ```text
//! supervisor ── host ── ssh ── agent (rcdeploy there): starts, signals, tells ── guard
//! ```
//!
//! All is decided by the supervisor. The agent starts processes, hands on what they say and print, and ends them all
//! when the connection ends. Both are of the same version: the supervisor puts a copy of its own program there.

mod agent;
mod connection;
mod copies;
mod host;
mod log_tail;
mod socket_proxy;
mod ssh;
mod timed_stream;

pub use self::agent::agent;
pub(crate) use connection::{AgentReady, Setup};
pub(crate) use host::{Host, HostEvent, HostSource, Outbox, RemoteProcess};

use rc_deploy_network::plan::Component;
use std::time::Duration;

/// What the supervisor sends to an agent.
pub(crate) type SupervisorMessage = rc_management::agent::SupervisorMessage<Component>;

/// How long the other side of a connection may be silent; then it is lost.
pub(crate) const HOST_LIMIT: Duration = Duration::from_secs(5);
/// How often each side says that it is there.
const BEAT: Duration = Duration::from_secs(1);
/// How long one step of the beginning may take in which no byte comes.
const STEP_LIMIT: Duration = Duration::from_secs(20);
/// How long it may take until an agent is there, with all copies.
pub(crate) const SET_UP_LIMIT: Duration = Duration::from_mins(10);
