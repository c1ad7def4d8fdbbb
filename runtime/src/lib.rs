//! The runtime of a component: its start, its event loop, its life cycle, its configuration, its
//! management and its log.
//!
//! A worker implements [`Worker`] or [`ManagedWorker`], and the traits of its interfaces.
//! Generated code has the [`Description`] of a component and the tables of [`Dispatch`];
//! [`adapter::run`] joins them. One thread runs the worker: `compute()` on its period, and handlers between two runs of it. A
//! second thread answers management requests, takes signals and sends heartbeats, so that rcdeploy
//! notices a worker that hangs.
//!
//! # Example
//!
//! ```
//! use rc_runtime::{Clock, SystemClock};
//!
//! // What a worker sees as `ctx.now()`.
//! let clock = SystemClock;
//! assert!(clock.now() <= clock.now());
//! ```

pub mod adapter;
mod ages;
mod arguments;
mod cached;
mod clock;
mod collect;
mod command_line;
mod commands;
mod component;
mod component_info;
mod configuration;
mod context;
mod converting;
mod description;
mod dispatch;
mod error;
mod event_loop;
mod exact;
mod fired_event;
mod firing;
mod forwarded;
mod fresh_slot;
mod freshness;
mod hops;
mod latest;
mod latest_values;
pub mod lifecycle;
mod lifecycle_server;
mod link;
mod log;
mod losses;
pub mod machine;
mod machine_record;
mod management;
mod member;
mod name_lock;
mod notify;
mod own_changes;
mod parameter_server;
mod parameter_service;
mod parameter_values;
mod ports;
mod probe;
mod process;
mod proposal;
mod settings;
mod shared;
mod signals;
mod slot_array;
mod slots;
mod stages;
mod start;
mod status;
mod stored_sample;
mod tap;
pub mod testing;
mod time;
mod tool_message;
mod tool_requests;
mod waker;
mod worker;
mod worker_error;

pub use adapter::Adapter;
pub use clock::{Clock, SimulatedClock, SystemClock, Time};
pub use collect::{Collect, Collected};
pub use component::{Body, CallEnd, Component, Sample};
pub use context::{Core, RecordedClock, WorldReport};
pub use converting::Places;
pub use description::{Description, Slot};
pub use dispatch::{
    CollectedHandler, Dispatch, End, MachineTable, Serving, SlotEntry, StateFunctions,
    WorkerContext, WorkerTable,
};
pub use error::StartError;
pub use fastrand;
pub use forwarded::ForwardCounts;
pub use fresh_slot::FreshSlot;
pub use latest::LatestSlot;
pub use member::MemberError;
pub use ports::{Awaited, CONVERTER, Connections, Converter, EarlySamples, Ports};
pub use process::{Embedded, embed, run, run_with};
pub use rc_configuration::model::Value;
pub use rc_configuration::{ParamChange, Values};
pub use rc_management::component::{Role, State as ComponentState, WorldStatus};
pub use rc_middleware as middleware;
pub use rc_middleware::{Linked, Member};
pub use shared::{ComponentType, run_components};
pub use slot_array::SlotArray;
pub use start::Start;
pub use time::{Order, TimeError, TimeSource};
pub use tracing;
pub use worker::{ManagedWorker, Worker};
pub use worker_error::WorkerError;

/// How to write and test a worker: two pages of the book.
// A test of the book compiles their code, which needs a generated crate.
#[cfg_attr(not(doctest), doc = include_str!("worker-guide.md"))]
#[allow(
    clippy::test_attr_in_doctest,
    reason = "the page shows tests of workers"
)]
pub mod guide {
    #[cfg_attr(not(doctest), doc = include_str!("testing.md"))]
    pub mod testing {}
}

/// The types of the network's time, which generated crates re-export under this name.
pub mod network_time {
    pub use crate::clock::{Clock, SimulatedClock, SystemClock, Time};
    pub use crate::time::{Order, TimeError, TimeSource};
}
