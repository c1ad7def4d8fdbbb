//! The native part of the Python package `robocomp`: it runs a worker in Python over the same
//! runtime as workers in Rust, with types that are known at run time.
//!
//! The generated package of a component hands over its description, the classes of its types, of
//! its context and of its worker. [`run`] joins them with the runtime.

mod alive;
mod bench;
mod client;
mod component;
mod errors;
mod freshness;
mod from_python;
mod hooks;
mod link;
mod log;
mod machine_runner;
mod meaning;
mod member;
mod memory;
mod names;
mod parameters;
mod parked;
mod publisher;
mod run;
mod samples;
mod session;
mod testing;
mod to_python;
mod types;
mod view;
mod waiting;
mod worker;

use pyo3::prelude::*;

/// The module `robocomp._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::alive::{await_end, leave_networks};
    #[pymodule_export]
    use super::bench::{Bench, Server, Topic};
    #[pymodule_export]
    use super::client::Network;
    #[pymodule_export]
    use super::link::Link;
    #[pymodule_export]
    use super::log::log;
    #[pymodule_export]
    use super::machine_runner::MachineRunner;
    #[pymodule_export]
    use super::meaning::{Conversion, Prototypes};
    #[pymodule_export]
    use super::member::Member;
    #[pymodule_export]
    use super::names::{name_of, nearest, primitives};
    #[pymodule_export]
    use super::publisher::Publisher;
    #[pymodule_export]
    use super::run::{Embedded, embed, run};
    #[pymodule_export]
    use super::samples::Samples;
    #[pymodule_export]
    use super::testing::{configuration, view_of};
    #[pymodule_export]
    use super::view::{Loan, View};
}
