//! What `rcdeploy plan` and `rcdeploy graph` print.

mod goldens;
#[path = "../outside/mod.rs"]
mod outside;
mod syntax;
mod wrong;
