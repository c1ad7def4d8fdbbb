//! What `rcdeploy plan` and `rcdeploy graph` print.

mod fleet;
mod goldens;
#[path = "../outside/mod.rs"]
mod outside;
mod syntax;
mod wrong;
