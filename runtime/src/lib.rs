//! What is the same in every component: its start, its one loop, its life cycle, its configuration, its
//! management endpoint and its log.
//!
//! Generated code hands a [`Description`] and a [`Component`] to [`run`]; everything else happens here. One
//! thread runs the worker: `compute()` on its period and every handler between two computes. A second thread
//! answers management, takes signals and sends the heartbeat, so that a worker that hangs is seen.

mod arguments;
pub mod component;
mod context;
mod event_loop;
mod link;
mod management;
mod name_lock;
mod notify;
mod parameter_service;
mod parameters;
mod ports;
mod probe;
mod process;
mod ros_arguments;
mod settings;
mod status;

pub use component::{Component, Connect, Description, Role, Slot, WorkerError};
pub use context::Core;
pub use ports::Ports;
pub use process::{Embedded, StartError, embed, run};
pub use rc_configuration::model::Value;
pub use rc_configuration::{ParamChange, Values};
pub use rc_middleware as middleware;
pub use status::State;
pub use tracing;
