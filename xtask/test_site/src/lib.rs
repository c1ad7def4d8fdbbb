//! Shared parts of the test programs of rcdeploy: the environment of one test ([`site::Site`]), and
//! networks that run over several middlewares.
#![allow(
    clippy::missing_panics_doc,
    reason = "a failed expectation is how a test ends"
)]

pub mod foxglove;
pub mod other_host;
pub mod racks;
pub mod recordings;
pub mod site;
mod tree;
mod tree_client;
