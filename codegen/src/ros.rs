//! The mapping of IDSL to ROS 2: packages, messages, services and their fields, and annotated
//! types. `docs/ros2-mapping.md` documents it for users.

mod check;
mod comments;
mod definitions;
mod fields;
mod mapping;
pub mod names;
mod standard;

pub use check::annotations;
pub(crate) use check::wrong_package;
pub(crate) use comments::sanitized;
pub use definitions::definitions;
pub(crate) use mapping::{Constant, Field, Package, packages};

use rc_diagnostics::Diagnostics;
use rc_idsl::Library;

/// Errors that prevent the use of interfaces in a ROS 2 node: names that become equal.
pub fn refused(library: &Library) -> Diagnostics {
    let mut found = Diagnostics::new();
    packages(library, &mut found);
    found
}
