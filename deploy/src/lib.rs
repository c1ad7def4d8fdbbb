//! Checks a network of components, starts it, watches it, and stops it.
//!
//! ```text
//! network → plan → up → supervise (a loop over units) → events → report
//!          ├─ control   what status, down, start … talk to
//!          └─ guard     a second process, which cleans up when the first one is gone
//! ```
//!
//! - [`process`]: the processes of this machine: identity, start, signals, end.
//! - [`guard`](mod@guard): lock, process registry and guard process. Nothing outlives its network,
//!   whichever process is killed.
//! - [`log`](mod@log): logs and events.
//! - [`supervisor`]: one thread that waits for processes, links, signals and clients in one `poll`.
//! - `remote`: components on other machines, over ssh; [`agent`](fn@agent) runs there.
//! - `doctor`: usual problems of a new machine.
//! - [`cli`]: the command line.
//!
//! Every wait has a limit. Processes are identified by pid *and* time of start, and are signalled
//! through a pidfd, so that a signal never reaches another process with a reused pid.

pub mod cli;
mod doctor;
pub mod guard;
pub mod log;
pub mod process;
mod remote;
pub mod supervisor;

pub use guard::guard_process::{GuardCommand, HoldProgress, HoldTask, guard};
pub use guard::process_registry::recover;
pub use rc_deploy_client::Error;
pub use rc_deploy_client::Format;
pub use rc_deploy_client::connection::{down, status};
pub use rc_deploy_network::plan::{Component, Host, Plan, Policy, Restart};
pub use rc_deploy_network::services::Service;
pub use rc_management::supervisor::{
    CommandResult, ComponentState, ComponentStatus, Event, NetworkStatus, Severity, Trouble, Verb,
};
pub use remote::agent;
pub use supervisor::detach::detach;
pub use supervisor::options::{Options, Outcome, StartView};
pub use supervisor::up::up;
