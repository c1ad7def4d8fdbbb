//! IDSL as ROS 2 has it: what packages, messages and services are called, of what fields they are, and which types of
//! others structures are. `middleware/ros2/MAPPING.md` tells it to users.

mod check;
mod comments;
mod fields;
mod mapping;
pub mod names;
mod standard;
mod words;

pub use check::annotations;
pub(crate) use comments::harmless;
pub(crate) use mapping::{Constant, Field, Package, packages};

use rc_diagnostics::Diagnostics;
use rc_idsl::Library;

/// What keeps interfaces from being those of a node: names that are one in ROS 2.
pub fn refused(library: &Library) -> Diagnostics {
    let mut found = Diagnostics::new();
    packages(library, &mut found);
    found
}
