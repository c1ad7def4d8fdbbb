//! Starts a network of components, watches it, and stops it: all of `rcdeploy` that knows no language.
//!
//! ```text
//! plan → up → supervise (a loop over units) → events → report
//!          ├─ control   what status and down talk to
//!          └─ guard     a second process, which cleans up when the first one is gone
//! ```
//!
//! - [`plan`]: what is to run, in which order, with which limits. Made by whoever read the `.ddsl`.
//! - [`up`](mod@up): one thread that waits for processes, links, signals and clients in one `poll`.
//! - [`guard`](mod@guard), [`held`]: nothing outlives its network, whichever process is killed.
//! - [`client`], [`detach`](mod@detach), [`logs`]: the other commands.
//!
//! Every wait has a limit. Processes are named by pid *and* time of start, and are signalled through a pidfd, so
//! that no stranger who got a pid for the second time is ever hit.

pub mod client;
mod control;
pub mod detach;
pub mod error;
pub mod events;
pub mod guard;
pub mod held;
mod lines;
mod link;
mod lock;
pub mod logs;
pub mod plan;
pub mod process;
mod relay;
pub mod report;
mod signals;
pub mod status;
mod supervise;
mod unit;
pub mod up;

pub use client::{down, status};
pub use detach::detach;
pub use error::Error;
pub use events::{Event, Severity};
pub use guard::{GuardCommand, guard};
pub use held::recover;
pub use plan::{Component, Plan};
pub use report::Format;
pub use status::{ComponentStatus, State, Status};
pub use up::{Options, Outcome, up};
