//! The description of a network: reads it, checks it, and makes a plan. This crate starts no
//! process but cargo, and Python for components in Python.
//!
//! ```text
//! .ddsl → load → Network → plan → Plan      what is to run, in which order, with which limits
//!                        → preview          the same for people
//!                        → topology         machines and connections, for pictures
//!                        → world            the graph that the components share: its checks
//!                        → chains           what follows what, and how soon at worst (bounds)
//!                        → generating    what is stale is generated
//!                        → sites            which machine builds for which host
//!                        → programs         where executables are, and how cargo builds them
//!                        → shared_process   the program of components that share a process
//!                        → interpreters     whether components in Python can start
//!                        → transports       the middlewares of slots and components
//!                        → services         the shared memory that guards hold open
//! ```

mod adaptors;
mod addresses;
pub mod bounds;
pub mod chains;
mod cmake;
mod configuration;
mod error;
mod files;
mod forwarder;
mod generating;
mod installation;
mod interpreters;
mod keeper;
mod launcher;
mod link_load;
mod load;
mod model;
mod network_time;
mod parameters;
mod path_values;
pub mod plan;
pub mod planned_chain;
mod planning;
pub mod preview;
mod process_name;
mod profile;
mod programs;
mod proxies;
mod python_copies;
mod reading;
mod ros_names;
mod rules;
mod sanitizer;
mod scenes;
pub mod services;
mod shared_process;
mod sites;
pub mod topology;
mod transports;
mod unsupported;
mod variant;
mod workspaces;
mod world;
mod world_report;

pub use error::Error;
pub use generating::Generated;
pub use installation::{Disagreement, Installation};
pub use interpreters::Next;
pub use load::{Overrides, load};
pub use model::{ClockPlan, Network, NetworkTime};
pub use plan::Plan;
pub use process_name::process_name;
pub use profile::Profile;
pub use programs::{Build, Programs, Source, Sources};
pub use reading::Reading;
pub use ros_names::ros_implementation;
pub use rules::{NetworkRules, RuledChanges};
pub use sanitizer::Sanitizer;
pub use sites::Site;
pub use workspaces::{cargo, target_variable};
pub use world_report::{WorldMember, WorldReport};
