//! Checks a network of components, starts it, watches it, and stops it.
//!
//! ```text
//! network → plan → up → supervise (a loop over units) → events → report
//!          ├─ control   what status, down, start … talk to
//!          └─ guard     a second process, which cleans up when the first one is gone
//! ```
//!
//! - [`network`]: the only module that knows a language: a `.ddsl` with all that it names, checked; with `addresses`,
//!   what all of that is called when it runs, `ros_names`, what of that is one in ROS 2, or two, `machine`, what it asks of
//!   this machine, and `unsupported`, what it cannot do yet.
//! - [`preview`], [`graph`]: what would run, as tables, as a picture, as JSON.
//! - [`plan`]: what is to run, in which order, with which limits.
//! - [`up`](mod@up): one thread that waits for processes, links, signals and clients in one `poll`.
//! - [`guard`](mod@guard), [`held`]: nothing outlives its network, whichever process is killed; `keep` joins them.
//! - `remote`: the same on other machines, over ssh; [`agent`](fn@agent) is the end there.
//! - [`services`]: the shared memory that the guard holds open, so that no kill leaves it half made.
//! - [`export`](mod@export): the same for engines of another kind.
//! - [`terminal`]: a live view, a client of the sockets of the supervisor and of the components.
//! - [`commands`]: components and groups that are stopped and started while all else runs on.
//! - [`client`], [`detach`](mod@detach), [`logs`], [`params`]: the other commands.
//!
//! Every wait has a limit. Processes are named by pid *and* time of start, and are signalled through a pidfd, so
//! that no stranger who got a pid for the second time is ever hit.

mod addresses;
mod body;
pub mod client;
pub mod commands;
mod configuration;
mod control;
pub mod detach;
pub mod error;
pub mod events;
pub mod export;
mod follower;
pub mod graph;
mod growth;
pub mod guard;
pub mod held;
mod journal;
mod keep;
mod launch;
mod left;
mod lines;
mod link;
mod lock;
pub mod logs;
mod machine;
pub mod network;
pub mod params;
pub mod plan;
pub mod preview;
pub mod process;
pub mod programs;
mod realtime;
mod relay;
mod remote;
pub mod report;
mod restart;
mod restore;
mod ros_names;
mod rotate;
pub mod services;
mod signals;
pub mod status;
mod supervise;
pub mod terminal;
mod unit;
mod unsupported;
pub mod up;
mod variant;
mod watch;

pub use client::{down, status};
pub use commands::{Carried, Verb};
pub use detach::detach;
pub use error::Error;
pub use events::{Event, Severity};
pub use guard::{GuardCommand, guard};
pub use held::recover;
pub use plan::{Component, Host, Plan, Policy, Restart};
pub use remote::agent;
pub use report::Format;
pub use status::{ComponentStatus, State, Status, Trouble};
pub use up::{Options, Outcome, up};
