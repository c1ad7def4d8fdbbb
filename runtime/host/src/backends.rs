//! The middlewares that a component may use: all of them.

use rc_middleware::{Backend, Environment, Linked, OpenError};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// A middleware by its name.
pub(crate) fn find(name: &str) -> Result<Linked, String> {
    let linked = rc_backends::find(name).ok_or_else(|| {
        let known = rc_vocabulary::listed(rc_vocabulary::Middleware::words(), "and");
        format!("there is no middleware `{name}`; there are {known}")
    })?;
    Ok(if linked.name == rc_ros2::NAME {
        Linked {
            connect: connect_ros2,
            ..linked
        }
    } else {
        linked
    })
}

/// Definitions of types that are not part of ROS 2, of all components of this process.
static ROS_TYPES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// Adds definitions of types, before their component joins ROS 2.
pub(crate) fn add_ros_types(types: Vec<String>) {
    let mut known = ROS_TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    for text in types {
        if !known.contains(text.as_str()) {
            known.insert(text.leak());
        }
    }
}

fn connect_ros2(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let known = ROS_TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    let types: Vec<&'static str> = known.iter().copied().collect();
    rc_ros2::connect(environment, types.leak())
}
