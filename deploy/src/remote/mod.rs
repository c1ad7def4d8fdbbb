//! Components on other machines.
//!
//! ```text
//! supervisor ── host ── ssh ── agent (rcdeploy there): starts, signals, tells ── guard
//! ```
//!
//! The supervisor decides everything. The agent starts processes, forwards their messages and
//! output, and ends them when the connection ends. Both have the same version: the supervisor
//! copies its own program to the other machine, or one for its processor, or has it built there.

mod agent;
mod agent_health;
mod agent_memory;
mod agent_process;
mod agent_renewal;
mod agent_setup;
mod agent_starts;
mod archive;
pub(crate) mod complaint;
mod connection;
mod copied_list;
mod copies;
mod host;
mod hosts;
mod known_hashes;
mod log_tail;
mod remote_process;
mod socket_proxy;
pub(crate) mod ssh;
pub(crate) mod there;
mod timed_stream;

pub use agent_setup::agent;
pub(crate) use connection::{AgentReady, is_served};
pub(crate) use host::{HostEvent, HostSource};
pub(crate) use hosts::Hosts;
pub(crate) use remote_process::{Outbox, RemoteProcess};

use rc_deploy_network::plan::{Component, Environment};
use std::time::Duration;

/// The hash of this program, under which a host keeps its own `rcdeploy`.
pub(crate) fn own_hash() -> std::io::Result<String> {
    connection::described(std::path::Path::new(crate::process::own_program::OWN))
        .map(|file| file.hash)
}

/// Message of the supervisor to an agent.
pub(crate) type SupervisorMessage = rc_management::agent::SupervisorMessage<Component, Environment>;

/// How long the other side may be silent before the connection is lost.
pub(crate) const HOST_LIMIT: Duration = Duration::from_secs(5);
/// The interval of heartbeats of each side.
const BEAT: Duration = Duration::from_secs(1);
/// How long a step of the setup may take without a byte.
const STEP_LIMIT: Duration = Duration::from_secs(20);
/// How long the setup may take, with all copies.
pub(crate) const SET_UP_LIMIT: Duration = Duration::from_mins(10);
